//! The head of the page of a rotary table's run.

use machine::records::{CalibrationRecord, ReadJournal};
use units::Radians;

use crate::program::page::head::{Fact, Made, Stated, facts_of};
use crate::program::text::verdict;
use crate::rotary::PlateLog;
use crate::rotary::verify::RotaryFigures;
use crate::rotary::{JudgedEntry, PlatePlanEntry, RotaryContent, SightedAt};

/// The head of the page of `journal`, with the calibrations that were made from it.
pub(crate) fn head(
    journal: &ReadJournal<PlateLog>,
    calibrations: &[(String, CalibrationRecord<RotaryContent>)],
) -> Vec<Fact> {
    let log = &journal.log;
    let made = calibrations.first().map(|(_, it)| &it.content);
    let stated = Stated {
        environment: None,
        corrections: corrections(journal),
        uncertainty: uncertainty(made, log.judged.as_ref()),
        verdict: log.judged.as_ref().and_then(judged),
        conformity: Some((
            "self-calibration with a plate, which is no procedure of ISO 230-2".into(),
            true,
        )),
        sign: "deviation = actual − target; table error = reading − true angle, the negative of it",
        made: calibrations
            .iter()
            .map(|(id, _)| ("calibration".into(), id.clone()))
            .collect(),
    };
    let mut facts = facts_of(journal, stated);
    // A plate is no instrument.
    facts.retain(|it| it.name != "instrument");
    facts.extend(log.plan.iter().flat_map(plate));
    facts
}

fn corrections(journal: &ReadJournal<PlateLog>) -> Vec<Made> {
    let made = |name: &str, is_made| Made {
        name: name.into(),
        is_made,
        is_missed: false,
    };
    match &journal.log.judged {
        Some(judged) => vec![
            made("table error", judged.left_rad.is_some()),
            made("errors of the plate", judged.plate_known),
        ],
        None => Vec::new(),
    }
}

fn uncertainty(made: Option<&RotaryContent>, judged: Option<&JudgedEntry>) -> Option<String> {
    let of_table = made.and_then(RotaryContent::uncertainty_max);
    let of_table = of_table.map(|u| {
        let expanded = (u * 2.0).arcsec();
        format!("of the table error at the lines: U (k = 2) {expanded:.4} ″ at most")
    });
    let noise = judged.and_then(|it| it.noise_rad).map(Radians);
    of_table.or(noise.map(|it| {
        let expanded = (it * 2.0).arcsec();
        format!("of one deviation, by the scatter of these readings: U (k = 2) {expanded:.4} ″")
    }))
}

fn judged(it: &JudgedEntry) -> Option<(String, bool)> {
    let left = RotaryFigures::of_record(it.left_rad.as_ref()?);
    let tolerance = Radians(it.tolerance_rad);
    let is_within = left.largest <= tolerance;
    let text = verdict(
        &format!("largest deviation as left {:.3} ″", left.largest.arcsec()),
        &format!("{:.3} ″", tolerance.arcsec()),
        is_within,
    );
    Some((text, is_within))
}

fn plate(plan: &PlatePlanEntry) -> [Fact; 3] {
    let offsets: Vec<_> = plan.offsets.iter().map(f64::to_string).collect();
    let how = match plan.sighted {
        None => format!(" at {:.3} °/s", plan.speed_rad_per_s.to_degrees()),
        Some(SightedAt::Position) => {
            ", by a person, with the table at each line's nominal angle".to_owned()
        }
        Some(SightedAt::Line) => ", by a person, with each line under the cross-hair".to_owned(),
    };
    let read = format!(
        "{} pass(es) in each direction{how}, the first repeated at the end",
        plan.passes
    );
    [
        Fact::new("plate", format!("{}, {} lines", plan.plate, plan.lines)),
        Fact::new("placements", format!("at {} lines", offsets.join(", "))),
        Fact::new("read", read),
    ]
}
