//! What makes the errors found uncertain: which readings, the thermometers, and what lies between the nodes.
//!
//! The errors found are linear in the readings, so that the variance of the tool's deviation is a sum over them
//! (GUM 5.1): what each reading has by itself, by where it comes from; what functions do between their nodes
//! where they were read, an error of the instrument that all of them have, and those of detectors that all readings of a
//! run have, which readings share; what the readings scatter more than was stated (Birge's ratio);
//! the thermometers; and what functions do between their nodes at the place itself.
//!
//! | symbol | name here |
//! |---|---|
//! | g = (XᵀX)⁻¹·r, for the row r of a place | `pulled` |
//! | h = X·g, by whitened reading | `whitened` |
//! | L⁻ᵀ·h, by reading in units of its own uncertainty | `own` |

use units::{Celsius, Metres};

use std::collections::BTreeMap;

use super::between::Extent;
use super::design::{Design, between_square, error_row};
use super::heat::add_heat;
use super::{Axis, IdentifyError, Observation, Plan, Point, Reading};
use crate::budget::{Contribution, Correlation, Evaluation, PlacesBudget};
use crate::least_squares::{self, Fit};
use crate::uncertainty::{propagate, rms};

/// One error of the instrument, which all readings have.
const IN_COMMON: &str = "scale and air of the instrument, common to all lines";
/// One error of a detector, which all readings of its run have.
const IN_RUNS: &str = "scale of detectors, common to each line";
/// What functions do between their nodes where they were read.
const WHERE_READ: &str = "between nodes, where read";
/// Readings that scatter more than was stated of them.
const BEYOND: &str = "scatter beyond what was stated";
/// Thermometers, each by itself in each run.
const THERMOMETERS: &str = "thermometers";
/// What functions do between their nodes at the place.
const BETWEEN: &str = "between nodes, at the place";

/// A tool at a place.
pub type ToolAt = (Point, Point);

impl Plan {
    /// What makes the tool's deviation uncertain at `places` (positions and offsets of the tool), as a length:
    /// the root sum of squares over x, y and z of what
    /// [`Identified::standard_uncertainty`](super::Identified::standard_uncertainty) states. `source` says of a
    /// reading, by its number, where it comes from: one contribution each. `temperatures` as there.
    ///
    /// # Errors
    /// When plan and observations do not fit each other.
    pub fn budget(
        &self,
        observations: &[Observation],
        source: impl Fn(usize) -> String,
        temperatures: &[Celsius],
        places: &[ToolAt],
    ) -> Result<PlacesBudget<Metres>, IdentifyError> {
        let design = Design::new(self, observations)?;
        let design = design.with_between(self, observations, &[], Extent::Likely)?;
        let fit = least_squares::solve(&design.rows, design.columns(), &design.values)?;
        let parts = Parts::of(self, observations, source, (design, fit));
        let above = self.thermal.above(temperatures);
        let squares: Vec<Vec<f64>> = places
            .iter()
            .map(|place| parts.squares(self, *place, &above))
            .collect();
        let lines = parts.lines(self, observations, &squares);
        // What contributes nowhere is no contribution.
        let counts =
            |at: &usize| squares.iter().any(|own| own[*at] > 0.0) && lines[*at].value > 0.0;
        let counted: Vec<usize> = (0..lines.len()).filter(counts).collect();
        let share = |own: &[f64], at: usize| own[at].max(0.0).sqrt() / lines[at].value;
        let sensitivities = squares.iter();
        let sensitivities =
            sensitivities.map(|own| counted.iter().map(|at| share(own, *at)).collect());
        let sensitivities = sensitivities.collect();
        let lines = counted.iter().map(|at| lines[*at].clone()).collect();
        Ok(PlacesBudget::new(lines, sensitivities)?)
    }
}

