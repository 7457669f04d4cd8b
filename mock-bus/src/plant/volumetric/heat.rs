//! How warm the machine is: pure functions of time, so that a night costs nothing.
//!
//! Everything that warms up does so with one time constant. Of a sinusoidal swing of the air
//! that is a smaller and later swing (the state that has lasted for ever); of a duty in steps it
//! is a sum of exponentials that begins at 0.

use core::cell::Cell;
use core::f64::consts::TAU;

use units::Time;
use units::portable::{atan, exp, sin};

use super::config::{DutyConfig, HeatConfig};
use crate::random::Stream;

/// How warm one axis is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct AxisHeat {
    /// The scale, and the guide's neutral plane.
    pub(super) scale_c: f64,
    /// Over the neutral plane minus under it.
    pub(super) gradient_k: f64,
    /// The films' warmth, 1 at full duty in the end.
    pub(super) film: f64,
}

#[derive(Clone, Debug)]
pub(super) struct Heat {
    config: HeatConfig,
    air: Swing,
    machine: Swing,
    /// Of scale and gradient, per axis.
    sizes: [[f64; 2]; 3],
    /// What was asked for last: sensors ask one after the other, all at one moment.
    asked: Cell<(Time, Everywhere)>,
}

/// What all axes have in common at one moment.
#[derive(Clone, Copy, Debug, Default)]
struct Everywhere {
    air_c: f64,
    machine_c: f64,
    /// What the duty so far has come to, of scale, gradient and films.
    warmth: [f64; 3],
}

/// A sinusoidal swing of the air, or of what follows it.
#[derive(Clone, Copy, Debug)]
struct Swing {
    middle_c: f64,
    size_k: f64,
    per_h: f64,
    phase: f64,
    lag: f64,
}

impl Heat {
    pub(super) fn new(config: HeatConfig, seed: u64) -> Self {
        let mut stream = Stream::new(seed, "volumetric heat");
        let phase = stream.between(0.0, TAU);
        let time_constant_h = config.air_time_constant_min / 60.0;
        Self {
            air: Swing::new(&config, phase, 0.0),
            machine: Swing::new(&config, phase, time_constant_h),
            sizes: [(); 3].map(|()| [(); 2].map(|()| stream.between(0.7, 1.3))),
            asked: Cell::new((Time::NEVER, Everywhere::default())),
            config,
        }
    }

    pub(super) fn axis(&self, axis: usize, now: Time) -> AxisHeat {
        let c = &self.config;
        let [scale, gradient] = self.sizes[axis];
        let everywhere = self.everywhere(now);
        let [scale_warmth, gradient_warmth, film] = everywhere.warmth;
        let scale_k = scale * c.scale_warming_k;
        let gradient_k = gradient * c.gradient_k;
        AxisHeat {
            scale_c: everywhere.machine_c + scale_k * scale_warmth,
            gradient_k: gradient_k * gradient_warmth
                + c.gradient_of_air * (everywhere.air_c - everywhere.machine_c),
            film,
        }
    }

    pub(super) fn air_c(&self, now: Time) -> f64 {
        self.everywhere(now).air_c
    }

    fn everywhere(&self, now: Time) -> Everywhere {
        let (asked, known) = self.asked.get();
        if asked == now {
            return known;
        }
        let c = &self.config;
        let hours = now.seconds() / 3600.0;
        let constants_min = [
            c.scale_time_constant_min,
            c.gradient_time_constant_min,
            c.film_time_constant_min,
        ];
        let everywhere = Everywhere {
            air_c: self.air.at(hours),
            machine_c: self.machine.at(hours),
            warmth: constants_min.map(|constant_min| warmth(&c.duty, hours, constant_min)),
        };
        self.asked.set((now, everywhere));
        everywhere
    }
}

impl Swing {
    /// Of what follows the air with a time constant.
    fn new(config: &HeatConfig, phase: f64, time_constant_h: f64) -> Self {
        let per_h = TAU / config.air_swing_period_h;
        let lag = per_h * time_constant_h;
        Self {
            middle_c: config.air_temperature_c,
            size_k: config.air_swing_k / (1.0 + lag * lag).sqrt(),
            per_h,
            phase,
            lag: atan(lag),
        }
    }

    fn at(&self, hours: f64) -> f64 {
        self.middle_c + self.size_k * sin(self.per_h * hours + self.phase - self.lag)
    }
}

/// What the duty so far has come to.
fn warmth(duty: &[DutyConfig], hours: f64, time_constant_min: f64) -> f64 {
    let left = |since_h: f64| exp(-(hours - since_h) * 60.0 / time_constant_min);
    let mut last_end = (f64::NAN, 0.0);
    let ends = duty.iter().skip(1).map(|next| next.from_h);
    duty.iter()
        .zip(ends.chain([f64::INFINITY]))
        .filter(|(now, _)| now.from_h < hours)
        .map(|(now, end_h)| {
            // The end of one step is the start of the next; one that lasts has lost nothing.
            let left_at_start = match last_end {
                (at_h, known) if at_h == now.from_h => known,
                _ => left(now.from_h),
            };
            let left_at_end = if end_h < hours { left(end_h) } else { 1.0 };
            last_end = (end_h, left_at_end);
            now.share * (left_at_end - left_at_start)
        })
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_of_duty_are_exponentials_that_follow_each_other() {
        let step = |from_h, share| DutyConfig { from_h, share };
        let duty = [step(0.0, 1.0), step(1.0, 0.0)];
        let one = 1.0 - (-1.0_f64).exp();
        assert_eq!(warmth(&duty, 0.0, 60.0), 0.0);
        assert!((warmth(&duty, 1.0, 60.0) - one).abs() < 1e-15);
        let later = one * (-2.0_f64).exp();
        assert!((warmth(&duty, 3.0, 60.0) - later).abs() < 1e-15);
        assert!((warmth(&[step(0.0, 0.5)], 1e3, 60.0) - 0.5).abs() < 1e-15);
    }

    #[test]
    fn what_was_asked_for_in_between_changes_nothing() {
        let fresh = || Heat::new(HeatConfig::default(), 3);
        let heat = fresh();
        for hours in [0.0, 3.0, 4.2, 9.0] {
            let now = Time::from_seconds(3600.0 * hours);
            for axis in 0..3 {
                assert_eq!(heat.axis(axis, now), fresh().axis(axis, now));
            }
            let later = Time::from_seconds(3600.0 * hours + 1e-3);
            assert_eq!(heat.air_c(later), fresh().air_c(later));
        }
    }

    #[test]
    fn slow_things_follow_the_air_less_and_later() {
        // One time constant and a period of 2π of them: 1/√2 of the swing, an eighth later.
        let period_h = 24.0;
        let config = HeatConfig {
            duty: Vec::new(),
            air_swing_period_h: period_h,
            air_time_constant_min: 60.0 * period_h / TAU,
            ..HeatConfig::default()
        };
        let heat = Heat::new(config, 3);
        let eighth = period_h / 8.0;
        for hours in [0.0, 5.0, 17.0] {
            let air = heat.air.at(hours) - 21.0;
            let body = heat.machine.at(hours + eighth) - 21.0;
            assert!((body - air / 2.0_f64.sqrt()).abs() < 1e-12);
        }
    }
}
