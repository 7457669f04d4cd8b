//! What is left of the readings of a run when the estimate is taken off.

use core::f64::consts::TAU;

use compensator::rotary::{Placement, Solution, SolveOptions};
use machine::records::ReadJournal;
use units::Radians;

use crate::rotary::PlateLog;
use crate::rotary::estimate::fit;
use crate::rotary::placed::Placed;

/// Where each reading of `journal` was made on the table, and what is left of it, all placements that are
/// whole one after the other; `None` when they are too few, or do not part table and plate.
pub(crate) fn residuals_of(journal: &ReadJournal<PlateLog>) -> Option<Vec<(Radians, Radians)>> {
    let plan = journal.log.plan.as_ref()?;
    let placements = journal.log.placements.iter();
    let placed: Vec<Placed> = placements
        .map(|it| Placed::in_plan(it, &journal.log.sweeps, plan))
        .collect();
    let options = SolveOptions {
        amplification_max: f64::INFINITY,
        ..SolveOptions::default()
    };
    let (solution, read) = fit(&journal.header.axis, plan.lines, &options, &placed).ok()?;
    let placements = read.placements().iter();
    Some(
        placements
            .flat_map(|it| of_placement(it, &solution))
            .collect(),
    )
}

fn of_placement(placement: &Placement, solution: &Solution) -> Vec<(Radians, Radians)> {
    let lines = placement.readings.len();
    let spacing = TAU / lines as f64;
    let expected = solution.expected(placement.offset);
    let apart: Vec<(Radians, Radians)> = (0..lines)
        .filter_map(|line| {
            let place = Radians(((line + placement.offset) % lines) as f64 * spacing);
            Some((place, placement.readings[line]? - expected[line]?))
        })
        .collect();
    let mean = apart.iter().map(|it| it.1).sum::<Radians>() / apart.len().max(1) as f64;
    let left = apart.into_iter();
    left.map(|(place, apart)| (place, apart - mean)).collect()
}
