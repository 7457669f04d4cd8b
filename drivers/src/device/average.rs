//! Mean and standard deviation of a run of samples.

use super::DisplacementReading;
use units::{Metres, Time};

/// The last average asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Averaging {
    /// None, or it failed.
    Never,
    /// Not all samples have come.
    Running(RunningAverage),
    /// Done.
    Done(DisplacementReading),
}

impl Averaging {
    /// The reading, when all samples have come.
    pub(super) const fn reading(&self) -> Option<DisplacementReading> {
        match self {
            Self::Done(reading) => Some(*reading),
            Self::Never | Self::Running(_) => None,
        }
    }
}

/// Welford's recurrence: no sum of squares that cancels (B. P. Welford, Technometrics 4,
/// 1962).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct RunningAverage {
    begun: Time,
    wanted: u32,
    taken: u32,
    mean_m: f64,
    squares_m2: f64,
    /// Samples that were missing or unusable meanwhile.
    pub(super) lacking: u64,
    /// Those among them whose phase was not valid.
    pub(super) dim: u64,
}

impl RunningAverage {
    pub(super) const fn new(begun: Time, wanted: u32) -> Self {
        Self {
            begun,
            wanted,
            taken: 0,
            mean_m: 0.0,
            squares_m2: 0.0,
            lacking: 0,
            dim: 0,
        }
    }

    /// Takes one sample; the reading when it was the last. What was measured
    /// before the beginning, before the machine stood, is left out.
    pub(super) fn add(&mut self, at: Time, displacement: Metres) -> Option<DisplacementReading> {
        if at < self.begun {
            return None;
        }
        self.taken += 1;
        let value = displacement.value();
        let step = value - self.mean_m;
        self.mean_m += step / f64::from(self.taken);
        self.squares_m2 += step * (value - self.mean_m);
        (self.taken >= self.wanted).then(|| self.reading(at))
    }

    fn reading(&self, at: Time) -> DisplacementReading {
        let deviation = match self.taken {
            0 | 1 => 0.0,
            taken => (self.squares_m2 / f64::from(taken - 1)).sqrt(),
        };
        DisplacementReading {
            at,
            vacuum: Metres(self.mean_m),
            standard_deviation: Metres(deviation),
            samples: self.taken,
        }
    }
}
