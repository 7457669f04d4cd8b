//! The physical truth, in SI units. It knows no bus and no protocol.
//!
//! Positions have their zero at the Hall zero as built: the true origin. The plant is
//! deterministic: the same seed and the same commands at the same times give the same bits,
//! however often [`Plant::advance`] is called in between.

mod analog;
pub mod camera;
pub mod config;
pub mod gantry;
mod hall_field;
mod instrument;
mod machine;
mod mechanics;
mod parts;
mod picture;
pub mod platform;
mod stage;
pub mod table;
mod thermal;
mod truth;
pub mod volumetric;

#[cfg(test)]
mod tests;

use units::{Celsius, Metres, Time};

pub use analog::InputFault;
pub use camera::Target;
pub use gantry::GantryTruth;
pub use hall_field::{DriftLimits, HallDrift, SensorDrift};
pub use instrument::{Beam, Fringes, Scanned};
pub use parts::pulse::{IndexPulse, ProbeEdge};
pub use parts::servo::Servo;
pub use parts::travel::{Travel, Travelled};
pub use picture::{BeamPlace, Mark, Scene};
pub use platform::{PlatformTruth, Pose};
pub use table::{Sight, TableTruth};
pub use thermal::Environment;
pub use truth::Truth;
pub(crate) use volumetric::Reflection;
pub use volumetric::{LineOptics, LineSetUp, LineTruth, VolumetricTruth};

use analog::Input;
use camera::Camera;
use config::PlantConfig;
use gantry::Gantry;
use hall_field::{HallField, Sensor};
use instrument::Interferometer;
use machine::Machine;
use parts::actuator::Actuator;
use platform::Platform;
use stage::Stage;
use table::Table;
use thermal::Climate;
use volumetric::{Sighting, Signal, TERMINALS, Volumetric};

/// Inputs 0 and 1 are the Hall sensors, of a gantry 2 and 3 those of its second side; the others are spare. Of a
/// rotary table input 0 is the photodiode over its plate. Three axes have their own.
const ANALOG_INPUTS: usize = 8;
/// Where thermometers are wired to, of the air and of the stage, on machines but those of three axes.
const AIR_TERMINAL: usize = 6;
const STAGE_TERMINAL: usize = 7;
/// What a resistance thermometer's input can show.
const TEMPERATURE_RAIL_C: f64 = 850.0;

/// Everything physical of one machine. Its axes are numbered from 0; axes that are not there
/// stand still and read 0.
///
/// # Example
///
/// ```
/// use mock_bus::plant::config::PlantConfig;
/// use mock_bus::plant::{Beam, Plant};
/// use units::Time;
///
/// let (config, now) = (PlantConfig::default(), Time::from_seconds(1.0));
/// let mut machines = [Plant::new(&config, 7), Plant::new(&config, 7)];
/// machines.iter_mut().for_each(|it| it.advance(now));
/// let [a, b] = machines.each_mut().map(|it| it.analog_volts(0));
/// assert_eq!(a, b, "the same noise");
/// let plant = &mut machines[0];
/// plant.set_beam(Beam::Blocked);
/// assert_eq!(plant.fringes().beam, Beam::Blocked);
/// assert_eq!(plant.encoder_counts(99), 0, "an axis that is not there");
/// ```
#[derive(Clone, Debug)]
pub struct Plant {
    now: Time,
    machine: Machine,
    hall: HallField,
    inputs: Vec<Input>,
    inputs_swapped: bool,
    climate: Climate,
    interferometer: Interferometer,
    camera: Camera,
}

impl Default for Plant {
    fn default() -> Self {
        Self::new(&PlantConfig::default(), 0)
    }
}

impl Plant {
    /// A machine as configured, with the errors and the noise of `seed`.
    pub fn new(config: &PlantConfig, seed: u64) -> Self {
        Self {
            now: Time::ZERO,
            machine: Machine::new(config, seed),
            hall: HallField::new(config.hall.clone()),
            inputs: inputs(config, seed),
            inputs_swapped: false,
            climate: Climate::new(config.climate.clone(), seed),
            interferometer: Interferometer::new(config.interferometer.clone(), seed),
            camera: Camera::new(config.camera.clone(), seed),
        }
    }

    /// Lets the physics run up to `now`; a moment that has passed changes nothing.
    pub fn advance(&mut self, now: Time) {
        if now > self.now {
            self.now = now;
            self.machine.advance(now);
        }
    }

    /// What the drive does to axis `axis` from now on.
    pub fn set_servo(&mut self, axis: usize, servo: Servo) {
        let now = self.now;
        if let Some(actuator) = self.machine.actuator_mut(axis) {
            actuator.set_servo(now, servo);
        }
    }

    /// The encoder of `axis`: counts since its power came on.
    pub fn encoder_counts(&self, axis: usize) -> i64 {
        self.read(axis, |actuator| actuator.counts(self.now))
    }

    /// Encoder speed of `axis` in counts per second.
    pub fn encoder_speed(&self, axis: usize) -> f64 {
        self.read(axis, |actuator| actuator.counts_per_s(self.now))
    }

