//! The uncertainty of the deviation, from the uncertainties of all its contributions.

mod budget;

use units::{Metres, Quantity, Radians};

use super::coefficients::COEFFICIENTS_MAX;
use super::thermal::ThermalSums;
use super::{Coefficient, Conditions, Squareness, ThermalBend, VolumetricModel};
use crate::volumetric::function::Function;
use crate::volumetric::point::{V3, add, cross};
use crate::volumetric::{Axis, NoCorrection, Point};

/// Something whose uncertainty makes that of the deviation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Input {
    /// Functions at their nodes, squarenesses, and thermal coefficients that were found with them.
    Errors,
    /// What functions do between their nodes.
    Between,
    /// What the detectors on the slide of an axis say of its displacement.
    Displacement(Axis),
    /// What they say of its roll.
    Roll(Axis),
    /// A thermometer, from 0.
    Temperature(usize),
    /// By how much the scale of an axis expands, found otherwise.
    Expansion(Axis),
    /// By how much the guide of an axis bends towards a direction, found otherwise.
    Bend(Axis, Axis),
}

/// What is known of this moment: the standard uncertainties of what detectors see of the slides of x, y and z, and of
/// temperatures in kelvin by channel.
#[derive(Clone, Copy, Debug, Default)]
pub struct Seen<'a> {
    /// Of displacements, along both directions across the axis.
    pub displacement: [Metres; 3],
    /// Of rolls.
    pub roll: [Radians; 3],
    /// Of what thermometers show; one beyond the end is as sure as it says of itself.
    pub temperatures: &'a [f64],
}

impl VolumetricModel {
    /// The standard uncertainty of the deviation at a command: of the functions, squarenesses,
    /// temperatures and thermal coefficients as far as they have one, with that of the detectors'
    /// displacements and rolls. Functions, squarenesses and thermal coefficients have in common what
    /// [`Self::with_covariance`] says of them; all else is taken as independent.
    ///
    /// `seen` is what all is known to now. A gradient is never less sure than that it is within what its bend is
    /// known for.
    ///
    /// # Errors
    /// When the command is outside the volume by more than the limit of size.
    pub fn standard_uncertainty(
        &self,
        command: Point,
        now: &Conditions,
        seen: &Seen<'_>,
    ) -> Result<Point, NoCorrection> {
        self.commands.check(command)?;
        let mut squares = self.variances_in_common(command, now).unwrap_or([0.0; 3]);
        self.each_input(command, now, seen, |_, effect, u| {
            for k in 0..3 {
                squares[k] += effect[k] * effect[k] * u * u;
            }
        });
        Ok(Point::of(squares.map(f64::sqrt)))
    }

    /// What functions, squarenesses and thermal coefficients make of the deviation, where it is known what they have in
    /// common.
    fn variances_in_common(&self, command: Point, now: &Conditions) -> Option<V3> {
        let known = self.covariance.as_ref()?;
        let tool = core::array::from_fn(|k| now.tool[k]);
        let found = known.coefficients();
        let mut warm = [[0.0; 3]; COEFFICIENTS_MAX];
        for (effect, it) in warm.iter_mut().zip(found) {
            *effect = self.effect_of_coefficient(*it, command, now);
        }
        Some(known.variances(command, tool, &warm[..found.len()]))
    }

    /// What a coefficient moves the tool by when it is too large by its standard uncertainty.
    fn effect_of_coefficient(&self, it: Coefficient, command: Point, now: &Conditions) -> V3 {
        let thermal = &self.machine.thermal;
        match it {
            Coefficient::Expansion(axis) => {
                let k = axis.index();
                let way = (command - thermal.fixed).array()[k];
                unit(axis).map(|it| it * way * now.u_expansion[k])
            }
            Coefficient::Bend(axis, towards) => {
                let own = |it: &&ThermalBend| (it.axis, it.towards) == (axis, towards);
                thermal.bends.iter().find(own).map_or([0.0; 3], |bend| {
                    let gradient = now.gradients[axis.index()][towards.index()];
                    let bows = gradient * bend.u.value();
                    self.arc_effect(bend, command, now).map(|it| it * bows)
                })
            }
        }
    }

    /// Whether it is known what a coefficient has in common with the errors.
    fn is_in_common(&self, it: Coefficient) -> bool {
        let known = self.covariance.as_ref();
        known.is_some_and(|known| known.coefficients().contains(&it))
    }

