//! One pose from several pictures.

use units::{Metres, Radians, Time};
use wire::in_sight::Inspection;

use super::settings::InSightSettings;
use crate::device::{DeviceError, DeviceName, PoseReading};

/// A pose under way.
#[derive(Clone, Debug)]
pub(super) struct Measurement {
    wanted: u32,
    means: [f64; 3],
    /// Sums of products of what is off the mean.
    products: [[f64; 3]; 3],
    good: u32,
    without_target: u32,
    judged_bad: u32,
    /// Of the good ones.
    worst_score: f64,
    /// Of the bad ones.
    best_score: f64,
}

impl Measurement {
    pub(super) const fn new(wanted: u32) -> Self {
        Self {
            wanted,
            means: [0.0; 3],
            products: [[0.0; 3]; 3],
            good: 0,
            without_target: 0,
            judged_bad: 0,
            worst_score: 1.0,
            best_score: 0.0,
        }
    }

    const fn rejected(&self) -> u32 {
        self.without_target + self.judged_bad
    }

    /// Takes one picture; how the measurement ends, when it was the last one.
    pub(super) fn take(
        &mut self,
        now: Time,
        picture: &Inspection,
        settings: &InSightSettings,
        device: DeviceName,
    ) -> Option<Result<PoseReading, DeviceError>> {
        let score = picture.score / 100.0;
        if picture.found < settings.targets {
            self.without_target += 1;
        } else if !picture.judged_ok || score < settings.score_min {
            self.judged_bad += 1;
            self.best_score = self.best_score.max(score);
        } else {
            self.worst_score = self.worst_score.min(score);
            self.add(picture, settings);
        }
        if self.good >= self.wanted {
            Some(Ok(self.reading(now)))
        } else if self.rejected() > settings.rejects_max {
            Some(Err(self.failure(device)))
        } else {
            None
        }
    }

    const fn failure(&self, device: DeviceName) -> DeviceError {
        DeviceError::NoGoodPicture {
            device,
            good: self.good,
            wanted: self.wanted,
            without_target: self.without_target,
            judged_bad: self.judged_bad,
            best_score: self.best_score,
        }
    }

    /// Welford's recurrence (B. P. Welford, Technometrics 4, 1962).
    fn add(&mut self, picture: &Inspection, settings: &InSightSettings) {
        self.good += 1;
        let mut values = settings.frame.to_machine([
            picture.x * settings.length_unit.value(),
            picture.y * settings.length_unit.value(),
            picture.angle * settings.angle_unit.value(),
        ]);
        // An angle near half a turn may be told with either sign.
        if self.good > 1 {
            values[2] -= Radians(values[2] - self.means[2]).whole_turns().value();
        }
        let steps: [f64; 3] = core::array::from_fn(|at| values[at] - self.means[at]);
        for (mean, step) in self.means.iter_mut().zip(steps) {
            *mean += step / f64::from(self.good);
        }
        for (row, step) in self.products.iter_mut().zip(steps) {
            for (at, product) in row.iter_mut().enumerate() {
                *product += step * (values[at] - self.means[at]);
            }
        }
    }

    fn reading(&self, at: Time) -> PoseReading {
        let [x, y, angle] = self.means;
        let freedom = f64::from(self.good.max(2) - 1);
        PoseReading {
            at,
            x: Metres(x),
            y: Metres(y),
            angle: Radians(angle),
            covariance: self.products.map(|row| row.map(|it| it / freedom)),
            score: self.worst_score,
            samples: self.good,
            rejected: self.rejected(),
        }
    }
}
