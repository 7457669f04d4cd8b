//! How the true position departs from the encoder: `true = encoder + deviation`.
//!
//! - a smooth field over the work range: a slope and the first five harmonics of twice the
//!   range, with random phases, scaled to a given band (the errors of a guide and a scale);
//! - a small cyclic term of the scale's grating;
//! - lost motion with a true engagement state: after a reversal it is taken up along the way;
//! - an error of each single stop;
//! - the scale's expansion, about the true zero.
//!
//! Deviation is zero at encoder position zero in the smooth field, so that the true zero of
//! the Hall magnets and the zero of the scale agree but for the other terms.

use crate::random::Stream;
use core::f64::consts::TAU;
use units::portable::{exp, sin};

use crate::plant::config::DeviationConfig;

const HARMONICS: usize = 5;
/// The zero of the field lies within this share of its band from the middle.
const CENTRED: f64 = 0.15;
const DRAWS: usize = 1000;
const SCAN_POINTS: usize = 601;

#[derive(Clone, Copy, Debug, Default)]
struct Wave {
    amplitude_m: f64,
    per_m: f64,
    phase: f64,
}

impl Wave {
    fn at(&self, position_m: f64) -> f64 {
        self.amplitude_m * sin(self.per_m * position_m + self.phase)
    }
}

/// The part that depends on the encoder position alone.
#[derive(Clone, Debug)]
pub(in crate::plant) struct Field {
    slope: f64,
    waves: [Wave; HARMONICS],
    at_zero_m: f64,
    cyclic: Wave,
}

impl Field {
    pub(in crate::plant) fn new(config: &DeviationConfig, seed: u64) -> Self {
        let mut stream = Stream::new(seed, "deviation field");
        let (low, high) = (config.work_min_mm * 1e-3, config.work_max_mm * 1e-3);
        let mut field = Self::shape(&mut stream, config, high - low);
        for _ in 0..DRAWS {
            let (least, most) = field.smooth_range(low, high);
            let middle = f64::midpoint(least, most);
            if middle.abs() < CENTRED * (most - least) {
                break;
            }
            field = Self::shape(&mut stream, config, high - low);
        }
        let (least, most) = field.smooth_range(low, high);
        field.scale(2.0 * config.peak_um * 1e-6 / (most - least));
        field
    }

    /// A draw of unit size.
    fn shape(stream: &mut Stream, config: &DeviationConfig, range_m: f64) -> Self {
        let mut waves = [Wave::default(); HARMONICS];
        for (order, wave) in (1..).zip(&mut waves) {
            let order = f64::from(order);
            *wave = Wave {
                amplitude_m: stream.between(0.4, 1.0) / (order * order.sqrt()),
                per_m: TAU * order / (2.0 * range_m),
                phase: stream.between(0.0, TAU),
            };
        }
        let cyclic = Wave {
            amplitude_m: config.cyclic_amplitude_nm * 1e-9,
            per_m: TAU / (config.cyclic_period_um * 1e-6),
            phase: stream.between(0.0, TAU),
        };
        let at_zero_m = waves.iter().map(|wave| wave.at(0.0)).sum();
        Self {
            slope: stream.between(-1.0, 1.0) / range_m,
            waves,
            at_zero_m,
            cyclic,
        }
    }

    fn scale(&mut self, factor: f64) {
        self.slope *= factor;
        self.at_zero_m *= factor;
        for wave in &mut self.waves {
            wave.amplitude_m *= factor;
        }
    }

    fn smooth_range(&self, low_m: f64, high_m: f64) -> (f64, f64) {
        let step = (high_m - low_m) / (SCAN_POINTS - 1) as f64;
        (0..SCAN_POINTS)
            .map(|i| self.smooth(low_m + i as f64 * step))
            .fold(
                (f64::INFINITY, f64::NEG_INFINITY),
                |(least, most), value| (least.min(value), most.max(value)),
            )
    }

    /// Without the cyclic term.
    pub(in crate::plant) fn smooth(&self, position_m: f64) -> f64 {
        let waves: f64 = self.waves.iter().map(|wave| wave.at(position_m)).sum();
        self.slope * position_m + waves - self.at_zero_m
    }

    pub(in crate::plant) fn at(&self, position_m: f64) -> f64 {
        self.smooth(position_m) + self.cyclic.at(position_m)
    }

    /// It is not larger at `position_m` than this, which costs less to tell.
    pub(in crate::plant) fn at_most(&self, position_m: f64) -> f64 {
        let waves: f64 = self.waves.iter().map(|wave| wave.amplitude_m.abs()).sum();
        let periodic_m = waves + self.at_zero_m.abs() + self.cyclic.amplitude_m.abs();
        (self.slope * position_m).abs() + periodic_m
    }
}

/// The part that depends on the way the stage came.
#[derive(Clone, Debug)]
pub(in crate::plant) struct Path {
    half_lost_m: f64,
    take_up_m: f64,
    engagement_m: f64,
    stop_error: StopError,
}

impl Path {
    pub(in crate::plant) fn new(config: &DeviationConfig, seed: u64) -> Self {
        Self {
            half_lost_m: config.lost_motion_um * 0.5e-6,
            take_up_m: config.lost_motion_take_up_um * 1e-6,
            engagement_m: 0.0,
            stop_error: StopError::new(
                config.repeatability_nm * 1e-9,
                Stream::new(seed, "stop error"),
            ),
        }
    }

    /// A stage that leaves its place will stop with another error.
    pub(in crate::plant) fn leave(&mut self) {
        self.stop_error.leave();
    }

    /// Moving forward the stage lags behind its encoder by half the lost motion, and moving
    /// back it leads by as much. The exponential makes the result independent of how a
    /// stroke is cut into pieces.
    pub(in crate::plant) fn travel(&mut self, by_m: f64) {
        let goal_m = -self.half_lost_m * by_m.signum();
        self.engagement_m = approach(self.engagement_m, goal_m, by_m.abs() / self.take_up_m);
        self.stop_error.travel(by_m);
    }

    pub(in crate::plant) fn deviation_m(&self) -> f64 {
        self.engagement_m + self.stop_error.error_m()
    }

    /// Fully engaged in the direction of `sign`, without the stop's error.
    pub(in crate::plant) fn engaged_m(&self, sign: f64) -> f64 {
        -self.half_lost_m * sign
    }
}

/// The error of each single stop, which nothing can predict.
#[derive(Clone, Debug)]
pub(in crate::plant) struct StopError {
    standard_deviation_m: f64,
    present_m: f64,
    next_m: f64,
    stream: Stream,
}

impl StopError {
    /// It is carried along over this travel.
    const TRAVEL_M: f64 = 5e-6;

    pub(in crate::plant) fn new(standard_deviation_m: f64, stream: Stream) -> Self {
        Self {
            standard_deviation_m,
            present_m: 0.0,
            next_m: 0.0,
            stream,
        }
    }

    /// What leaves its place will stop with another error.
    pub(in crate::plant) fn leave(&mut self) {
        self.next_m = self.standard_deviation_m * self.stream.gaussian();
    }

    pub(in crate::plant) fn travel(&mut self, by_m: f64) {
        self.present_m = approach(self.present_m, self.next_m, by_m.abs() / Self::TRAVEL_M);
    }

    pub(in crate::plant) const fn error_m(&self) -> f64 {
        self.present_m
    }
}

fn approach(from: f64, to: f64, lengths: f64) -> f64 {
    // What has arrived stays, as the exponential would have it too.
    if from == to {
        return to;
    }
    to + (from - to) * exp(-lengths)
}
