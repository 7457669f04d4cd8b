//! The head of the page of a platform's run.

use machine::records::{ReadJournal, short};
use units::{Metres, Radians};

use super::{Named, Visit};
use crate::platform::{PlatformLog, PoseRecord};
use crate::program::page::head::{
    Fact, IN_USE, Made, Stated, facts_of, not_for_temperature, warmth,
};
use crate::program::text::verdict;
use crate::store::budget::PlacesBudgetRecord;

/// The head of the page of `journal`, with the calibrations that were made from it.
pub(crate) fn head(journal: &ReadJournal<PlatformLog>, calibrations: &[Named]) -> Vec<Fact> {
    let log = &journal.log;
    let measured = log.poses.iter().any(|it| it.target.is_some());
    let stated = Stated {
        environment: warmth(&log.thermometers),
        corrections: corrections(journal, measured),
        uncertainty: uncertainty(calibrations).or_else(|| seen(journal)),
        verdict: judged(journal),
        conformity: Some((
            "seen by a camera in the plane, which no standard describes".into(),
            true,
        )),
        sign: "error = seen − target; deviation = stroke seen − stroke commanded",
        made: made(calibrations),
    };
    let mut facts = facts_of(journal, stated);
    for it in facts.iter_mut().filter(|it| it.name == IN_USE) {
        it.value = named(&it.value);
    }
    let count = log.strokes.len() + log.poses.len();
    facts.push(Fact::new("points", count.to_string()));
    facts
}

fn corrections(journal: &ReadJournal<PlatformLog>, measured: bool) -> Vec<Made> {
    let models = Made {
        name: "models of the screws".into(),
        is_made: journal.header.calibration.is_some(),
        is_missed: false,
    };
    let mut corrections: Vec<Made> = measured.then_some(models).into_iter().collect();
    if measured || !journal.log.strokes.is_empty() {
        corrections.push(not_for_temperature());
    }
    corrections
}

/// The calibrations' names as short as elsewhere.
fn named(in_use: &str) -> String {
    let each = in_use.split(' ').map(|it| match it.split_once('=') {
        Some((axis, id)) => format!("{axis} {}", short(id)),
        None => it.to_owned(),
    });
    each.collect::<Vec<_>>().join(", ")
}

fn made(calibrations: &[Named]) -> Vec<(String, String)> {
    let each = calibrations.iter();
    each.map(|(id, it)| (format!("screw {}", it.head.axis), id.clone()))
        .collect()
}

/// Of a single stop, as moves state it: that of the screw that is least certain.
fn uncertainty(calibrations: &[Named]) -> Option<String> {
    let budgets = calibrations
        .iter()
        .filter_map(|(_, it)| it.content.budget.as_ref());
    let worst = budgets.filter_map(PlacesBudgetRecord::least_certain);
    let most = worst.map(|it| it.expanded_u_si).reduce(f64::max)?;
    Some(format!(
        "of a single stop of the least certain screw: U (k = 2) up to {:.3} µm",
        Metres(most).um()
    ))
}

/// Of the error of a pose that was verified, at its least certain part, with where it comes from.
fn seen(journal: &ReadJournal<PlatformLog>) -> Option<String> {
    let arrangement = journal.log.arrangement.as_ref()?;
    let (camera, edge) = (arrangement.camera_u?, arrangement.edge_m);
    let poses = journal.log.poses.iter().filter(|it| it.target.is_some());
    let told: Option<Vec<PoseRecord>> = poses.map(|it| it.seen_u).collect();
    let Some(told) = told.filter(|it| !it.is_empty()) else {
        return Some(SINGLE.into());
    };
    let parts = |it: &PoseRecord| [it.x_m, it.y_m, it.angle_rad * edge];
    let largest = |it: [f64; 3]| it.into_iter().fold(0.0, f64::max);
    let own = parts(&camera);
    let scatter = |it: &PoseRecord| {
        let all = parts(it);
        let repeated = |at: usize| all[at] * all[at] - own[at] * own[at];
        largest([0, 1, 2].map(|at| repeated(at).max(0.0).sqrt()))
    };
    let expanded = 2.0 * told.iter().map(|it| largest(parts(it))).fold(0.0, f64::max);
    let repeats = told.iter().map(scatter).fold(0.0, f64::max);
    Some(format!(
        "of the error of a pose: U (k = 2) up to {:.3} µm. It has the camera's own scale and teaching as configured, \
         u {:.3} µm and {:.3}″ ({:.3} µm at the edge), and what its pictures do not repeat, those of the zero included, \
         u up to {:.3} µm",
        Metres(expanded).um(),
        Metres(camera.x_m).um(),
        Radians(camera.angle_rad).arcsec(),
        Metres(own[2]).um(),
        Metres(repeats).um(),
    ))
}

/// Why there is no uncertainty.
const SINGLE: &str = "NOT STATED: a single picture of each pose does not say what the camera repeats; take several \
                      (`exposures` of [platform])";

fn judged(journal: &ReadJournal<PlatformLog>) -> Option<(String, bool)> {
    let visit = (String::new(), journal);
    let visit = Visit::of(&visit);
    let (seen, tolerance) = (visit.figures.largest, visit.tolerance?);
    let is_within = seen <= tolerance;
    let text = verdict(
        &format!("largest error of a pose {:.3} µm", seen.um()),
        &format!("{:.3} µm", tolerance.um()),
        is_within,
    );
    (!visit.poses.is_empty()).then_some((text, is_within))
}
