//! SINUMERIK's compensation of leadscrew and encoder errors, `$AA_ENC_COMP`.
//!
//! Source: Siemens, SINUMERIK 840D sl / 828D Function Manual Extended Functions, 6FC5397-1BP40-3BA1 (03/2013), K3
//! "Compensations", 4.4.2 (parameters of the table; example) and the Function Manual of the 808D (01/2017), page 106
//! (the sense: the value is applied to the actual position, and a positive one moves the axis in negative direction).
//!
//! So a value is the deviation: what is to be added to the measuring system's position to have the true one. Places
//! count from 0 at MIN, STEP apart; between them straight lines, beyond them the end's value, or, with IS_MODULO, the
//! table again. In millimetres or degrees. One value for both directions.

use core::f64::consts::TAU;

use serde_json::{Map, json};

use super::correction::Measure;
use super::exported::{Exported, Written};
use super::lines::{Lines, Wanted, cut, steps};
use crate::Failure;

/// Values of a table at most (MD38000 reserves as many).
const VALUES_MAX: usize = 5000;

pub(super) fn written(exported: &Exported<'_>) -> Result<Written, Failure> {
    let correction = exported.correction;
    let (side, told) = correction.one_side(exported.format, exported.side)?;
    let mut told: Vec<String> = told.into_iter().collect();
    let axis = machine_axis(exported)?;
    let is_modulo = exported.measure() == Measure::Angle;
    let (lines, step) = lines(exported, |it| correction.deviation(it, side))?;
    let mut figures = Map::new();
    let off = lines.off(
        |it| correction.deviation(it, side),
        &correction.corners(side),
    );
    told.push(exported.lines_told(off, lines.places.len(), &mut figures));
    told.push(format!(
        "MD38000 $MA_MM_ENC_COMP_MAX_POINTS[0,{axis}] must be at least {}; load with MD32700 $MA_ENC_COMP_ENABLE[0] = 0, \
         then set it to 1 and reference the axis",
        lines.places.len()
    ));
    told.push(format!(
        "whether the control looks a value up at the position before or after it is applied makes {} at most",
        exported.measure().small(correction.second_order())
    ));
    if !is_modulo {
        told.push("beyond the first and the last value the control holds them".into());
    }
    figures.insert("points_min".into(), json!(lines.places.len()));
    let text = text(exported, &axis, &lines, step, &told);
    Ok(Written {
        text,
        told,
        figures,
    })
}

fn machine_axis(exported: &Exported<'_>) -> Result<String, Failure> {
    let usual = format!("{}1", exported.head.axis.to_uppercase());
    let name = exported.name.map_or(usual, str::to_owned);
    let is_name = name
        .chars()
        .all(|it| it.is_ascii_alphanumeric() || it == '_')
        && name.starts_with(|it: char| it.is_ascii_alphabetic());
    match is_name {
        true => Ok(name),
        false => Err(Failure::Usage {
            what: format!("{name} is no name of a machine axis"),
            help: "write it as in MD10000, such as --name X1".into(),
        }),
    }
}

/// Equal steps, and how long they are.
fn lines(
    exported: &Exported<'_>,
    curve: impl Fn(f64) -> f64 + Copy,
) -> Result<(Lines, f64), Failure> {
    let calibrated = exported.correction.places();
    let wanted = Wanted {
        step: exported.step,
        max: VALUES_MAX,
        measure: exported.measure(),
    };
    let asked = wanted.step(&calibrated)?;
    let (first, last) = (calibrated[0], calibrated[calibrated.len() - 1]);
    wanted.require_room(
        steps(first, last, asked).saturating_add(1),
        (last - first) / (VALUES_MAX - 1) as f64,
    )?;
    let count = match exported.measure() {
        Measure::Length => steps(first, last, asked),
        Measure::Angle => whole_turn(asked)?,
    };
    let step = match exported.measure() {
        Measure::Length => asked,
        Measure::Angle => TAU / count as f64,
    };
    let coarse: Vec<f64> = (0..=count).map(|it| first + it as f64 * step).collect();
    let (lines, parts) = wanted.lines(|parts| cut(&coarse, parts), curve, &calibrated)?;
    Ok((lines, step / parts as f64))
}

/// How many steps make a turn.
fn whole_turn(step: f64) -> Result<usize, Failure> {
    let count = (TAU / step).round();
    match (count * step - TAU).abs() < 1e-9 {
        true => Ok(count as usize),
        false => Err(Failure::Usage {
            what: format!(
                "--step {}: a turn is no whole number of such steps",
                units::Short(step.to_degrees())
            ),
            help: "give a step that 360 degrees can be divided by".into(),
        }),
    }
}

fn text(exported: &Exported<'_>, axis: &str, lines: &Lines, step: f64, told: &[String]) -> String {
    let measure = exported.measure();
    let unit = measure.place_unit();
    let first = measure.place(lines.places[0]);
    let step = measure.place(step);
    let last = first + step * (lines.places.len() - 1) as f64;
    let what = [
        format!(
            "values: deviation = actual - target, {unit}; a positive value moves the axis in negative direction"
        ),
        "measuring system 0, metric (MD10240 = 1)".to_owned(),
    ];
    let mut text = "%_N_AX_EEC_INI\n".to_owned();
    for line in exported.header(&[&what[..], told].concat()) {
        text += &format!("; {line}\n");
    }
    text += "CHANDATA(1)\n";
    for (at, value) in lines.values.iter().enumerate() {
        text += &format!(
            "$AA_ENC_COMP[0,{at},{axis}]={:.9}\n",
            measure.place(*value) + 0.0
        );
    }
    let is_modulo = u8::from(measure == Measure::Angle);
    text += &format!(
        "$AA_ENC_COMP_STEP[0,{axis}]={step:.9}\n$AA_ENC_COMP_MIN[0,{axis}]={first:.9}\n\
         $AA_ENC_COMP_MAX[0,{axis}]={last:.9}\n$AA_ENC_COMP_IS_MODULO[0,{axis}]={is_modulo}\nM17\n"
    );
    text
}
