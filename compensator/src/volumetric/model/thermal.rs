//! What temperatures add to the 21 errors: expansion, growth, squareness, and guides that bend.
//!
//! Source: a beam that is warmer on one side by an even gradient bends to an arc of curvature
//! α·ΔT/H (H: distance between the places where ΔT is taken), an elementary result of the theory
//! of thermal stresses. Its chord stays where the guide is held.
//!
//! | symbol | name here |
//! |---|---|
//! | ΔT, less what it was at the calibration | gradient: the reading `over` less that `under` |
//! | h, the arc's height over its chord per kelvin, αL²/(8H) | [`ThermalBend::bow`] |
//! | s(q) = 4h(q − a)(b − q)/L², L = b − a | sideways part |
//! | s′(q) | tilt: of the axis's direction towards that of the bow |
//!
//! A chord that leans as the guide bends is a squareness per kelvin, one that moves a growth.
//!
//! Absent: gradients along a guide, what lags behind its thermometers.

use units::portable::hypot;
use units::{Celsius, Metres, Radians};

use super::Chain;
use crate::volumetric::point::{V3, cross};
use crate::volumetric::{Axis, Point};

/// What one temperature does to the machine, per kelvin above its reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThermalChannel {
    /// The temperature at which it does nothing: that of the calibration.
    pub reference: Celsius,
    /// The lowest temperature the coefficients are known for.
    pub low: Celsius,
    /// The highest.
    pub high: Celsius,
    /// Expansion of x, y, z in 1/K: positive where the scale grows, negative where the
    /// workpiece does.
    pub expansion: [f64; 3],
    /// Standard uncertainties of the expansions, in 1/K. Those of several channels for one axis
    /// are taken as fully dependent, which they are when the channels share one coefficient.
    pub u_expansion: [f64; 3],
    /// Growth of the structure: displacement of the tool per kelvin.
    pub growth: Point,
    /// Change of the squarenesses per kelvin, in the order of
    /// [`Squareness`](super::Squareness).
    pub squareness: [Radians; 3],
    /// Standard uncertainty of the temperature, in kelvin.
    pub u: f64,
}

/// A guide that bends to an arc with the temperature difference across it: its slide strays
/// sideways and tilts with the slope.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThermalBend {
    /// Whose guide.
    pub axis: Axis,
    /// The direction across it that a positive bow goes to.
    pub towards: Axis,
    /// The channel over the neutral plane, from 0: warmer there is positive.
    pub over: usize,
    /// The channel under it; without one, what counts is how far `over` is above its reference.
    pub under: Option<usize>,
    /// Displacement in the middle of the arc per kelvin, as the straightness of the axis counts
    /// it: of the tool as seen from the workpiece.
    pub bow: Metres,
    /// Its standard uncertainty.
    pub u: Metres,
    /// Where the arc begins on its chord.
    pub low: Metres,
    /// Where it ends.
    pub high: Metres,
    /// The largest temperature difference it is known for, by magnitude, in kelvin.
    pub gradient_max: f64,
    /// Whether detectors see the sideways part: then the tilt alone comes from here. Detectors
    /// never see the tilt, and the slope of what they see is none: films grow too.
    pub is_watched: bool,
}

/// What temperatures do to the machine.
#[derive(Clone, Debug, Default)]
pub struct Thermal {
    /// By the order in which temperatures are given.
    pub channels: Vec<ThermalChannel>,
    /// Guides that bend.
    pub bends: Vec<ThermalBend>,
    /// Where the scales are held: they expand from here.
    pub fixed: Point,
}

impl Thermal {
    /// Which channels belong together, by the first one of each group: those that make one effect
    /// between them (the two of a bend, those whose sum is the expansion along one axis, a growth
    /// along one direction or one squareness), and those that belong together with one of these.
    /// One of them alone says something else than all: half an expansion, or a bend where there is
    /// none.
    pub fn groups(&self) -> Vec<usize> {
        let count = self.channels.len();
        let mut groups: Vec<usize> = (0..count).collect();
        let mut join = |makes: &dyn Fn(usize) -> bool| {
            let together: Vec<usize> = (0..count).filter(|it| makes(*it)).collect();
            let own: Vec<usize> = together.iter().map(|it| groups[*it]).collect();
            if let Some(first) = own.iter().copied().min() {
                for group in groups.iter_mut().filter(|it| own.contains(it)) {
                    *group = first;
                }
            }
        };
        for k in 0..3 {
            join(&|it| self.channels[it].expansion[k] != 0.0);
            join(&|it| self.channels[it].growth.array()[k] != 0.0);
            join(&|it| self.channels[it].squareness[k] != Radians(0.0));
        }
        for bend in &self.bends {
            join(&|it| bend.share(it) != 0.0);
        }
        groups
    }
}

