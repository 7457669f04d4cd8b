//! Calibrations of every kind.

use super::super::record::{CalibrationRecord, Content, EnvironmentRecord, RecordHead};
use super::{
    ANGLE_RAD, ANGLE_U_RAD, CELSIUS, COUNT_MAX, ERROR_M, ERROR_U_M, HUMIDITY, Judged, LENGTH_M,
    PASCAL, PER_KELVIN, PER_KELVIN_U, PLACE_M, RATIO, RESOLUTION, SLOPE, approach, as_many,
    counted, file_name, increasing, is, letter, model, number, numbers, optional, optionals,
};
use crate::linear::LinearContent;
use crate::platform::ScrewContent;
use crate::rotary::RotaryContent;
use crate::volumetric::{
    AXES, BeamReferencesContent, FunctionRecord, GeometryContent, StateMemoryContent, error_name,
};

/// Periodic terms of a screw at most, and the finest of them.
const HARMONICS_MAX: usize = 100;
const HARMONIC_MAX: usize = 10_000;
/// Nodes of an error function at most.
const NODES_MAX: usize = 10_000;
/// A figure that follows from others may differ by rounding.
const ROUNDING: f64 = 1e-9;

/// The whole record.
pub(in crate::store) fn record(record: &CalibrationRecord) -> Judged {
    head(&record.head)?;
    match &record.content {
        Content::LinearErrorTable(it) => linear(it),
        Content::RotaryErrorTable(it) => rotary(it),
        Content::ScrewModel(it) => screw(it),
        Content::VolumetricGeometry(it) => geometry(it),
        Content::BeamReferences(it) => references(it),
        Content::StateMemory(it) => memory(it),
    }
}

fn head(head: &RecordHead) -> Judged {
    // The axis names the file that says what is in use.
    file_name("axis", &head.axis)?;
    optional("resolution_m", head.resolution_m, &RESOLUTION)?;
    optional("resolution_rad", head.resolution_rad, &RESOLUTION)?;
    let u = head.instrument.standard_uncertainty_m;
    number("instrument.standard_uncertainty_m", u, &ERROR_U_M)?;
    environment("environment", &head.environment)
}

/// What sensors of the surroundings said.
pub(super) fn environment(place: &str, seen: &EnvironmentRecord) -> Judged {
    let at = |key: &str| format!("{place}.{key}");
    let air = seen.air_temperature_c;
    optional(&at("air_temperature_c"), air, &CELSIUS)?;
    let material = seen.material_temperature_c;
    optional(&at("material_temperature_c"), material, &CELSIUS)?;
    optional(&at("pressure_pa"), seen.pressure_pa, &PASCAL)?;
    optional(&at("relative_humidity"), seen.relative_humidity, &HUMIDITY)
}

fn linear(it: &LinearContent) -> Judged {
    counted("runs", it.runs as usize, 0..=COUNT_MAX)?;
    optional("closure_m", it.closure_m, &ERROR_M)?;
    optional("lost_motion_m", it.lost_motion_m, &ERROR_M)?;
    optional("lost_motion_u_m", it.lost_motion_u_m, &ERROR_U_M)?;
    for (at, node) in it.nodes.iter().enumerate() {
        let place = |key: &str| format!("nodes[{at}].{key}");
        number(place("position_m"), node.position_m, &PLACE_M)?;
        optional(&place("forward_m"), node.forward_m, &ERROR_M)?;
        optional(&place("reverse_m"), node.reverse_m, &ERROR_M)?;
        optional(&place("forward_u_m"), node.forward_u_m, &ERROR_U_M)?;
        optional(&place("reverse_u_m"), node.reverse_u_m, &ERROR_U_M)?;
    }
    let positions: Vec<f64> = it.nodes.iter().map(|it| it.position_m).collect();
    increasing("nodes", &positions)?;
    let table = it.table("");
    let follows = table.as_ref().ok().and_then(|it| it.lost_motion());
    model("nodes", table)?;
    let Some(stated) = it.lost_motion_m else {
        return Ok(());
    };
    let mean = follows.map(|it| it.mean.value());
    let agrees = mean.is_some_and(|it| (it - stated).abs() <= ROUNDING * (it.abs() + 1e-6));
    let expected = || match mean {
        Some(it) => format!("{it:e} m, which follows from the nodes"),
        None => "null: the nodes have one approach only".to_owned(),
    };
    is("lost_motion_m", agrees, expected, || {
        format!("{stated:e} m")
    })
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
    model("table_error_rad", it.table(""))
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
        .map_or(Ok(()), |own| covariance(own, 3 + 2 * it.harmonics.len()))
}

