//! What makes the error of a rotary table uncertain.
//!
//! All that is stated of a table error comes from how readings scatter about the model: detector, bearing and
//! what the table's own readings do within a line are all in that, and a placement's constant and the plate's
//! errors are unknowns of the same fit. The scatter reaches the error by the amplification of the placements,
//! with what missing readings add to it. Straight lines between the lines leave out how the error bends there.
//!
//! Absent, because no reading says anything of it: harmonics above half the number of lines, and what is the
//! same in every placement.

use units::Radians;

use super::solution::Solution;
use super::{PeriodicInterpolation, PeriodicTable};
use crate::budget::{BudgetError, Contribution, Correlation, Evaluation, PlacesBudget};

/// The largest share of the second difference that a straight line is off by, half-way.
const BEND_SHARE: f64 = 1.0 / 8.0;

impl Solution {
    /// What the uncertainty of each table error is made of, and what it is half-way to the next line: places 2n
    /// and 2n + 1. Of a table that is drawn by `interpolation` between its lines; `None` where neither residuals
    /// nor a stated noise say anything.
    ///
    /// # Errors
    /// When a figure is no uncertainty.
    pub fn budget(
        &self,
        interpolation: PeriodicInterpolation,
    ) -> Result<Option<PlacesBudget<Radians>>, BudgetError> {
        let Some(readings) = self.of_readings() else {
            return Ok(None);
        };
        let lines = self.amplification.len();
        let bends = match interpolation {
            PeriodicInterpolation::BandLimited => None,
            PeriodicInterpolation::Linear => self.bends(),
        };
        let most = bends.iter().flatten().copied().fold(0.0, f64::max);
        let bend = bends.as_ref().map(|_| Contribution {
            name: "straight lines between the lines".to_owned(),
            evaluation: Evaluation::B,
            value: most,
            degrees_of_freedom: None,
            correlation: Correlation::BetweenPositions,
            ..readings.clone()
        });
        let of_bend = |line: usize| bends.as_ref().map(|it| share_of(it[line], most));
        let places = (0..lines).flat_map(|line| {
            let (here, next) = (
                self.amplification[line],
                self.amplification[(line + 1) % lines],
            );
            let between = (f64::midpoint(here * here, next * next)).sqrt();
            let at_line = core::iter::once(here).chain(of_bend(line).map(|_| 0.0));
            let half_way = core::iter::once(between).chain(of_bend(line));
            [at_line.collect::<Vec<f64>>(), half_way.collect()]
        });
        let contributions = core::iter::once(readings).chain(bend).collect();
        PlacesBudget::new(contributions, places.collect()).map(Some)
    }

    fn of_readings(&self) -> Option<Contribution> {
        let freedom = self.degrees_of_freedom as f64;
        let (name, evaluation, value, degrees_of_freedom) =
            match (self.reading_noise_seen, self.reading_noise_given) {
                (Some(seen), _) => (SEEN, Evaluation::A, seen, Some(freedom)),
                (None, Some(given)) => (GIVEN, Evaluation::B, given, None),
                (None, None) => return None,
            };
        let noise = (value.value(), "rad");
        Some(Contribution {
            degrees_of_freedom,
            ..Contribution::new(name, evaluation, noise, Correlation::SharedReadings)
        })
    }

    /// By line, how far a straight line to the next one is off half-way; `None` of errors that are no table.
    fn bends(&self) -> Option<Vec<f64>> {
        let table = PeriodicTable::new(self.deviations(), None).ok()?;
        let lines = self.table_error.len();
        Some((0..lines).map(|it| BEND_SHARE * table.bend(it)).collect())
    }
}

/// Readings as they scatter about the model.
const SEEN: &str = "readings of lines, about the model";
/// Readings as their noise is stated beforehand.
const GIVEN: &str = "readings of lines, as stated";

fn share_of(value: f64, most: f64) -> f64 {
    if most > 0.0 { value / most } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use core::f64::consts::TAU;

    use super::*;
    use crate::noise::Noise;
    use crate::rotary::{
        PeriodicCompensation, PeriodicLimits, Placement, RotarySeries, SolveOptions, solve,
    };

    const LINES: usize = 24;

    /// 24 lines in three placements, one reading missing, with scatter.
    fn solved() -> Solution {
        let mut noise = Noise(42);
        let table = |at: usize| 3e-5 * (TAU * (at % LINES) as f64 / LINES as f64).sin();
        let placements = [0, 1, 5].map(|offset| Placement {
            offset,
            readings: (0..LINES)
                .map(|line| Some(Radians(table(line + offset) + 1e-7 * noise.normal())))
                .map(|it| it.filter(|it| offset != 5 || it.value() < 2.9e-5))
                .collect(),
        });
        let series = RotarySeries::new(LINES, placements.to_vec()).unwrap();
        solve(&series, &SolveOptions::default()).unwrap()
    }

    /// What a corrected move states.
    fn stated(solution: &Solution, drawn: PeriodicInterpolation, half_line: usize) -> f64 {
        let table = PeriodicTable::new(solution.deviations(), solution.standard_uncertainty());
        let limits = PeriodicLimits {
            size: Radians(1e-3),
            slope: 0.1,
        };
        let made = PeriodicCompensation::new(table.unwrap(), drawn, limits).unwrap();
        let angle = Radians(TAU * half_line as f64 / (2 * LINES) as f64);
        made.standard_uncertainty(angle).unwrap().unwrap().value()
    }

    #[test]
    fn a_budget_comes_to_what_a_move_states_at_every_line_and_half_way() {
        let solution = solved();
        assert!(!solution.missing.is_empty(), "the amplification differs");
        for drawn in [
            PeriodicInterpolation::BandLimited,
            PeriodicInterpolation::Linear,
        ] {
            let budget = solution.budget(drawn).unwrap().unwrap();
            for place in 0..2 * LINES {
                let (seen, expected) = (budget.at(place), stated(&solution, drawn, place));
                let u = seen.standard_uncertainty.value();
                assert!(
                    (u / expected - 1.0).abs() < 1e-9,
                    "{place}: {u:e}, {expected:e}"
                );
                let freedom = seen.degrees_of_freedom.unwrap();
                let own = solution.degrees_of_freedom as f64;
                assert!(freedom >= own * (1.0 - 1e-9), "{freedom} of {own}");
            }
        }
    }

    #[test]
    fn two_placements_have_a_budget_only_of_a_noise_that_is_stated() {
        let mut solution = solved();
        solution.reading_noise_seen = None;
        let drawn = PeriodicInterpolation::BandLimited;
        assert_eq!(solution.budget(drawn), Ok(None));
        solution.reading_noise_given = Some(Radians(2e-7));
        let budget = solution.budget(drawn).unwrap().unwrap();
        let line = &budget.contributions()[0];
        assert_eq!(
            (line.evaluation, line.degrees_of_freedom),
            (Evaluation::B, None)
        );
        let expected = 2e-7 * solution.amplification[3];
        let u = budget.at(6).standard_uncertainty.value();
        assert!((u / expected - 1.0).abs() < 1e-12);
    }
}
