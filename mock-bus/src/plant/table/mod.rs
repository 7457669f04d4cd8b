//! A rotary table that turns endlessly, with a glass plate on it and a line detector over it.
//!
//! Source: the machine of CN 001 (system S2): an angle sensor of any kind with an error that
//! repeats from turn to turn, and a plate whose lines are no better. Angles are radians and
//! count on over the turns.
//!
//! | symbol | name |
//! |---|---|
//! | G | encoder error: reading minus true angle, of the reading |
//! | A | error of a line on the plate: where it is minus where it should be |
//! | s | placement: by how many lines the plate is turned against the table |
//!
//! Line n passes the detector when the true angle is (n + s) spacings, plus A of the line, plus
//! what the placement is off by. Absent: wobble of the plate, run-out that moves the lines under
//! the detector, heat.

pub mod config;
mod detector;
mod encoder_error;
mod hands;
mod microscope;
mod plate;
mod signal;
#[cfg(test)]
mod tests;
mod truth;

use core::f64::consts::TAU;
use core::time::Duration;
use std::collections::VecDeque;

use units::{Radians, Time};

pub use microscope::Sight;
pub use truth::TableTruth;

use crate::config::error::ConfigError;
use crate::plant::config::InterferometerConfig;
use crate::plant::mechanics::{Mechanics, Section};
use crate::plant::parts::actuator::Actuator;
use crate::plant::parts::drive_train::DriveTrain;
use crate::plant::parts::encoder::Encoder;
use crate::plant::parts::index_mark::IndexMark;
use crate::plant::parts::pulse::ProbeEdge;
use crate::plant::parts::servo::Servo;
use crate::plant::parts::servo::{GRID_NS, Mass};
use crate::random::Stream;
use config::TableConfig;
use detector::{Detector, Passage};
use encoder_error::EncoderError;
use microscope::Microscope;
use plate::Plate;
use signal::Photodiode;

#[derive(Clone, Debug)]
pub(super) struct Table {
    train: DriveTrain,
    error: EncoderError,
    plate: Plate,
    detector: Detector,
    photodiode: Photodiode,
    microscope: Microscope,
    /// What a hand does that nobody calls, in order.
    hand_lines: VecDeque<f64>,
    /// How many lines had been seen when the plate was turned last.
    passages_before: u64,
    /// The grid step that ends next.
    step: u64,
    power_cycle_shift: f64,
    shift: Stream,
}

impl Table {
    pub(super) fn new(config: &TableConfig, seed: u64) -> Self {
        let mut shift = Stream::new(seed, "table start");
        let start = shift.between(0.0, TAU);
        let encoder = &config.encoder;
        let repeatability = Radians::from_arcsec(encoder.index_repeatability_arcsec).value();
        Self {
            train: DriveTrain {
                travelled: start.into(),
                mass: Mass::new(
                    config.motion.dynamics(),
                    start,
                    Stream::new(seed, "table servo rest"),
                ),
                encoder: Encoder::new(TAU / f64::from(encoder.counts_per_turn), start),
                index: Some(IndexMark::new(
                    TAU,
                    repeatability,
                    Stream::new(seed, "table index"),
                )),
                // What turns endlessly has no ends.
                switches: None,
            },
            error: EncoderError::new(encoder, &config.bearing, seed),
            plate: Plate::new(&config.plate, seed),
            detector: Detector::new(&config.detector, seed),
            photodiode: Photodiode::new(&config.signal),
            microscope: Microscope::new(&config.microscope, seed),
            hand_lines: config.plate.hand_lines.iter().copied().collect(),
            passages_before: 0,
            step: 0,
            power_cycle_shift: config.motion.power_cycle_shift_deg.to_radians(),
            shift,
        }
    }

    fn true_angle(&self, reading: f64) -> f64 {
        reading - self.error.at(reading)
    }

