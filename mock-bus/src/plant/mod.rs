//! The physical truth, in SI units. It knows no bus and no protocol.
//!
//! Positions have their zero at the Hall zero as built: the true origin. The plant is
//! deterministic: the same seed and the same commands at the same times give the same bits,
//! however often [`Plant::advance`] is called in between.

mod analog;
pub mod config;
mod deviation;
mod hall_field;
mod instrument;
mod servo;
mod stage;
mod thermal;
mod truth;

#[cfg(test)]
mod tests;

use units::{Metres, Time};

pub use analog::InputFault;
pub use hall_field::{DriftLimits, HallDrift, SensorDrift};
pub use instrument::{Beam, Fringes};
pub use thermal::Environment;
pub use truth::Truth;

use analog::Input;
use config::PlantConfig;
use hall_field::{HallField, Sensor};
use instrument::Interferometer;
use stage::Stage;
use thermal::Climate;

/// Inputs 0 and 1 are the Hall sensors; the others are spare.
const ANALOG_INPUTS: usize = 8;

/// How a servo drive acts on its axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Servo {
    /// No torque: the axis coasts to a stop by friction.
    Off,
    /// The position controller follows this demand (metres of encoder travel since power-on).
    Follow {
        /// Demanded encoder position in metres since the encoder was powered.
        demand_m: f64,
    },
}

/// Everything physical of one machine. It has one axis, number 0; axes that are not there
/// stand still and read 0.
#[derive(Clone, Debug)]
pub struct Plant {
    now: Time,
    rail_v: f64,
    stage: Stage,
    hall: HallField,
    inputs: Vec<Input>,
    inputs_swapped: bool,
    climate: Climate,
    interferometer: Interferometer,
}

impl Default for Plant {
    fn default() -> Self {
        Self::new(&PlantConfig::default(), 0)
    }
}

impl Plant {
    /// A machine as configured, with the errors and the noise of `seed`.
    pub fn new(config: &PlantConfig, seed: u64) -> Self {
        let noise_v = config.hall.noise_mv * 1e-3;
        Self {
            now: Time::ZERO,
            rail_v: config.hall.rail_v,
            stage: Stage::new(config.stage.clone(), seed),
            hall: HallField::new(config.hall.clone()),
            inputs: (0..ANALOG_INPUTS)
                .map(|channel| Input::new(noise_v, seed, channel))
                .collect(),
            inputs_swapped: false,
            climate: Climate::new(config.climate.clone(), seed),
            interferometer: Interferometer::new(config.interferometer.clone(), seed),
        }
    }

    /// Lets the physics run up to `now`; a moment that has passed changes nothing.
    pub fn advance(&mut self, now: Time) {
        self.now = self.now.max(now);
        self.stage.advance(self.now);
    }

    /// What the drive does to axis `axis` from now on.
    pub fn set_servo(&mut self, axis: usize, servo: Servo) {
        if axis == 0 {
            self.stage.set_servo(self.now, servo);
        }
    }

    /// The encoder of `axis`: counts since its power came on.
    pub fn encoder_counts(&self, axis: usize) -> i64 {
        if axis == 0 {
            self.stage.counts(self.now)
        } else {
            0
        }
    }

    /// Encoder speed of `axis` in counts per second.
    pub fn encoder_speed(&self, axis: usize) -> f64 {
        if axis == 0 {
            self.stage.counts_per_s(self.now)
        } else {
            0.0
        }
    }

    /// Metres of encoder travel per count of `axis`.
    pub fn encoder_resolution_m(&self, _axis: usize) -> f64 {
        self.stage.resolution_m()
    }

    /// Negative and positive limit switch of `axis`: true when pressed.
    pub fn limit_switches(&self, axis: usize) -> (bool, bool) {
        if axis == 0 {
            self.stage.limit_switches()
        } else {
            (false, false)
        }
    }

    /// The voltage at analog input `channel` now, noise included.
    pub fn analog_volts(&mut self, channel: usize) -> f64 {
        let wired = match (channel, self.inputs_swapped) {
            (0, false) | (1, true) => Some(Sensor::Even),
            (1, false) | (0, true) => Some(Sensor::Odd),
            _ => None,
        };
        let sensor_v = wired.map_or(0.0, |sensor| self.hall.volts(sensor, self.true_position()));
        self.inputs
            .get_mut(channel)
            .map_or(0.0, |input| input.read(sensor_v, self.rail_v))
    }

    /// The encoder of `axis` loses or gets power: its count starts again from 0.
    pub fn encoder_power(&mut self, axis: usize, on: bool) {
        if axis == 0 {
            self.stage.encoder_power(on);
        }
    }

    /// Whether the safe torque off input of `axis` has taken the torque away.
    pub const fn safe_torque_off(&self, axis: usize) -> bool {
        axis == 0 && self.stage.torque_off()
    }

    /// The interferometer's signal now, noise included.
    pub fn fringes(&mut self) -> Fringes {
        let air = self.climate.at(self.now);
        let position_m = self.true_position().value();
        self.interferometer
            .fringes(position_m, self.stage.speed(self.now), &air)
    }

    /// What the interferometer's own sensors say about air and stage now.
    pub fn sensed_environment(&self) -> Environment {
        self.interferometer.sensed(self.climate.at(self.now))
    }

    fn true_position(&self) -> Metres {
        let stage_c = self.climate.at(self.now).stage_temperature.value();
        Metres(self.stage.true_position_m(self.now, stage_c))
    }

    /// The mains is off for a while: the Hall sensors come back as `drift` says, and nobody
    /// has held the stage. The devices themselves tell when their encoders lose power.
    pub fn power_cycle(&mut self, drift: HallDrift) {
        self.hall.drift = drift;
        self.stage.push_a_little();
    }

    /// Holds axis 0 fast, or lets it go.
    pub fn set_blocked(&mut self, blocked: bool) {
        self.stage.set_blocked(blocked);
    }

    /// Opens or closes the safe torque off circuit.
    pub fn set_safe_torque_off(&mut self, off: bool) {
        self.stage.set_torque_off(off);
    }

    /// Holds a limit switch in a state, or (with `None`) leaves it to the stage.
    pub fn force_limit_switch(&mut self, positive: bool, forced: Option<bool>) {
        self.stage.force_switch(positive, forced);
    }

    /// Breaks or mends an analog input.
    pub fn set_input_fault(&mut self, channel: usize, fault: Option<InputFault>) {
        if let Some(input) = self.inputs.get_mut(channel) {
            input.fault = fault;
        }
    }

    /// Exchanges inputs 0 and 1.
    pub fn set_inputs_swapped(&mut self, swapped: bool) {
        self.inputs_swapped = swapped;
    }

    /// What becomes of the interferometer's beam.
    pub fn set_beam(&mut self, beam: Beam) {
        self.interferometer.beam = beam;
    }

    /// The counter slips by whole half wavelengths, as an electric spike makes it do.
    pub fn slip_fringes(&mut self, half_wavelengths: i64) {
        self.interferometer.slipped += half_wavelengths;
    }

    /// The interferometer's reflector shakes with this standard deviation.
    pub fn set_vibration(&mut self, amplitude: Metres) {
        self.interferometer.vibration_m = amplitude.value();
    }

    /// The interferometer's sensors show this for ever (or, with `None`, the truth again).
    pub fn freeze_environment(&mut self, frozen: Option<Environment>) {
        self.interferometer.frozen = frozen;
    }

    /// The truth, for judges only: no device may look.
    pub const fn truth(&self) -> Truth<'_> {
        Truth::new(self)
    }
}
