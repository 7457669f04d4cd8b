//! Verify a platform: from pose to pose over its work range, each looked at; and alignment, where
//! the image leads and the moves follow.

use std::path::PathBuf;

use compensator::platform::Pose;
use units::portable::powi;
use units::{Metres, Radians};

use crate::correction::Correction;
use crate::failure::Failure;
use crate::platform::PoseEntry;
use crate::platform::failure::PlatformFailure;
use crate::platform::handle::AlignmentPlatform;
use crate::platform::look::SeenPose;
use crate::platform::state::{difference, largest_error};
use crate::platform::{AlignConfig, PlatformConfig};
use crate::platform::{PlatformEntry, PlatformLog};
use crate::run::{note_failure, settle};
use crate::store::{Journal, Store};
use machine::Stage;

/// One pose that was verified.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseChecked {
    /// Where the platform was told to be.
    pub target: Pose,
    /// Where the camera saw it, open loop.
    pub seen: Pose,
    /// The largest of the errors in x, y, and of the angle at the edge.
    pub error: Metres,
    /// From the start of the first screw to that of the last, seconds.
    pub skew_s: Option<f64>,
    /// The error that the screws' calibrations took away, as far as they know it.
    pub(crate) known: Option<Pose>,
    /// The standard uncertainty of each part of what was seen; `None` where a single picture does not tell it.
    pub(crate) uncertainty: Option<Pose>,
}

impl PoseChecked {
    /// What `seen` at `target` comes to with errors of the angle counted at `edge`.
    pub(crate) fn new(target: Pose, seen: Pose, edge: Metres, skew_s: Option<f64>) -> Self {
        Self {
            target,
            seen,
            error: largest_error(difference(seen, target), edge),
            skew_s,
            known: None,
            uncertainty: None,
        }
    }
}

/// What all poses of a verification come to.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct PoseFigures {
    pub(crate) largest: Metres,
    pub(crate) rms: Metres,
    pub(crate) skew_max_s: Option<f64>,
}

impl PoseFigures {
    /// Of poses that were seen.
    pub(crate) fn of(poses: &[PoseChecked]) -> Self {
        let squares: f64 = poses.iter().map(|it| powi(it.error.value(), 2)).sum();
        let errors = poses.iter().map(|it| it.error);
        Self {
            largest: errors.fold(Metres::ZERO, Metres::max),
            rms: Metres((squares / poses.len().max(1) as f64).sqrt()),
            skew_max_s: poses.iter().filter_map(|it| it.skew_s).reduce(f64::max),
        }
    }
}

/// A verification of a platform.
#[derive(Clone, Debug, PartialEq)]
pub struct PlatformVerified {
    /// Each pose, in the order visited.
    pub poses: Vec<PoseChecked>,
    /// The largest error.
    pub largest: Metres,
    /// Root mean square of the errors.
    pub rms: Metres,
    /// The largest skew of a start, seconds.
    pub skew_max_s: Option<f64>,
    /// The tolerance of the configuration.
    pub tolerance: Metres,
    /// Where every pose is.
    pub journal: PathBuf,
}

impl PlatformVerified {
    /// Whether every pose was within the tolerance.
    pub fn is_within_tolerance(&self) -> bool {
        self.largest <= self.tolerance
    }

    /// What a verification with calibrations fails by, where it does.
    pub(crate) fn out_of_tolerance(&self) -> Option<Failure> {
        let (seen, limit) = (self.largest, self.tolerance);
        let failure = PlatformFailure::OutOfTolerance { seen, limit };
        (!self.is_within_tolerance()).then(|| failure.into())
    }
}

/// How an alignment went.
#[derive(Clone, Debug, PartialEq)]
pub struct Aligned {
    /// The error of the first, open-loop move.
    pub open_loop: Metres,
    /// The error that is left.
    pub left: Metres,
    /// How many moves were made, the first included.
    pub moves: u32,
}

