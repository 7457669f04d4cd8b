//! A stage with magnets of the tests' own: it shares no formula with what it tests.
//!
//! Each magnet is a lobe 1/(1 + (x/w)²)^1.5 (a dipole seen from the side); group 1 is three of
//! alternating sign, group 2 two of opposite sign.

use core::time::Duration;

use super::*;
pub(super) use crate::noise::Noise;
use units::{Approach, Metres, MetresPerSecond, Time, Volts};

/// Both sensors as they are today; positions in millimetres from the true zero.
#[derive(Clone, Copy, Debug)]
pub(super) struct Magnets {
    pub(super) offset: [f64; 2],
    pub(super) gain: [f64; 2],
    /// Change of gain per millimetre (plate and stage out of parallel).
    pub(super) tilt: [f64; 2],
    pub(super) swapped: bool,
}

impl Magnets {
    pub(super) const IDEAL: Self = Self {
        offset: [2.0, 2.5],
        gain: [1.0; 2],
        tilt: [0.0; 2],
        swapped: false,
    };

    /// ±100 mV of offset and ±3 % of gain on each sensor, ±`tilt` per millimetre.
    pub(super) fn drifted(noise: &mut Noise, tilt: f64) -> Self {
        let mut m = Self::IDEAL;
        for sensor in 0..2 {
            m.offset[sensor] += noise.within(0.1);
            m.gain[sensor] += noise.within(0.03);
            m.tilt[sensor] = noise.within(tilt);
        }
        m
    }

    pub(super) fn volts(&self, mm: f64) -> [f64; 2] {
        let lobe = |c: f64| (1.0 + ((mm - c) / 0.7).powi(2)).powf(-1.5);
        let even = 0.95 * (lobe(0.0) - 0.6 * (lobe(-1.1) + lobe(1.1)));
        let odd = 0.75 * (lobe(0.6) - lobe(-0.6));
        let of = |sensor: usize, field: f64| {
            let gain = self.gain[sensor] * (1.0 + self.tilt[sensor] * mm);
            self.offset[sensor] + gain * field
        };
        if self.swapped {
            [of(0, odd), of(1, even)]
        } else {
            [of(0, even), of(1, odd)]
        }
    }
}

/// What is done to the stage or its sensors beyond drift.
pub(super) type Spoil = fn(&mut Sample);

/// A stage under the search's orders, sampled every 5 ms.
pub(super) struct Stage {
    pub(super) magnets: Magnets,
    pub(super) noise: Noise,
    pub(super) noise_volts: f64,
    /// True position of the raw encoder's zero, in metres.
    pub(super) encoder_zero: f64,
    /// By how much the voltages are older than the position, in seconds.
    pub(super) lag: f64,
    pub(super) spoil: Spoil,
    pub(super) motor_works: bool,
    /// By how many samples the axis obeys late.
    pub(super) latency: usize,
    position: f64,
    speed: f64,
    still: u32,
}

const STEP: f64 = 1e-3;
const ACCELERATION: f64 = 0.05;
pub(super) const SAMPLE_PERIOD: Duration = Duration::from_millis(5);

impl Stage {
    pub(super) fn new(magnets: Magnets, seed: u64) -> Self {
        let mut noise = Noise(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ 0x5DEE_CE66);
        let position = noise.within(0.5e-3);
        let encoder_zero = noise.within(1e-3);
        Self {
            magnets,
            noise,
            noise_volts: 0.2e-3,
            encoder_zero,
            lag: 0.0,
            spoil: |_| {},
            motor_works: true,
            latency: 0,
            position,
            speed: 0.0,
            still: 100,
        }
    }

    /// Where the true zero is in raw encoder coordinates.
    pub(super) fn origin(&self) -> f64 {
        -self.encoder_zero
    }

    fn drive(&mut self, wish: &Progress) {
        let goal = match wish {
            Progress::Move { to, speed } if self.motor_works => {
                let left = to.value() + self.encoder_zero - self.position;
                let stoppable = (2.0 * ACCELERATION * left.abs()).sqrt();
                left.signum() * speed.value().min(stoppable).min(left.abs() / STEP)
            }
            _ => 0.0,
        };
        let change = (goal - self.speed).clamp(-ACCELERATION * STEP, ACCELERATION * STEP);
        self.speed += change;
        self.position += self.speed * STEP;
        self.still = if self.speed.abs() < 1e-9 {
            self.still + 1
        } else {
            0
        };
    }

