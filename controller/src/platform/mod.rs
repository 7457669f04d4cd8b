//! The cycle of an alignment platform (system S1): its pose is made of the strokes of three or
//! four screws, and seen by a camera.
//!
//! deviation of a screw = stroke by the camera − stroke commanded, where the camera's pose is
//! turned into strokes by the exact kinematics, counted from the pose in which all screws stand
//! at their zero, reached forward.

mod agreement;
mod calibrate;
pub(crate) mod check;
pub(crate) mod config;
mod entries;
mod failure;
mod handle;
mod header;
pub mod json;
mod log;
mod look;
mod moves;
mod record;
pub mod report;
mod sound;
mod state;
mod take_up;
mod verify;
mod zero;

pub use calibrate::{PlatformCalibrated, ScrewCalibrated};
pub use compensator::platform::Pose;
pub use config::{
    ActuatorConfig, AlignConfig, LostMotionRule, PlatformCalibrateConfig, PlatformConfig,
    PlatformVerifyConfig, PlatformZeroConfig, ScrewCompensationConfig,
};
pub use entries::{ArrangementEntry, PoseEntry, PoseRecord, StrokeEntry};
pub use failure::{Contradiction, PlatformFailure};
pub use handle::AlignmentPlatform;
pub use log::{PlatformEntry, PlatformLog};
pub use moves::PoseMoved;
pub use record::{HarmonicRecord, ScrewContent, ScrewMethodName, StrokeRecord};
pub use take_up::TakenUp;
pub use verify::{Aligned, PlatformVerified, PoseChecked};
pub use zero::PlatformZeroed;

pub(crate) use state::{PlatformState, difference, kinematics, largest_error};
