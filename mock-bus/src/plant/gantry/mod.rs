//! A gantry: one stage that two linear motors move, one on each side, each with a scale, limit switches and a pair
//! of magnet groups over Hall sensors of its own.
//!
//! Source: CN101551226A (system S5), description: two points of a stage, each found again without drift, hold its
//! rotation too.
//!
//! | symbol | name |
//! |---|---|
//! | x1, x2 | true places of both sides, each from its own scale's zero |
//! | d | `distance_mm`, across the travel |
//! | φ0 | how far the stage is turned where both scales read 0, drawn from the seed |
//!
//! The stage is turned by `(x2 - x1) / d + φ0`, positive where the second side is ahead. At 0 both groups of magnets
//! stand over their sensors: the second ones see their magnets where that side is `φ0 d` before the zero of its scale.
//!
//! Absent: forces between both drives (each moves its side as if the other one followed), mass that moves from side
//! to side with a slide on the beam, a reflector.

pub mod config;
#[cfg(test)]
mod tests;
mod truth;

use units::{Metres, Time};

pub use truth::GantryTruth;

use self::config::GantryConfig;
use super::config::{InterferometerConfig, StageConfig};
use super::hall_field::{DriftLimits, HallDrift, HallField, Sensor};
use super::mechanics::{Mechanics, Section};
use super::parts::actuator::Actuator;
use super::stage::Stage;
use crate::config::error::ConfigError;
use crate::random::Stream;

/// Each side has errors and noise of its own: those of a stage with another seed.
const OF_THE_SECOND: u64 = 0x6A6E_7472_7932_0000;

#[derive(Clone, Debug)]
pub(super) struct Gantry {
    config: GantryConfig,
    sides: [Stage; 2],
    /// φ0.
    turned: f64,
    /// What power cycles do to the second side's sensors; those of the first are told.
    drift: HallDrift,
    cycles: u64,
    seed: u64,
}

impl Gantry {
    fn new(config: &GantryConfig, seed: u64) -> Self {
        let mut draw = Stream::new(seed, "gantry");
        let limit = config.rotation_max_urad * 1e-6;
        let turned = draw.between(-limit, limit);
        let motion = &config.side.motion;
        let start_mm = draw.between(motion.start_min_mm, motion.start_max_mm);
        // Both sides of one stage stand next to each other, but for what it is turned by.
        let skew_mm = config.start_skew_um * 1e-3;
        let mut side = |seed: u64| {
            let at_mm = start_mm + draw.between(-skew_mm, skew_mm) / 2.0;
            Stage::new(standing_at(&config.side, at_mm), seed)
        };
        let sides = [side(seed), side(seed ^ OF_THE_SECOND)];
        let mut gantry = Self {
            config: config.clone(),
            sides,
            turned,
            drift: HallDrift::default(),
            cycles: 0,
            seed,
        };
        gantry.drift_anew();
        gantry
    }

    fn drift_anew(&mut self) {
        let limits = DriftLimits {
            offset: units::Volts(self.config.sensor_offset_max_mv * 1e-3),
            gain: self.config.sensor_gain_max,
            gain_per_m: 0.0,
        };
        self.drift = HallDrift::random(self.seed ^ OF_THE_SECOND, self.cycles, limits);
    }

    fn distance_m(&self) -> f64 {
        self.config.distance_mm * 1e-3
    }

    /// Both true places, each from the zero of its own scale.
    fn places_m(&self, now: Time, stage_c: f64) -> [f64; 2] {
        self.sides
            .each_ref()
            .map(|it| it.true_position_m(now, stage_c))
    }

    /// How far the stage is turned.
    fn angle(&self, now: Time, stage_c: f64) -> f64 {
        let [first, second] = self.places_m(now, stage_c);
        (second - first) / self.distance_m() + self.turned
    }

    /// The voltage at analog input `channel`: 0 and 1 are the first side's sensors, 2 and 3 the second's.
    pub(super) fn hall_volts(
        &self,
        (channel, field): (usize, &HallField),
        now: Time,
        stage_c: f64,
    ) -> Option<f64> {
        let [first, second] = self.places_m(now, stage_c);
        let sensor = [Sensor::Even, Sensor::Odd][channel % 2];
        match channel / 2 {
            0 => Some(field.volts(sensor, Metres(first))),
            1 => {
                let place = Metres(second + self.turned * self.distance_m());
                Some(field.volts_drifted(&self.drift, sensor, place))
            }
            _ => None,
        }
    }
}

/// `side` when it first stands there.
fn standing_at(side: &StageConfig, at_mm: f64) -> StageConfig {
    let mut side = side.clone();
    side.motion.start_min_mm = at_mm;
    side.motion.start_max_mm = at_mm;
    side
}

impl Section for GantryConfig {
    fn check(&self) -> Result<(), ConfigError> {
        self.check_numbers()
    }

    fn resolution_nm(&self) -> Option<f64> {
        Some(self.side.encoder.resolution_nm)
    }

    fn build(&self, _: &InterferometerConfig, seed: u64) -> Box<dyn Mechanics> {
        Box::new(Gantry::new(self, seed))
    }
}

impl Mechanics for Gantry {
    fn advance(&mut self, now: Time) {
        self.sides.iter_mut().for_each(|it| it.advance(now));
    }

    fn actuator(&self, number: usize) -> Option<&dyn Actuator> {
        self.sides.get(number).map(|it| it as &dyn Actuator)
    }

    fn actuator_mut(&mut self, number: usize) -> Option<&mut dyn Actuator> {
        self.sides.get_mut(number).map(|it| it as &mut dyn Actuator)
    }

    fn power_cycle(&mut self) {
        self.sides.iter_mut().for_each(Mechanics::power_cycle);
        self.cycles += 1;
        self.drift_anew();
    }

    fn boxed(&self) -> Box<dyn Mechanics> {
        Box::new(self.clone())
    }
}