/// What a place's variance is computed from.
struct Parts {
    design: Design,
    fit: Fit,
    /// Birge's ratio, where it is above 1.
    enlarged: f64,
    /// Of what thermometers were off by.
    heat: Vec<f64>,
    /// Where readings come from, each once.
    names: Vec<String>,
    /// By reading, the number of its name.
    numbers: Vec<usize>,
    /// By reading, what one error of the instrument makes of it in units of its own uncertainty.
    common: Vec<f64>,
    /// Likewise one error of the detector of its run, by that run.
    of_runs: Vec<(usize, f64)>,
}

impl Parts {
    fn of(
        plan: &Plan,
        observations: &[Observation],
        source: impl Fn(usize) -> String,
        (design, fit): (Design, Fit),
    ) -> Self {
        let count = design.errors();
        let mut heat = vec![0.0; count * count];
        add_heat(plan, &design, observations, &fit, &mut heat);
        let mut names: Vec<String> = Vec::new();
        let mut numbers = Vec::new();
        for source in (0..observations.len()).map(source) {
            let known = names.iter().position(|it| *it == source);
            numbers.push(known.unwrap_or(names.len()));
            if known.is_none() {
                names.push(source);
            }
        }
        Self {
            enlarged: fit.residual_sd().unwrap_or(1.0).max(1.0),
            names,
            numbers,
            heat,
            common: design.common(observations),
            of_runs: observations
                .iter()
                .map(|it| it.run)
                .zip(design.common_of_runs(observations))
                .collect(),
            design,
            fit,
        }
    }

    /// By contribution the variance at a place, over all three directions.
    fn squares(&self, plan: &Plan, (at, tool): ToolAt, above: &[f64]) -> Vec<f64> {
        let mut squares = vec![0.0; self.names.len() + 6];
        for axis in Axis::ALL {
            let (readings, others) = squares.split_at_mut(self.names.len());
            let blocks = &self.design.blocks;
            let row = error_row(plan, blocks, at, tool, above, |effect| {
                effect.moved[axis.index()]
            });
            let whitened = self.whitened(&row);
            let own = self.design.whitening.of_influence(&whitened);
            for (number, own) in self.numbers.iter().zip(&own) {
                readings[*number] += own * own;
            }
            let square = |all: &[f64]| all.iter().map(|it| it * it).sum::<f64>();
            let whole = square(&whitened);
            let between = &self.design.between;
            let at_the_place = between_square(plan, blocks, between, at, tool, |effect| {
                effect.moved[axis.index()]
            });
            let in_common: f64 = own.iter().zip(&self.common).map(|(a, b)| a * b).sum();
            let in_runs = self.in_runs(&own);
            others[0] += whole - square(&own) - in_common * in_common - in_runs;
            others[1] += (self.enlarged * self.enlarged - 1.0) * whole;
            others[2] += propagate(&row, &self.heat);
            others[3] += at_the_place;
            others[4] += in_common * in_common;
            others[5] += in_runs;
        }
        squares
    }

    /// The variance that errors of the detectors of runs make, by what each reading does.
    fn in_runs(&self, own: &[f64]) -> f64 {
        let mut by_run = BTreeMap::new();
        for (own, (run, of_run)) in own.iter().zip(&self.of_runs) {
            *by_run.entry(*run).or_insert(0.0) += own * of_run;
        }
        by_run.into_values().map(|it: f64| it * it).sum()
    }

    /// What one whitened reading more does to what `row` sees of the errors.
    fn whitened(&self, row: &[f64]) -> Vec<f64> {
        let all = self.design.columns();
        let mut pulled = vec![0.0; all];
        for (weight, cofactor) in row.iter().zip(self.fit.cofactor.chunks_exact(all)) {
            let sums = pulled.iter_mut().zip(cofactor);
            sums.for_each(|(sum, it)| *sum += weight * it);
        }
        let rows = self.design.rows.chunks_exact(all);
        rows.map(|row| row.iter().zip(&pulled).map(|(a, b)| a * b).sum())
            .collect()
    }

