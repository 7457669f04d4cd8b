//! Does every position fit its neighbours?
//!
//! Wrong is a position whose deviation does not belong to the curve of the stage: a knock on the
//! reflector, a count lost in every run, a slip of the pen. How far a good position stands off its
//! neighbours is a matter of this stage, its noise and the distance of its positions, so that it
//! is taken from the table itself and not from a number that somebody set:
//!
//! - Over every 3 and every 5 neighbouring positions the divided difference of the deviations is
//!   formed, whose weights take out a straight line and a cubic; scaled to unit weight vectors, so
//!   that noise of one size gives differences of that size whatever the distances are.
//! - The largest difference is compared with the rms of those that do not share its middle
//!   position (both approaches together). What is larger than chance makes it in one of
//!   1/[`FALSE_ALARMS`] good tables is a position that stands off. Then its surroundings are left
//!   out and the next largest is judged, so that one wrong position does not hide another
//!   (Rosner's generalised extreme Studentised deviate, 1983).
//! - Of the positions in that difference the one is named that explains its neighbours' best.
//!
//! Neighbouring differences share positions, so there are fewer degrees of freedom than
//! differences: for white noise the number is divided by the sum of their squared correlations.
//! The curve of a real stage is smoother than that, and its differences are bounded where noise has
//! tails: the rate is kept from above (`tests/systems/virtual_time/wrong_position.rs` counts).
//!
//! Absent: a judgement of tables of fewer than seven positions, of which nothing can be said.

use units::{Approach, Metres};

use super::ErrorTable;
use crate::significance::student_limit;

/// The share of good tables in which a position is held for wrong.
pub const FALSE_ALARMS: f64 = 1e-4;

/// How many wrong positions are looked for at most.
const WRONG_MAX: usize = 4;

/// The curves that are taken out: a difference over so many intervals has no part in a polynomial
/// of one degree less.
const ORDERS: [Order; 2] = [
    // The correlations of neighbouring second differences of white noise are -2/3 and 1/6.
    Order {
        intervals: 2,
        differences_per_freedom: 1.944,
    },
    // Those of fourth differences -4/5, 2/5, -4/35 and 1/70.
    Order {
        intervals: 4,
        differences_per_freedom: 2.627,
    },
];

#[derive(Clone, Copy)]
struct Order {
    intervals: usize,
    differences_per_freedom: f64,
}

/// A position that does not fit its neighbours.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error(
    "error table: at {:.3} mm (approach `{}`) the deviation of {:.3} um stands {:.3} um off the \
     curve through its neighbours from {:.3} to {:.3} mm; judged by the other positions, at most \
     {:.3} um is plausible",
    position.mm(), approach.symbol(), deviation.um(), seen.abs().um(), from.mm(), to.mm(),
    limit.um()
)]
pub struct StandOff {
    /// The position.
    pub position: Metres,
    /// In which approach it shows most.
    pub approach: Approach,
    /// Its deviation.
    pub deviation: Metres,
    /// That deviation less the one that its neighbours let expect.
    pub seen: Metres,
    /// The largest magnitude of it that a good table has.
    pub limit: Metres,
    /// The first neighbour.
    pub from: Metres,
    /// The last neighbour.
    pub to: Metres,
    /// Whether this approach to it begins where the stage turns, just beyond the end of the table.
    pub is_after_turn: bool,
}

