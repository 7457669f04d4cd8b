//! The head of the page of a rotary table's run.

use machine::records::{CalibrationRecord, ReadJournal};
use units::Radians;

use crate::program::page::head::{Fact, Made, Stated, facts_of, not_for_temperature, warmth};
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
        environment: warmth(&log.thermometers),
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
    let mut corrections = match &journal.log.judged {
        Some(judged) => vec![
            made("table error", judged.left_rad.is_some()),
            made("errors of the plate", judged.plate_known),
        ],
        None => Vec::new(),
    };
    corrections.push(not_for_temperature());
    corrections
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
    let passes = match plan.passes {
        1 => "1 pass".to_owned(),
        several => format!("{several} passes"),
    };
    let read = format!("{passes} in each direction{how}, the first repeated at the end");
    [
        Fact::new("plate", format!("{}, {} lines", plan.plate, plan.lines)),
        Fact::new("placements", format!("at {} lines", offsets.join(", "))),
        Fact::new("read", read),
    ]
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use machine::records::{ThermometersEntry, read_journal};

    use super::*;

    #[track_caller]
    fn check(journal: &ReadJournal<PlateLog>, name: &str, expected: &str) {
        let facts = head(journal, &[]);
        let seen = facts.iter().find(|it| it.name == name);
        assert_eq!(seen.map(|it| &*it.value), Some(expected));
    }

    #[test]
    fn how_warm_it_was_is_said_by_thermometer_and_that_nobody_recorded_it_where_nobody_did() {
        let golden = concat!(env!("CARGO_MANIFEST_DIR"), "/golden/rotary_verify.jsonl");
        let mut journal = read_journal::<PlateLog>(Path::new(golden)).unwrap();
        check(&journal, "environment", "not recorded");
        check(&journal, "corrections off", "temperature");
        let names = vec![
            "heat 1".to_owned(),
            "heat 2".to_owned(),
            "heat 3".to_owned(),
        ];
        journal.log.thermometers = [20.80, 20.90]
            .map(|celsius| ThermometersEntry {
                names: names.clone(),
                temperatures_c: vec![Some(celsius), Some(21.0), None],
                at_s: 1.0,
            })
            .to_vec();
        let expected = "thermometers of the machine: heat 1 20.850 °C (20.800 to 20.900), heat 2 21.000 °C \
                        (21.000 to 21.000)";
        check(&journal, "environment", expected);
    }
}
