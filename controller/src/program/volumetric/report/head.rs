//! The head of the page of a run of three axes.

use machine::records::ReadJournal;
use units::Metres;

use super::{Made, read_along};
use crate::program::page::head::{self, Fact, Stated, facts_of};
use crate::program::text::verdict;
use crate::volumetric::{LineReadingEntry, VolumeLog};

/// The head of the page of `journal`, with what was made from it.
pub(crate) fn head(journal: &ReadJournal<VolumeLog>, made: &Made) -> Vec<Fact> {
    let log = &journal.log;
    let stated = Stated {
        environment: environment(&log.readings),
        corrections: corrections(log),
        uncertainty: uncertainty(log, made),
        verdict: judged(journal),
        conformity: Some((
            "lines through the volume, with the errors of ISO 230-1; no test of ISO 230-2 or 230-6"
                .into(),
            true,
        )),
        sign: "deviation = actual − target, at the tool; tilts are right-handed",
        made: made
            .named
            .iter()
            .map(|(id, kind)| ((*kind).to_owned(), id.clone()))
            .collect(),
    };
    let mut facts = facts_of(journal, stated);
    // Three axes are no drive.
    facts.retain(|it| it.name != "drive");
    if let Some(plan) = &log.plan {
        let (whole, all) = (log.whole.len(), plan.lines.len());
        facts.push(Fact::new("lines", format!("{whole} of {all} read whole")));
        facts.push(Fact::new("chain", plan.chain.clone()));
    }
    facts.push(Fact::new("readings", log.readings.len().to_string()));
    facts
}

/// From where to where all thermometers were.
fn environment(readings: &[LineReadingEntry]) -> Option<String> {
    let seen = || {
        readings
            .iter()
            .flat_map(|it| &it.temperatures_c)
            .flatten()
            .copied()
    };
    let low = seen().reduce(f64::min)?;
    let high = seen().reduce(f64::max)?;
    Some(format!(
        "thermometers of the machine {low:.3} to {high:.3} °C"
    ))
}

/// Of a verification, whose state says what corrected it.
fn corrections(log: &VolumeLog) -> Vec<head::Made> {
    let Some(check) = &log.check else {
        return Vec::new();
    };
    let made = |name: &str, is_made| head::Made {
        name: name.into(),
        is_made,
        is_missed: false,
    };
    vec![
        made("tables of the errors", check.state != "as found"),
        made("detectors and thermometers", check.state == "as left"),
    ]
}

fn uncertainty(log: &VolumeLog, made: &Made) -> Option<String> {
    if log.check.is_some() {
        let most = log.readings.iter().map(|it| it.u_si).reduce(f64::max)?;
        let expanded = Metres(most) * 2.0;
        return Some(format!(
            "of a reading: U (k = 2) {:.3} µm at most",
            expanded.um()
        ));
    }
    let agreement = made.geometries.first()?.agreement.as_ref()?;
    let expanded = Metres(agreement.tool_u_max_m) * 2.0;
    Some(format!(
        "of the tool in the volume: U (k = 2) {:.3} µm at most",
        expanded.um()
    ))
}

fn judged(journal: &ReadJournal<VolumeLog>) -> Option<(String, bool)> {
    let limit = Metres(journal.log.check.as_ref()?.limit_m);
    let (_, range) = read_along(journal);
    let is_within = range <= limit;
    let text = verdict(
        &format!("range along the line {:.3} µm", range.um()),
        &format!("{:.3} µm", limit.um()),
        is_within,
    );
    Some((text, is_within))
}