impl ErrorTable {
    /// Judges every position by its neighbours, and returns the smallest error of a single position
    /// (not one of the outermost two at either end) that would have been noticed; `None` when the
    /// table is too short to say anything. What stands off by no more than `harmless` is believed.
    ///
    /// # Errors
    /// The position that stands off most.
    ///
    /// # Example
    ///
    /// ```
    /// use compensator::error_table::{ErrorTable, Node};
    /// use units::Metres;
    ///
    /// let nodes = (0..=20).map(|at| {
    ///     let knock_um = if at == 8 { 5.0 } else { 0.0 };
    ///     let curve_um = 0.02 * f64::from(at * at) + 0.1 * f64::from(at * 7 % 5);
    ///     Node {
    ///         position: Metres::from_mm(3.0 * f64::from(at)),
    ///         forward: Some(Metres::from_um(curve_um + knock_um)),
    ///         reverse: None,
    ///         u_forward: None,
    ///         u_reverse: None,
    ///     }
    /// });
    /// let table = ErrorTable::new(nodes.collect())?;
    /// let wrong = table.judge_neighbours(Metres::ZERO).expect_err("5 µm are much");
    /// assert_eq!(wrong.position, Metres::from_mm(24.0));
    /// # Ok::<(), compensator::error_table::TableError>(())
    /// ```
    pub fn judge_neighbours(&self, harmless: Metres) -> Result<Option<Metres>, StandOff> {
        let orders = ORDERS.into_iter();
        let differences: Vec<_> = orders.filter_map(|it| Differences::new(self, it)).collect();
        let found = differences.iter().flat_map(|it| it.judge(self));
        // The largest of all: a number that lets it pass lets the others pass as well.
        let worst = found.max_by(|a, b| a.seen.abs().value().total_cmp(&b.seen.abs().value()));
        match worst.filter(|it| it.seen.abs() > harmless) {
            Some(worst) => Err(worst),
            None => Ok(differences
                .iter()
                .filter_map(Differences::noticed)
                .map(|it| Metres(it).max(harmless))
                .reduce(Metres::min)),
        }
    }
}

/// The differences of one order over a whole table.
struct Differences {
    order: Order,
    /// One row of weights per difference, of unit length.
    weights: Vec<Vec<f64>>,
    sides: Vec<(Approach, Vec<f64>)>,
}

impl Differences {
    fn new(table: &ErrorTable, order: Order) -> Option<Self> {
        let at: Vec<f64> = table.nodes().iter().map(|it| it.position.value()).collect();
        let weights: Vec<Vec<f64>> = at.windows(order.intervals + 1).map(weights).collect();
        if weights.is_empty() {
            return None;
        }
        let sides = [Approach::Forward, Approach::Reverse]
            .into_iter()
            .filter(|approach| table.knows(*approach))
            .map(|approach| {
                let deviations = table.nodes().iter().filter_map(|it| it.deviation(approach));
                let deviations: Vec<f64> = deviations.map(Metres::value).collect();
                let windows = deviations.windows(order.intervals + 1);
                let differences = windows.zip(&weights).map(|(d, w)| dot(d, w)).collect();
                (approach, differences)
            })
            .collect();
        Some(Self {
            order,
            weights,
            sides,
        })
    }

    /// What stands off: the largest difference is judged, then, without its surroundings, the next
    /// largest.
    fn judge(&self, table: &ErrorTable) -> Vec<StandOff> {
        let mut kept = vec![true; self.weights.len()];
        let mut found = Vec::new();
        for _ in 0..WRONG_MAX {
            let Some((at, side)) = self.largest(&kept) else {
                break;
            };
            let Some(limit) = self.limit(&kept, at) else {
                break;
            };
            if self.size((at, side)) > limit {
                let place = self.blame(at, side);
                found.push(self.stand_off(table, at, side, place, limit));
                self.rows_of(at + place).for_each(|it| kept[it] = false);
            }
            self.neighbourhood(at).for_each(|it| kept[it] = false);
        }
        found
    }

    /// The smallest error of one position, in metres, that makes a difference beyond the limit.
    fn noticed(&self) -> Option<f64> {
        let kept = vec![true; self.weights.len()];
        let (at, _) = self.largest(&kept)?;
        let middle = self.weights[at][self.order.intervals / 2];
        Some(self.limit(&kept, at)? / middle.abs())
    }

    /// The differences that the position `node` is part of.
    fn rows_of(&self, node: usize) -> core::ops::Range<usize> {
        node.saturating_sub(self.order.intervals)..(node + 1).min(self.weights.len())
    }

