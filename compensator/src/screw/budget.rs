//! What makes the place of a ball screw's nut uncertain.
//!
//! A model's covariance has two parts, by what its scatter was judged by (see `strata`): what strokes scatter
//! about the model, which is the screw's own error at a stroke with what is left of the rest in the mean of a
//! stroke; and how the sides and repetitions of one stroke differ, which is what the camera sees wrongly and a
//! stop does not repeat. Both were widened for their degrees of freedom where these are few, which is in the
//! sensitivities here: the expanded uncertainty is twice the combined one as it is. A third part, where it is known,
//! is where the strokes are seen from: no stroke shows that error, which all of them have. A single stop scatters
//! about the model besides (see `stop`), widened likewise.
//!
//! Absent, because the strokes say nothing of it: the scale of the camera, what play leaves open while nobody
//! knows which flank the nut leans on.

use units::{Approach, Metres};

use super::ScrewModel;
use crate::budget::{BudgetError, Contribution, Correlation, Evaluation, PlacesBudget};
use crate::uncertainty::propagate;

/// Some scatter, and what a model's covariance has of it.
#[derive(Clone, Debug, PartialEq)]
pub struct ScatterPart {
    pub(super) name: &'static str,
    pub(super) scatter: Metres,
    pub(super) degrees_of_freedom: usize,
    /// As that of the model.
    pub(super) covariance: Vec<f64>,
}

/// What the uncertainty of a model is made of.
#[derive(Clone, Debug, PartialEq)]
pub struct ScatterParts {
    /// Of its covariance.
    pub(super) of_model: Vec<ScatterPart>,
    /// How well the scatter of a single stop is known.
    pub(super) freedom_of_stop: usize,
}

impl ScatterParts {
    /// The budget of where the nut of a screw with `model` stands at `places` after a single stop, its play
    /// taken up.
    ///
    /// # Errors
    /// When a figure is no uncertainty.
    pub fn budget(
        &self,
        model: &ScrewModel,
        places: &[(Metres, Approach)],
    ) -> Result<PlacesBudget<Metres>, BudgetError> {
        let of_model = self.of_model.iter().map(|it| {
            let correlation = Correlation::SharedReadings;
            line(it.name, it.scatter, it.degrees_of_freedom, correlation)
        });
        let stop = model
            .scatter
            .map(|it| line(ONE_STOP, it, self.freedom_of_stop, Correlation::Independent));
        let sensitivities = places.iter().map(|(stroke, approach)| {
            let gradient = model.gradient(stroke.value(), *approach);
            let of_part = |it: &ScatterPart| {
                let share = propagate(&gradient, &it.covariance).max(0.0).sqrt();
                share / it.scatter.value()
            };
            let own = self.of_model.iter().map(of_part);
            own.chain(stop.iter().map(|_| 1.0)).collect()
        });
        let sensitivities = sensitivities.collect();
        PlacesBudget::new(of_model.chain(stop.clone()).collect(), sensitivities)
    }
}

/// What strokes scatter about the model.
pub(super) const STROKES: &str = "strokes about the model";
/// How sides and repetitions of a stroke differ.
pub(super) const SIDES: &str = "sides and repetitions of a stroke";
/// Where all of them are counted from.
pub(super) const ORIGIN: &str = "the zero as it was seen";
/// What a single stop does besides.
const ONE_STOP: &str = "one stop";

fn line(
    name: &str,
    scatter: Metres,
    degrees_of_freedom: usize,
    correlation: Correlation,
) -> Contribution {
    Contribution {
        degrees_of_freedom: Some(degrees_of_freedom.max(1) as f64),
        ..Contribution::new(name, Evaluation::A, (scatter.value(), "m"), correlation)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::noise::Noise;
    use crate::screw::{
        Engagement, FitOptions, Limits, Rule, ScrewCompensation, ScrewMemory, Stroke, fit, patent,
    };

    /// Nine strokes from both sides, repeated so often; the screw has errors of its own.
    fn strokes(repeated: impl Fn(i32, Approach) -> usize) -> Vec<Stroke> {
        let mut noise = Noise(11);
        let mut strokes = Vec::new();
        for at in -4..=4 {
            let own = 0.2e-6 * noise.normal();
            for (approach, lost_motion) in [(Approach::Forward, 0.0), (Approach::Reverse, 2e-6)] {
                for _ in 0..repeated(at, approach) {
                    let off = own + lost_motion + 0.1e-6 * noise.normal();
                    strokes.push(Stroke {
                        approach,
                        stroke: Metres(f64::from(at) * 1e-3),
                        deviation: Metres(1e-3 * f64::from(at) * 1e-3 + off),
                    });
                }
            }
        }
        strokes
    }

    /// What a move states that ends at a place with its play taken up.
    fn check(model: &ScrewModel, parts: &ScatterParts, rule: Rule) {
        let sides = [Approach::Forward, Approach::Reverse];
        let places = (-9..9).map(|at| Metres(f64::from(at) * 0.4e-3));
        let places: Vec<_> = places.flat_map(|at| sides.map(|side| (at, side))).collect();
        let limits = Limits {
            size: Metres(1e-3),
            slope: 0.1,
            extrapolation: Metres(1e-3),
            resolution: Metres(1e-9),
        };
        let screw = ScrewCompensation::new(model.clone(), limits, rule).unwrap();
        let budget = parts.budget(model, &places).unwrap();
        for (number, (at, approach)) in places.iter().enumerate() {
            let engagement = match approach {
                Approach::Forward => Engagement::Forward,
                Approach::Reverse => Engagement::Reverse,
            };
            let before = ScrewMemory {
                set_point: *at - Metres(1e-4) * approach.sign(),
                engagement,
            };
            let stated = screw.expected(*at, &before).standard_uncertainty.unwrap();
            let seen = budget.at(number).standard_uncertainty;
            assert!(
                (seen / stated - 1.0).abs() < 1e-9,
                "{at:?} {approach:?}: {seen:?}, {stated:?}"
            );
        }
    }

    #[test]
    fn a_budget_comes_to_what_a_move_states_at_every_place_from_both_sides() {
        // As often everywhere, otherwise, and from one side only where that may be.
        let counts: [fn(i32, Approach) -> usize; 4] = [
            |_, _| 3,
            |at, _| 1 + at.unsigned_abs() as usize % 3,
            |at, side| usize::from(at != 2 || side == Approach::Forward) * 2,
            |_, _| 1,
        ];
        for repeated in counts {
            let fitted = fit(&strokes(repeated), &FitOptions::default()).unwrap();
            check(&fitted.model, &fitted.parts.unwrap(), Rule::Engagement);
        }
    }

    #[test]
    fn a_budget_of_the_patents_means_comes_to_what_they_state() {
        let reverse = |_, side| usize::from(side == Approach::Reverse) * 3;
        let estimate = patent::estimate(&strokes(reverse)).unwrap();
        let parts = estimate.parts().unwrap();
        check(&estimate.model(), &parts, Rule::Patent);
        assert_eq!(parts.of_model[0].degrees_of_freedom, 18);
    }
}