    /// Tells `each` of every input that is independent of the others: what a unit of it moves the tool by, and its
    /// standard uncertainty. Some come in several pieces.
    fn each_input(
        &self,
        command: Point,
        now: &Conditions,
        seen: &Seen<'_>,
        mut each: impl FnMut(Input, V3, f64),
    ) {
        let is_known = self.covariance.is_some();
        for axis in Axis::ALL {
            let lever = self.lever(axis, command, now);
            let errors = &self.machine.axes[axis.index()];
            let position = command.along(axis);
            for direction in Axis::ALL {
                let k = direction.index();
                let moves = unit(direction);
                let turns = cross(moves, lever);
                let along = errors.along[k].as_ref();
                each(Input::Errors, moves, u_at_nodes(along, position, is_known));
                each(Input::Between, moves, u_between(along, position, is_known));
                let about = errors.about[k].as_ref();
                each(Input::Errors, turns, u_at_nodes(about, position, is_known));
                each(Input::Between, turns, u_between(about, position, is_known));
                if direction == axis {
                    each(Input::Roll(axis), turns, seen.roll[axis.index()].value());
                } else {
                    let u = seen.displacement[axis.index()];
                    each(Input::Displacement(axis), moves, u.value());
                }
            }
        }
        let own = self.machine.squareness.u.iter().enumerate();
        for (k, u) in own.filter(|_| !is_known) {
            let mut one = [0.0; 3];
            one[k] = 1.0;
            let leans = lean_effect(Squareness::lean(one), command);
            each(Input::Errors, leans, u.value());
        }
        self.each_warmth(command, now, seen, each);
    }

    /// The same of temperatures, and of what is known of their effects.
    fn each_warmth(
        &self,
        command: Point,
        now: &Conditions,
        seen: &Seen<'_>,
        mut each: impl FnMut(Input, V3, f64),
    ) {
        let thermal = &self.machine.thermal;
        let way = (command - thermal.fixed).array();
        let u_of_channel = |at: usize| {
            let known = seen.temperatures.get(at).copied();
            known.unwrap_or(thermal.channels[at].u)
        };
        for at in 0..thermal.channels.len() {
            let effect = self.effect_of_channel(at, command, now, u_of_channel);
            each(Input::Temperature(at), effect, u_of_channel(at));
        }
        for axis in Axis::ALL {
            if self.is_in_common(Coefficient::Expansion(axis)) {
                continue;
            }
            let k = axis.index();
            let grows = unit(axis).map(|it| it * way[k]);
            each(Input::Expansion(axis), grows, now.u_expansion[k].abs());
        }
        for bend in &thermal.bends {
            if self.is_in_common(Coefficient::Bend(bend.axis, bend.towards)) {
                continue;
            }
            let gradient = now.gradients[bend.axis.index()][bend.towards.index()];
            let effect = self.arc_effect(bend, command, now);
            let bows = effect.map(|it| it * gradient);
            each(Input::Bend(bend.axis, bend.towards), bows, bend.u.value());
        }
    }

    /// What a kelvin of one thermometer moves the tool by, as far as uncertainties can make it.
    fn effect_of_channel(
        &self,
        at: usize,
        command: Point,
        now: &Conditions,
        u_of_channel: impl Fn(usize) -> f64,
    ) -> V3 {
        let thermal = &self.machine.thermal;
        let way = (command - thermal.fixed).array();
        let mut one = ThermalSums::default();
        one.add(&thermal.channels[at], 1.0, false);
        let lean = lean_effect(Squareness::lean(one.squareness), command);
        let scale: V3 = core::array::from_fn(|k| one.expansion[k] * way[k]);
        let mut effect = add(add(lean, scale), one.growth);
        for bend in &thermal.bends {
            let gradient = now.gradients[bend.axis.index()][bend.towards.index()];
            let within = bend.share_within(gradient, &u_of_channel);
            let bows = bend.bow.value() * bend.share(at) * within;
            let arc = self.arc_effect(bend, command, now);
            effect = core::array::from_fn(|k| effect[k] + arc[k] * bows);
        }
        effect
    }

    /// What a guide's arc of height 1 moves the tool by.
    fn arc_effect(&self, bend: &ThermalBend, command: Point, now: &Conditions) -> V3 {
        let arc = bend.arc(self.machine.chain);
        let position = command.along(bend.axis).value();
        let tilt = arc.turn.map(|it| it * arc.slope(position));
        let turned = cross(tilt, self.lever(bend.axis, command, now));
        let sideways = if bend.is_watched {
            0.0
        } else {
            arc.height(position)
        };
        add(turned, arc.towards.map(|it| it * sideways))
    }
}

fn lean_effect(lean: [V3; 3], command: Point) -> V3 {
    let q = command.array();
    core::array::from_fn(|k| lean[0][k] * q[0] + lean[1][k] * q[1] + lean[2][k] * q[2])
}

fn unit(axis: Axis) -> V3 {
    core::array::from_fn(|k| f64::from(u8::from(k == axis.index())))
}

/// At its nodes, and by straight lines between them; none where it is known what all functions have in common.
fn u_at_nodes<Q: Quantity>(
    function: Option<&Function<Q>>,
    position: Metres,
    is_known: bool,
) -> f64 {
    let own = function.filter(|_| !is_known);
    let u = own.and_then(|it| it.uncertainty_of_nodes(position));
    u.map_or(0.0, Q::value)
}

/// By what it does between its nodes; of a function whose nodes nobody states an uncertainty of, nothing is stated.
fn u_between<Q: Quantity>(function: Option<&Function<Q>>, position: Metres, is_known: bool) -> f64 {
    let stated = |it: &&Function<Q>| is_known || it.uncertainty_of_nodes(position).is_some();
    let own = function.filter(stated);
    own.map_or(0.0, |it| it.between_at(position).value())
}