fn unit(axis: Axis) -> V3 {
    core::array::from_fn(|k| f64::from(u8::from(k == axis.index())))
}

/// From the direction of an axis to that of its bow.
fn turn(axis: Axis, towards: Axis) -> V3 {
    cross(unit(axis), unit(towards))
}

/// An arc of height 1 over its chord, and which way the slide on it turns.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Arc {
    /// Sideways by powers of the position.
    pub(crate) powers: V3,
    /// Rotation per slope.
    pub(crate) turn: V3,
    /// The direction of the bow.
    pub(crate) towards: V3,
}

impl Arc {
    pub(crate) fn new(chain: Chain, axis: Axis, towards: Axis, low: f64, high: f64) -> Self {
        // A slide with the workpiece goes the other way than the tool does as seen from it, and
        // turns the tool the other way too: of the three signs one is left.
        let sense = chain.sense(axis);
        let per = 4.0 / ((high - low) * (high - low));
        Self {
            powers: [-low * high * per, (low + high) * per, -per],
            turn: turn(axis, towards).map(|it| it * sense),
            towards: unit(towards),
        }
    }

    pub(crate) fn height(&self, position: f64) -> f64 {
        let [constant, linear, quadratic] = self.powers;
        constant + position * (linear + position * quadratic)
    }

    pub(crate) fn slope(&self, position: f64) -> f64 {
        self.powers[1] + 2.0 * position * self.powers[2]
    }

    /// The largest magnitudes of height and slope over `low..=high`.
    pub(crate) fn largest(&self, low: f64, high: f64) -> (f64, f64) {
        let middle = (-self.powers[1] / (2.0 * self.powers[2])).clamp(low, high);
        let ends = [low, middle, high];
        let most = |of: &dyn Fn(f64) -> f64| ends.map(of).into_iter().fold(0.0, f64::max);
        (
            most(&|it| self.height(it).abs()),
            most(&|it| self.slope(it).abs()),
        )
    }
}

impl ThermalBend {
    /// By what the slide itself is turned at `position`, whatever it carries; `kelvin` is how far
    /// each channel is above its reference.
    pub fn slide_turn(&self, position: Metres, kelvin: impl Fn(usize) -> f64) -> [Radians; 3] {
        let (low, high) = (self.low.value(), self.high.value());
        let way = low + high - 2.0 * position.value();
        let slope = 4.0 * way / ((high - low) * (high - low));
        let bow = self.bow.value() * self.gradient(kelvin);
        turn(self.axis, self.towards).map(|it| Radians(it * bow * slope))
    }

    pub(crate) fn arc(&self, chain: Chain) -> Arc {
        let (low, high) = (self.low.value(), self.high.value());
        Arc::new(chain, self.axis, self.towards, low, high)
    }

    /// How much the gradient grows with a kelvin of `channel`.
    pub(crate) fn share(&self, channel: usize) -> f64 {
        let over = f64::from(u8::from(self.over == channel));
        over - f64::from(u8::from(self.under == Some(channel)))
    }

    /// The gradient, of how far each channel is above its reference.
    pub(crate) fn gradient(&self, kelvin: impl Fn(usize) -> f64) -> f64 {
        kelvin(self.over) - self.under.map_or(0.0, kelvin)
    }

    /// The share of what its channels' uncertainties make of the gradient that can be: one beyond
    /// what the coefficient is known for is refused, so that it is within that on either side.
    pub(crate) fn share_within(&self, gradient: f64, u_of_channel: impl Fn(usize) -> f64) -> f64 {
        let u = hypot(
            u_of_channel(self.over),
            self.under.map_or(0.0, u_of_channel),
        );
        let most = (self.gradient_max + gradient.abs()) / 3.0_f64.sqrt();
        if u > most { most / u } else { 1.0 }
    }

