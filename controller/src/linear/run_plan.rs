//! What a measuring run is made of.

use core::time::Duration;

use machine::Stage;
use units::{Metres, MetresPerSecond};

use crate::config::AxisConfig;
use crate::linear::positions::positions;
use crate::linear::{CalibrateConfig, VerifyConfig};

/// What is measured, and how.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct RunPlan {
    /// The instrument's name.
    pub instrument: String,
    /// Where, increasing.
    pub targets: Vec<Metres>,
    /// How often each from each side.
    pub runs: u32,
    /// How far beyond the ends a run turns round, so that every target has its approach.
    pub overrun: Metres,
    /// How long the stage stands before it is read.
    pub settle: Duration,
    /// How many readings are averaged.
    pub average_samples: u32,
    /// Largest relative difference of instrument and encoder believed, where it is judged.
    pub scale_limit_ppm: f64,
    /// How far the datum may have drifted at the end of each run; `None` for any distance.
    pub closure_limit: Option<Metres>,
}

impl RunPlan {
    /// What it comes to when the axis moves with `speed`.
    pub(crate) fn planned(&self, speed: MetresPerSecond) -> PlannedRun {
        let (first, last) = match self.targets.as_slice() {
            [first, .., last] => (*first, *last),
            _ => (Metres::ZERO, Metres::ZERO),
        };
        let runs = f64::from(self.runs);
        let travel = (last - first + self.overrun * 2.0) * (2.0 * runs);
        let points = 2 * u64::from(self.runs) * self.targets.len() as u64;
        let ways = travel.value() / speed.value();
        let standing = self.settle.as_secs_f64() * points as f64;
        PlannedRun {
            points,
            travel,
            at_least: Duration::try_from_secs_f64(ways + standing).unwrap_or_default(),
        }
    }
}

/// What a measuring run will do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlannedRun {
    /// How many points it measures.
    pub points: u64,
    /// How far the axis goes from the first of them to the last.
    pub travel: Metres,
    /// How long that takes at least: the ways at the usual speed, and standing.
    pub at_least: Duration,
}

/// Of a calibration.
pub(super) fn of_calibration(config: &CalibrateConfig) -> RunPlan {
    RunPlan {
        instrument: config.instrument.clone(),
        targets: positions(config),
        runs: config.runs,
        overrun: Metres::from_mm(config.overrun_mm),
        settle: Duration::from_millis(config.settle_ms.into()),
        average_samples: config.average_samples,
        scale_limit_ppm: config.scale_limit_ppm,
        closure_limit: None,
    }
}

/// The measuring run that is configured for `axis`.
pub(crate) fn plan_of(axis: &AxisConfig, of: Stage) -> Option<RunPlan> {
    match of {
        Stage::Calibrate => Some(of_calibration(axis.calibrate.as_ref()?)),
        Stage::Verify => Some(of_verification(axis.verify.as_ref()?, 0.0)),
        Stage::Zero | Stage::Reference | Stage::Job => None,
    }
}

/// How fast an axis goes unless it is told otherwise.
pub(crate) fn speed_of(axis: &AxisConfig) -> MetresPerSecond {
    MetresPerSecond(axis.motion.speed_mm_per_s * 1e-3)
}

/// Of a verification.
pub(super) fn of_verification(config: &VerifyConfig, scale_limit_ppm: f64) -> RunPlan {
    let step = (config.end_mm - config.start_mm) / f64::from(config.targets - 1);
    let targets = (0..config.targets)
        .map(|at| Metres::from_mm(config.start_mm + f64::from(at) * step))
        .collect();
    RunPlan {
        instrument: config.instrument.clone(),
        targets,
        runs: config.runs,
        overrun: Metres::from_mm(config.overrun_mm),
        settle: Duration::from_millis(config.settle_ms.into()),
        average_samples: config.average_samples,
        scale_limit_ppm,
        closure_limit: None,
    }
}
