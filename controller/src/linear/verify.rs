//! Verify: measure again, at positions between the calibrated ones, and judge by ISO 230-2.

use std::path::PathBuf;

use compensator::budget::Combined;
use compensator::error_table::{Compensation, ErrorTable};
use compensator::iso230::{self, Figures};
use units::{Approach, Metres, Short};

use crate::failure::{Failure, in_use_text};
use crate::linear::course::ROUNDING;
use crate::linear::measure::{MeasureOptions, Measured, series_of};
use crate::linear::memory::Untried;
use crate::linear::on_trial::NewIsWorse;
use crate::linear::record::{CombinedRecord, PlaceRecord};
use crate::linear::run_plan::{PlannedRun, of_verification, plan_of, speed_of};
use crate::linear::stage::LinearStage;
use crate::linear::{CriterionEntry, LinearEntry, LinearLog};
use crate::run::{missing, note_failure, settle};
use crate::store::{Store, short};
use crate::worse::likely_cause;
use machine::{Stage, ask_disk};

/// Between instrument and encoder; a stage as found may be this wrong over its whole travel.
const SCALE_LIMIT_PPM: f64 = 1000.0;

/// A of one and the same axis differs by less from one verification to the next, when nothing is wrong.
const CLEARLY: f64 = 1.25;

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
    /// How uncertain the corrected position is at each target; empty for a measurement as found.
    pub uncertainty: Vec<UncertaintyAtTarget>,
}

/// How uncertain the corrected position is at a target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UncertaintyAtTarget {
    /// The target.
    pub target: Metres,
    /// Approached forward; `None` where the calibration says nothing of it.
    pub forward: Option<Combined>,
    /// Likewise in reverse.
    pub reverse: Option<Combined>,
}

impl Verified {
    /// Whether the bidirectional accuracy is within the tolerance.
    pub fn is_within_tolerance(&self) -> bool {
        self.figures.accuracy.bidirectional <= self.tolerance
    }

    /// What a verification of `axis` with its calibration fails by, where it does.
    pub(crate) fn out_of_tolerance(&self, axis: &str) -> Option<Failure> {
        (!self.is_within_tolerance()).then(|| Failure::OutOfTolerance {
            axis: axis.to_owned(),
            seen: self.figures.accuracy.bidirectional,
            limit: self.tolerance,
        })
    }
}

