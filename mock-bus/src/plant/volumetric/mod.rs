//! Three linear axes with all errors of rigid bodies, that warm up, with reference beams along
//! them (patent CN 003, system S4).
//!
//! Terminals, as modules are wired to them:
//!
//! | terminals | what |
//! |---|---|
//! | 8·axis + 0 … 3 | the slide's detector, quadrants A, B, C, D, volts |
//! | 8·axis + 4 … 7 | the detector at the end of the beam's way, volts |
//! | 24, 25 | the two roll detectors, volts |
//! | 26 + 2·axis, 27 + 2·axis | over and under a guide's neutral plane, temperatures |
//! | 32 + 2·n, 33 + 2·n | the roll detectors of further slide number n, volts; nothing where there is none |
//!
//! The heat follows the configured duty, not the motions made: the machine's errors are pure
//! functions of time and of where the slides are. Absent: lost motion, dynamic errors of the
//! structure, the workpiece, the load's weight, twisting of the foot.

mod beam;
mod chain;
pub mod config;
mod guide;
mod hands;
mod heat;
mod laser;
#[cfg(test)]
mod laser_tests;
mod reflection;
mod rigid;
mod roll;
mod slide;
mod spot;
#[cfg(test)]
mod tests;
mod truth;

use units::Time;

pub(crate) use beam::BeamTrouble;
pub(super) use laser::Sighting;
pub use laser::{LineOptics, LineSetUp};
pub(crate) use reflection::Reflection;
pub use truth::{ErrorMotion, LineTruth, Point, VolumetricTruth};

use super::config::InterferometerConfig;
use super::mechanics::{Mechanics, Section};
use super::parts::actuator::Actuator;
use super::picture::{BeamPlace as Place, Mark};
use crate::config::error::ConfigError;
use crate::random::Stream;
use beam::Beam;
use chain::{Chain, Stand};
use config::VolumetricConfig;
use guide::{Guide, Motion};
use heat::Heat;
use laser::Laser;
use rigid::Vector;
use roll::RollDetectors;
use slide::Slide;

/// How many terminals there are.
pub(in crate::plant) const TERMINALS: usize = FIRST_FURTHER_ROLL + 4;
const PER_AXIS: usize = 8;
const FIRST_ROLL: usize = 3 * PER_AXIS;
const FIRST_TEMPERATURE: usize = FIRST_ROLL + 2;
const FIRST_FURTHER_ROLL: usize = FIRST_TEMPERATURE + 6;

/// Over which a speed is taken.
const SOON_S: f64 = 1e-3;

/// Whether a temperature sensor is wired to a terminal.
pub(in crate::plant) const fn is_temperature(terminal: usize) -> bool {
    terminal >= FIRST_TEMPERATURE && terminal < FIRST_FURTHER_ROLL
}

/// What is at a terminal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::plant) enum Signal {
    /// Volts.
    Voltage(f64),
    /// Degrees Celsius.
    Temperature(f64),
}

/// The two directions across an axis, in the order of x, y, z.
const fn across(axis: usize) -> [usize; 2] {
    match axis {
        0 => [1, 2],
        1 => [0, 2],
        _ => [0, 1],
    }
}

#[derive(Clone, Debug)]
pub(super) struct Volumetric {
    slides: [Slide; 3],
    guides: [Guide; 3],
    chain: Chain,
    heat: Heat,
    beams: [Beam; 3],
    roll: RollDetectors,
    roll_axis: usize,
    further_rolls: Vec<usize>,
    sensor_offsets_k: [f64; 6],
    laser: Laser,
}