    /// The lines that pass while the reading goes straight from one value to another in the grid
    /// step that has just ended.
    fn watch_lines(&mut self, from: f64, to: f64) {
        let (before, after) = (self.true_angle(from), self.true_angle(to));
        let (low, high) = (before.min(after), before.max(after));
        let mut numbers: Vec<i64> = self
            .plate
            .candidates(low, high)
            .filter(|number| {
                let angle = self.plate.angle(*number);
                // Each end belongs to one of two steps that follow each other.
                angle > low && angle <= high
            })
            .collect();
        if after < before {
            numbers.reverse();
        }
        for number in numbers {
            let share = (self.plate.angle(number) - before) / (after - before);
            if let Some(line) = self.plate.visible(number) {
                self.pass(line, number, share, (from, to));
            }
        }
    }

    fn pass(&mut self, line: u32, number: i64, share: f64, (from, to): (f64, f64)) {
        let angle = self.plate.angle(number);
        let mut reading = from + share * (to - from);
        // The error changes slowly: each round is some thousand times nearer.
        for _ in 0..2 {
            reading += angle - self.true_angle(reading);
        }
        let start = Time((self.step - 1) * GRID_NS);
        let passage = Passage {
            line,
            at: start + Duration::from_nanos((share * GRID_NS as f64) as u64),
            reading,
            speed: (to - from) / (GRID_NS as f64 * 1e-9),
        };
        let encoder = &self.train.encoder;
        self.detector
            .see(passage, |reading| encoder.counts(reading));
    }

    pub(super) fn turn_plate(&mut self, lines: f64) {
        self.plate.turn(lines);
        self.passages_before = self.detector.passages();
    }

    /// Somebody who waits until the plate has been read and the drive is off.
    fn lend_a_hand(&mut self) {
        let read = self.detector.passages() - self.passages_before;
        if 2 * read > 5 * self.plate.lines() as u64
            && let Some(lines) = self.hand_lines.pop_front()
        {
            self.turn_plate(lines);
        }
    }

    pub(super) fn set_smudged(&mut self, line: u32, smudged: bool) {
        self.plate.smudge(line, smudged);
    }

    pub(super) fn shift_line(&mut self, line: u32, shift: Radians) {
        self.detector.shift(line, shift);
    }

    pub(super) const fn set_detector_dead(&mut self, dead: bool) {
        self.detector.set_dead(dead);
    }

    pub(super) fn set_scratched(&mut self, line: u32, scratched: bool) {
        self.detector.scratch(line, scratched);
    }
}

impl Section for TableConfig {
    fn check(&self) -> Result<(), ConfigError> {
        self.check_numbers()
    }

    fn build(&self, _: &InterferometerConfig, seed: u64) -> Box<dyn Mechanics> {
        Box::new(Table::new(self, seed))
    }
}

impl Mechanics for Table {
    fn advance(&mut self, now: Time) {
        while let Some((from, to)) = self.train.step_until(now) {
            self.step += 1;
            if to != from {
                self.watch_lines(from, to);
            }
        }
        if self.train.settle(now) {
            self.step = now.nanos() / GRID_NS;
        }
    }

    fn actuator(&self, number: usize) -> Option<&dyn Actuator> {
        (number == 0).then_some(self as &dyn Actuator)
    }

    fn actuator_mut(&mut self, number: usize) -> Option<&mut dyn Actuator> {
        (number == 0).then_some(self as &mut dyn Actuator)
    }

    /// Without power the table can be turned.
    fn power_cycle(&mut self) {
        let limit = self.power_cycle_shift;
        self.train.mass.push(self.shift.between(-limit, limit));
    }

    fn boxed(&self) -> Box<dyn Mechanics> {
        Box::new(self.clone())
    }
}

impl Actuator for Table {
    fn train(&self) -> &DriveTrain {
        &self.train
    }

    fn train_mut(&mut self) -> &mut DriveTrain {
        &mut self.train
    }

    fn set_servo(&mut self, now: Time, servo: Servo) {
        self.train.set_servo(now, servo);
        if servo == Servo::Off {
            self.lend_a_hand();
        }
    }

    fn probe_edge(&mut self, now: Time) -> Option<ProbeEdge> {
        self.detector.take(now)
    }
}
