//! A move of a platform as it is asked for: from where the camera sees it, by the calibrations in use or without them,
//! and seen at its end.

use compensator::platform::{Platform, Pose};
use machine::records::Store;
use units::{AxisSpeed, Metres, MetresPerSecond};

use crate::correction::Correction;
use crate::failure::Failure;
use crate::platform::PlatformConfig;
use crate::platform::handle::AlignmentPlatform;
use crate::platform::jog::{PoseJog, Reach, margin, standing};
use crate::platform::look::SeenPose;
use crate::platform::moves::{PoseMoved, check_pose_of};
use crate::platform::pace::screw_speed;
use crate::platform::target::{NamedPose, places};
use crate::platform::verify::{Aligned, alignment};
use crate::runs::{GroupMove, Judging, Place};

/// A move that is asked for.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PoseAsked {
    pub(crate) named: NamedPose,
    /// Go on until the image agrees.
    pub(crate) align: bool,
    /// By the screws' calibrations, which all of them need.
    pub(crate) compensated: bool,
}

impl PoseAsked {
    pub(super) fn of(asked: &GroupMove) -> Self {
        Self {
            named: NamedPose::of(asked),
            align: asked.align,
            compensated: !asked.agreed.uncompensated,
        }
    }
}

/// A move that was made, and looked at.
#[derive(Clone, Debug)]
pub struct PlatformMoved {
    /// Where it was told to be.
    pub target: Pose,
    /// The parts of that which nobody named.
    pub unnamed: Vec<&'static str>,
    /// The calibration of each screw; nothing when the screws went by their encoders alone.
    pub calibrations: Vec<(String, Option<String>)>,
    /// How it went there, without alignment.
    pub moved: Option<PoseMoved>,
    /// How it was aligned, where that was asked for.
    pub aligned: Option<Aligned>,
    /// Where the camera sees it.
    pub seen: Pose,
    /// The standard uncertainty of each part of that; `None` where the pictures do not tell it.
    pub uncertainty: Option<Pose>,
}

/// What can be told of a move before any device is asked.
#[derive(Clone, Debug)]
pub(super) struct PlatformCourse {
    config: PlatformConfig,
    kinematics: Platform,
    /// So far short of the ends of its reach a jog stays.
    margin: Metres,
    /// As fast as a screw may go.
    speed: MetresPerSecond,
    /// The screws that have no calibration.
    without: Vec<String>,
}

impl Judging for PlatformCourse {
    fn judge(&self, _: &machine::Machine, asked: &GroupMove) -> Result<(), Failure> {
        match asked.jog {
            // It goes as far as it can.
            Some(_) => Ok(()),
            None => self.check(&PoseAsked::of(asked)),
        }
    }

    fn end_of_jog(
        &self,
        machine: &machine::Machine,
        part: &str,
        speed: AxisSpeed,
    ) -> Result<Option<Place>, Failure> {
        let jog = PoseJog::new(part, speed)?;
        let reach = Reach {
            config: &self.config,
            kinematics: &self.kinematics,
            margin: self.margin,
            speed: self.speed,
        };
        let from = standing(&self.kinematics, machine)?;
        Ok(Some(jog.place(reach.end_of(jog, from))))
    }

    fn standing(&self, machine: &machine::Machine) -> Result<Vec<(String, Place)>, Failure> {
        let pose = standing(&self.kinematics, machine)?;
        Ok(places(pose)
            .map(|(name, place)| (name.to_owned(), place))
            .to_vec())
    }
}

impl PlatformCourse {
    /// Where it stands, what is not named is judged before it moves.
    pub(super) fn check(&self, asked: &PoseAsked) -> Result<(), Failure> {
        let target = asked.named.from(Pose::default());
        check_pose_of((&self.config, &self.kinematics), target)?;
        if asked.align {
            alignment(&self.config)?;
        }
        match asked.compensated && !self.without.is_empty() {
            false => Ok(()),
            true => Err(uncalibrated(&self.without)),
        }
    }
}

fn uncalibrated(without: &[String]) -> Failure {
    Failure::NotCalibrated {
        what: format!(
            "the platform has screws without a calibration ({})",
            without.join(", ")
        ),
    }
}

impl AlignmentPlatform<'_> {
    /// What judges its moves; `without` are the screws without a calibration.
    pub(super) fn course(&self, without: Vec<String>) -> PlatformCourse {
        PlatformCourse {
            config: self.config.clone(),
            kinematics: self.state.kinematics.clone(),
            margin: margin(self.config, self.core.config),
            speed: screw_speed(self.config, self.core.config),
            without,
        }
    }

    /// Whether `asked` can be made, as far as that can be told before anything is sent.
    ///
    /// # Errors
    /// Why not.
    pub(crate) fn check_asked(&self, store: &Store, asked: &PoseAsked) -> Result<(), Failure> {
        let without = match asked.compensated {
            true => self.without_calibration(store)?,
            false => Vec::new(),
        };
        self.course(without).check(asked)
    }

    /// Whether every screw has a calibration.
    ///
    /// # Errors
    /// When one has none.
    #[cfg(feature = "program")]
    pub(crate) fn require_calibrations(&self, store: &Store) -> Result<(), Failure> {
        match self.without_calibration(store)?.as_slice() {
            [] => Ok(()),
            without => Err(uncalibrated(without)),
        }
    }

    /// Where the camera sees it, when not all of `asked` is named.
    ///
    /// # Errors
    /// The camera sees nothing it can judge.
    pub(crate) fn look_for(&mut self, asked: &PoseAsked) -> Result<Option<Pose>, Failure> {
        match asked.named.unnamed().is_empty() {
            true => Ok(None),
            false => self.look().map(Some),
        }
    }

    /// Moves as `asked` says; `before` is where the camera saw what nobody named.
    ///
    /// # Errors
    /// Those of [`Self::move_to`] and [`Self::align`]; the camera sees nothing it can judge.
    pub(crate) fn move_asked(
        &mut self,
        store: &Store,
        asked: &PoseAsked,
        before: Option<Pose>,
    ) -> Result<PlatformMoved, Failure> {
        let here = before.map(|seen| self.since_zero(seen)).transpose()?;
        let target = asked.named.from(here.unwrap_or_default());
        let (calibrations, correction) = match asked.compensated {
            true => (self.load_active(store)?, Correction::On),
            false => (Vec::new(), Correction::Off),
        };
        let (moved, aligned) = match asked.align {
            true => (None, Some(self.align_by(target, correction)?)),
            false => (Some(self.move_by(target, correction)?), None),
        };
        let SeenPose { pose, uncertainty } = self.look_closely()?;
        Ok(PlatformMoved {
            target,
            unnamed: asked.named.unnamed(),
            calibrations,
            moved,
            aligned,
            seen: self.since_zero(pose)?,
            uncertainty,
        })
    }
}
