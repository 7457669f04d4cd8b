//! The uncertainty of the deviation as a budget: which input makes how much of it, along x, y and z.

use units::Metres;

use super::super::{Conditions, VolumetricModel};
use super::{Input, Seen, unit};
use crate::budget::{Contribution, Correlation, Evaluation, PlacesBudget};
use crate::volumetric::point::V3;
use crate::volumetric::{Axis, Point};

/// What one input does to the deviation.
struct Line {
    input: Input,
    /// Its standard uncertainty; of errors that each have their own, none.
    u: f64,
    /// The variances that it makes.
    squares: V3,
}

impl VolumetricModel {
    /// What makes [`Self::standard_uncertainty`] of the same arguments: each independent input with its standard
    /// uncertainty and its sensitivities. The places of the budget are the deviations along x, y and z, in this order.
    /// `None` outside the volume, and where nothing is uncertain.
    ///
    /// Errors that were found together are one contribution, and what functions do between their nodes is another:
    /// these have no single unit, and count by the larger of what they make along x, y and z.
    pub fn uncertainty_budget(
        &self,
        command: Point,
        now: &Conditions,
        seen: &Seen<'_>,
    ) -> Option<PlacesBudget<Metres>> {
        self.commands.check(command).ok()?;
        let mut lines: Vec<Line> = Vec::new();
        let mut add = |input: Input, effect: V3, u: f64| {
            let known = lines.iter().position(|it| it.input == input);
            let at = known.unwrap_or(lines.len());
            if known.is_none() {
                let squares = [0.0; 3];
                lines.push(Line { input, u, squares });
            }
            for (sum, effect) in lines[at].squares.iter_mut().zip(effect) {
                *sum += effect * effect * u * u;
            }
        };
        if let Some(variances) = self.variances_in_common(command, now) {
            for (axis, variance) in Axis::ALL.into_iter().zip(variances) {
                add(Input::Errors, unit(axis), variance.sqrt());
            }
        }
        self.each_input(command, now, seen, &mut add);
        lines.retain(|it| it.squares.iter().any(|square| *square > 0.0));
        if lines.is_empty() {
            return None;
        }
        let along = |k: usize| lines.iter().map(|it| it.sensitivity(k)).collect();
        let sensitivities = (0..3).map(along).collect();
        let freedom = self
            .covariance
            .as_ref()
            .and_then(|it| it.degrees_of_freedom());
        let contributions = lines.iter().map(|it| it.contribution(freedom)).collect();
        PlacesBudget::new(contributions, sensitivities).ok()
    }
}

impl Line {
    /// The standard uncertainty of the input, in its unit.
    fn value(&self) -> f64 {
        match self.input {
            Input::Errors | Input::Between => self.squares.into_iter().fold(0.0, f64::max).sqrt(),
            Input::Displacement(_)
            | Input::Roll(_)
            | Input::Temperature(_)
            | Input::Expansion(_)
            | Input::Bend(..) => self.u,
        }
    }

    fn sensitivity(&self, k: usize) -> f64 {
        self.squares[k].sqrt() / self.value()
    }

    /// `freedom`: that of errors that were judged by how readings scatter.
    fn contribution(&self, freedom: Option<f64>) -> Contribution {
        let of_b = |name: &str, unit: &str, correlation| {
            Contribution::new(name, Evaluation::B, (self.value(), unit), correlation)
        };
        match self.input {
            Input::Errors => Contribution {
                evaluation: freedom.map_or(Evaluation::B, |_| Evaluation::A),
                degrees_of_freedom: freedom,
                ..of_b("errors, as calibrated", "m", Correlation::SharedReadings)
            },
            Input::Between => of_b(
                "between nodes, at the place",
                "m",
                Correlation::BetweenPositions,
            ),
            Input::Displacement(axis) => of_b(
                &format!("displacement of the {axis} slide"),
                "m",
                Correlation::Independent,
            ),
            Input::Roll(axis) => of_b(
                &format!("roll of the {axis} slide"),
                "rad",
                Correlation::Independent,
            ),
            Input::Temperature(at) => of_b(
                &format!("thermometer {at}"),
                "K",
                Correlation::SharedReadings,
            ),
            Input::Expansion(axis) => of_b(
                &format!("expansion of {axis}"),
                "m/m",
                Correlation::SharedReadings,
            ),
            Input::Bend(axis, towards) => of_b(
                &format!("guide of {axis} bends towards {towards}"),
                "m/K",
                Correlation::SharedReadings,
            ),
        }
    }
}