    /// The contributions; what has no unit of its own counts by its largest share.
    fn lines(
        &self,
        plan: &Plan,
        observations: &[Observation],
        squares: &[Vec<f64>],
    ) -> Vec<Contribution> {
        let first = self.names.len();
        let most = |at: usize| {
            let each = squares.iter().map(|it| it[at].max(0.0).sqrt());
            each.fold(0.0, f64::max)
        };
        let of_readings = self.names.iter().enumerate().map(|(number, name)| {
            let own = observations.iter().zip(&self.numbers);
            let own = own.filter(|it| *it.1 == number).map(|it| it.0);
            // Without what it has in common with others.
            let u = own.clone().map(Observation::u_by_itself);
            let u: Vec<f64> = u.collect();
            let mut own = own.map(|it| it.reading);
            let is_angle = own.all(|it| matches!(it, Reading::Angle { .. }));
            let unit = if is_angle { "rad" } else { "m" };
            Contribution::new(
                name,
                Evaluation::B,
                (rms(&u), unit),
                Correlation::SharedReadings,
            )
        });
        let freedom = Some(self.fit.degrees_of_freedom as f64).filter(|it| *it > 0.0);
        let shared = |name, at: usize, correlation| {
            Contribution::new(name, Evaluation::B, (most(first + at), "m"), correlation)
        };
        let beyond = Contribution {
            evaluation: Evaluation::A,
            degrees_of_freedom: freedom,
            ..shared(BEYOND, 1, Correlation::SharedReadings)
        };
        let heat = (plan.thermal.u, "K");
        let others = [
            shared(WHERE_READ, 0, Correlation::SharedReadings),
            beyond,
            Contribution::new(
                THERMOMETERS,
                Evaluation::B,
                heat,
                Correlation::SharedReadings,
            ),
            shared(BETWEEN, 3, Correlation::BetweenPositions),
            shared(IN_COMMON, 4, Correlation::CommonScale),
            shared(IN_RUNS, 5, Correlation::SharedReadings),
        ];
        of_readings.chain(others).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::super::rig::{Measured, Rig, TOOL};
    use super::*;

    fn source(observations: &[Observation], at: usize) -> String {
        match observations[at].reading {
            Reading::Length { .. } => "lengths".to_owned(),
            Reading::Angle { .. } => "angles".to_owned(),
        }
    }

    /// The names of what contributes to a machine that is measured so.
    fn check(rig: &Rig, seed: u64) -> Vec<String> {
        let Measured {
            plan, observations, ..
        } = rig.measured(seed);
        let found = plan.identify(&observations).unwrap();
        let shares = [[0.0, 0.0, 0.0], [0.33, 0.6, 0.45], [1.0, 1.0, 1.0]];
        let at = |share: [f64; 3]| Point::of(core::array::from_fn(|k| rig.span_m[k] * share[k]));
        let places: Vec<ToolAt> = shares.map(|it| (at(it), TOOL)).to_vec();
        let named = |at| source(&observations, at);
        let budget = plan.budget(&observations, named, &[], &places).unwrap();
        for (number, (at, tool)) in places.iter().enumerate() {
            let stated = found.standard_uncertainty(*at, *tool, &[]).unwrap();
            let (seen, stated) = (budget.at(number).standard_uncertainty, stated.distance());
            assert!(
                (seen / stated - 1.0).abs() < 1e-9,
                "{at:?}: {seen:?}, {stated:?}"
            );
        }
        let lines = budget.contributions().iter();
        lines.map(|it| it.name.clone()).collect()
    }

    #[test]
    fn a_budget_comes_to_what_is_stated_of_the_tool_wherever_it_is() {
        let quiet = Rig {
            noise: 0.5,
            ..Rig::default()
        };
        let usual = ["lengths", "angles", WHERE_READ, BETWEEN];
        let mut seen = check(&quiet, 5);
        seen.sort();
        let mut expected = usual.map(str::to_owned).to_vec();
        expected.sort();
        assert_eq!(seen, expected);
        let noisy = Rig {
            noise: 1.3,
            ..Rig::default()
        };
        assert!(check(&noisy, 6).contains(&BEYOND.to_owned()));
        let stretched = Rig {
            in_common: 1e-6,
            ..quiet
        };
        assert!(check(&stretched, 7).contains(&IN_COMMON.to_owned()));
    }
}