impl Volumetric {
    /// `dead_path_m` is that of a laser's linear optics.
    pub(super) fn new(config: &VolumetricConfig, dead_path_m: f64, seed: u64) -> Self {
        let mut stream = Stream::new(seed, "temperature sensors");
        let offset_k = config.temperatures.offset_k;
        let beam = |axis: usize| Beam::new(&config.beams, config.travel_mm[axis], axis, seed);
        Self {
            slides: [0, 1, 2].map(|axis| Slide::new(config, axis, seed)),
            guides: [0, 1, 2].map(|axis| Guide::new(config, axis, seed)),
            chain: Chain::new(config, seed),
            heat: Heat::new(config.heat.clone(), seed),
            beams: [0, 1, 2].map(beam),
            roll: RollDetectors::new(&config.roll),
            roll_axis: config.roll.axis,
            further_rolls: config.roll.further_axes.clone(),
            sensor_offsets_k: [(); 6].map(|()| stream.between(-offset_k, offset_k)),
            laser: Laser::new(&config.laser, dead_path_m, seed),
        }
    }

    /// What goes wrong with a beam from now on; nothing happens to one that is not there.
    pub(super) fn trouble_mut(&mut self, axis: usize) -> Option<&mut BeamTrouble> {
        self.beams.get_mut(axis).map(|beam| &mut beam.trouble)
    }

    fn scales_m(&self, now: Time) -> Vector {
        [0, 1, 2].map(|axis| self.slides[axis].scale_m(now))
    }

    fn motion(&self, axis: usize, scale_m: f64, now: Time) -> Motion {
        let heat = self.heat.axis(axis, now);
        self.guides[axis].motion(scale_m, &heat, now)
    }

    fn motions(&self, scales_m: Vector, now: Time) -> [Motion; 3] {
        [0, 1, 2].map(|axis| self.motion(axis, scales_m[axis], now))
    }

    fn stand(&self, scales_m: Vector, now: Time) -> Stand {
        let motions = self.motions(scales_m, now);
        self.chain.stand(scales_m, &motions)
    }

    fn tool_point_m(&self, scales_m: Vector, now: Time) -> Vector {
        let motions = self.motions(scales_m, now);
        self.chain.tool_point(scales_m, &motions)
    }

    /// Sets the laser up along a line that begins where the machine stands.
    pub(super) fn set_up_line(&mut self, set_up: &LineSetUp, now: Time) {
        let scales_m = self.scales_m(now);
        let stand = self.stand(scales_m, now);
        self.laser
            .set_up(set_up, |offset_m| stand.point(offset_m), now);
    }

    pub(super) fn take_line_away(&mut self) {
        self.laser.take_away();
    }

    /// What the laser looks at; `None` while no line is set up.
    pub(super) fn sighting(&self, now: Time) -> Option<Sighting> {
        if !self.laser.is_set_up() {
            return None;
        }
        let here_m = self.scales_m(now);
        let speeds = [0, 1, 2].map(|axis| self.slides[axis].speed_m_per_s(now));
        let soon_m = rigid::add(here_m, rigid::times(speeds, SOON_S));
        let here = self.stand(here_m, now);
        let soon = match soon_m == here_m {
            true => here,
            false => self.stand(soon_m, now),
        };
        let [here, soon] = [here, soon].map(|stand| move |offset_m| stand.point(offset_m));
        self.laser.sighting(here, (soon, SOON_S), now)
    }

    /// The air, and the machine as a thermometer on its frame shows it.
    pub(super) fn temperatures_c(&self, now: Time) -> (f64, f64) {
        let scales = [0, 1, 2].map(|axis| self.heat.axis(axis, now).scale_c);
        (self.heat.air_c(now), scales.iter().sum::<f64>() / 3.0)
    }

