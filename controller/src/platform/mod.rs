//! The cycle of an alignment platform (system S1): its pose is made of the strokes of three or
//! four screws, and seen by a camera.
//!
//! deviation of a screw = stroke by the camera − stroke commanded, where the camera's pose is
//! turned into strokes by the exact kinematics, counted from the pose in which all screws stand
//! at their zero, reached forward.

mod agreement;
mod benefit;
pub(crate) mod calibrate;
mod causes;
pub(crate) mod check;
pub(crate) mod config;
mod dependence;
mod entries;
mod explanation;
mod failure;
#[cfg(test)]
mod golden;
mod handle;
mod header;
mod in_use;
mod jog;
mod kind;
mod log;
mod look;
mod mistaken;
mod motion;
pub(crate) mod moves;
mod pace;
pub(crate) mod record;
mod runs;
mod sound;
pub(crate) mod state;
mod take_up;
mod target;
mod together;
mod told;
pub(crate) mod verify;
mod warnings;
pub(crate) mod zero;

// What users write; `tests/tidy/public_names.txt` lists it.
pub use compensator::platform::Pose;
pub use failure::PlatformFailure;
pub use handle::AlignmentPlatform;
pub use log::PlatformLog;
pub use record::ScrewContent;
pub use told::PlatformTeller;

// What the rest of this package uses.
pub(crate) use config::{
    AlignConfig, LostMotionRule, PlatformCalibrateConfig, PlatformConfig, ScrewCompensationConfig,
};
pub(crate) use entries::{ArrangementEntry, PoseEntry, PoseRecord, StrokeEntry};
#[cfg(feature = "program")]
pub(crate) use jog::PoseJog;
pub(crate) use kind::KIND;
pub(crate) use log::PlatformEntry;
#[cfg(feature = "program")]
pub(crate) use motion::{PlatformMoved, PoseAsked};
#[cfg(feature = "program")]
pub(crate) use moves::PoseMoved;
pub(crate) use record::ScrewMethodName;
pub(crate) use runs::RUNS;
pub(crate) use state::kinematics;
#[cfg(feature = "program")]
pub(crate) use target::NamedPose;
