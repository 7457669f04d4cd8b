//! Air and machine: slow swings around configured values, a pure function of time.

use crate::random::Stream;
use core::f64::consts::TAU;
use units::portable::sin;
use units::{Celsius, Pascals, RelativeHumidity, Time};

use super::config::ClimateConfig;

/// The state of the air and the machine at one moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Environment {
    /// Air around the beam.
    pub air_temperature: Celsius,
    /// Air pressure.
    pub pressure: Pascals,
    /// Relative humidity.
    pub humidity: RelativeHumidity,
    /// Stage and scale.
    pub stage_temperature: Celsius,
}

/// The climate of one run.
#[derive(Clone, Debug)]
pub(super) struct Climate {
    config: ClimateConfig,
    phases: [f64; 4],
}

impl Climate {
    pub(super) fn new(config: ClimateConfig, seed: u64) -> Self {
        let mut stream = Stream::new(seed, "climate");
        Self {
            config,
            phases: core::array::from_fn(|_| stream.between(0.0, TAU)),
        }
    }

    /// The stage alone, as [`Climate::at`] has it.
    pub(super) fn stage_temperature(&self, now: Time) -> Celsius {
        let swing = sin(self.angle(now) + self.phases[3]);
        self.stage_at(swing)
    }

    fn angle(&self, now: Time) -> f64 {
        TAU * now.seconds() / (self.config.swing_period_min * 60.0)
    }

    fn stage_at(&self, swing: f64) -> Celsius {
        let c = &self.config;
        Celsius(c.stage_temperature_c + c.stage_temperature_swing_k * swing)
    }

    pub(super) fn at(&self, now: Time) -> Environment {
        let c = &self.config;
        let angle = self.angle(now);
        let [air, pressure, humidity, stage] = self.phases.map(|phase| sin(angle + phase));
        Environment {
            air_temperature: Celsius(c.air_temperature_c + c.air_temperature_swing_k * air),
            pressure: Pascals(100.0 * (c.pressure_hpa + c.pressure_swing_hpa * pressure)),
            humidity: RelativeHumidity(
                (c.humidity_percent + c.humidity_swing_percent * humidity) / 100.0,
            ),
            stage_temperature: self.stage_at(stage),
        }
    }
}