    /// Metres or radians of encoder travel per count of `axis`; of axis 0 for an axis that is
    /// not there.
    pub fn encoder_resolution(&self, axis: usize) -> f64 {
        let actuator = self.machine.actuator(axis);
        let actuator = actuator.or_else(|| self.machine.actuator(0));
        actuator.map_or(0.0, |actuator| actuator.resolution())
    }

    /// The last index pulse of `axis`'s encoder since its power came on.
    pub fn index_pulse(&self, axis: usize) -> Option<IndexPulse> {
        self.read(axis, |actuator| actuator.index_pulse())
    }

    /// The next edge at the fast input of `axis`'s drive that has come by now.
    pub fn probe_edge(&mut self, axis: usize) -> Option<ProbeEdge> {
        let now = self.now;
        self.machine.actuator_mut(axis)?.probe_edge(now)
    }

    /// Negative and positive limit switch of `axis`: true when pressed.
    pub fn limit_switches(&self, axis: usize) -> (bool, bool) {
        self.read(axis, |actuator| actuator.limit_switches())
    }

    fn read<T: Default>(&self, axis: usize, what: impl FnOnce(&dyn Actuator) -> T) -> T {
        self.machine.actuator(axis).map_or_else(T::default, what)
    }

    /// The voltage at analog input `channel` now, noise included; a temperature sensor gives
    /// none.
    pub fn analog_volts(&mut self, channel: usize) -> f64 {
        let sensor_v = match self.signal(channel) {
            Some(Signal::Voltage(volts)) => volts,
            Some(Signal::Temperature(_)) | None => 0.0,
        };
        let input = self.inputs.get_mut(channel);
        input.map_or(0.0, |input| input.read(sensor_v))
    }

    /// The temperature that the sensor at analog input `channel` shows now, noise included;
    /// `None` where none is wired to it, or the wire is open.
    pub fn analog_temperature(&mut self, channel: usize) -> Option<Celsius> {
        let Some(Signal::Temperature(celsius)) = self.signal(channel) else {
            return None;
        };
        let input = self.inputs.get_mut(channel)?;
        let open = input.fault == Some(InputFault::Open);
        (!open).then(|| Celsius(input.read_within(celsius, TEMPERATURE_RAIL_C)))
    }

    /// What is wired to analog input `channel`.
    fn signal(&mut self, channel: usize) -> Option<Signal> {
        if let Some(volumetric) = self.machine.of_mut::<Volumetric>() {
            return volumetric.signal(channel, self.now);
        }
        match channel {
            AIR_TERMINAL => {
                let air_c = self.climate.at(self.now).air_temperature.value();
                return Some(Signal::Temperature(air_c));
            }
            STAGE_TERMINAL => {
                let stage_c = self.climate.stage_temperature(self.now).value();
                return Some(Signal::Temperature(stage_c));
            }
            _ => {}
        }
        if let Some(table) = self.machine.of::<Table>() {
            return (channel == 0).then(|| Signal::Voltage(table.line_volts(self.now)));
        }
        if let Some(gantry) = self.machine.of::<Gantry>() {
            let exchanged = usize::from(self.inputs_swapped && channel < 2);
            let wired = (channel ^ exchanged, &self.hall);
            let stage_c = self.climate.stage_temperature(self.now).value();
            let volts = gantry.hall_volts(wired, self.now, stage_c)?;
            return Some(Signal::Voltage(volts));
        }
        let sensor = match (channel, self.inputs_swapped) {
            (0, false) | (1, true) => Sensor::Even,
            (1, false) | (0, true) => Sensor::Odd,
            _ => return None,
        };
        Some(Signal::Voltage(
            self.hall.volts(sensor, self.true_position()),
        ))
    }

    /// A judge begins to watch the motion of `axis`.
    pub fn mark_travel(&mut self, axis: usize) {
        let now = self.now;
        if let Some(actuator) = self.machine.actuator_mut(axis) {
            actuator.train_mut().mark(now);
        }
    }

    /// The encoder of `axis` loses or gets power: its count starts again from 0.
    pub fn encoder_power(&mut self, axis: usize, on: bool) {
        if let Some(actuator) = self.machine.actuator_mut(axis) {
            actuator.encoder_power(on);
        }
    }

    /// Whether the safe torque off input of `axis` has taken the torque away.
    pub fn safe_torque_off(&self, axis: usize) -> bool {
        self.read(axis, |actuator| actuator.torque_off())
    }

    /// The interferometer's signal now, noise included.
    pub fn fringes(&mut self) -> Fringes {
        let air = self.environment();
        let seen = self.sighting(&air);
        self.interferometer.fringes(seen, &air)
    }

    /// What a scanning head in the reflector's place reads from a scale along the same line; `None` where
    /// nobody has set a line up.
    pub fn scanned(&self) -> Option<Scanned> {
        let seen = self.sighting(&self.environment())?;
        Some(self.interferometer.scanned(&seen))
    }