    pub(super) fn sample(&mut self, at: Time) -> Sample {
        let raw = self.position - self.encoder_zero;
        let seen = (self.position - self.speed * self.lag) * 1e3;
        let [v1, v2] = self.magnets.volts(seen);
        let mut sample = Sample {
            at,
            position: Metres((raw / 10e-9).round() * 10e-9),
            peak: Volts(v1 + self.noise_volts * self.noise.normal()),
            slope: Volts(v2 + self.noise_volts * self.noise.normal()),
            standing: self.still > 20,
        };
        (self.spoil)(&mut sample);
        sample
    }

    /// Runs a search to its end; `nominal_error` is how far its nominal zero is off.
    pub(super) fn zero(&mut self, settings: Settings, nominal_error: f64) -> Progress {
        let nominal = Metres(self.origin() + nominal_error);
        let settings = Settings {
            soft_min: nominal + settings.soft_min,
            soft_max: nominal + settings.soft_max,
            ..settings
        };
        let mut search = Search::new(settings, nominal, Time::ZERO).unwrap();
        let mut now = Time::ZERO;
        let mut wishes = std::collections::VecDeque::from(vec![Progress::Stand; self.latency]);
        for _ in 0..100_000 {
            let wish = search.handle_sample(&self.sample(now));
            if let Progress::Move { to, speed } = &wish {
                assert!((*to - nominal).abs() <= settings.search_limit + Metres(1e-12));
                assert!(*to >= settings.soft_min && *to <= settings.soft_max);
                assert!(*speed <= settings.speed && *speed > MetresPerSecond::ZERO);
            }
            if matches!(wish, Progress::Found(_) | Progress::Failed(_)) {
                assert_eq!(search.handle_sample(&self.sample(now)), Progress::Stand);
                return wish;
            }
            wishes.push_back(wish);
            let wish = wishes.pop_front().expect("one was just pushed");
            for _ in 0..5 {
                self.drive(&wish);
            }
            now += SAMPLE_PERIOD;
        }
        panic!("the search did not end");
    }
}

/// A triangular sweep around the origin: `passes` times over ± `half_mm`, 2.5 µm per sample.
pub(super) fn sweep(
    magnets: &Magnets,
    noise: &mut Noise,
    half_mm: f64,
    passes: usize,
) -> Vec<HallPoint> {
    let steps = (2.0 * half_mm / 2.5e-3) as usize;
    let mut points = Vec::new();
    for pass in 0..passes {
        for i in 0..=steps {
            let i = if pass % 2 == 0 { i } else { steps - i };
            let mm = -half_mm + i as f64 * 2.5e-3;
            let [v1, v2] = magnets.volts(mm);
            points.push(HallPoint {
                position: Metres((mm * 1e-3 / 10e-9).round() * 10e-9),
                peak: Volts(v1 + 0.2e-3 * noise.normal()),
                slope: Volts(v2 + 0.2e-3 * noise.normal()),
            });
        }
    }
    points
}

/// A stage as passes see it.
#[derive(Clone, Copy)]
pub(super) struct Passed {
    pub(super) noise_mv: f64,
    pub(super) repeatability_nm: f64,
    pub(super) lost_motion_um: f64,
    /// Where its origin is.
    pub(super) zero_um: f64,
}

impl Passed {
    /// Passes of it, by turns: each shifted by what it repeats to, and by half the lost motion.
    pub(super) fn passes(&self, count: usize, noise: &mut Noise) -> Vec<Pass> {
        let magnets = Magnets::drifted(noise, 0.0);
        (0..count)
            .map(|number| {
                let approach = [Approach::Forward, Approach::Reverse][number % 2];
                let sign = if number % 2 == 0 { 1.0 } else { -1.0 };
                let lost_mm = sign * self.lost_motion_um * 0.5e-3;
                let shift_mm = self.repeatability_nm * 1e-6 * noise.normal() - lost_mm;
                let point = |step: i32| {
                    let mm = sign * f64::from(step) * 5e-3;
                    let [v1, v2] = magnets.volts(mm + shift_mm - self.zero_um * 1e-3);
                    HallPoint {
                        position: Metres((mm * 1e5).round() * 1e-8),
                        peak: Volts(v1 + self.noise_mv * 1e-3 * noise.normal()),
                        slope: Volts(v2 + self.noise_mv * 1e-3 * noise.normal()),
                    }
                };
                let points = (-200..=200).map(point).collect();
                Pass { approach, points }
            })
            .collect()
    }
}
