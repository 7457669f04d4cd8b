//! Calibrate a platform: each screw alone through its strokes from both sides, seen by the
//! camera; a model for each, stored and activated together (S1, test step S100).

use std::path::PathBuf;

use compensator::platform::Pose;
use compensator::platform::cause::Sighting;
use compensator::screw::Stroke;
use compensator::screw::{
    self, FitOptions, Limits, Rule, ScatterParts, ScrewCompensation, ScrewModel, StrokeOutlier,
    patent,
};
use units::{Approach, Metres};

use crate::correction::Correction;
use crate::failure::Failure;
use crate::platform::config::ScrewMethodName as Method;
use crate::platform::failure::PlatformFailure;
use crate::platform::handle::AlignmentPlatform;
use crate::platform::look::Seen;
use crate::platform::zero::DATUM_LOOKS;
use crate::platform::{LostMotionRule, PlatformCalibrateConfig, ScrewCompensationConfig};
use crate::platform::{PlatformEntry, PlatformLog};
use crate::platform::{ScrewContent, ScrewMethodName, StrokeEntry};
use crate::run::{CalibrateOptions, is_used_by, note_failure, settle, utc_now};
use crate::store::ClosureEntry;
use crate::store::{CalibrationRecord, Journal, RecordHead, Store};
use machine::Stage;

/// A screw that was calibrated.
#[derive(Clone, Debug)]
pub struct ScrewCalibrated {
    /// Its axis.
    pub axis: String,
    /// Its calibration's name.
    pub id: String,
    /// Its model.
    pub model: ScrewModel,
    /// How many strokes were measured.
    pub strokes: usize,
    /// Those of them that do not fit the others and were left out.
    pub outliers: Vec<StrokeOutlier>,
    /// As it is stored.
    pub content: ScrewContent,
}

/// What was measured of a screw.
#[derive(Clone, Debug, Default)]
struct MeasuredScrew {
    strokes: Vec<Stroke>,
    /// Of what was seen of each by what pictures do not repeat, m²; fewer where that is not known.
    variances: Vec<f64>,
}

impl MeasuredScrew {
    /// Standard uncertainty of one of them by what pictures do not repeat.
    fn reading(&self) -> Option<Metres> {
        let known = !self.strokes.is_empty() && self.variances.len() == self.strokes.len();
        let mean = || self.variances.iter().sum::<f64>() / self.variances.len() as f64;
        known.then(|| Metres(mean().sqrt()))
    }

    /// The same of the zero, which is looked at more often.
    fn origin(&self) -> Option<Metres> {
        let looks = f64::from(DATUM_LOOKS);
        self.reading().map(|it| it / looks.sqrt())
    }
}

fn square(length: Metres) -> f64 {
    length.value() * length.value()
}

/// What the strokes of a screw say.
struct FittedScrew {
    model: ScrewModel,
    outliers: Vec<StrokeOutlier>,
    parts: Option<ScatterParts>,
}

/// A platform that was calibrated.
#[derive(Clone, Debug)]
pub struct PlatformCalibrated {
    /// Each screw, in the order of the configuration.
    pub screws: Vec<ScrewCalibrated>,
    /// Where every stroke is.
    pub journal: PathBuf,
    /// How far the largest of the strokes was off at zero after everything.
    pub closure: Metres,
    /// Whether they are used from now on.
    pub is_in_use: bool,
}

impl PlatformCalibrated {
    /// What the store calls each calibration, and its name.
    pub(crate) fn stored(&self) -> Vec<(String, String)> {
        let each = self.screws.iter();
        each.map(|it| (it.axis.clone(), it.id.clone())).collect()
    }
}

