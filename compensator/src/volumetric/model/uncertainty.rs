//! The uncertainty of the deviation, from the uncertainties of all its contributions.

use units::{Metres, Quantity, Radians};

use super::thermal::ThermalSums;
use super::{Conditions, Squareness, ThermalBend, VolumetricModel};
use crate::volumetric::function::Function;
use crate::volumetric::point::{V3, add, cross};
use crate::volumetric::{Axis, NoCorrection, Point};

impl VolumetricModel {
    /// The standard uncertainty of the deviation at a command: of the functions, squarenesses,
    /// temperatures and thermal coefficients as far as they have one, with that of the detectors'
    /// displacements and rolls. Functions and squarenesses have in common what
    /// [`Self::with_covariance`] says of them; all else is taken as independent.
    ///
    /// `u_temperatures`, in kelvin by channel, are what the temperatures are known to now; a channel
    /// beyond their end is as sure as it says of itself. A gradient is never less sure than that it
    /// is within what its bend is known for.
    ///
    /// # Errors
    /// When the command is outside the volume by more than the limit of size.
    pub fn standard_uncertainty(
        &self,
        command: Point,
        now: &Conditions,
        u_displacement: Metres,
        u_roll: Radians,
        u_temperatures: &[f64],
    ) -> Result<Point, NoCorrection> {
        self.commands.check(command)?;
        let known = self.covariance.as_ref();
        let tool = core::array::from_fn(|k| now.tool[k]);
        let mut squares = known.map_or([0.0; 3], |it| it.variances(command, tool));
        let mut combine = |effect: V3, u: f64| {
            for k in 0..3 {
                squares[k] += effect[k] * effect[k] * u * u;
            }
        };
        for axis in Axis::ALL {
            let lever = self.lever(axis, command, now);
            let errors = &self.machine.axes[axis.index()];
            let position = command.along(axis);
            for direction in Axis::ALL {
                let k = direction.index();
                let unit: V3 = core::array::from_fn(|i| f64::from(u8::from(i == k)));
                let sideways = direction != axis;
                let u_live = if sideways {
                    u_displacement.value()
                } else {
                    u_roll.value()
                };
                let along = u_of(errors.along[k].as_ref(), position, known.is_some());
                let about = u_of(errors.about[k].as_ref(), position, known.is_some());
                combine(unit, along);
                combine(cross(unit, lever), about);
                combine(if sideways { unit } else { cross(unit, lever) }, u_live);
            }
        }
        let own = self.machine.squareness.u.iter().enumerate();
        for (k, u) in own.filter(|_| known.is_none()) {
            let mut one = [0.0; 3];
            one[k] = 1.0;
            combine(lean_effect(Squareness::lean(one), command), u.value());
        }
        let thermal = &self.machine.thermal;
        let way = (command - thermal.fixed).array();
        let u_of_channel = |at: usize| {
            let known = u_temperatures.get(at).copied();
            known.unwrap_or(thermal.channels[at].u)
        };
        for at in 0..thermal.channels.len() {
            let effect = self.effect_of_channel(at, command, now, u_of_channel);
            combine(effect, u_of_channel(at));
        }
        for axis in Axis::ALL {
            let k = axis.index();
            let unit: V3 = core::array::from_fn(|i| f64::from(u8::from(i == k)));
            combine(unit, now.u_expansion[k] * way[k]);
        }
        for bend in &thermal.bends {
            let gradient = now.gradients[bend.axis.index()][bend.towards.index()];
            let effect = self.arc_effect(bend, command, now);
            combine(effect, bend.u.value() * gradient);
        }
        Ok(Point::of(squares.map(f64::sqrt)))
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

/// Of what the function does between its nodes alone, where it is known what the nodes have in common.
fn u_of<Q: Quantity>(function: Option<&Function<Q>>, position: Metres, between_alone: bool) -> f64 {
    let u = function.and_then(|it| match between_alone {
        true => Some(it.between_at(position)),
        false => it.standard_uncertainty(position),
    });
    u.map_or(0.0, Q::value)
}
