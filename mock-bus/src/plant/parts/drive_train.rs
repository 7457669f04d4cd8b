//! What everything driven is made of: a mass under its servo, the encoder on it, and, where it
//! has them, an index mark and limit switches.

use units::Time;

use super::encoder::Encoder;
use super::index_mark::IndexMark;
use super::limit_switch::LimitSwitch;
use super::pulse::IndexPulse;
use super::servo::Servo;
use super::servo::{Mass, Stroke};
use super::travel::{Travel, Travelled};

/// Metres of a linear one, radians of a rotary one.
#[derive(Clone, Debug)]
pub(in crate::plant) struct DriveTrain {
    pub(in crate::plant) mass: Mass,
    pub(in crate::plant) encoder: Encoder,
    pub(in crate::plant) index: Option<IndexMark>,
    /// The negative one and the positive one; what turns endlessly has no ends.
    pub(in crate::plant) switches: Option<[LimitSwitch; 2]>,
    /// Where it was since a judge has marked it.
    pub(in crate::plant) travelled: Travelled,
}

impl DriveTrain {
    /// Runs the next grid step if it ends by `now`; returns where it led from and to.
    pub(in crate::plant) fn step_until(&mut self, now: Time) -> Option<Stroke> {
        let stroke = self.mass.step_until(now, self.encoder.count_zero());
        if let (Some((from, to)), Some(index)) = (stroke, &mut self.index)
            && from != to
        {
            index.watch(from, to, &self.encoder);
        }
        if let Some((from, to)) = stroke {
            self.travelled.pass(from, to);
        }
        stroke
    }

    /// A judge begins to watch.
    pub(in crate::plant) fn mark(&mut self, now: Time) {
        self.travelled = Travelled::from(self.mass.position_at(now));
    }

    /// Where it is, how fast, and where it was since it was marked.
    pub(in crate::plant) fn travel(&self, now: Time) -> Travel {
        Travel {
            position: self.mass.position_at(now),
            speed: self.mass.speed_at(now),
            since_mark: self.travelled,
        }
    }

    /// After the last step by `now`: the grid is skipped while the mass rests. Whether it does.
    pub(in crate::plant) fn settle(&mut self, now: Time) -> bool {
        let resting = self.mass.resting();
        if resting {
            self.mass.skip_to(now);
        }
        resting
    }

    /// Lets the switches see where the mass is; `true_of` is the place they act by, never further
    /// than `error_m` from the scale's.
    pub(in crate::plant) fn watch_switches(&mut self, error_m: f64, true_of: impl Fn(f64) -> f64) {
        let scale = self.mass.position_at(Time::ZERO);
        let near = self.switches.iter_mut().flatten();
        for switch in near.filter(|it| it.is_near(scale, error_m)) {
            switch.watch(true_of(scale));
        }
    }

    /// Returns whether the servo has taken a mass along that rested.
    pub(in crate::plant) fn set_servo(&mut self, now: Time, servo: Servo) -> bool {
        let rested = self.mass.resting();
        self.mass.set_servo(now, servo);
        rested && !self.mass.resting()
    }

    pub(in crate::plant) fn encoder_power(&mut self, on: bool) {
        let scale = self.mass.position_at(Time::ZERO);
        if self.encoder.power(on, scale)
            && let Some(index) = &mut self.index
        {
            index.forget();
        }
    }

    pub(in crate::plant) fn counts(&self, now: Time) -> i64 {
        self.encoder.counts(self.mass.position_at(now))
    }

    pub(in crate::plant) fn counts_per_s(&self, now: Time) -> f64 {
        self.mass.speed_at(now) / self.encoder.resolution()
    }

    pub(in crate::plant) fn index_pulse(&self) -> Option<IndexPulse> {
        self.index.as_ref().and_then(IndexMark::last)
    }

    pub(in crate::plant) fn limit_switches(&self) -> (bool, bool) {
        let pressed = |[negative, positive]: &[LimitSwitch; 2]| {
            (negative.is_pressed(), positive.is_pressed())
        };
        self.switches.as_ref().map_or((false, false), pressed)
    }

    pub(in crate::plant) fn force_switch(&mut self, positive: bool, forced: Option<bool>) {
        if let Some(switches) = &mut self.switches {
            switches[usize::from(positive)].forced = forced;
        }
    }
}
