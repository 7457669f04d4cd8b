//! One slide: linear motor, incremental scale with reference marks, limit switches.

use units::Time;

use super::config::VolumetricConfig;
use crate::plant::Servo;
use crate::plant::encoder::Encoder;
use crate::plant::index_mark::IndexMark;
use crate::plant::limit_switch::LimitSwitch;
use crate::plant::machine::{Actuator, IndexPulse};
use crate::plant::servo::Mass;
use crate::random::Stream;

#[derive(Clone, Debug)]
pub(super) struct Slide {
    mass: Mass,
    encoder: Encoder,
    index: IndexMark,
    switches: [LimitSwitch; 2],
    shift_max_m: f64,
    shift: Stream,
}

impl Slide {
    pub(super) fn new(config: &VolumetricConfig, axis: usize, seed: u64) -> Self {
        let whose = format!("slide {axis} ");
        let stream = |what: &str| Stream::new(seed, &format!("{whose}{what}"));
        let travel_mm = config.travel_mm[axis];
        let slide = &config.slide;
        let mut shift = stream("start position");
        let start_m = 1e-3 * shift.between(slide.start_min_mm, slide.start_max_mm);
        Self {
            mass: Mass::new(slide.motion(travel_mm), start_m, stream("servo rest")),
            encoder: Encoder::new(config.resolution_nm * 1e-9, start_m),
            index: IndexMark::new(
                slide.index_spacing_mm * 1e-3,
                slide.index_repeatability_nm * 1e-9,
                stream("index"),
            ),
            switches: LimitSwitch::pair(&slide.limits(travel_mm), seed, &whose),
            shift_max_m: slide.power_cycle_shift_um * 1e-6,
            shift,
        }
    }

    pub(super) fn advance(&mut self, now: Time) {
        let offset_m = self.encoder.count_zero();
        while let Some((from, to)) = self.mass.step_until(now, offset_m) {
            if to != from {
                self.index.watch(from, to, &self.encoder);
                self.watch_switches(to);
            }
        }
        if self.mass.resting() {
            self.mass.skip_to(now);
        }
    }

    /// Where a switch acts varies by more than the errors of the axis: these are left out.
    fn watch_switches(&mut self, scale_m: f64) {
        for switch in &mut self.switches {
            if switch.is_near(scale_m) {
                switch.watch(scale_m);
            }
        }
    }

    /// Without power the slide can be moved.
    pub(super) fn push_a_little(&mut self) {
        let by_m = self.shift.between(-self.shift_max_m, self.shift_max_m);
        self.mass.push(by_m);
    }

    /// Where the scale is read, from its own zero.
    pub(super) fn scale_m(&self, now: Time) -> f64 {
        self.mass.position_at(now)
    }

    pub(super) fn count_zero_m(&self) -> f64 {
        self.encoder.count_zero()
    }
}

impl Actuator for Slide {
    fn set_servo(&mut self, now: Time, servo: Servo) {
        self.mass.set_servo(now, servo);
    }

    fn counts(&self, now: Time) -> i64 {
        self.encoder.counts(self.mass.position_at(now))
    }

    fn counts_per_s(&self, now: Time) -> f64 {
        self.mass.speed_at(now) / self.encoder.resolution()
    }

    fn resolution(&self) -> f64 {
        self.encoder.resolution()
    }

    fn encoder_power(&mut self, on: bool) {
        if self.encoder.power(on, self.mass.position_at(Time::ZERO)) {
            self.index.forget();
        }
    }

    fn index_pulse(&self) -> Option<IndexPulse> {
        self.index.last()
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