impl LinearStage<'_> {
    /// What a calibration or a verification of the axis would do; `None` for what is not configured, and for
    /// everything that does not measure.
    pub fn planned(&self, of: Stage) -> Option<PlannedRun> {
        Some(plan_of(self.config, of)?.planned(speed_of(self.config)))
    }

    /// Measures the axis at the configuration's verification targets and evaluates ISO 230-2.
    /// Being out of tolerance is a result here, not an error; being out of tolerance and worse
    /// than without the calibration is one, and takes the calibration out of use. So is the first
    /// verification of one that was just made, when that is out of tolerance and clearly worse than the axis was before.
    ///
    /// # Errors
    /// When the axis is not zeroed or anything stops the machine.
    pub fn verify(&mut self, store: &Store, options: &VerifyOptions) -> Result<Verified, Failure> {
        let axis = self.axis;
        let of_axis = self.config;
        // One figure for both runs: the scale is the same.
        let scale_limit_ppm = of_axis
            .calibrate
            .as_ref()
            .map_or(SCALE_LIMIT_PPM, |it| it.scale_limit_ppm);
        let config = of_axis.verify.clone();
        let config = config.ok_or_else(|| missing(self.axis, "verify"))?;
        self.core.require_zeroed(self.axis)?;
        if options.compensated && self.compensation().is_none() {
            return Err(Failure::Usage {
                what: format!("axis {axis} uses no calibration"),
                help: "load or make one, or verify uncompensated".into(),
            });
        }
        let plan = of_verification(&config, scale_limit_ppm);
        if options.compensated {
            self.require_calibrated(&plan.targets)?;
        }
        // Before the header, which says who measures.
        self.core.use_instrument(&plan.instrument)?;
        let header = self.journal_header("verify", &plan, options.calibration.clone());
        let resume = options.resume.as_ref();
        let (mut journal, earlier) = self.open_journal(store, &header, resume)?;
        let tolerance = Metres::from_um(config.accuracy_tolerance_um);
        let uncertainty: Vec<UncertaintyAtTarget> = match options.compensated {
            true => plan.targets.iter().map(|it| self.at_target(*it)).collect(),
            false => Vec::new(),
        };
        journal.write(&LinearEntry::Criterion(criterion(tolerance, &uncertainty)))?;
        let measuring = MeasureOptions {
            stage: Stage::Verify,
            compensated: options.compensated,
        };
        let measured = self
            .measure_runs(&plan, measuring, &mut journal, earlier)
            .inspect_err(|failure| note_failure(&mut journal, failure))?;
        journal.complete()?;
        settle(&mut self.core, store)?;
        let verified = Verified {
            figures: iso230::evaluate(&measured.series()?)?,
            journal: journal.path().to_owned(),
            measured,
            tolerance,
            uncertainty,
        };
        if options.compensated {
            let calibration = options.calibration.as_deref();
            self.judge_benefit(store, &verified, calibration)
                .and_then(|()| self.judge_new(store, &verified, calibration))
                .inspect_err(|failure| note_failure(&mut journal, failure))?;
        }
        Ok(verified)
    }

    /// Beyond what is calibrated a verification would judge what nobody measured, and blame the calibration.
    fn require_calibrated(&self, targets: &[Metres]) -> Result<(), Failure> {
        let Some(table) = self.compensation() else {
            return Ok(());
        };
        let (first, last) = table.table().range();
        // Steps add up to their end but for rounding.
        let reach = first - ROUNDING..=last + ROUNDING;
        let Some(beyond) = targets.iter().find(|it| !reach.contains(it)) else {
            return Ok(());
        };
        Err(Failure::Usage {
            what: format!(
                "axis {} is to be verified at {} mm, and is calibrated from {} to {} mm; nothing was moved",
                self.axis,
                Short(beyond.mm()),
                Short(first.mm()),
                Short(last.mm())
            ),
            help: "verify within that ([axis.….verify]), calibrate as far, or verify without it: --uncompensated".into(),
        })
    }

    fn at_target(&self, target: Metres) -> UncertaintyAtTarget {
        UncertaintyAtTarget {
            target,
            forward: self.uncertainty_at(target, Approach::Forward),
            reverse: self.uncertainty_at(target, Approach::Reverse),
        }
    }

    /// A calibration that is out of tolerance and makes the axis worse than it was found is
    /// taken out of use (fault class 48: sign, axis or index exchanged).
    fn judge_benefit(
        &mut self,
        store: &Store,
        verified: &Verified,
        calibration: Option<&str>,
    ) -> Result<(), Failure> {
        let Some(compensation) = self.compensation() else {
            return Ok(());
        };
        let before = systematic_deviation(compensation.table());
        let after = verified.figures.systematic_deviation.bidirectional;
        // Of a stage that shakes, means of a few runs say nothing of the calibration.
        let shakes = scatters(&verified.figures);
        if verified.is_within_tolerance() || after <= before || shakes {
            return Ok(());
        }
        let cause = likely_cause(&pairs(compensation, &verified.figures));
        let in_use = self.fall_back(store, calibration)?;
        Err(Failure::MadeWorse {
            axis: self.axis.to_owned(),
            calibration: calibration.map_or_else(|| "in use".to_owned(), short),
            before,
            after,
            cause,
            in_use: in_use.as_deref().map(short),
        })
    }

    /// A calibration that was just made stays in use when its first verification is within tolerance, or not clearly
    /// worse than what was before; of one that has proved itself a bad day is no reason to go back.
    fn judge_new(
        &mut self,
        store: &Store,
        verified: &Verified,
        calibration: Option<&str>,
    ) -> Result<(), Failure> {
        let untried = self.memory.untried.take();
        let Some(made) = untried.filter(|it| Some(it.id.as_str()) == calibration) else {
            return Ok(());
        };
        let seen = verified.figures.accuracy.bidirectional;
        if verified.is_within_tolerance() {
            return Ok(());
        }
        let before = self.before(store, &made)?;
        let Some(before) = before.filter(|it| it.accuracy * CLEARLY < seen) else {
            return Ok(());
        };
        let cause = match self.compensation() {
            Some(compensation) if !scatters(&verified.figures) => {
                likely_cause(&pairs(compensation, &verified.figures))
            }
            _ => format!(
                "its runs scatter, R = {:.3} µm, which no calibration takes away: vibration, a loose optic or mount, \
                 a servo that hunts",
                verified.figures.repeatability.bidirectional.um()
            ),
        };
        let in_use = self.fall_back(store, calibration)?;
        Err(Failure::NewIsWorse(Box::new(NewIsWorse {
            axis: self.axis.to_owned(),
            calibration: short(&made.id),
            seen,
            limit: verified.tolerance,
            before: before.accuracy,
            was: before.what,
            cause,
            then: in_use_text(in_use.as_deref().map(short).as_deref()),
        })))
    }

    /// How good the axis would be without `made`: as what would be in use then was last verified, or as found.
    fn before(&mut self, store: &Store, made: &Untried) -> Result<Option<Before>, Failure> {
        let found = made.as_found.map(|accuracy| Before {
            accuracy,
            what: "as found".into(),
        });
        let history = store.active(self.axis)?.history;
        let mut newest_first = history.iter().rev();
        let Some(earlier) = newest_first.find(|id| self.usable(store, id).is_ok()) else {
            return Ok(found);
        };
        let (axis, id) = (self.axis.to_owned(), earlier.clone());
        let recorded = ask_disk(&mut self.core, store, move |store| {
            recorded_accuracy(store, &axis, &id)
        })??;
        let recorded = recorded.map(|accuracy| Before {
            accuracy,
            what: format!(
                "with calibration {} when it was last verified",
                short(earlier)
            ),
        });
        Ok(recorded.or(found))
    }

    /// Goes back to the newest calibration before `calibration` that fits this machine, or to
    /// none.
    fn fall_back(
        &mut self,
        store: &Store,
        calibration: Option<&str>,
    ) -> Result<Option<String>, Failure> {
        self.set_compensation(None);
        // One that is not the active one is only forgotten here.
        if calibration.is_none() || store.active(self.axis)?.current.as_deref() != calibration {
            return Ok(None);
        }
        let mut found = None;
        let in_use = store.retire_to(self.axis, |id| {
            found = self.usable(store, id).ok();
            found.is_some()
        })?;
        if let Some(usable) = found {
            self.use_calibration(usable);
        }
        settle(&mut self.core, store)?;
        Ok(in_use)
    }
}