/// Square, symmetric, no negative variance, no more common than both have on their own.
fn covariance(seen: &[f64], parameters: usize) -> Judged {
    let place = "covariance_si";
    let of = format!("{parameters} × {parameters} parameters");
    as_many(place, seen.len(), parameters * parameters, &of)?;
    numbers(place, seen, &super::limits(-1e6, 1e6, "SI units squared"))?;
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

/// Nodes in order, a value and an uncertainty each, of metres or radians.
fn function(place: &str, it: &FunctionRecord) -> Judged {
    let key = |key: &str| format!("{place}.{key}");
    let nodes = it.positions_m.len();
    counted(&key("positions_m"), nodes, 2..=NODES_MAX)?;
    numbers(&key("positions_m"), &it.positions_m, &PLACE_M)?;
    increasing(&key("positions_m"), &it.positions_m)?;
    as_many(
        &key("values_si"),
        it.values_si.len(),
        nodes,
        "the positions",
    )?;
    numbers(&key("values_si"), &it.values_si, &ERROR_M)?;
    let Some(u) = &it.standard_uncertainties_si else {
        return Ok(());
    };
    let place = key("standard_uncertainties_si");
    as_many(&place, u.len(), nodes, "the positions")?;
    numbers(&place, u, &ERROR_U_M)
}

fn geometry(it: &GeometryContent) -> Judged {
    for (at, own) in it.functions.iter().enumerate() {
        let place = format!("functions[{at}]");
        let is_new = it.functions[..at]
            .iter()
            .all(|before| before.name != own.name);
        let is_error = error_name(&own.name).is_some() && is_new;
        let expected = || "an error of three axes (e_yx, e_ax …), each once".to_owned();
        is(format_args!("{place}.name"), is_error, expected, || {
            format!("`{}`", own.name.escape_debug())
        })?;
        function(&format!("{place} ({})", own.name), own)?;
    }
    numbers("squareness_rad", &it.squareness_rad, &ANGLE_RAD)?;
    numbers("squareness_u_rad", &it.squareness_u_rad, &ANGLE_U_RAD)?;
    numbers("temperatures_c", &it.temperatures_c, &CELSIUS)?;
    counted("temperatures_c", it.temperatures_c.len(), 0..=COUNT_MAX)?;
    warmth(it)?;
    let drives = it.drives.len();
    let expected = || "none, or those of x, y and z".to_owned();
    is("drives", drives == 0 || drives == 3, expected, || {
        drives.to_string()
    })?;
    for (at, [axis, towards]) in it.unknown.bends.iter().enumerate() {
        letter(&format!("unknown.bends[{at}]"), *axis, &AXES)?;
        letter(&format!("unknown.bends[{at}]"), *towards, &AXES)?;
    }
    for (at, name) in it.unknown.without_effect.iter().enumerate() {
        let expected = || "an error of three axes".to_owned();
        let place = format_args!("unknown.without_effect[{at}]");
        is(place, error_name(name).is_some(), expected, || {
            format!("`{}`", name.escape_debug())
        })?;
    }
    let Some(own) = &it.agreement else {
        return Ok(());
    };
    counted("agreement.readings", own.readings, 0..=COUNT_MAX)?;
    counted("agreement.lines", own.lines, 0..=own.readings)?;
    let spare = own.degrees_of_freedom;
    counted("agreement.degrees_of_freedom", spare, 0..=own.readings)?;
    optional("agreement.scatter_ratio", own.scatter_ratio, &RATIO)?;
    number("agreement.tool_u_max_m", own.tool_u_max_m, &ERROR_U_M)
}

fn warmth(it: &GeometryContent) -> Judged {
    let thermometers = it.temperatures_c.len();
    let known = |place: &str, at: usize| {
        let expected = || format!("one of {thermometers} thermometers, from 0");
        is(place, at < thermometers, expected, || at.to_string())
    };
    for (at, bend) in it.bends.iter().enumerate() {
        let place = |key: &str| format!("bends[{at}].{key}");
        letter(&place("axis"), bend.axis, &AXES)?;
        letter(&place("towards"), bend.towards, &AXES)?;
        known(&place("over"), bend.over)?;
        known(&place("under"), bend.under.unwrap_or(bend.over))?;
        let ends = [bend.low_m, bend.high_m];
        numbers(&place("low_m, high_m"), &ends, &PLACE_M)?;
        increasing(&place("low_m, high_m"), &ends)?;
        number(place("bow_m_per_k"), bend.bow_m_per_k, &PER_KELVIN)?;
        let u = bend.standard_uncertainty_m_per_k;
        number(place("standard_uncertainty_m_per_k"), u, &PER_KELVIN_U)?;
    }
    for (at, expansion) in it.expansions.iter().enumerate() {
        let place = |key: &str| format!("expansions[{at}].{key}");
        letter(&place("axis"), expansion.axis, &AXES)?;
        counted(
            &place("thermometers"),
            expansion.thermometers.len(),
            1..=thermometers.max(1),
        )?;
        for own in &expansion.thermometers {
            known(&place("thermometers"), *own)?;
        }
        number(place("per_k"), expansion.per_k, &PER_KELVIN)?;
        let u = expansion.standard_uncertainty_per_k;
        number(place("standard_uncertainty_per_k"), u, &PER_KELVIN_U)?;
    }
    Ok(())
}

/// Also what a run writes down of them.
pub(super) fn references(it: &BeamReferencesContent) -> Judged {
    for (at, beam) in it.beams.iter().enumerate() {
        let place = format!("beams[{at}]");
        letter(&format!("{place}.axis"), beam.axis, &AXES)?;
        let is_new = it.beams[..at].iter().all(|before| before.axis != beam.axis);
        let expected = || "each axis once".to_owned();
        is(&place, is_new, expected, || {
            format!("`{}` again", beam.axis)
        })?;
        for (direction, own) in beam.slider.iter().enumerate() {
            function(&format!("{place}.slider[{direction}]"), own)?;
        }
        let end = beam.end_m.unwrap_or_default();
        numbers(&format!("{place}.end_m"), &end, &ERROR_M)?;
    }
    it.roll.as_ref().map_or(Ok(()), |it| function("roll", it))
}

fn memory(it: &StateMemoryContent) -> Judged {
    for (at, own) in it.axes.iter().enumerate() {
        let place = format!("axes[{at}]");
        letter(&format!("{place}.axis"), own.axis, &AXES)?;
        for (direction, it) in own.functions.iter().enumerate() {
            function(&format!("{place}.functions[{direction}]"), it)?;
        }
    }
    model("axes", it.map(""))
}
