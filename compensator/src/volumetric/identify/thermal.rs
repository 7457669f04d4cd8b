//! What temperature adds to the errors, found from runs at two or more temperatures: expansion of
//! the scales, and guides that bend.
//!
//! Source: the terms of [`crate::volumetric::model::Thermal`]; warming up a machine and measuring
//! it again is ISO 230-3's idea. Each coefficient is one column of the design: its effect per
//! kelvin times what the thermometers showed in the run, less their references.
//!
//! | symbol | name here |
//! |---|---|
//! | ∂β/∂T, of the coefficients by one thermometer's reading in one run | [`add_heat`](super::heat::add_heat) |
//!
//! The zeros of runs take up whatever grows without depending on a position. An angle's zero takes
//! up the chord's tilt: that the arc begins and ends on its chord is the plan's assumption.

use units::{Celsius, Metres};

use super::effect::{Effect, lever, seen};
use super::{IdentifyError, Observation, Plan, Unknown};
use crate::volumetric::model::{Arc, ErrorName, ThermalBend, ThermalChannel};
use crate::volumetric::point::{V3, cross};
use crate::volumetric::{Axis, Point};

/// How many standard uncertainties of a thermometer runs must differ by: a coefficient is then
/// known to a seventh at the worst.
const APART: f64 = 10.0;

/// How far apart they must be at least, in kelvin: machines are not alike over less.
const APART_K: f64 = 0.1;

/// A scale whose expansion is to be found.
#[derive(Clone, Debug, PartialEq)]
pub struct ExpansionPlan {
    /// Along which axis it lies.
    pub axis: Axis,
    /// The thermometers, from 0, whose mean is its temperature.
    pub thermometers: Vec<usize>,
}

/// A guide whose bending is to be found: as in [`ThermalBend`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BendPlan {
    /// Whose guide.
    pub axis: Axis,
    /// The direction across it that a positive bow goes to.
    pub towards: Axis,
    /// The thermometer over the neutral plane, from 0.
    pub over: usize,
    /// The one under it, if there is one.
    pub under: Option<usize>,
    /// Where the arc begins on its chord.
    pub low: Metres,
    /// Where it ends.
    pub high: Metres,
    /// Whether the arc also shows in sideways readings. Where films or supports grow too, it is
    /// found from angles and levers alone, and sideways readings belong to one temperature.
    pub sideways: bool,
    /// Where a detector sits on the slide whose displacements were taken off all readings: with
    /// them it took off what it saw of the tilt.
    pub seen_from: Option<Point>,
}

/// The thermal errors that are to be found. Empty when all runs count as made at one temperature.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ThermalPlan {
    /// By thermometer: what it shows when the functions hold as they are.
    pub references: Vec<Celsius>,
    /// By run: what the thermometers showed.
    pub runs: Vec<Vec<Celsius>>,
    /// Standard uncertainty of what one thermometer showed in one run, in kelvin.
    pub u: f64,
    /// The scales' expansions.
    pub expansions: Vec<ExpansionPlan>,
    /// The bending guides.
    pub bends: Vec<BendPlan>,
    /// Where the scales are held: they expand from here.
    pub fixed: Point,
}

/// An expansion found.
#[derive(Clone, Debug, PartialEq)]
pub struct IdentifiedExpansion {
    /// Of what, by which thermometers.
    pub plan: ExpansionPlan,
    /// In 1/K of the thermometers' mean.
    pub per_kelvin: f64,
    /// Its standard uncertainty.
    pub u: f64,
}

impl IdentifiedExpansion {
    /// Gives every thermometer's channel its share, for this axis in place of what was there.
    /// Channels that are not there are left out.
    pub fn apply(&self, channels: &mut [ThermalChannel]) {
        let k = self.plan.axis.index();
        let count = self.plan.thermometers.len() as f64;
        for (at, channel) in channels.iter_mut().enumerate() {
            if self.plan.thermometers.contains(&at) {
                channel.expansion[k] = self.per_kelvin / count;
                channel.u_expansion[k] = self.u / count;
            }
        }
    }
}

/// A bend found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IdentifiedBend {
    /// Of what.
    pub plan: BendPlan,
    /// Displacement in the middle of the arc per kelvin.
    pub bow: Metres,
    /// Its standard uncertainty.
    pub u: Metres,
}

