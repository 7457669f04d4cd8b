//! One ball screw: motor, encoder, nut, and the table's side of the nut's play.
//!
//! The encoder turns with the screw; the nut is where screw and lead error put it; the table
//! is pushed by the nut's flanks and stays where it is while neither touches. That is the play
//! operator (hysteron) of M. A. Krasnosel'skii and A. V. Pokrovskii, Systems with Hysteresis
//! (1989), chapter 1: table = clamp(table before, nut ± half the play). Its outcome does not
//! depend on how a stroke is cut into pieces.

use crate::random::Stream;
use units::Time;

use crate::plant::parts::actuator::Actuator;
use crate::plant::parts::deviation::StopError;
use crate::plant::parts::drive_train::DriveTrain;
use crate::plant::parts::encoder::Encoder;
use crate::plant::parts::index_mark::IndexMark;
use crate::plant::parts::limit_switch::LimitSwitch;
use crate::plant::parts::servo::Mass;
use crate::plant::parts::servo::Servo;

use super::config::ScrewConfig;
use super::lead_error::LeadError;

#[derive(Clone, Debug)]
pub(super) struct Screw {
    config: ScrewConfig,
    /// One of the index marks is in the middle of the screw.
    train: DriveTrain,
    error: LeadError,
    play: Play,
    /// On top of where the flanks have pushed the table.
    stop_error: StopError,
    shift: Stream,
}

impl Screw {
    /// Screw number `number` of a platform.
    pub(super) fn new(config: &ScrewConfig, seed: u64, number: usize) -> Self {
        let whose = format!("screw {number} ");
        let stream = |what: &str| Stream::new(seed, &format!("{whose}{what}"));
        let error = LeadError::new(config, &mut stream("lead error"));
        let mut shift = stream("start position");
        let start_m = 1e-3 * shift.between(-config.start_mm, config.start_mm);
        let mut play = Play::new(error.lost_motion_m());
        play.lie_anywhere(start_m + error.at(start_m), &mut shift);
        let mut screw = Self {
            train: DriveTrain {
                travelled: start_m.into(),
                mass: Mass::new(config.motion(), start_m, stream("servo rest")),
                encoder: Encoder::new(config.resolution_nm * 1e-9, start_m),
                index: Some(IndexMark::new(
                    config.lead_mm * 1e-3,
                    config.index_repeatability_nm * 1e-9,
                    stream("index"),
                )),
                switches: Some(LimitSwitch::pair(&config.limits(), seed, &whose)),
            },
            error,
            play,
            stop_error: StopError::new(config.repeatability_nm * 1e-9, stream("stop error")),
            shift,
            config: config.clone(),
        };
        screw.watch_switches();
        screw
    }

    pub(super) fn advance(&mut self, now: Time) {
        while let Some((from, to)) = self.train.step_until(now) {
            if to != from {
                self.play.push(to + self.error.at(to));
                self.stop_error.travel(to - from);
                self.watch_switches();
            }
        }
        self.train.settle(now);
    }

    fn watch_switches(&mut self) {
        let error = &self.error;
        let nut_m = |screw_m: f64| screw_m + error.at(screw_m);
        let error_m = error.at_most(self.train.mass.position_at(Time::ZERO));
        self.train.watch_switches(error_m, nut_m);
    }

    /// Without power the screw can be turned, and the table moves within the play.
    pub(super) fn push_a_little(&mut self) {
        let limit_m = self.config.power_cycle_shift_um * 1e-6;
        let by_m = self.shift.between(-limit_m, limit_m);
        self.train.mass.push(by_m);
        self.stop_error.leave();
        self.stop_error.travel(by_m);
        let nut_m = self.nut_m(Time::ZERO);
        self.play.lie_anywhere(nut_m, &mut self.shift);
    }

    fn nut_m(&self, now: Time) -> f64 {
        let screw_m = self.train.mass.position_at(now);
        screw_m + self.error.at(screw_m)
    }

    /// The stroke that the table has really made, from the middle of the screw.
    pub(super) fn stroke_m(&self, now: Time) -> f64 {
        self.play.pushed_m(self.nut_m(now)) + self.stop_error.error_m()
    }

    /// The stroke that the screw's turns say.
    pub(super) fn screw_m(&self, now: Time) -> f64 {
        self.train.mass.position_at(now)
    }

    /// Where within the play the table lies: minus half the play after a forward move.
    pub(super) fn engagement_m(&self, now: Time) -> f64 {
        let nut_m = self.nut_m(now);
        self.play.pushed_m(nut_m) - nut_m
    }

    pub(super) const fn lost_motion_m(&self) -> f64 {
        self.error.lost_motion_m()
    }

    /// Stroke minus screw position, fully engaged in the direction of `sign` (0: between both),
    /// without the stop's error.
    pub(super) fn systematic_deviation_m(&self, screw_m: f64, sign: f64) -> f64 {
        self.error.at(screw_m) - sign * self.error.lost_motion_m() / 2.0
    }

    pub(super) fn count_zero_m(&self) -> f64 {
        self.train.encoder.count_zero()
    }
}

impl Actuator for Screw {
    fn train(&self) -> &DriveTrain {
        &self.train
    }

    fn train_mut(&mut self) -> &mut DriveTrain {
        &mut self.train
    }

    fn set_servo(&mut self, now: Time, servo: Servo) {
        if self.train.set_servo(now, servo) {
            self.stop_error.leave();
        }
    }
}

/// The table between the two flanks of a nut.
#[derive(Clone, Debug)]
pub(super) struct Play {
    half_m: f64,
    table_m: f64,
}

impl Play {
    pub(super) const fn new(width_m: f64) -> Self {
        Self {
            half_m: width_m / 2.0,
            table_m: 0.0,
        }
    }

    /// The nut has gone straight to `nut_m`.
    pub(super) fn push(&mut self, nut_m: f64) {
        self.table_m = self.pushed_m(nut_m);
    }

    /// Where the table is pushed to when the nut goes straight to `nut_m`.
    pub(super) fn pushed_m(&self, nut_m: f64) -> f64 {
        self.table_m.clamp(nut_m - self.half_m, nut_m + self.half_m)
    }

    /// Nobody knows where between the flanks of a nut at `nut_m` it lies.
    fn lie_anywhere(&mut self, nut_m: f64, chance: &mut Stream) {
        self.table_m = nut_m + chance.between(-self.half_m, self.half_m);
    }
}