    fn sighting(&self, air: &Environment) -> Option<Sighting> {
        if let Some(volumetric) = self.machine.of::<Volumetric>() {
            return volumetric.sighting(self.now);
        }
        let stage_c = air.stage_temperature.value();
        let position_m = self.true_position_at(stage_c).value();
        let stage = self.machine.of::<Stage>();
        let speed = stage.map_or(0.0, |stage| stage.speed(self.now));
        Some(self.interferometer.reflector(position_m, speed))
    }

    /// What the interferometer's own sensors say about air and stage now.
    pub fn sensed_environment(&self) -> Environment {
        self.interferometer.sensed(self.environment())
    }

    /// Air and machine. Three axes have their own warmth, in the air that makes it.
    fn environment(&self) -> Environment {
        let climate = self.climate.at(self.now);
        let Some(volumetric) = self.machine.of::<Volumetric>() else {
            return climate;
        };
        let (air_c, machine_c) = volumetric.temperatures_c(self.now);
        Environment {
            air_temperature: Celsius(air_c),
            stage_temperature: Celsius(machine_c),
            ..climate
        }
    }

    /// The cameras that look at `scene` begin to take their pictures.
    pub fn open_shutter(&mut self, scene: Scene) {
        let now = self.now;
        match scene {
            Scene::Marks => self.camera.open_shutter(self.pose()),
            Scene::Beam { axis, at } => {
                if let Some(volumetric) = self.machine.of_mut::<Volumetric>() {
                    volumetric.open_shutter(axis, at, now);
                }
            }
        }
    }

    /// The pictures are taken: each mark, `None` where it is not in its picture. Of a beam it is the spots that are there,
    /// the brightest first.
    pub fn close_shutter(&mut self, scene: Scene) -> Vec<Option<Mark>> {
        let now = self.now;
        match scene {
            Scene::Marks => self.camera.close_shutter(self.pose()),
            Scene::Beam { axis, at } => {
                let volumetric = self.machine.of_mut::<Volumetric>();
                let spots = volumetric.map(|it| it.close_shutter(axis, at, now));
                spots.into_iter().flatten().map(Some).collect()
            }
        }
    }

    /// What carries the marks; on a machine without a platform they stand.
    fn pose(&self) -> Pose {
        let platform = self.machine.of::<Platform>();
        platform.map_or_else(Pose::default, |platform| platform.pose(self.now))
    }

    /// Of the linear stage: what carries the magnets and the reflector. Without one these
    /// stand at their zero.
    fn true_position(&self) -> Metres {
        if self.machine.of::<Stage>().is_none() {
            return Metres::ZERO;
        }
        self.true_position_at(self.climate.stage_temperature(self.now).value())
    }

    /// The same with the stage's temperature known.
    fn true_position_at(&self, stage_c: f64) -> Metres {
        let stage = self.machine.of::<Stage>();
        stage.map_or(Metres::ZERO, |stage| {
            Metres(stage.true_position_m(self.now, stage_c))
        })
    }

    /// How far the Hall sensors have drifted.
    pub(crate) const fn hall_drift(&self) -> HallDrift {
        self.hall.drift
    }

    /// The mains is off for a while: the Hall sensors come back as `drift` says, and nobody
    /// has held the machine. The devices themselves tell when their encoders lose power.
    pub fn power_cycle(&mut self, drift: HallDrift) {
        self.hall.drift = drift;
        self.machine.power_cycle();
    }

    /// Holds `axis` fast, or lets it go.
    pub fn set_blocked(&mut self, axis: usize, blocked: bool) {
        if let Some(actuator) = self.machine.actuator_mut(axis) {
            actuator.set_blocked(blocked);
        }
    }

    /// Opens or closes the safe torque off circuit, which all axes are on.
    pub fn set_safe_torque_off(&mut self, off: bool) {
        self.machine.set_torque_off(off);
    }

    /// Holds a limit switch of `axis` in a state, or (with `None`) leaves it to the mechanics.
    pub fn force_limit_switch(&mut self, axis: usize, positive: bool, forced: Option<bool>) {
        if let Some(actuator) = self.machine.actuator_mut(axis) {
            actuator.force_switch(positive, forced);
        }
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

    /// The instruments shake against the machine with this standard deviation.
    pub fn set_vibration(&mut self, amplitude: Metres) {
        self.interferometer.vibration_m = amplitude.value();
        self.camera.vibration_m = amplitude.value();
    }

    /// What becomes of the cameras' marks.
    pub fn set_target(&mut self, target: Target) {
        self.camera.target = target;
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

/// The channels' own noise and rails.
fn inputs(config: &PlantConfig, seed: u64) -> Vec<Input> {
    let Some(volumetric) = &config.volumetric else {
        let noise_v = config.hall.noise_mv * 1e-3;
        let hall = |channel| Input::new(noise_v, config.hall.rail_v, seed, channel);
        return (0..ANALOG_INPUTS).map(hall).collect();
    };
    let (beams, noise_k) = (&volumetric.beams, volumetric.temperatures.noise_k);
    let input = |channel| {
        if volumetric::is_temperature(channel) {
            Input::new(noise_k, TEMPERATURE_RAIL_C, seed, channel)
        } else {
            Input::new(beams.noise_mv * 1e-3, beams.rail_v, seed, channel)
        }
    };
    (0..TERMINALS).map(input).collect()
}
