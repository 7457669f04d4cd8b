//! What no device knows about a gantry: for tests and reports that judge.

use units::{Metres, Radians, Time};

use super::Gantry;
use crate::plant::truth::Truth;

/// A look at a gantry behind all sensors.
#[derive(Clone, Copy, Debug)]
pub struct GantryTruth<'a> {
    gantry: &'a Gantry,
    now: Time,
    stage_c: f64,
}

impl<'a> Truth<'a> {
    /// The gantry, where the machine is one.
    pub fn gantry(&self) -> Option<GantryTruth<'a>> {
        let plant = self.plant;
        Some(GantryTruth {
            gantry: plant.machine.of::<Gantry>()?,
            now: plant.now,
            stage_c: self.environment().stage_temperature.value(),
        })
    }
}

impl GantryTruth<'_> {
    /// How far the stage is turned: 0 where both groups of magnets stand over their sensors, positive where the
    /// second side is ahead.
    pub fn angle(&self) -> Radians {
        Radians(self.gantry.angle(self.now, self.stage_c))
    }

    /// How far it is turned where both scales read 0.
    pub const fn turned(&self) -> Radians {
        Radians(self.gantry.turned)
    }

    /// How far it is turned where the scales read so, on average: without what they err within their period, lost
    /// motion, and the error of a stop.
    pub fn angle_at(&self, scales: [Metres; 2]) -> Radians {
        let [first, second] = [0, 1].map(|side| {
            let scale_m = scales[side].value();
            self.gantry.sides[side].smooth_place_m(scale_m, self.stage_c)
        });
        Radians((second - first) / self.gantry.distance_m() + self.gantry.turned)
    }

    /// From the one side to the other.
    pub fn distance(&self) -> Metres {
        Metres(self.gantry.distance_m())
    }

    /// Where each scale is read, from its own zero, without quantisation.
    pub fn scale_positions(&self) -> [Metres; 2] {
        let sides = self.gantry.sides.each_ref();
        sides.map(|it| Metres(it.scale_position_m(self.now)))
    }
}
