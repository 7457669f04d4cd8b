//! One ball screw: motor, encoder, nut, and the table's side of the nut's play.
//!
//! The encoder turns with the screw; the nut is where screw and lead error put it; the table
//! is pushed by the nut's flanks and stays where it is while neither touches. That is the play
//! operator (hysteron) of M. A. Krasnosel'skii and A. V. Pokrovskii, Systems with Hysteresis
//! (1989), chapter 1: table = clamp(table before, nut ± half the play). Its outcome does not
//! depend on how a stroke is cut into pieces.

use crate::random::Stream;
use units::Time;

use crate::plant::Servo;
use crate::plant::deviation::StopError;
use crate::plant::encoder::Encoder;
use crate::plant::limit_switch::LimitSwitch;
use crate::plant::machine::{Actuator, IndexPulse};
use crate::plant::servo::Mass;

use super::config::ScrewConfig;
use super::lead_error::LeadError;

#[derive(Clone, Debug)]
pub(super) struct Screw {
    config: ScrewConfig,
    mass: Mass,
    encoder: Encoder,
    index: Index,
    error: LeadError,
    play: Play,
    /// On top of where the flanks have pushed the table.
    stop_error: StopError,
    switches: [LimitSwitch; 2],
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
            mass: Mass::new(config.motion(), start_m, stream("servo rest")),
            encoder: Encoder::new(config.resolution_nm, start_m),
            index: Index::new(config, stream("index")),
            error,
            play,
            stop_error: StopError::new(config.repeatability_nm * 1e-9, stream("stop error")),
            switches: LimitSwitch::pair(&config.limits(), seed, &whose),
            shift,
            config: config.clone(),
        };
        screw.watch_switches(start_m);
        screw
    }

    pub(super) fn advance(&mut self, now: Time) {
        let offset_m = self.encoder.count_zero_m();
        while let Some((from, to)) = self.mass.step_until(now, offset_m) {
            if to != from {
                self.travel(from, to);
            }
        }
        if self.mass.resting() {
            self.mass.skip_to(now);
        }
    }

    fn travel(&mut self, from: f64, to: f64) {
        self.play.push(to + self.error.at(to));
        self.stop_error.travel(to - from);
        self.index.watch(from, to, &self.encoder);
        self.watch_switches(to);
    }

    fn watch_switches(&mut self, screw_m: f64) {
        for switch in &mut self.switches {
            if switch.is_near(screw_m) {
                switch.watch(screw_m + self.error.at(screw_m));
            }
        }
    }

    /// Without power the screw can be turned, and the table moves within the play.
    pub(super) fn push_a_little(&mut self) {
        let limit_m = self.config.power_cycle_shift_um * 1e-6;
        let by_m = self.shift.between(-limit_m, limit_m);
        self.mass.push(by_m);
        self.stop_error.leave();
        self.stop_error.travel(by_m);
        let nut_m = self.nut_m(Time::ZERO);
        self.play.lie_anywhere(nut_m, &mut self.shift);
    }

    fn nut_m(&self, now: Time) -> f64 {
        let screw_m = self.mass.position_at(now);
        screw_m + self.error.at(screw_m)
    }

    /// The stroke that the table has really made, from the middle of the screw.
    pub(super) fn stroke_m(&self, now: Time) -> f64 {
        self.play.pushed_m(self.nut_m(now)) + self.stop_error.error_m()
    }

    /// The stroke that the screw's turns say.
    pub(super) fn screw_m(&self, now: Time) -> f64 {
        self.mass.position_at(now)
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
        self.encoder.count_zero_m()
    }
}

impl Actuator for Screw {
    fn set_servo(&mut self, now: Time, servo: Servo) {
        let resting = self.mass.resting();
        self.mass.set_servo(now, servo);
        if resting && !self.mass.resting() {
            self.stop_error.leave();
        }
    }

    fn counts(&self, now: Time) -> i64 {
        self.encoder.counts(self.mass.position_at(now))
    }

    fn counts_per_s(&self, now: Time) -> f64 {
        self.mass.speed_at(now) / self.encoder.resolution_m()
    }

    fn resolution_m(&self) -> f64 {
        self.encoder.resolution_m()
    }

    fn encoder_power(&mut self, on: bool) {
        if self.encoder.power(on, self.mass.position_at(Time::ZERO)) {
            self.index.last = None;
        }
    }

    fn index_pulse(&self) -> Option<IndexPulse> {
        self.index.last
    }

    fn limit_switches(&self) -> (bool, bool) {
        let [negative, positive] = &self.switches;
        (negative.is_pressed(), positive.is_pressed())
    }

    fn force_switch(&mut self, positive: bool, forced: Option<bool>) {
        self.switches[usize::from(positive)].forced = forced;
    }

    fn set_blocked(&mut self, blocked: bool) {
        self.mass.set_blocked(blocked);
    }

    fn set_torque_off(&mut self, off: bool) {
        self.mass.set_torque_off(off);
    }

    fn torque_off(&self) -> bool {
        self.mass.torque_off()
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

/// The encoder's mark, met once a turn; one of the marks is in the middle of the screw.
#[derive(Clone, Debug)]
struct Index {
    turn_m: f64,
    repeatability_m: f64,
    last: Option<IndexPulse>,
    stream: Stream,
}

impl Index {
    fn new(config: &ScrewConfig, stream: Stream) -> Self {
        Self {
            turn_m: config.lead_mm * 1e-3,
            repeatability_m: config.index_repeatability_nm * 1e-9,
            last: None,
            stream,
        }
    }

    fn watch(&mut self, from: f64, to: f64, encoder: &Encoder) {
        let (before, after) = ((from / self.turn_m).floor(), (to / self.turn_m).floor());
        if before == after {
            return;
        }
        let mark_m = before.max(after) * self.turn_m;
        let jitter_m = self.repeatability_m * self.stream.gaussian();
        self.last = Some(IndexPulse {
            count: encoder.counts(mark_m + jitter_m),
            number: self.last.map_or(1, |last| last.number + 1),
        });
    }
}
