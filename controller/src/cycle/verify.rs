//! Verify: measure again, at positions between the calibrated ones, and judge by ISO 230-2.

use core::time::Duration;
use std::path::PathBuf;

use compensator::iso230::{self, Figures};
use units::Metres;

use super::calibrate::{missing, note_failure, open_journal};
use super::measure::{MeasureOptions, Measured, RunPlan};
use crate::config::VerifyConfig;
use crate::failure::Failure;
use crate::machine::Machine;
use crate::observer::Stage;
use crate::store::Store;

/// Between instrument and encoder; a stage as found may be this wrong over its whole travel.
const SCALE_LIMIT_PPM: f64 = 1000.0;

/// How a verification is made.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct VerifyOptions {
    /// With the calibration in use (as left), or without (as found).
    pub compensated: bool,
    /// The name of the calibration in use, for the journal.
    pub calibration: Option<String>,
    /// Continue this journal instead of starting a new one.
    pub resume: Option<PathBuf>,
}

/// What a verification gave.
#[derive(Clone, Debug)]
pub struct Verified {
    /// The figures.
    pub figures: Figures,
    /// Where every point is.
    pub journal: PathBuf,
    /// What was measured.
    pub measured: Measured,
    /// The tolerance of the configuration.
    pub tolerance: Metres,
}

impl Verified {
    /// Whether the bidirectional accuracy is within the tolerance.
    pub fn is_within_tolerance(&self) -> bool {
        self.figures.accuracy.bidirectional <= self.tolerance
    }
}

impl Machine {
    /// Measures `axis` at the configuration's verification targets and evaluates ISO 230-2.
    /// Being out of tolerance is a result here, not an error.
    ///
    /// # Errors
    /// When the axis is not zeroed or anything stops the machine.
    pub fn verify(
        &mut self,
        axis: &str,
        store: &Store,
        options: &VerifyOptions,
    ) -> Result<Verified, Failure> {
        let config = self.axis_config(axis)?.verify.clone();
        let config = config.ok_or_else(|| missing(axis, "verify"))?;
        if !self.is_zeroed(axis) {
            return Err(Failure::NotZeroed {
                axis: axis.to_owned(),
            });
        }
        if options.compensated && self.compensation(axis).is_none() {
            return Err(Failure::Usage {
                what: format!("axis {axis} uses no calibration"),
                help: "load or make one, or verify uncompensated".into(),
            });
        }
        let plan = run_plan(&config);
        let header = self.journal_header("verify", axis, &plan, options.calibration.clone());
        let (mut journal, earlier) = open_journal(store, &header, options.resume.as_ref())?;
        let measuring = MeasureOptions {
            stage: Stage::Verify,
            compensated: options.compensated,
        };
        let measured = self
            .measure_runs(axis, &plan, measuring, &mut journal, &earlier)
            .inspect_err(|failure| note_failure(&mut journal, failure))?;
        Ok(Verified {
            figures: iso230::evaluate(&measured.series()?)?,
            journal: journal.path().to_owned(),
            measured,
            tolerance: Metres::from_um(config.accuracy_tolerance_um),
        })
    }
}

fn run_plan(config: &VerifyConfig) -> RunPlan {
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
        scale_limit_ppm: SCALE_LIMIT_PPM,
    }
}