impl AlignmentPlatform<'_> {
    /// Visits the configuration's verification poses, moving open loop, and looks at each.
    /// Being out of tolerance is a result here, not an error; being out of tolerance and worse
    /// than without the calibrations is one, and takes them out of use.
    ///
    /// # Errors
    /// Not zeroed, `compensated` without a calibration, and whatever stops the machine.
    pub fn verify(
        &mut self,
        store: &Store,
        compensated: bool,
    ) -> Result<PlatformVerified, Failure> {
        self.require_zeroed()?;
        let section = "verify";
        let config = self.config;
        let plan = config.verify.clone();
        let plan = plan.ok_or(PlatformFailure::NotConfigured { section })?;
        if compensated {
            self.require_calibrated_screws()?;
        }
        let targets = self.verification_poses(plan.poses, plan.seed)?;
        let calibrations = if compensated {
            self.calibrations_in_use()?
        } else {
            None
        };
        let tolerance = Metres::from_um(plan.tolerance_um);
        let mut journal = self.journal_header(store, "verify", 1, calibrations, Some(tolerance))?;
        let checked = self
            .check_poses(&targets, compensated, &mut journal)
            .inspect_err(|failure| note_failure(&mut journal, failure))?;
        settle(&mut self.core, store)?;
        let PoseFigures {
            largest,
            rms,
            skew_max_s,
        } = PoseFigures::of(&checked);
        let verified = PlatformVerified {
            largest,
            rms,
            skew_max_s,
            tolerance,
            journal: journal.path().to_owned(),
            poses: checked,
        };
        if compensated {
            self.judge_benefit(store, &verified)?;
        }
        Ok(verified)
    }

    fn check_poses(
        &mut self,
        targets: &[Pose],
        compensated: bool,
        journal: &mut Journal<PlatformLog>,
    ) -> Result<Vec<PoseChecked>, Failure> {
        let edge = Metres::from_mm(self.config.edge_mm);
        let mut checked = Vec::new();
        self.note_thermometers(journal)?;
        for (done, target) in (1..).zip(targets) {
            let moved = if compensated {
                self.move_to(*target)?
            } else {
                self.go_to_pose(*target, Correction::Off)?
            };
            let SeenPose { pose, uncertainty } = self.look_closely()?;
            let seen = self.since_zero(pose)?;
            let skew_s = moved.skew.map(|it| it.as_secs_f64());
            journal.write(&PlatformEntry::Pose(PoseEntry {
                target: Some((*target).into()),
                set_points_m: moved.set_points.iter().map(|(_, at)| at.value()).collect(),
                seen: seen.into(),
                seen_u: uncertainty.map(Into::into),
                skew_s,
                at_s: self.core.now().seconds(),
            }))?;
            let known = compensated
                .then(|| self.known_error(*target, &moved))
                .flatten();
            checked.push(PoseChecked {
                known,
                uncertainty,
                ..PoseChecked::new(*target, seen, edge, skew_s)
            });
            let total = targets.len() as u64;
            self.core
                .observer()
                .progress(Stage::Verify, "platform", done, total);
        }
        self.note_thermometers(journal)?;
        journal.complete()?;
        Ok(checked)
    }

    /// Moves to `target`, then on until the image agrees with it.
    ///
    /// # Errors
    /// As [`Self::move_to`], and when it does not agree after the moves allowed.
    pub fn align(&mut self, target: Pose) -> Result<Aligned, Failure> {
        self.align_by(target, Correction::On)
    }

    /// The same with the screws' calibrations or without them.
    pub(super) fn align_by(
        &mut self,
        target: Pose,
        correction: Correction,
    ) -> Result<Aligned, Failure> {
        let align = alignment(self.config)?.clone();
        let edge = Metres::from_mm(self.config.edge_mm);
        let limit = Metres::from_um(align.tolerance_um);
        let mut told = target;
        let mut open_loop = None;
        let mut left = Metres::ZERO;
        for moves in 1..=align.iterations_max {
            self.move_by(told, correction)?;
            let error = difference(self.measure_pose()?, target);
            left = largest_error(error, edge);
            let open_loop = *open_loop.get_or_insert(left);
            if left <= limit {
                return Ok(Aligned {
                    open_loop,
                    left,
                    moves,
                });
            }
            told = difference(told, error);
        }
        Err(PlatformFailure::NotAligned {
            moves: align.iterations_max,
            seen: left,
            limit,
        }
        .into())
    }

    fn require_calibrated_screws(&self) -> Result<(), Failure> {
        let screws = &self.state.screws;
        match screws.iter().find(|it| it.compensation.is_none()) {
            None => Ok(()),
            Some(screw) => Err(Failure::Usage {
                what: format!("axis {} uses no calibration", screw.axis),
                help: "load or make one, or verify uncompensated".into(),
            }),
        }
    }

    /// Poses all over the work range, those out of reach left out; the same for the same seed.
    ///
    /// # Errors
    /// When there is no platform, or hardly a pose of its work range is within reach.
    pub fn verification_poses(&self, count: u32, seed: u64) -> Result<Vec<Pose>, Failure> {
        let config = self.config;
        let kinematics = &self.state.kinematics;
        let ranges = [
            config.x_max_mm * 1e-3,
            config.y_max_mm * 1e-3,
            config.theta_max_deg.to_radians(),
        ];
        let mut poses: Vec<Pose> = Vec::new();
        let mut from = Pose::default();
        for index in 0..u64::from(count) * TRIES {
            if poses.len() == count as usize {
                break;
            }
            let [x, y, angle] = [0, 1, 2].map(|at| ranges[at] * spread(seed, index, at));
            let pose = Pose {
                x: Metres(x),
                y: Metres(y),
                angle: Radians(angle),
            };
            let reached = kinematics.check(pose).is_ok();
            if reached && kinematics.check_path(from, pose).is_ok() {
                poses.push(pose);
                from = pose;
            }
        }
        if poses.len() == count as usize {
            return Ok(poses);
        }
        Err(Failure::Usage {
            what: "the screws cannot reach most of the work range".into(),
            help: "lower x_max_mm, y_max_mm or theta_max_deg of [platform]".into(),
        })
    }
}

