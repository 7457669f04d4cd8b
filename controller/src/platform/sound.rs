//! Whether a calibration of a platform's screw can be so.

use compensator::uncertainty::combine;
use machine::records::Content;
use machine::records::sound::{
    COUNT_MAX, ERROR_M, ERROR_U_M, Judged, LENGTH_M, PLACE_M, SLOPE, approach, as_many, counted,
    increasing, is, limits, number, numbers, optional,
};

use units::{Approach, Metres};

use crate::platform::ScrewContent;
use crate::store::budget::PlacesBudgetRecord;

/// Periodic terms of a screw at most, and the finest of them.
const HARMONICS_MAX: usize = 100;
const HARMONIC_MAX: usize = 10_000;

impl Content for ScrewContent {
    const KIND: &'static str = Self::KIND;

    fn summary(&self) -> String {
        self.summary()
    }

    fn judge(&self) -> Judged {
        screw(self)
    }
}

fn screw(it: &ScrewContent) -> Judged {
    counted("rows", it.rows as usize, 1..=COUNT_MAX)?;
    number("offset_m", it.offset_m, &ERROR_M)?;
    number("slope_m_per_m", it.slope_m_per_m, &SLOPE)?;
    number("lost_motion_m", it.lost_motion_m, &ERROR_M)?;
    optional("lead_m", it.lead_m, &LENGTH_M)?;
    number("first_stroke_m", it.first_stroke_m, &PLACE_M)?;
    number("last_stroke_m", it.last_stroke_m, &PLACE_M)?;
    increasing("strokes", &[it.first_stroke_m, it.last_stroke_m])?;
    optional("scatter_m", it.scatter_m, &ERROR_U_M)?;
    counted("harmonics", it.harmonics.len(), 0..=HARMONICS_MAX)?;
    for (at, harmonic) in it.harmonics.iter().enumerate() {
        let place = |key: &str| format!("harmonics[{at}].{key}");
        let number_of = harmonic.number as usize;
        counted(&place("number"), number_of, 1..=HARMONIC_MAX)?;
        number(place("sine_m"), harmonic.sine_m, &ERROR_M)?;
        number(place("cosine_m"), harmonic.cosine_m, &ERROR_M)?;
        let before = &it.harmonics[..at];
        let is_new = before.iter().all(|it| it.number != harmonic.number);
        let expected = || "each number once".to_owned();
        is(place("number"), is_new, expected, || number_of.to_string())?;
    }
    let has_lead = it.harmonics.is_empty() || it.lead_m.is_some();
    let expected = || "a length: the periodic terms count turns".to_owned();
    is("lead_m", has_lead, expected, || "null".to_owned())?;
    counted("outliers", it.outliers.len(), 0..=it.rows as usize)?;
    for (at, stroke) in it.outliers.iter().enumerate() {
        let place = |key: &str| format!("outliers[{at}].{key}");
        approach(&place("approach"), stroke.approach)?;
        number(place("stroke_m"), stroke.stroke_m, &PLACE_M)?;
        number(place("deviation_m"), stroke.deviation_m, &ERROR_M)?;
    }
    it.covariance_si
        .as_ref()
        .map_or(Ok(()), |own| covariance(own, 3 + 2 * it.harmonics.len()))?;
    it.budget.as_ref().map_or(Ok(()), |own| budget(it, own))
}

/// A budget comes to what the model states of a single stop.
fn budget(it: &ScrewContent, budget: &PlacesBudgetRecord) -> Judged {
    let model = it.model();
    let stated = budget.places.iter().enumerate().map(|(at, place)| {
        let stroke = place.at_si.first().copied().unwrap_or(f64::NAN);
        let side = place.side().unwrap_or(Approach::Forward);
        let of_model = model.predict(Metres(stroke), side).standard_uncertainty;
        let of_model = of_model.map_or(f64::NAN, Metres::value);
        (at, combine(&[of_model, it.scatter_m.unwrap_or_default()]))
    });
    budget.judge(&stated.collect::<Vec<_>>())
}

/// Square, symmetric, no negative variance, no more common than both have on their own.
fn covariance(seen: &[f64], parameters: usize) -> Judged {
    let place = "covariance_si";
    let of = format!("{parameters} × {parameters} parameters");
    as_many(place, seen.len(), parameters * parameters, &of)?;
    numbers(place, seen, &limits(-1e6, 1e6, "SI units squared"))?;
    for row in 0..parameters {
        let variance = seen[row * parameters + row];
        let at = format_args!("{place}[{}]", row * parameters + row);
        let expected = || "a variance, not below 0".to_owned();
        is(at, variance >= 0.0, expected, || format!("{variance:e}"))?;
        for column in 0..row {
            let (a, b) = (row * parameters + column, column * parameters + row);
            let most = (variance * seen[column * parameters + column]).sqrt();
            // By rounding a little more than all.
            let close = |x: f64, y: f64| (x - y).abs() <= 1e-6 * most + f64::MIN_POSITIVE;
            let holds =
                close(seen[a], seen[b]) && seen[a].abs() <= most * 1.001 + f64::MIN_POSITIVE;
            let expected = || format!("{:e} as at [{b}], and at most {most:e}", seen[b]);
            let at = format_args!("{place}[{a}]");
            is(at, holds, expected, || format!("{:e}", seen[a]))?;
        }
    }
    Ok(())
}