impl IdentifiedBend {
    /// The model's term, for temperature differences up to `gradient_max` kelvin.
    pub fn thermal_bend(&self, gradient_max: f64, is_watched: bool) -> ThermalBend {
        let BendPlan {
            axis,
            towards,
            over,
            under,
            low,
            high,
            ..
        } = self.plan;
        ThermalBend {
            axis,
            towards,
            over,
            under,
            bow: self.bow,
            u: self.u,
            low,
            high,
            gradient_max,
            is_watched,
        }
    }
}

/// One thermal coefficient: by what its effect is multiplied, and the effect.
#[derive(Clone, Debug)]
enum Term<'a> {
    Expansion(&'a ExpansionPlan),
    Bend(&'a BendPlan),
}

impl Term<'_> {
    fn unknown(&self) -> Unknown {
        match self {
            Self::Expansion(it) => Unknown::Expansion(it.axis, it.thermometers[0]),
            Self::Bend(it) => Unknown::Bend(it.axis, it.towards),
        }
    }

    fn thermometers(&self) -> Vec<usize> {
        match self {
            Self::Expansion(it) => it.thermometers.clone(),
            Self::Bend(it) => [Some(it.over), it.under].into_iter().flatten().collect(),
        }
    }

    /// Kelvin that the effect is per: the mean of thermometers, or the difference of two.
    fn kelvin(&self, above: &[f64]) -> f64 {
        match self {
            Self::Expansion(it) => {
                let sum: f64 = it.thermometers.iter().map(|at| above[*at]).sum();
                sum / it.thermometers.len() as f64
            }
            Self::Bend(it) => above[it.over] - it.under.map_or(0.0, |at| above[at]),
        }
    }

    fn effect(&self, plan: &Plan, at: Point, lever: impl Fn(Axis) -> V3) -> Effect {
        match self {
            Self::Expansion(it) => {
                let k = it.axis.index();
                let way = (at - plan.thermal.fixed).array()[k];
                Effect {
                    turn: [0.0; 3],
                    moved: core::array::from_fn(|i| if i == k { way } else { 0.0 }),
                }
            }
            Self::Bend(it) => {
                let (low, high) = (it.low.value(), it.high.value());
                let arc = Arc::new(plan.chain, it.axis, it.towards, low, high);
                let position = at.along(it.axis).value();
                let turn = arc.turn.map(|turn| turn * arc.slope(position));
                let height = if it.sideways {
                    arc.height(position)
                } else {
                    0.0
                };
                let turned = cross(turn, lever(it.axis));
                // A detector does not look along its axis.
                let seen_from = it.seen_from.unwrap_or(Point::ZERO);
                let mut taken_off = cross(turn, seen_from.array());
                taken_off[it.axis.index()] = 0.0;
                Effect {
                    turn,
                    moved: core::array::from_fn(|k| {
                        turned[k] + arc.towards[k] * height - taken_off[k]
                    }),
                }
            }
        }
    }

    /// Whether a function planned says the same as this term while nothing gets warmer.
    fn is_hidden_by(&self, name: ErrorName) -> bool {
        match (self, name) {
            (Self::Expansion(it), ErrorName::Along(axis, along)) => {
                axis == it.axis && along == it.axis
            }
            (Self::Bend(it), ErrorName::Along(axis, along)) => {
                it.sideways && axis == it.axis && along == it.towards
            }
            (Self::Bend(it), ErrorName::About(axis, about)) => {
                axis == it.axis && about != it.axis && about != it.towards
            }
            (Self::Expansion(_), ErrorName::About(..)) => false,
        }
    }
}

