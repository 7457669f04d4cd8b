//! Whether calibrations, references and memories of three axes can be so.

use machine::records::Content;
use machine::records::sound::{
    ANGLE_RAD, ANGLE_U_RAD, CELSIUS, COUNT_MAX, ERROR_M, ERROR_U_M, Judged, PER_KELVIN,
    PER_KELVIN_U, PLACE_M, RATIO, as_many, counted, increasing, is, letter, model, number, numbers,
    optional,
};

use crate::volumetric::{
    AXES, BeamReferencesContent, FunctionRecord, GeometryContent, StateMemoryContent, error_name,
};

/// Nodes of an error function at most.
const NODES_MAX: usize = 10_000;

impl Content for GeometryContent {
    const KIND: &'static str = Self::KIND;

    fn summary(&self) -> String {
        self.summary()
    }

    fn judge(&self) -> Judged {
        geometry(self)
    }
}

impl Content for BeamReferencesContent {
    const KIND: &'static str = Self::KIND;

    fn summary(&self) -> String {
        self.summary()
    }

    fn judge(&self) -> Judged {
        references(self)
    }
}

impl Content for StateMemoryContent {
    const KIND: &'static str = Self::KIND;

    fn summary(&self) -> String {
        self.summary()
    }

    fn judge(&self) -> Judged {
        memory(self)
    }
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
    it.covariance.as_ref().map_or(Ok(()), |it| it.judge())?;
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
    number("agreement.tool_u_max_m", own.tool_u_max_m, &ERROR_U_M)?;
    let Some(budget) = &it.budget else {
        return Ok(());
    };
    let places = budget.places.iter().enumerate();
    let most = places.reduce(|most, it| if it.1.u_si > most.1.u_si { it } else { most });
    let stated = most.map(|(at, _)| (at, own.tool_u_max_m));
    budget.judge(stated.as_slice())
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
        let stops = beam.slider[0].positions_m.len();
        for own in beam.wandered_m.iter().flatten() {
            let key = format!("{place}.wandered_m");
            as_many(&key, own.len(), stops, "the positions")?;
            numbers(&key, own, &ERROR_M)?;
        }
        if let Some(own) = &beam.drift {
            let key = format!("{place}.drift");
            numbers(&key, &[own.source_m, own.end_m], &PLACE_M)?;
            let expected = || "a source elsewhere than the end".to_owned();
            is(&key, own.source_m != own.end_m, expected, || {
                own.source_m.to_string()
            })?;
            number(&key, own.translation_share, &RATIO)?;
        }
    }
    for (at, own) in it.rolls.iter().enumerate() {
        let place = format!("rolls[{at}]");
        letter(&format!("{place}.axis"), own.axis, &AXES)?;
        let is_new = it.rolls[..at].iter().all(|before| before.axis != own.axis);
        let expected = || "each axis once".to_owned();
        is(&place, is_new, expected, || format!("`{}` again", own.axis))?;
        function(&format!("{place}.roll"), &own.roll)?;
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
    for (at, own) in it.rolls.iter().enumerate() {
        let place = format!("rolls[{at}]");
        letter(&format!("{place}.axis"), own.axis, &AXES)?;
        function(&format!("{place}.roll"), &own.roll)?;
    }
    model("axes", it.map(""))
}