    /// The largest magnitude of the gradient that channels and this coefficient permit.
    pub(crate) fn gradient_bound(&self, channels: &[ThermalChannel]) -> f64 {
        let extremes = |at: usize| {
            let it = &channels[at];
            let (below, above) = (it.low - it.reference, it.high - it.reference);
            (below.value(), above.value())
        };
        let (below, above) = extremes(self.over);
        let (lowest, highest) = self.under.map_or((0.0, 0.0), extremes);
        (above - lowest).max(highest - below).min(self.gradient_max)
    }

    /// What is wrong with it.
    pub(crate) fn trouble(&self, channels: usize) -> Option<&'static str> {
        let own = self.over < channels && self.under.is_none_or(|it| it < channels);
        if !own || self.under == Some(self.over) {
            return Some("a bending guide whose channels are not two different temperatures");
        }
        let ends = self.low.is_finite() && self.high.is_finite() && self.low < self.high;
        if self.axis == self.towards || !ends {
            return Some("the direction or the range of a bending guide");
        }
        let sizes = [self.u.value(), self.gradient_max];
        let sound = sizes.into_iter().all(|it| it >= 0.0 && it.is_finite());
        (!(sound && self.bow.is_finite())).then_some("the bow of a bending guide")
    }
}

/// The sums of all channels' effects.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ThermalSums {
    pub(crate) expansion: V3,
    pub(crate) growth: V3,
    pub(crate) squareness: V3,
    /// What the expansions' uncertainties come to.
    pub(crate) u_expansion: V3,
}

impl ThermalSums {
    /// Adds `kelvin` times what `channel` does, or does at most when `magnitudes`.
    pub(crate) fn add(&mut self, channel: &ThermalChannel, kelvin: f64, magnitudes: bool) {
        let effect = |coefficient: f64| {
            let it = coefficient * kelvin;
            if magnitudes { it.abs() } else { it }
        };
        let growth = channel.growth.array();
        let squareness = channel.squareness.map(Radians::value);
        for (sums, coefficients) in [
            (&mut self.expansion, channel.expansion),
            (&mut self.growth, growth),
            (&mut self.squareness, squareness),
            (&mut self.u_expansion, channel.u_expansion),
        ] {
            for (sum, coefficient) in sums.iter_mut().zip(coefficients) {
                *sum += effect(coefficient);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn channel(expansion: [f64; 3], growth_z_um: f64) -> ThermalChannel {
        ThermalChannel {
            reference: Celsius(20.0),
            low: Celsius(10.0),
            high: Celsius(30.0),
            expansion,
            u_expansion: [0.0; 3],
            growth: Point::new(Metres(0.0), Metres(0.0), Metres::from_um(growth_z_um)),
            squareness: [Radians(0.0); 3],
            u: 0.0,
        }
    }

    fn bend(over: usize, under: Option<usize>) -> ThermalBend {
        ThermalBend {
            axis: Axis::X,
            towards: Axis::Z,
            over,
            under,
            bow: Metres::from_um(4.0),
            u: Metres(0.0),
            low: Metres(0.0),
            high: Metres(0.5),
            gradient_max: 4.0,
            is_watched: false,
        }
    }

    #[test]
    fn channels_that_make_one_effect_between_them_belong_together() {
        let none = [0.0; 3];
        let along = |k: usize| core::array::from_fn(|i| if i == k { 5e-6 } else { 0.0 });
        let mut thermal = Thermal {
            channels: vec![channel(none, 0.0); 6],
            ..Thermal::default()
        };
        assert_eq!(thermal.groups(), [0, 1, 2, 3, 4, 5], "nothing joins them");
        thermal.bends = vec![bend(4, Some(1)), bend(3, None)];
        assert_eq!(thermal.groups(), [0, 1, 2, 3, 1, 5]);
        thermal.channels[2] = channel(along(1), 0.0);
        thermal.channels[4] = channel(along(1), 0.0);
        assert_eq!(thermal.groups(), [0, 1, 1, 3, 1, 5], "one by the other");
        thermal.channels[0] = channel(none, 1.0);
        thermal.channels[1] = channel(none, -1.0);
        thermal.channels[5] = channel(along(0), 0.0);
        assert_eq!(thermal.groups(), [0, 0, 0, 3, 0, 5]);
    }
}
