//! One linear-motor stage: mass, encoder, deviation and limit switches in one.

use crate::random::Stream;
use units::Time;

use super::Servo;
use super::config::{LimitConfig, StageConfig};
use super::deviation::{Field, Path};
use super::servo::Mass;

/// Scales are true at this temperature (ISO 1).
const REFERENCE_C: f64 = 20.0;

#[derive(Clone, Debug)]
pub(super) struct Stage {
    config: StageConfig,
    mass: Mass,
    field: Field,
    path: Path,
    switches: [Switch; 2],
    resolution_m: f64,
    /// The encoder's count where its power came on.
    power_on_count: i64,
    encoder_powered: bool,
    shift: Stream,
}

impl Stage {
    pub(super) fn new(config: StageConfig, seed: u64) -> Self {
        let mut shift = Stream::new(seed, "start position");
        let start_m = 1e-3 * shift.between(config.motion.start_min_mm, config.motion.start_max_mm);
        let resolution_m = config.encoder.resolution_nm * 1e-9;
        let mut stage = Self {
            mass: Mass::new(config.motion.clone(), start_m, seed),
            field: Field::new(&config.deviation, seed),
            path: Path::new(&config.deviation, seed),
            switches: Switch::pair(&config.limits, seed),
            resolution_m,
            power_on_count: (start_m / resolution_m).round() as i64,
            encoder_powered: true,
            shift,
            config,
        };
        stage.watch_switches();
        stage
    }

    pub(super) fn advance(&mut self, now: Time) {
        let offset_m = self.power_on_count as f64 * self.resolution_m;
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

    pub(super) fn set_servo(&mut self, now: Time, servo: Servo) {
        let resting = self.mass.resting();
        self.mass.set_servo(now, servo);
        if resting && !self.mass.resting() {
            self.path.leave();
        }
    }

    pub(super) fn set_blocked(&mut self, blocked: bool) {
        self.mass.set_blocked(blocked);
    }

    pub(super) fn set_torque_off(&mut self, off: bool) {
        self.mass.set_torque_off(off);
    }

    pub(super) const fn torque_off(&self) -> bool {
        self.mass.torque_off()
    }

    pub(super) fn force_switch(&mut self, positive: bool, forced: Option<bool>) {
        self.switches[usize::from(positive)].forced = forced;
    }

    pub(super) fn limit_switches(&self) -> (bool, bool) {
        let [negative, positive] = &self.switches;
        (negative.is_pressed(), positive.is_pressed())
    }

    pub(super) fn encoder_power(&mut self, on: bool) {
        if on && !self.encoder_powered {
            self.power_on_count =
                (self.mass.position_at(Time::ZERO) / self.resolution_m).round() as i64;
        }
        self.encoder_powered = on;
    }

    /// Without power the stage can be moved; `now` is when the power is off.
    pub(super) fn push_a_little(&mut self) {
        let limit_m = self.config.motion.power_cycle_shift_um * 1e-6;
        let by_m = self.shift.between(-limit_m, limit_m);
        self.mass.push(by_m);
        self.path.leave();
        self.path.travel(by_m);
    }

    pub(super) fn counts(&self, now: Time) -> i64 {
        if !self.encoder_powered {
            return 0;
        }
        (self.mass.position_at(now) / self.resolution_m).round() as i64 - self.power_on_count
    }

    pub(super) fn counts_per_s(&self, now: Time) -> f64 {
        self.mass.speed_at(now) / self.resolution_m
    }

    pub(super) const fn resolution_m(&self) -> f64 {
        self.resolution_m
    }

    /// Scale position of the encoder's present zero count.
    pub(super) fn count_zero_m(&self) -> f64 {
        self.power_on_count as f64 * self.resolution_m
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

/// A limit switch: it acts a little elsewhere each time.
#[derive(Clone, Debug)]
struct Switch {
    /// +1 for the positive end, -1 for the negative one.
    side: f64,
    /// Distance from zero, along its side.
    at_m: f64,
    config: LimitConfig,
    jitter_m: f64,
    pressed: bool,
    forced: Option<bool>,
    stream: Stream,
}

impl Switch {
    fn pair(config: &LimitConfig, seed: u64) -> [Self; 2] {
        let switch = |side: f64, at_mm: f64, name| Self {
            side,
            at_m: side * at_mm * 1e-3,
            config: config.clone(),
            jitter_m: 0.0,
            pressed: false,
            forced: None,
            stream: Stream::new(seed, name),
        };
        [
            switch(-1.0, config.negative_mm, "negative limit"),
            switch(1.0, config.positive_mm, "positive limit"),
        ]
    }

    /// Whether it may change its state here, by a generous margin; saves looking closer.
    fn is_near(&self, encoder_m: f64) -> bool {
        const MARGIN_M: f64 = 1e-3;
        self.pressed || self.side * encoder_m - self.at_m > -MARGIN_M
    }

    fn watch(&mut self, true_m: f64) {
        let beyond_m = self.side * true_m - self.at_m - self.jitter_m;
        if !self.pressed && beyond_m >= 0.0 {
            self.pressed = true;
        } else if self.pressed && beyond_m < -self.config.hysteresis_um * 1e-6 {
            self.pressed = false;
            let limit_m = self.config.repeatability_um * 1e-6;
            self.jitter_m = self.stream.between(-limit_m, limit_m);
        }
    }

    fn is_pressed(&self) -> bool {
        self.forced.unwrap_or(self.pressed)
    }
}