/// Poses drawn for each one wanted.
const TRIES: u64 = 20;

/// A number in -1 to 1, evenly spread over the index: the additive recurrence of M. Roberts'
/// R3 sequence, whose steps are powers of the inverse plastic number of three dimensions.
fn spread(seed: u64, index: u64, dimension: usize) -> f64 {
    const STEPS: [f64; 3] = [
        0.819_172_513_396_164_4,
        0.671_043_606_703_789_2,
        0.549_700_477_901_970_4,
    ];
    let begin = (seed as f64 * 0.618_033_988_749_894_9).fract();
    let place = (begin + STEPS[dimension] * (index + 1) as f64).fract();
    2.0 * place - 1.0
}

/// How a platform is moved until the image agrees.
pub(super) fn alignment(config: &PlatformConfig) -> Result<&AlignConfig, PlatformFailure> {
    let section = "align";
    let align = config.align.as_ref();
    align.ok_or(PlatformFailure::NotConfigured { section })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn poses_are_spread_over_the_whole_range_and_differ_from_seed_to_seed() {
        for dimension in 0..3 {
            let places: Vec<f64> = (0..64).map(|at| spread(7, at, dimension)).collect();
            let in_band = |low: f64| {
                places
                    .iter()
                    .filter(move |it| (low..low + 0.5).contains(*it))
            };
            for low in [-1.0, -0.5, 0.0, 0.5] {
                let count = in_band(low).count();
                assert!((12..=20).contains(&count), "{count} from {low}");
            }
        }
        assert_ne!(spread(1, 0, 0), spread(2, 0, 0));
    }
}