impl ThermalPlan {
    fn terms(&self) -> impl Iterator<Item = Term<'_>> {
        let expansions = self.expansions.iter().map(Term::Expansion);
        expansions.chain(self.bends.iter().map(Term::Bend))
    }

    /// How many coefficients it has.
    pub(super) fn count(&self) -> usize {
        self.expansions.len() + self.bends.len()
    }

    pub(super) fn unknowns(&self) -> impl Iterator<Item = Unknown> {
        self.terms().map(|it| it.unknown())
    }

    /// Readings less their references; what is missing is at its reference.
    pub(super) fn above(&self, shown: &[Celsius]) -> Vec<f64> {
        let references = self.references.iter().enumerate();
        let above = references.map(|(at, reference)| {
            let shown = shown.get(at).unwrap_or(reference);
            (*shown - *reference).value()
        });
        above.collect()
    }

    /// By run, what thermometers showed less their references.
    pub(super) fn above_of_run(&self, run: usize) -> Vec<f64> {
        self.above(self.runs.get(run).map_or(&[], Vec::as_slice))
    }

    /// The effects of the coefficients.
    pub(super) fn effects(
        plan: &Plan,
        at: Point,
        above: &[f64],
        lever: impl Fn(Axis) -> V3,
    ) -> Vec<Effect> {
        let scaled = |term: Term<'_>| {
            let (kelvin, effect) = (term.kelvin(above), term.effect(plan, at, &lever));
            Effect {
                turn: effect.turn.map(|it| it * kelvin),
                moved: effect.moved.map(|it| it * kelvin),
            }
        };
        plan.thermal.terms().map(scaled).collect()
    }

    pub(super) fn check(&self, runs: usize) -> Result<(), IdentifyError> {
        let refuse = |what| Err(IdentifyError::Thermal { what });
        if self.count() == 0 {
            return Ok(());
        }
        let count = self.references.len();
        if self.runs.len() != runs || self.runs.iter().any(|it| it.len() != count) {
            return refuse("every run needs a reading of every thermometer");
        }
        let readings = self.runs.iter().flatten().chain(&self.references);
        let sound = readings.into_iter().all(|it| it.is_finite());
        let fixed = self.fixed.array().into_iter().all(f64::is_finite);
        if !(sound && fixed && self.u.is_finite() && self.u >= 0.0) {
            return refuse("a temperature, its uncertainty or the fixed point is not a number");
        }
        if self.expansions.iter().any(|it| it.thermometers.is_empty()) {
            return refuse("an expansion has no thermometer");
        }
        let mut before = Vec::new();
        for term in self.terms() {
            let mut own = term.thermometers();
            own.sort_unstable();
            if own.windows(2).any(|it| it[0] == it[1]) || own.iter().any(|it| *it >= count) {
                return refuse(
                    "a thermometer is used twice for one coefficient, or does not exist",
                );
            }
            if before.contains(&term.unknown()) {
                return refuse("an expansion or a bend is planned twice");
            }
            before.push(term.unknown());
        }
        let arcs = |it: &BendPlan| it.axis != it.towards && it.low < it.high;
        let ends = |it: &BendPlan| it.low.is_finite() && it.high.is_finite();
        if !self.bends.iter().all(|it| arcs(it) && ends(it)) {
            return refuse("a bend goes along its own axis, or its arc has no length");
        }
        Ok(())
    }
}

/// Refuses to find what thermometers hardly saw: runs that tell a coefficient must differ.
pub(super) fn check_apart(plan: &Plan, observations: &[Observation]) -> Result<(), IdentifyError> {
    let thermal = &plan.thermal;
    let least = (APART * thermal.u).max(APART_K);
    let runs: Vec<Vec<f64>> = (0..plan.runs.len())
        .map(|run| thermal.above_of_run(run))
        .collect();
    for term in thermal.terms() {
        let told = observations.iter().filter(|it| {
            let effect = term.effect(plan, it.at, |axis| lever(plan, axis, it.at, it.tool));
            seen(it.reading, &effect) != 0.0
        });
        let mut kelvins: Vec<f64> = told.map(|it| term.kelvin(&runs[it.run])).collect();
        // Nothing that tells it at all is for the singular values to say.
        if kelvins.is_empty() {
            continue;
        }
        if !plan.functions.iter().any(|it| term.is_hidden_by(it.name)) {
            // What is known of the machine at its references counts as a run.
            kelvins.push(0.0);
        }
        let high = kelvins.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let low = kelvins.iter().copied().fold(f64::INFINITY, f64::min);
        let (unknown, spread) = (term.unknown(), high - low);
        if spread < least {
            return Err(IdentifyError::TooAlike {
                unknown,
                spread,
                least,
            });
        }
    }
    Ok(())
}