/// How good an axis was before a calibration.
struct Before {
    /// A, bidirectional.
    accuracy: Metres,
    /// With what, in words.
    what: String,
}

/// A of the newest whole verification of `axis` with the calibration `id`; what cannot be read is passed over.
fn recorded_accuracy(store: &Store, axis: &str, id: &str) -> Result<Option<Metres>, Failure> {
    let part = format!("-verify-{axis}-");
    let mut names = store.journals()?;
    names.retain(|it| it.contains(&part));
    names.sort_unstable();
    let newest_first = names.iter().rev();
    let mut accuracies = newest_first.filter_map(|name| {
        let path = store.runs().join(name);
        let journal = store.read_journal::<LinearLog>(&path).ok()?;
        let header = &journal.header;
        let is_whole = journal.log.closures.len() == header.runs as usize;
        let is_its = header.axis == axis && header.calibration.as_deref() == Some(id);
        let series = (is_its && is_whole).then(|| series_of(&journal.log.points).ok())??;
        Some(iso230::evaluate(&series).ok()?.accuracy.bidirectional)
    });
    Ok(accuracies.next())
}

/// Whether what is left is mostly no deviation of the axis, but differs from run to run.
fn scatters(left: &Figures) -> bool {
    left.repeatability.bidirectional > left.systematic_deviation.bidirectional
}

/// As the journal has it.
fn criterion(tolerance: Metres, uncertainty: &[UncertaintyAtTarget]) -> CriterionEntry {
    let record = |it: &UncertaintyAtTarget| PlaceRecord {
        position_m: it.target.value(),
        forward: it.forward.as_ref().map(CombinedRecord::from),
        reverse: it.reverse.as_ref().map(CombinedRecord::from),
    };
    CriterionEntry {
        tolerance_m: tolerance.value(),
        targets: uncertainty.iter().map(record).collect(),
    }
}

/// Of each target what the calibration says of it, and what is left there.
fn pairs(used: &Compensation, left: &Figures) -> Vec<(f64, f64)> {
    let pairs = left.targets.iter().flat_map(|it| {
        let sides = [
            (Approach::Forward, it.mean_forward),
            (Approach::Reverse, it.mean_reverse),
        ];
        sides.map(|(approach, seen)| {
            let says = used.deviation(it.target, approach).ok()?;
            Some((says.value(), seen.value()))
        })
    });
    pairs.flatten().collect()
}

/// The range of the deviations that a table takes away, both approaches together.
fn systematic_deviation(table: &ErrorTable) -> Metres {
    let deviations = || {
        let nodes = table.nodes().iter();
        nodes
            .flat_map(|node| [node.forward, node.reverse])
            .flatten()
    };
    let largest = deviations().fold(Metres(f64::NEG_INFINITY), Metres::max);
    let smallest = deviations().fold(Metres(f64::INFINITY), Metres::min);
    largest - smallest
}
