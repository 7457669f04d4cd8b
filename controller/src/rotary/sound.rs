//! Whether a calibration of a rotary table can be so.

use machine::records::Content;
use machine::records::sound::{
    ANGLE_RAD, ANGLE_U_RAD, COUNT_MAX, Judged, RATIO, as_many, counted, is, model, number, numbers,
    optional, optionals,
};

use crate::rotary::RotaryContent;

impl Content for RotaryContent {
    const KIND: &'static str = Self::KIND;

    fn summary(&self) -> String {
        self.summary()
    }

    fn judge(&self) -> Judged {
        rotary(self)
    }
}

fn rotary(it: &RotaryContent) -> Judged {
    let lines = it.lines as usize;
    counted("lines", lines, 2..=COUNT_MAX)?;
    as_many(
        "table_error_rad",
        it.table_error_rad.len(),
        lines,
        "the lines",
    )?;
    as_many(
        "plate_error_rad",
        it.plate_error_rad.len(),
        lines,
        "the lines",
    )?;
    numbers("table_error_rad", &it.table_error_rad, &ANGLE_RAD)?;
    optionals("plate_error_rad", &it.plate_error_rad, &ANGLE_RAD)?;
    if let Some(u) = &it.standard_uncertainty_rad {
        as_many("standard_uncertainty_rad", u.len(), lines, "the lines")?;
        numbers("standard_uncertainty_rad", u, &ANGLE_U_RAD)?;
    }
    optional("plate_phase_rad", it.plate_phase_rad, &ANGLE_RAD)?;
    optional("reading_noise_rad", it.reading_noise_rad, &ANGLE_U_RAD)?;
    number("residual_rms_rad", it.residual_rms_rad, &ANGLE_U_RAD)?;
    number("noise_amplification", it.noise_amplification, &RATIO)?;
    counted("offsets", it.offsets.len(), 1..=COUNT_MAX)?;
    let beyond = it.offsets.iter().position(|it| *it as usize >= lines);
    let place = format!("offsets[{}]", beyond.unwrap_or_default());
    let below = || format!("less than {lines}, the lines");
    let of = |at: Option<usize>| at.map_or(0, |at| it.offsets[at]).to_string();
    is(place, beyond.is_none(), below, || of(beyond))?;
    let readings = lines.saturating_mul(it.offsets.len());
    let spare = it.degrees_of_freedom as usize;
    counted("degrees_of_freedom", spare, 0..=readings)?;
    for (what, named) in [("missing", &it.missing), ("outliers", &it.outliers)] {
        for (at, reading) in named.iter().enumerate() {
            let known = (reading.line as usize) < lines && it.offsets.contains(&reading.offset);
            let expected = || "a line of the plate at one of the offsets".to_owned();
            let seen = || format!("line {} at offset {}", reading.line, reading.offset);
            is(format_args!("{what}[{at}]"), known, expected, seen)?;
        }
    }
    model("table_error_rad", it.table(""))?;
    let Some(budget) = &it.budget else {
        return Ok(());
    };
    as_many(
        "budget.places",
        budget.places.len(),
        2 * lines,
        "the lines, and the places between them",
    )?;
    let stated = it.standard_uncertainty_rad.iter().flatten();
    let stated: Vec<_> = stated.enumerate().map(|(line, u)| (2 * line, *u)).collect();
    budget.judge(&stated)
}
