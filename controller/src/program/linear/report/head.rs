//! The head of a linear axis's page.

use compensator::budget::Combined;
use compensator::iso230::Figures;
use machine::records::{CalibrationRecord, EnvironmentRecord, ReadJournal};
use units::Metres;

use crate::linear::measure::largest_closure;
use crate::linear::record::{CombinedRecord, PlaceRecord};
use crate::linear::{CriterionEntry, LinearContent, LinearLog, PointEntry, UncertaintyAtTarget};
use crate::program::linear::uncertainty;
use crate::program::page::head::{Fact, Made, Stated, facts_of, spread};
use crate::program::text;

/// The run of a calibration, as its journal calls it.
pub(crate) const CALIBRATE: &str = "calibrate";

/// The head of the page of `journal`; `made` are the calibrations made from it.
pub(crate) fn head(
    journal: &ReadJournal<LinearLog>,
    figures: Option<&Figures>,
    made: &[(String, CalibrationRecord<LinearContent>)],
) -> Vec<Fact> {
    let log = &journal.log;
    let stated = Stated {
        environment: environment(&log.points),
        corrections: corrections(journal),
        uncertainty: uncertainty_of(log, made.first().map(|(_, it)| &it.content)),
        verdict: verdict(log.criterion.as_ref(), figures),
        conformity: figures.map(|it| conformity(it, &journal.header.verb)),
        sign: "deviation = actual − target; compensation = −deviation; B = mean ↑ − mean ↓",
        made: made
            .iter()
            .map(|(id, _)| ("calibration".into(), id.clone()))
            .collect(),
    };
    let mut facts = facts_of(journal, stated);
    if !log.points.is_empty() {
        let count = log.points.len();
        facts.push(Fact::new("points", count.to_string()));
        let closure = largest_closure(&log.closures);
        facts.push(Fact::new("datum after the runs", text::closure(closure)));
    }
    facts
}

/// Only of what was measured: a job and a zero know no uncorrected state.
fn corrections(journal: &ReadJournal<LinearLog>) -> Vec<Made> {
    let header = &journal.header;
    if header.verb == "zero" {
        return Vec::new();
    }
    vec![Made {
        name: "error table of the axis".into(),
        is_made: header.calibration.is_some(),
        // It is measured as found on purpose.
        is_missed: false,
    }]
}

/// The means over all points, and from where to where each was.
fn environment(points: &[PointEntry]) -> Option<String> {
    type Quantity = (
        &'static str,
        &'static str,
        usize,
        fn(&EnvironmentRecord) -> Option<f64>,
    );
    const QUANTITIES: [Quantity; 4] = [
        ("air", "°C", 3, |it| it.air_temperature_c),
        ("material", "°C", 3, |it| it.material_temperature_c),
        ("pressure", "hPa", 2, |it| Some(it.pressure_pa? / 100.0)),
        ("humidity", "%", 1, |it| Some(it.relative_humidity? * 100.0)),
    ];
    let of = |(name, unit, digits, value): &Quantity| {
        let seen: Vec<f64> = points
            .iter()
            .filter_map(|it| value(&it.environment))
            .collect();
        spread(name, unit, *digits, &seen)
    };
    let told: Vec<_> = QUANTITIES.iter().filter_map(of).collect();
    (!told.is_empty()).then(|| told.join(", "))
}

fn uncertainty_of(log: &LinearLog, made: Option<&LinearContent>) -> Option<String> {
    if let Some(made) = made {
        return Some(uncertainty::sentence(made));
    }
    let of_zeros = log.zeros.last().map(|it| {
        let expanded = Metres(it.standard_uncertainty_m) * 2.0;
        format!("of the zero: U (k = 2) {:.3} µm", expanded.um())
    });
    let targets: Vec<_> = log
        .criterion
        .iter()
        .flat_map(|it| &it.targets)
        .map(at_target)
        .collect();
    uncertainty::of_targets(&targets).or(of_zeros)
}