impl AlignmentPlatform<'_> {
    /// Measures every screw, fits its model, stores and activates all of them, and uses them
    /// from now on.
    ///
    /// # Errors
    /// Not zeroed, whatever stops the machine, a datum that drifted, strokes that give no
    /// model, or a model beyond the limits. Nothing is activated then.
    pub fn calibrate(&mut self, store: &Store) -> Result<PlatformCalibrated, Failure> {
        self.calibrate_by(store, &CalibrateOptions::default())
    }

    /// The same; with `options.aside` what is found is stored only, and what was used before is used still.
    ///
    /// # Errors
    /// As [`Self::calibrate`].
    pub fn calibrate_by(
        &mut self,
        store: &Store,
        options: &CalibrateOptions,
    ) -> Result<PlatformCalibrated, Failure> {
        self.require_zeroed()?;
        let missing = |section| PlatformFailure::NotConfigured { section };
        let config = self.config;
        let plan = config.calibrate.clone().ok_or(missing("calibrate"))?;
        config
            .compensation
            .as_ref()
            .ok_or(missing("compensation"))?;
        self.check_single_screws(&plan)?;
        let mut journal = self.journal_header(store, "calibrate", plan.runs, None, None)?;
        let mut sightings = Vec::new();
        let done = self
            .measure_screws(&plan, &mut journal, &mut sightings)
            .and_then(|(strokes, closure)| {
                settle(&mut self.core, store)?;
                let screws = self.fit_and_store(store, &journal, &plan, &strokes)?;
                settle(&mut self.core, store)?;
                if !options.aside {
                    self.use_screws(store, &screws)?;
                }
                Ok((screws, closure))
            });
        let (screws, closure) = done
            .map_err(|it| self.explained(it, &sightings))
            .inspect_err(|it| note_failure(&mut journal, it))?;
        journal.complete()?;
        settle(&mut self.core, store)?;
        Ok(PlatformCalibrated {
            screws,
            journal: journal.path().to_owned(),
            closure,
            is_in_use: !options.aside,
        })
    }

    /// One screw moves while the others stand: three bear that, four contradict each other.
    /// Refused before the first of them moves, not in the middle of its run.
    fn check_single_screws(&self, plan: &PlatformCalibrateConfig) -> Result<(), Failure> {
        let count = self.state.screws.len();
        for at in 0..count {
            for (stroke, _) in &round(&self.targets(at, plan), plan) {
                let strokes = alone(at, *stroke, count);
                self.check_agreement(Pose::default(), &strokes, "; nothing was moved")?;
            }
        }
        Ok(())
    }

    /// The strokes that screw number `at` is calibrated at.
    fn targets(&self, at: usize, plan: &PlatformCalibrateConfig) -> Vec<Metres> {
        plan.strokes_of(&self.config.actuator[at]).targets()
    }

    fn measure_screws(
        &mut self,
        plan: &PlatformCalibrateConfig,
        journal: &mut Journal<PlatformLog>,
        sightings: &mut Vec<Sighting>,
    ) -> Result<(Vec<MeasuredScrew>, Metres), Failure> {
        let count = self.state.screws.len();
        let targets: Vec<_> = (0..count).map(|at| self.targets(at, plan)).collect();
        let stops: usize = targets.iter().map(|it| 2 * it.len()).sum();
        let total = stops as u64 * u64::from(plan.runs);
        let mut all = vec![MeasuredScrew::default(); count];
        let mut done = 0;
        self.note_thermometers(journal)?;
        for (at, measured) in all.iter_mut().enumerate() {
            for run in 1..=plan.runs {
                for (stroke, approach) in round(&targets[at], plan) {
                    let commanded = alone(at, stroke, count);
                    self.go_to_strokes(&commanded, Correction::Off)?;
                    let Some(approach) = approach else { continue };
                    let seen = self.camera_sees(self.config.exposures)?;
                    let pose = seen.pose;
                    sightings.push(Sighting {
                        commanded,
                        seen: pose,
                    });
                    let (seen, u) =
                        self.stroke_seen(at, run, (stroke, approach), &seen, journal)?;
                    measured.strokes.push(seen);
                    measured.variances.extend(u.map(square));
                    done += 1;
                    let observer = self.core.observer();
                    observer.progress(Stage::Calibrate, "platform", done, total);
                }
            }
            self.approach_zero()?;
            self.note_thermometers(journal)?;
        }
        let closure = self.closure(plan)?;
        journal.write(&PlatformEntry::Closed(ClosureEntry {
            run: plan.runs,
            start_m: 0.0,
            closure_m: closure.value(),
        }))?;
        Ok((all, closure))
    }

    /// What the pose that was seen says of a stroke, written down.
    fn stroke_seen(
        &self,
        at: usize,
        run: u32,
        (stroke, approach): (Metres, Approach),
        seen: &Seen,
        journal: &mut Journal<PlatformLog>,
    ) -> Result<(Stroke, Option<Metres>), Failure> {
        let datum = self.state.datum.ok_or(PlatformFailure::NotZeroed)?;
        let pose = seen.pose.since(datum);
        let kinematics = &self.state.kinematics;
        let measured = kinematics.strokes(pose)[at];
        let of_all = seen.covariance.as_ref();
        let u = of_all.map(|it| kinematics.u_strokes(pose, it)[at]);
        let axis = self.state.screws[at].axis.clone();
        let entry = StrokeEntry {
            axis,
            run,
            approach: approach.symbol(),
            stroke_m: stroke.value(),
            measured_m: measured.value(),
            measured_u_m: u.map(Metres::value),
            pose: pose.into(),
            at_s: self.core.now().seconds(),
        };
        let seen = entry.stroke();
        journal.write(&PlatformEntry::Stroke(entry))?;
        Ok((seen, u))
    }

    /// The pose zero looked at again: it must still be there.
    fn closure(&mut self, plan: &PlatformCalibrateConfig) -> Result<Metres, Failure> {
        let pose = self.measure_pose()?;
        let strokes = self.state.kinematics.strokes(pose);
        let seen = strokes.into_iter().map(Metres::abs);
        let seen = seen.fold(Metres::ZERO, Metres::max);
        let limit = Metres::from_um(plan.closure_limit_um);
        // A comparison with NaN is false, so that it is refused too.
        let is_closed = seen <= limit;
        if is_closed {
            return Ok(seen);
        }
        Err(Failure::Closure {
            axis: "platform".into(),
            seen,
            limit,
        })
    }

    fn fit_screw(
        &self,
        at: usize,
        plan: &PlatformCalibrateConfig,
        measured: &MeasuredScrew,
    ) -> Result<FittedScrew, Failure> {
        let strokes = &measured.strokes;
        let config = self.config;
        let axis = config.actuator[at].axis.clone();
        let fitted = match plan.method {
            Method::LeastSquares => {
                let options = FitOptions {
                    lead: Some(Metres::from_mm(config.actuator[at].lead_mm)),
                    harmonics_max: plan.harmonics_max,
                    significance: plan.significance,
                    reading: measured.reading(),
                    origin: measured.origin(),
                    ..FitOptions::default()
                };
                let fitted = screw::fit(strokes, &options);
                let fitted = fitted.map_err(|source| PlatformFailure::Fit { axis, source })?;
                FittedScrew {
                    model: fitted.model,
                    outliers: fitted.outliers,
                    parts: fitted.parts,
                }
            }
            Method::Patent => {
                // The mean over strokes reached in reverse, from a zero set forward, is what the
                // patent takes for the lost motion.
                let reverse = |it: &&Stroke| it.approach == Approach::Reverse;
                let strokes: Vec<_> = strokes.iter().filter(reverse).copied().collect();
                let estimate = patent::estimate(&strokes);
                let estimate = estimate.map_err(|source| PlatformFailure::Fit { axis, source })?;
                FittedScrew {
                    model: estimate.model(),
                    outliers: Vec::new(),
                    parts: estimate.parts(),
                }
            }
        };
        self.prepare_screw(at, fitted.model.clone())?;
        Ok(fitted)
    }

    /// Proves that a model can be applied within the limits of the configuration.
    pub(super) fn prepare_screw(
        &self,
        at: usize,
        model: ScrewModel,
    ) -> Result<ScrewCompensation, Failure> {
        let config = self.config;
        let axis = &config.actuator[at].axis;
        let section = "compensation";
        let limits = config.compensation.as_ref();
        let limits = limits.ok_or(PlatformFailure::NotConfigured { section })?;
        let resolution = Metres(self.core.config.axis[axis].motion.resolution_nm.abs() * 1e-9);
        ScrewCompensation::new(model, limits_of(limits, resolution), rule_of(limits)).map_err(
            |source| {
                let axis = axis.clone();
                PlatformFailure::Compensation { axis, source }.into()
            },
        )
    }

    fn fit_and_store(
        &mut self,
        store: &Store,
        journal: &Journal<PlatformLog>,
        plan: &PlatformCalibrateConfig,
        measured: &[MeasuredScrew],
    ) -> Result<Vec<ScrewCalibrated>, Failure> {
        let mut fitted = Vec::new();
        for (at, measured) in measured.iter().enumerate() {
            fitted.push(self.fit_screw(at, plan, measured)?);
        }
        self.store_screws(store, journal, plan, measured, &fitted)
    }

    fn store_screws(
        &mut self,
        store: &Store,
        journal: &Journal<PlatformLog>,
        plan: &PlatformCalibrateConfig,
        measured: &[MeasuredScrew],
        fitted: &[FittedScrew],
    ) -> Result<Vec<ScrewCalibrated>, Failure> {
        let method = match plan.method {
            Method::LeastSquares => ScrewMethodName::LeastSquares,
            Method::Patent => ScrewMethodName::Patent,
        };
        let source = journal.path().file_name().unwrap_or_default();
        let mut calibrated = Vec::new();
        for (at, fitted) in fitted.iter().enumerate() {
            let FittedScrew {
                model,
                outliers,
                parts,
            } = fitted;
            let axis = self.state.screws[at].axis.clone();
            let head = RecordHead {
                created: utc_now(),
                source: source.to_string_lossy().into_owned(),
                instrument: self.camera_record()?,
                ..self.core.this_machine(&axis)
            };
            let rows = u32::try_from(measured[at].strokes.len()).unwrap_or(u32::MAX);
            let content = ScrewContent::new(model, method, rows).without(outliers);
            let content = content.with_budget(parts.as_ref(), &measured[at].strokes);
            let content = content.map_err(|source| Failure::Budget {
                axis: axis.clone(),
                source,
            })?;
            let id = store.save(&CalibrationRecord {
                head,
                content: content.clone(),
            })?;
            calibrated.push(ScrewCalibrated {
                axis,
                id,
                model: model.clone(),
                strokes: measured[at].strokes.len(),
                outliers: outliers.clone(),
                content,
            });
        }
        Ok(calibrated)
    }

    /// Only when all of them are on the disk.
    fn use_screws(&mut self, store: &Store, calibrated: &[ScrewCalibrated]) -> Result<(), Failure> {
        let mut stored = Ok(());
        for screw in calibrated {
            let used = store.activate(&screw.axis, &screw.id);
            let used = used.map_err(Failure::from);
            let used = used.and_then(|()| settle(&mut self.core, store));
            if !is_used_by(&used) {
                return used;
            }
            stored = stored.and(used);
        }
        for (at, screw) in calibrated.iter().enumerate() {
            let compensation = self.prepare_screw(at, screw.model.clone())?;
            let state = &mut self.state.screws[at];
            state.compensation = Some(compensation);
            state.calibration = Some(screw.id.clone());
        }
        stored
    }
}