    /// What is at a terminal, without the noise of its channel.
    pub(super) fn signal(&mut self, terminal: usize, now: Time) -> Option<Signal> {
        match terminal {
            0..FIRST_ROLL => Some(Signal::Voltage(self.beam_volts(terminal, now))),
            FIRST_ROLL..FIRST_TEMPERATURE => {
                let volts = self.roll_volts(self.roll_axis, now);
                Some(Signal::Voltage(volts[terminal - FIRST_ROLL]))
            }
            FIRST_FURTHER_ROLL..TERMINALS => {
                let number = terminal - FIRST_FURTHER_ROLL;
                let axis = self.further_rolls.get(number / 2);
                let volts = axis.map_or([0.0; 2], |axis| self.roll_volts(*axis, now));
                Some(Signal::Voltage(volts[number % 2]))
            }
            FIRST_TEMPERATURE..FIRST_FURTHER_ROLL => {
                let sensor = terminal - FIRST_TEMPERATURE;
                let heat = self.heat.axis(sensor / 2, now);
                let side = if sensor.is_multiple_of(2) { 0.5 } else { -0.5 };
                let here_c = heat.scale_c + side * heat.gradient_k;
                Some(Signal::Temperature(here_c + self.sensor_offsets_k[sensor]))
            }
            _ => None,
        }
    }

    /// The camera in the place of a detector opens its shutter; nothing happens on an axis that is not there.
    pub(super) fn open_shutter(&mut self, axis: usize, place: Place, now: Time) {
        let Some(slide) = self.slides.get(axis) else {
            return;
        };
        let scale_m = slide.scale_m(now);
        let motion = self.motion(axis, scale_m, now);
        self.beams[axis].open_shutter(place, scale_m, (&motion, across(axis)), now);
    }

    /// It closes its shutter: the spots in its picture, the brightest first.
    pub(super) fn close_shutter(&mut self, axis: usize, place: Place, now: Time) -> Vec<Mark> {
        let Some(slide) = self.slides.get(axis) else {
            return Vec::new();
        };
        let scale_m = slide.scale_m(now);
        let motion = self.motion(axis, scale_m, now);
        self.beams[axis].close_shutter(place, scale_m, (&motion, across(axis)), now)
    }

    /// What the roll detectors of a slide give.
    fn roll_volts(&self, axis: usize, now: Time) -> [f64; 2] {
        let motion = self.motion(axis, self.slides[axis].scale_m(now), now);
        // The cross-section's second direction: after the axis comes u, then v.
        let lift_m = motion.shift[(axis + 2) % 3];
        self.roll.volts(motion.turn[axis], lift_m)
    }

    fn beam_volts(&mut self, terminal: usize, now: Time) -> f64 {
        let (axis, channel) = (terminal / PER_AXIS, terminal % PER_AXIS);
        let place = if channel < 4 {
            Place::Slide
        } else {
            Place::End
        };
        let quadrant = channel % 4;
        if let Some(volts) = self.beams[axis].seen(place, now) {
            return volts[quadrant];
        }
        let scale_m = self.slides[axis].scale_m(now);
        let motion = self.motion(axis, scale_m, now);
        let seen = (&motion, across(axis));
        self.beams[axis].look(place, scale_m, seen, now)[quadrant]
    }
}

impl Section for VolumetricConfig {
    fn check(&self) -> Result<(), ConfigError> {
        self.check_numbers()
    }

    fn resolution_nm(&self) -> Option<f64> {
        Some(self.resolution_nm)
    }

    fn build(&self, interferometer: &InterferometerConfig, seed: u64) -> Box<dyn Mechanics> {
        let dead_path_m = interferometer.dead_path_mm * 1e-3;
        Box::new(Volumetric::new(self, dead_path_m, seed))
    }
}

impl Mechanics for Volumetric {
    fn advance(&mut self, now: Time) {
        for slide in &mut self.slides {
            slide.advance(now);
        }
    }

    fn actuator(&self, number: usize) -> Option<&dyn Actuator> {
        self.slides.get(number).map(|slide| slide as &dyn Actuator)
    }

    fn actuator_mut(&mut self, number: usize) -> Option<&mut dyn Actuator> {
        let slide = self.slides.get_mut(number);
        slide.map(|slide| slide as &mut dyn Actuator)
    }

    fn power_cycle(&mut self) {
        for slide in &mut self.slides {
            slide.push_a_little();
        }
    }

    fn boxed(&self) -> Box<dyn Mechanics> {
        Box::new(self.clone())
    }
}
