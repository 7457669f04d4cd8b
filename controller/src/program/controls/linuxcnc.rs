//! LinuxCNC's screw compensation, COMP_FILE with COMP_FILE_TYPE = 1.
//!
//! Source: LinuxCNC, `src/emc/motion/usrmotintf.cc` (`usrmotLoadComp`), `command.c` (`EMCMOT_SET_JOINT_COMP`),
//! `motion.c` and `control.c` (`compute_screw_comp`, `output_to_hal`); INI configuration, section `[JOINT_n]`.
//!
//! A row is nominal, forward trim, reverse trim, in the machine's unit; the trim of the direction of motion is added
//! to the commanded position. Between rows it is a straight line, beyond them the end's. Reading ends at the first line
//! that is no row: whose table it is stands below the rows.

use compensator::error_table::ROWS_MAX;
use serde_json::Map;

use super::correction::{Measure, Side, one_sided};
use super::exported::{Exported, Written};
use super::lines::{Lines, Wanted, cut, steps};
use crate::Failure;

pub(super) fn written(exported: &Exported<'_>) -> Result<Written, Failure> {
    if exported.measure() == Measure::Angle {
        return Err(Failure::Usage {
            what: "--format linuxcnc: a table of LinuxCNC does not begin again after a turn, and this one does".into(),
            help: "a rotary table can be written with --format csv, sinumerik-eec or pmac".into(),
        });
    }
    let joint = joint(exported.name)?;
    let (sides, mut told) = sides(exported)?;
    let [forward, reverse] = lines(exported, sides)?;
    let mut figures = Map::new();
    let off = [(&forward, sides[0]), (&reverse, sides[1])].map(|(lines, side)| {
        lines.off(
            |it| exported.correction.compensation(it, side),
            &exported.correction.corners(side),
        )
    });
    let off = off[0].max(off[1]);
    told.push(exported.lines_told(off, forward.places.len(), &mut figures));
    told.push(
        "the rows are in millimetres ([TRAJ] LINEAR_UNITS = mm); beyond the first and the last the control holds \
         their values"
            .into(),
    );
    let rows = forward
        .places
        .iter()
        .zip(forward.values.iter().zip(&reverse.values));
    let mut text = String::new();
    for (nominal, (forward, reverse)) in rows {
        text += &format!(
            "{:.6} {:.9} {:.9}\n",
            nominal * 1e3,
            forward * 1e3,
            reverse * 1e3
        );
    }
    let what = [
        "columns: nominal, forward trim, reverse trim, mm; trim = compensation = -(actual - target), it is added"
            .to_owned(),
        format!("in the INI file: [JOINT_{joint}] COMP_FILE = this file, COMP_FILE_TYPE = 1, no BACKLASH"),
    ];
    for line in exported.header(&[&what[..], &told].concat()) {
        text += &format!("# {line}\n");
    }
    Ok(Written {
        text,
        told,
        figures,
    })
}

fn joint(name: Option<&str>) -> Result<u32, Failure> {
    let name = name.unwrap_or("0");
    name.parse().map_err(|_| Failure::Usage {
        what: format!("--name {name}: joints of LinuxCNC have numbers from 0"),
        help: "write --name 0 for [JOINT_0]".into(),
    })
}

/// What the forward and the reverse column say.
fn sides(exported: &Exported<'_>) -> Result<([Side; 2], Vec<String>), Failure> {
    let correction = exported.correction;
    if correction.has_two_sides() && exported.side.is_none() {
        return Ok(([Side::Forward, Side::Reverse], Vec::new()));
    }
    if !correction.has_two_sides() {
        let side = correction.only_side(exported.side)?;
        return Ok(([side; 2], vec![one_sided(side)]));
    }
    let (side, told) = correction.one_side(exported.format, exported.side)?;
    Ok(([side; 2], told.into_iter().collect()))
}

/// Both columns at the same nominals.
fn lines(exported: &Exported<'_>, sides: [Side; 2]) -> Result<[Lines; 2], Failure> {
    let correction = exported.correction;
    let calibrated = correction.places();
    let wanted = Wanted {
        step: exported.step,
        max: ROWS_MAX,
        measure: exported.measure(),
    };
    let step = wanted.step(&calibrated)?;
    if exported.step.is_some() {
        let (first, last) = (calibrated[0], calibrated[calibrated.len() - 1]);
        let values = steps(first, last, step).saturating_add(1);
        wanted.require_room(values, (last - first) / (ROWS_MAX - 1) as f64)?;
    }
    let places = |parts| match exported.step {
        None => cut(&calibrated, parts),
        Some(_) => equal(&calibrated, step),
    };
    let of = |side| {
        let curve = move |it: f64| correction.compensation(it, side);
        let lines = wanted.lines(places, curve, &correction.corners(side));
        lines.map(|(lines, _)| lines)
    };
    let [forward, reverse] = [of(sides[0])?, of(sides[1])?];
    // The side that needs more lines decides for both.
    let places = match forward.places.len() >= reverse.places.len() {
        true => forward.places,
        false => reverse.places,
    };
    Ok(sides.map(|side| Lines::new(places.clone(), |it| correction.compensation(it, side))))
}

/// From the first calibrated place to the last; the last step is the rest.
fn equal(calibrated: &[f64], step: f64) -> Vec<f64> {
    let (first, last) = (calibrated[0], calibrated[calibrated.len() - 1]);
    let count = steps(first, last, step);
    let places = (0..count).map(|it| first + it as f64 * step);
    places.chain([last]).collect()
}
