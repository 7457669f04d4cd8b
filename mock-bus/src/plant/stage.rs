//! One linear-motor stage: mass, encoder, deviation and limit switches in one.

use crate::random::Stream;
use units::Time;

use super::Servo;
use super::config::StageConfig;
use super::deviation::{Field, Path};
use super::encoder::Encoder;
use super::limit_switch::LimitSwitch;
use super::machine::{Actuator, IndexPulse};
use super::servo::Mass;

/// Scales are true at this temperature (ISO 1).
const REFERENCE_C: f64 = 20.0;

#[derive(Clone, Debug)]
pub(super) struct Stage {
    config: StageConfig,
    mass: Mass,
    field: Field,
    path: Path,
    switches: [LimitSwitch; 2],
    encoder: Encoder,
    shift: Stream,
}

impl Stage {
    pub(super) fn new(config: StageConfig, seed: u64) -> Self {
        let mut shift = Stream::new(seed, "start position");
        let start_m = 1e-3 * shift.between(config.motion.start_min_mm, config.motion.start_max_mm);
        let mut stage = Self {
            mass: Mass::new(
                config.motion.clone(),
                start_m,
                Stream::new(seed, "servo rest"),
            ),
            field: Field::new(&config.deviation, seed),
            path: Path::new(&config.deviation, seed),
            switches: LimitSwitch::pair(&config.limits, seed, ""),
            encoder: Encoder::new(config.encoder.resolution_nm, start_m),
            shift,
            config,
        };
        stage.watch_switches();
        stage
    }

    pub(super) fn advance(&mut self, now: Time) {
        let offset_m = self.encoder.count_zero_m();
        while let Some((from, to)) = self.mass.step_until(now, offset_m) {
            if to != from {
                self.path.travel(to - from);
                self.watch_switches();
            }
        }
        if self.mass.resting() {
            self.mass.skip_to(now);
        }
    }

    /// The switches' own place varies by more than the scale grows: expansion is left out.
    fn watch_switches(&mut self) {
        let encoder_m = self.mass.position_at(Time::ZERO);
        if !self.switches.iter().any(|switch| switch.is_near(encoder_m)) {
            return;
        }
        let true_m = encoder_m + self.field.at(encoder_m);
        for switch in &mut self.switches {
            switch.watch(true_m);
        }
    }

    /// Without power the stage can be moved; `now` is when the power is off.
    pub(super) fn push_a_little(&mut self) {
        let limit_m = self.config.motion.power_cycle_shift_um * 1e-6;
        let by_m = self.shift.between(-limit_m, limit_m);
        self.mass.push(by_m);
        self.path.leave();
        self.path.travel(by_m);
    }

    /// Scale position of the encoder's present zero count.
    pub(super) fn count_zero_m(&self) -> f64 {
        self.encoder.count_zero_m()
    }

    pub(super) fn scale_position_m(&self, now: Time) -> f64 {
        self.mass.position_at(now)
    }

    pub(super) fn speed(&self, now: Time) -> f64 {
        self.mass.speed_at(now)
    }

    pub(super) fn true_position_m(&self, now: Time, stage_c: f64) -> f64 {
        let scale_m = self.mass.position_at(now);
        self.grown(scale_m, stage_c) + self.field.at(scale_m) + self.path.deviation_m()
    }

    fn grown(&self, scale_m: f64, stage_c: f64) -> f64 {
        let per_k = self.config.encoder.scale_expansion_ppm_per_k * 1e-6;
        scale_m * (1.0 + per_k * (stage_c - REFERENCE_C))
    }

    /// True minus scale position, fully engaged in the direction of `sign` (0: between both).
    pub(super) fn systematic_deviation_m(&self, scale_m: f64, sign: f64, stage_c: f64) -> f64 {
        self.grown(scale_m, stage_c) - scale_m + self.field.at(scale_m) + self.path.engaged_m(sign)
    }
}

impl Actuator for Stage {
    fn set_servo(&mut self, now: Time, servo: Servo) {
        let resting = self.mass.resting();
        self.mass.set_servo(now, servo);
        if resting && !self.mass.resting() {
            self.path.leave();
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
        self.encoder.power(on, self.mass.position_at(Time::ZERO));
    }

    /// The scale has no index mark.
    fn index_pulse(&self) -> Option<IndexPulse> {
        None
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