fn at_target(it: &PlaceRecord) -> UncertaintyAtTarget {
    let combined = |it: CombinedRecord| Combined {
        standard_uncertainty: Metres(it.u_m),
        degrees_of_freedom: it.degrees_of_freedom,
    };
    UncertaintyAtTarget {
        target: Metres(it.position_m),
        forward: it.forward.map(combined),
        reverse: it.reverse.map(combined),
    }
}

fn verdict(
    criterion: Option<&CriterionEntry>,
    figures: Option<&Figures>,
) -> Option<(String, bool)> {
    let (criterion, figures) = (criterion?, figures?);
    let targets: Vec<_> = criterion.targets.iter().map(at_target).collect();
    let accuracy = figures.accuracy.bidirectional;
    Some(uncertainty::verdict(
        accuracy,
        Metres(criterion.tolerance_m),
        &targets,
    ))
}

fn conformity(figures: &Figures, verb: &str) -> (String, bool) {
    let it = &figures.conformity;
    if let Some(told) = text::no_test(it).filter(|_| verb == CALIBRATE) {
        return (told, true);
    }
    let lack = text::lack(it);
    let is_so = lack.is_none();
    let conforms = format!(
        "ISO 230-2: {} runs from each side at {} targets, as the standard asks ({} at {})",
        it.runs, it.targets, it.runs_wanted, it.targets_wanted
    );
    (lack.unwrap_or(conforms), is_so)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use machine::records::read_journal;

    use super::*;
    use crate::program::linear::page::{figures_of, html};

    const GOLDEN: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/golden/linear_calibrate.jsonl");

    fn fact(journal: &ReadJournal<LinearLog>, name: &str) -> Fact {
        let figures = figures_of(&journal.log.points).unwrap();
        let mut facts = head(journal, figures.as_ref(), &[]).into_iter();
        facts
            .find(|it| it.name == name)
            .expect("it is on every page")
    }

    #[test]
    fn a_calibration_is_no_test_by_the_standard_and_a_verification_is_one() {
        let mut journal = read_journal::<LinearLog>(Path::new(GOLDEN)).unwrap();
        let told = fact(&journal, "conformity");
        let no_test = "a calibration, no test by ISO 230-2, which takes 5 runs from each side (";
        assert!(
            told.value.starts_with(no_test) && !told.is_warning,
            "{told:?}"
        );
        let page = html(Path::new(GOLDEN)).unwrap();
        assert!(
            !page.contains("DOES NOT CONFORM") && page.matches(no_test).count() == 2,
            "{page}"
        );
        journal.header.verb = "verify".into();
        let told = fact(&journal, "conformity");
        assert!(
            told.value.starts_with("DOES NOT CONFORM") && told.is_warning,
            "{told:?}"
        );
    }

    /// The verdict of a verification with this tolerance and expanded uncertainty, micrometres.
    fn verified(tolerance: f64, expanded: f64) -> Fact {
        let mut journal = read_journal::<LinearLog>(Path::new(GOLDEN)).unwrap();
        journal.header.verb = "verify".into();
        journal.complete = true;
        let combined = CombinedRecord {
            u_m: expanded * 0.5e-6,
            expanded_u_m: expanded * 1e-6,
            degrees_of_freedom: None,
        };
        journal.log.criterion = Some(CriterionEntry {
            tolerance_m: tolerance * 1e-6,
            targets: vec![PlaceRecord {
                position_m: 0.0,
                forward: Some(combined),
                reverse: None,
            }],
        });
        fact(&journal, "tolerance")
    }

    #[test]
    fn a_verification_that_is_less_certain_than_its_tolerance_is_wide_is_a_red_line() {
        let fact = verified(1000.0, 1500.0);
        let doubt = "tolerance 1000.000 µm: within, but U = 1500.000 µm (k = 2) is larger than the tolerance: this run \
                     cannot show it";
        assert!(fact.value.ends_with(doubt) && fact.is_warning, "{fact:?}");
        let fact = verified(1000.0, 1.0);
        assert!(
            fact.value.ends_with("tolerance 1000.000 µm: within"),
            "{fact:?}"
        );
        assert!(!fact.is_warning);
        let fact = verified(0.001, 1500.0);
        assert!(
            fact.value.ends_with(": NOT WITHIN") && fact.is_warning,
            "{fact:?}"
        );
    }
}
