//! Where the measured point must have been, for the tilts that are known to make of it what was read.
//!
//! The model is linear in the errors and linear in the arm, not in both: by Gauss and Newton, from the
//! stated arm and from those that are easily taken for it. Directions in which nothing tells the arm are
//! left as stated.

use units::Metres;

use super::ALIKE;
use super::weigh::{Weighed, Weights};
use crate::volumetric::Point;
use crate::volumetric::identify::design::error_row;
use crate::volumetric::identify::effect::seen;
use crate::volumetric::identify::{Observation, Plan};

/// Steps at most: two to five are usual.
const STEPS: usize = 15;
/// Nearer than this nothing changes.
const NEAR_M: f64 = 1e-5;
/// An arm that explains the readings.
#[derive(Clone, Debug)]
pub(super) struct Moved {
    /// By how much it is off in each direction with its standard uncertainty; `None` where it is as stated.
    pub(super) by: [Option<(Metres, Metres)>; 3],
    pub(super) weighed: Weighed,
}

/// An arm that is looked for.
#[derive(Clone)]
struct Search<'a> {
    plan: &'a Plan,
    observations: &'a [Observation],
    /// The readings that it made.
    own: &'a [usize],
    /// By how much it is longer, and in which directions that is looked for.
    by: [f64; 3],
    free: Vec<usize>,
    far: f64,
}

/// From each of `starts`: off in as few directions as explain the readings, and each set of directions
/// that explains them as well as any other; none where no arm does.
pub(super) fn moved(
    plan: &Plan,
    observations: &[Observation],
    own: &[usize],
    starts: impl Iterator<Item = Point>,
) -> Vec<Moved> {
    let far = far(plan, observations);
    let ends = starts.filter_map(|start| {
        let mut search = Search {
            plan,
            observations,
            own,
            by: start.array(),
            free: (0..3).collect(),
            far,
        };
        let weighed = search.converge(Weights::AsRead)?;
        Some((weighed.fit.squares(), search))
    });
    let Some((_, mut best)) = ends.min_by(|a, b| a.0.total_cmp(&b.0)) else {
        return Vec::new();
    };
    let whole = best.converge(Weights::BetweenNodes);
    if whole.is_none_or(|it| !it.explains()) {
        return Vec::new();
    }
    let mut sets: Vec<(Search<'_>, Weighed)> = Vec::new();
    for set in 1..8_usize {
        let mut search = best.clone();
        search.free.retain(|k| set >> k & 1 == 1);
        search.by = core::array::from_fn(|k| if set >> k & 1 == 1 { best.by[k] } else { 0.0 });
        let found = search.converge(Weights::BetweenNodes);
        let is_new = sets.iter().all(|(it, _)| it.free != search.free);
        if let (Some(weighed), true) = (found, is_new) {
            sets.push((search, weighed));
        }
    }
    let information = |it: &(Search<'_>, Weighed)| it.1.information(1.0);
    let least = sets.iter().map(information).fold(f64::INFINITY, f64::min);
    sets.retain(|it| information(it) <= least + ALIKE);
    let is_least = |it: &&(Search<'_>, Weighed)| {
        let fewer = |other: &Search<'_>| {
            other.free.len() < it.0.free.len() && other.free.iter().all(|k| it.0.free.contains(k))
        };
        !sets.iter().any(|(other, _)| fewer(other))
    };
    let found = sets.iter().filter(is_least);
    found
        .map(|(search, weighed)| search.moved(weighed))
        .collect()
}

impl Search<'_> {
    fn moved(&self, weighed: &Weighed) -> Moved {
        let by = core::array::from_fn(|k| {
            let at = self.free.iter().position(|it| *it == k)?;
            Some((Metres(self.by[k]), Metres(weighed.extra(at).1)))
        });
        let weighed = weighed.clone();
        Moved { by, weighed }
    }

    /// To where no step is left.
    fn converge(&mut self, weights: Weights) -> Option<Weighed> {
        let first = self.now();
        let mut weighed = Weighed::new(self.plan, &first, &[], weights).ok()?;
        for _ in 0..STEPS {
            let now = self.now();
            let levers = levers(self.plan, &now, self.own, &weighed);
            self.free.retain(|k| levers[*k].iter().any(|it| *it != 0.0));
            weighed = self.solve(&now, &levers, weights)?;
            let mut moved: f64 = 0.0;
            for (at, k) in self.free.iter().enumerate() {
                let (step, u) = weighed.extra(at);
                self.by[*k] += step;
                // A tenth of a standard uncertainty is near enough, too.
                moved = moved.max(step.abs().min(step.abs() / u * NEAR_M * 10.0));
            }
            if moved <= NEAR_M {
                let is_there = self.by.iter().all(|it| it.abs() <= self.far);
                return is_there.then_some(weighed);
            }
        }
        None
    }

    /// The readings with the arm as it is taken to be now.
    fn now(&self) -> Vec<Observation> {
        let mut moved = self.observations.to_vec();
        for at in self.own {
            moved[*at].tool = moved[*at].tool + Point::of(self.by);
        }
        moved
    }

    /// With the arm in the free directions as unknowns; those that others cannot be told from are left out.
    fn solve(
        &mut self,
        now: &[Observation],
        levers: &[Vec<f64>; 3],
        weights: Weights,
    ) -> Option<Weighed> {
        while !self.free.is_empty() {
            let extra: Vec<Vec<f64>> = self.free.iter().map(|k| levers[*k].clone()).collect();
            if let Ok(weighed) = Weighed::new(self.plan, now, &extra, weights) {
                return Some(weighed);
            }
            self.free.pop();
        }
        None
    }
}

/// Nobody mounts an optic farther off than on the other side of the tool, or where the machine ends: twice
/// the longest arm, or the shortest travel where that is longer. Beyond it an arm only looks as if it
/// explained what something else has made.
fn far(plan: &Plan, observations: &[Observation]) -> f64 {
    let arms = observations.iter().map(|it| it.tool.distance().value());
    let travels = plan.functions.iter().filter_map(|it| {
        let (first, last) = (it.nodes.first()?, it.nodes.last()?);
        Some((*last - *first).value())
    });
    let shortest = travels.fold(f64::INFINITY, f64::min);
    let twice = 2.0 * arms.fold(0.0, f64::max);
    if shortest.is_finite() {
        twice.max(shortest)
    } else {
        twice
    }
}

/// What a metre more of the arm in each direction adds to each reading, by the errors found.
pub(super) fn levers(
    plan: &Plan,
    observations: &[Observation],
    own: &[usize],
    weighed: &Weighed,
) -> [Vec<f64>; 3] {
    let design = &weighed.design;
    let errors = &weighed.fit.coefficients[..design.errors()];
    let mut levers = [(); 3].map(|()| vec![0.0; observations.len()]);
    for at in own {
        let it = &observations[*at];
        let above = plan.thermal.above_of_run(it.run);
        let read = |tool: Point| -> f64 {
            let row = error_row(plan, &design.blocks, it.at, tool, &above, |effect| {
                seen(it.reading, effect)
            });
            row.iter().zip(errors).map(|(a, b)| a * b).sum()
        };
        let without = read(it.tool);
        for (k, lever) in levers.iter_mut().enumerate() {
            let mut longer = [0.0; 3];
            longer[k] = 1.0;
            lever[*at] = read(it.tool + Point::of(longer)) - without;
        }
    }
    levers
}