/// One of `count` screws at `stroke`, the others at zero.
fn alone(at: usize, stroke: Metres, count: usize) -> Vec<Metres> {
    let mut strokes = vec![Metres::ZERO; count];
    strokes[at] = stroke;
    strokes
}

/// The stops of one run: below the first target, up through all, beyond the last, and back.
fn round(targets: &[Metres], plan: &PlatformCalibrateConfig) -> Vec<(Metres, Option<Approach>)> {
    let overrun = Metres::from_mm(plan.overrun_mm);
    let (first, last) = (targets[0], targets[targets.len() - 1]);
    let up = targets.iter().map(|it| (*it, Some(Approach::Forward)));
    let down = targets
        .iter()
        .rev()
        .map(|it| (*it, Some(Approach::Reverse)));
    core::iter::once((first - overrun, None))
        .chain(up)
        .chain(core::iter::once((last + overrun, None)))
        .chain(down)
        .collect()
}

fn limits_of(config: &ScrewCompensationConfig, resolution: Metres) -> Limits {
    Limits {
        size: Metres::from_um(config.size_limit_um),
        slope: config.slope_limit,
        extrapolation: Metres::from_mm(config.extrapolation_mm),
        resolution: resolution / 2.0,
    }
}

const fn rule_of(config: &ScrewCompensationConfig) -> Rule {
    match config.rule {
        LostMotionRule::Engagement => Rule::Engagement,
        LostMotionRule::Patent => Rule::Patent,
    }
}
