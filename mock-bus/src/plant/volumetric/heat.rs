//! How warm the machine is: pure functions of time, so that a night costs nothing.
//!
//! Everything that warms up does so with one time constant. Of a sinusoidal swing of the air
//! that is a smaller and later swing (the state that has lasted for ever); of a duty in steps it
//! is a sum of exponentials that begins at 0.

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
    phase: f64,
    /// Of scale and gradient, per axis.
    sizes: [[f64; 2]; 3],
}

impl Heat {
    pub(super) fn new(config: HeatConfig, seed: u64) -> Self {
        let mut stream = Stream::new(seed, "volumetric heat");
        Self {
            config,
            phase: stream.between(0.0, TAU),
            sizes: [(); 3].map(|()| [(); 2].map(|()| stream.between(0.7, 1.3))),
        }
    }

    pub(super) fn axis(&self, axis: usize, now: Time) -> AxisHeat {
        let c = &self.config;
        let hours = now.seconds() / 3600.0;
        let [scale, gradient] = self.sizes[axis];
        let machine_c = self.swing(hours, c.air_time_constant_min / 60.0);
        let air_c = self.swing(hours, 0.0);
        let scale_k = scale * c.scale_warming_k;
        let gradient_k = gradient * c.gradient_k;
        AxisHeat {
            scale_c: machine_c + scale_k * warmth(&c.duty, hours, c.scale_time_constant_min),
            gradient_k: gradient_k * warmth(&c.duty, hours, c.gradient_time_constant_min)
                + c.gradient_of_air * (air_c - machine_c),
            film: warmth(&c.duty, hours, c.film_time_constant_min),
        }
    }

    pub(super) fn air_c(&self, now: Time) -> f64 {
        self.swing(now.seconds() / 3600.0, 0.0)
    }

    /// What follows the air with a time constant.
    fn swing(&self, hours: f64, time_constant_h: f64) -> f64 {
        let per_h = TAU / self.config.air_swing_period_h;
        let lag = per_h * time_constant_h;
        let size = self.config.air_swing_k / (1.0 + lag * lag).sqrt();
        self.config.air_temperature_c + size * sin(per_h * hours + self.phase - atan(lag))
    }
}

/// What the duty so far has come to.
fn warmth(duty: &[DutyConfig], hours: f64, time_constant_min: f64) -> f64 {
    let left = |since_h: f64| exp(-(hours - since_h) * 60.0 / time_constant_min);
    let ends = duty.iter().skip(1).map(|next| next.from_h);
    duty.iter()
        .zip(ends.chain([f64::INFINITY]))
        .filter(|(now, _)| now.from_h < hours)
        .map(|(now, end_h)| now.share * (left(end_h.min(hours)) - left(now.from_h)))
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
    fn slow_things_follow_the_air_less_and_later() {
        let config = HeatConfig {
            duty: Vec::new(),
            ..HeatConfig::default()
        };
        let heat = Heat::new(config, 3);
        // One time constant and a period of 2π of them: 1/√2 of the swing, an eighth later.
        let (period_h, constant_h) = (24.0, 24.0 / TAU);
        let eighth = period_h / 8.0;
        for hours in [0.0, 5.0, 17.0] {
            let air = heat.swing(hours, 0.0) - 21.0;
            let body = heat.swing(hours + eighth, constant_h) - 21.0;
            assert!((body - air / 2.0_f64.sqrt()).abs() < 1e-12);
        }
    }
}