    /// The differences that share the middle position of the one at `at`.
    fn neighbourhood(&self, at: usize) -> core::ops::Range<usize> {
        let half = self.order.intervals / 2;
        at.saturating_sub(half)..(at + half + 1).min(self.weights.len())
    }

    /// The largest difference of those kept, as its place and its side.
    fn largest(&self, kept: &[bool]) -> Option<(usize, usize)> {
        let all =
            (0..self.weights.len()).flat_map(|at| (0..self.sides.len()).map(move |s| (at, s)));
        all.filter(|(at, _)| kept[*at])
            .max_by(|a, b| self.size(*a).total_cmp(&self.size(*b)))
    }

    fn size(&self, (at, side): (usize, usize)) -> f64 {
        self.sides[side].1[at].abs()
    }

    /// How large a difference the others let expect; `None` when there are too few of them.
    fn limit(&self, kept: &[bool], at: usize) -> Option<f64> {
        let near = self.neighbourhood(at);
        let tests = kept.iter().filter(|it| **it).count() * self.sides.len();
        let rest: Vec<usize> = (0..kept.len())
            .filter(|it| kept[*it] && !near.contains(it))
            .collect();
        let count = rest.len() * self.sides.len();
        let freedom = (count as f64 / self.order.differences_per_freedom) as usize;
        let squares: f64 = self
            .sides
            .iter()
            .flat_map(|(_, all)| rest.iter().map(|it| all[*it] * all[*it]))
            .sum();
        let chance = FALSE_ALARMS / (ORDERS.len() * tests) as f64;
        (freedom >= 1).then(|| student_limit(chance, freedom) * (squares / count as f64).sqrt())
    }

    /// Which position of the difference at `at` explains it and its neighbours best, as its place
    /// in the difference: the one whose error alone would take most out of them.
    fn blame(&self, at: usize, side: usize) -> usize {
        let explained = |place: usize| {
            let node = at + place;
            let (mut product, mut squares) = (0.0, 0.0);
            for row in self.rows_of(node) {
                let weight = self.weights[row][node - row];
                product += self.sides[side].1[row] * weight;
                squares += weight * weight;
            }
            product * product / squares
        };
        (0..=self.order.intervals)
            .max_by(|a, b| explained(*a).total_cmp(&explained(*b)))
            .unwrap_or(self.order.intervals / 2)
    }

    fn stand_off(
        &self,
        table: &ErrorTable,
        at: usize,
        side: usize,
        place: usize,
        limit: f64,
    ) -> StandOff {
        let nodes = &table.nodes()[at..=at + self.order.intervals];
        let (approach, differences) = &self.sides[side];
        let weight = self.weights[at][place];
        let node = &nodes[place];
        let is_after_turn = match approach {
            Approach::Forward => at + place == 0,
            Approach::Reverse => at + place + 1 == table.nodes().len(),
        };
        StandOff {
            position: node.position,
            approach: *approach,
            deviation: node.deviation(*approach).unwrap_or(Metres::ZERO),
            seen: Metres(differences[at] / weight),
            limit: Metres(limit / weight.abs()),
            from: nodes[0].position,
            to: nodes[self.order.intervals].position,
            is_after_turn,
        }
    }
}

/// The weights of the divided difference over `at`, scaled to a sum of squares of 1.
fn weights(at: &[f64]) -> Vec<f64> {
    let span = at[at.len() - 1] - at[0];
    let raw: Vec<f64> = at
        .iter()
        .map(|x| {
            let others = at.iter().filter(|y| *y != x);
            others.map(|y| span / (x - y)).product()
        })
        .collect();
    let length = raw.iter().map(|w: &f64| w * w).sum::<f64>().sqrt();
    raw.into_iter().map(|w| w / length).collect()
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
#[path = "stand_off_tests.rs"]
mod tests;
