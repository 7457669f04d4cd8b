//! What is asked of the service.

use std::collections::BTreeMap;

use machine::Stage;
use serde::{Deserialize, Serialize};
use truestage::rotary::Way;
use truestage::runs::Group;
use truestage::volumetric::MemoryName;
use units::Approach;
use utoipa::ToSchema;

mod given;
mod rows;
mod targets;
mod whole;

pub use given::GivenFile;
pub use rows::{PathRows, PathTable};

use crate::coordinate::Coordinate;
use crate::quantity::{Speed, SpeedIn, TravelSpeedIn};

/// Who asks, and by which right.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Caller {
    /// A name for people: events and ends of motions say it.
    pub name: String,
    /// What the holder of the lease was given.
    pub lease: Option<String>,
}

impl Caller {
    /// Somebody without a lease.
    pub fn named(name: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            lease: None,
        }
    }
}

/// Where each axis goes.
pub type Target = BTreeMap<String, Coordinate>;

/// A motion that is asked for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct MoveRequest {
    /// Where each axis goes, in machine coordinates. The axes begin in one tick and end each in its own time; those
    /// of a platform (x, y, theta) and of three axes that are corrected together move as one.
    #[serde(deserialize_with = "targets::read")]
    #[schema(schema_with = crate::quantity::targets)]
    pub targets: Target,
    /// How fast each may be at most; no faster than its configuration says, which holds when left out. An angular speed
    /// where they turn. Of axes that move as one: how fast the tool goes or the platform is shifted; an angular speed says
    /// how fast the platform turns.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Option<TravelSpeedIn>)]
    pub speed: Option<Speed>,
    /// Which way round an axis goes that turns; the shortest when left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub way: Option<WayName>,
    /// From which side an axis arrives that goes along a way, so that its lost motion is taken up in the same way each time:
    /// over `approach_mm` of its configuration or, where that says none, the overrun of its calibrations. As its
    /// configuration has it when left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub approach: Option<ApproachName>,
    /// What happens when one of the axes is in use.
    #[serde(default)]
    pub if_moving: IfMoving,
    /// `true`: the axes go by their encoders alone, also those that are corrected only together. Without it those that
    /// have no calibration are refused.
    // Motions that were written down before it had this name are still read.
    #[serde(default, alias = "uncorrected")]
    pub uncompensated: bool,
    /// `true`: also beyond the calibrated range of an axis, where its deviation was never measured. Without it that is
    /// refused.
    #[serde(default)]
    pub beyond: bool,
    /// `true`: a platform goes on moving until its camera sees it at the target.
    #[serde(default)]
    pub align: bool,
    /// A dead-man: the motion stops unless it is renewed within this time, again and again, in milliseconds.
    #[serde(
        default,
        deserialize_with = "whole::maybe",
        skip_serializing_if = "Option::is_none"
    )]
    #[schema(minimum = 50, maximum = 60000)]
    pub dead_man_ms: Option<u32>,
}

impl MoveRequest {
    /// The motion of one axis, as it is refused, corrected and limited by default.
    pub fn of(axis: &str, target: impl Into<Coordinate>) -> Self {
        Self {
            targets: [(axis.to_owned(), target.into())].into(),
            speed: None,
            way: None,
            approach: None,
            if_moving: IfMoving::default(),
            uncompensated: false,
            beyond: false,
            align: false,
            dead_man_ms: None,
        }
    }
}

/// Which way round an axis goes that turns.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum WayName {
    /// Less than half a turn, whichever way that is.
    Shortest,
    /// With growing angles, less than a turn.
    Forward,
    /// With falling angles, less than a turn.
    Reverse,
    /// As many turns as the angle says, from the zero.
    Turns,
}

/// From which side an axis arrives.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum ApproachName {
    /// With growing positions.
    Forward,
    /// With falling positions.
    Reverse,
}

impl From<ApproachName> for Approach {
    fn from(name: ApproachName) -> Self {
        match name {
            ApproachName::Forward => Self::Forward,
            ApproachName::Reverse => Self::Reverse,
        }
    }
}

impl From<WayName> for Way {
    fn from(name: WayName) -> Self {
        match name {
            WayName::Shortest => Self::Shortest,
            WayName::Forward => Self::Forward,
            WayName::Reverse => Self::Reverse,
            WayName::Turns => Self::Turns,
        }
    }
}

/// One axis runs as long as somebody holds the key.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct JogRequest {
    /// Which axis, or which part of where a platform is: x, y or theta.
    pub axis: String,
    /// How fast, and with its sign which way; 0, in any unit, ends the jog. At most the usual speed of its
    /// configuration. An angular speed (`5deg/s`) of an axis that turns.
    #[schema(value_type = SpeedIn, example = "-2mm/s")]
    pub speed: Speed,
}

/// What happens when an axis of a new motion is in use.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum IfMoving {
    /// The new motion is refused.
    #[default]
    Refuse,
    /// It begins when the axes are free.
    Queue,
    /// The motions of these axes are stopped, and it begins when the axes stand.
    Supersede,
}

/// How everything is stopped.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum StopMode {
    /// Each moving axis slows down and stays enabled.
    #[default]
    Controlled,
    /// Every drive stops as fast as its quick stop deceleration allows, and is switched off.
    Quick,
}

impl StopMode {
    /// As it is written.
    pub(crate) const fn word(self) -> &'static str {
        match self {
            Self::Controlled => "controlled",
            Self::Quick => "quick",
        }
    }
}

/// What is run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum RunKind {
    /// Find the origin.
    Zero,
    /// Measure the deviations, store and activate the calibration.
    Calibrate,
    /// Measure between the calibrated positions, judge.
    Verify,
    /// Take down what the detectors of three axes read: from now on, a displacement is what has changed since.
    Reference,
    /// Keep the state that the detectors of three axes see now as the one in which the machine was built: all later parts
    /// are made with it.
    FirstMemory,
    /// Likewise as the state beyond that one.
    SecondMemory,
    /// Follow a path of three axes, given in `path`.
    Path,
    /// The same as the first of several parts: what the detectors see meanwhile is not corrected but kept, so that all
    /// later parts are made like this one.
    FirstPart,
    /// Do a job of one axis, given in `job`.
    Job,
}

impl RunKind {
    /// All of them.
    pub(crate) const ALL: [Self; 9] = [
        Self::Zero,
        Self::Calibrate,
        Self::Verify,
        Self::Reference,
        Self::FirstMemory,
        Self::SecondMemory,
        Self::Path,
        Self::FirstPart,
        Self::Job,
    ];

    /// Whether `group` has it.
    pub(crate) fn is_offered(self, group: &Group) -> bool {
        match self {
            Self::Path | Self::FirstPart => group.follows_paths(),
            Self::Job => group.does_jobs(),
            Self::Zero
            | Self::Calibrate
            | Self::Verify
            | Self::Reference
            | Self::FirstMemory
            | Self::SecondMemory => group.offered().contains(&self.stage()),
        }
    }

    /// Whether what it goes along is in its request, and in no journal.
    pub(crate) const fn has_rows(self) -> bool {
        match self {
            Self::Path | Self::FirstPart | Self::Job => true,
            Self::Zero
            | Self::Calibrate
            | Self::Verify
            | Self::Reference
            | Self::FirstMemory
            | Self::SecondMemory => false,
        }
    }

    /// As it is written.
    pub(crate) fn word(self) -> String {
        let value = serde_json::to_value(self).unwrap_or_default();
        value.as_str().unwrap_or_default().to_owned()
    }

    /// What it keeps of three axes.
    pub(crate) const fn memory(self) -> Option<MemoryName> {
        match self {
            Self::FirstMemory => Some(MemoryName::First),
            Self::SecondMemory => Some(MemoryName::Second),
            _ => None,
        }
    }

    /// What procedures call it.
    pub(crate) const fn stage(self) -> Stage {
        match self {
            Self::Zero => Stage::Zero,
            Self::Calibrate => Stage::Calibrate,
            Self::Verify => Stage::Verify,
            Self::Reference | Self::FirstMemory | Self::SecondMemory => Stage::Reference,
            Self::Path | Self::FirstPart | Self::Job => Stage::Job,
        }
    }
}

/// A run that is asked for. It is planned, and begins when it is started.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct RunRequest {
    /// What is run.
    pub kind: RunKind,
    /// Which axis, or `platform` or `volume`: those of a platform or of a volume are run together. May be left out when
    /// there is only one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub axis: Option<String>,
    /// Calibrate: save although the same place measured at the beginning and at the end differs too much.
    #[serde(default)]
    pub accept_drift: bool,
    /// Calibrate: store what is found, and use what was used before. Not together with `verify`.
    #[serde(default)]
    pub aside: bool,
    /// Calibrate: verify with it at once; where it makes things worse, what was used before is used again. What failed
    /// of the verification is in `out_of_tolerance`, beside what was stored.
    #[serde(default)]
    pub verify: bool,
    /// Verify: without the calibration, the stage as found. Path: by the encoders alone.
    #[serde(default)]
    pub uncompensated: bool,
    /// Calibrate three axes: they go to and fro for so many minutes, and the lines are read again that show what
    /// warmth changes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(exclusive_minimum = 0, exclusive_maximum = 100000)]
    pub warm_up_min: Option<f64>,
    /// Path: its rows, as a CSV file has them or as a table: a heading `time_s,x_mm,y_mm,z_mm`, and a row for each
    /// moment. A line `# join: linear 50um` above the heading (`join` of a table) joins them by straight lines whose
    /// corners are passed within that length; without it runs a cubic spline, at rest at both ends. At most 600 s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub path: Option<PathRows>,
    /// Path: what joins its rows, `spline` or `linear 50um`, where they do not say it themselves.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(max_length = 100, example = "linear 50um")]
    pub join: Option<String>,
    /// Job: what `truestage run JOB.toml` takes, as a text. At most 2000 points, repetitions counted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(max_length = 1000000)]
    pub job: Option<String>,
    /// Job: also to points beyond the calibrated range of its axis.
    #[serde(default)]
    pub beyond: bool,
    /// Calibrate and verify a table whose plate a person reads: what was read of it elsewhere, the placement that is due
    /// and the next ones, a file each (CSV, the columns as `truestage check` names them). First memory: a shape that was
    /// designed, one file. Nothing moves, no axis is switched on, and none has to be zeroed. A calibration that has not
    /// all placements yet is `done` all the same: it says in `told` what is due, and goes on with `resume`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schema(max_items = 64)]
    pub files: Vec<GivenFile>,
    /// Job: goes on with this journal of the same job, at the point after the last one that it went on from. With
    /// `files`: with this journal of a calibration or verification.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(max_length = 200)]
    pub resume: Option<String>,
    /// Starts it at once.
    #[serde(default)]
    pub start: bool,
}

impl RunRequest {
    /// A run of `axis` that begins at once.
    pub fn of(kind: RunKind, axis: Option<&str>) -> Self {
        Self {
            kind,
            axis: axis.map(str::to_owned),
            accept_drift: false,
            aside: false,
            verify: false,
            uncompensated: false,
            warm_up_min: None,
            path: None,
            join: None,
            job: None,
            beyond: false,
            files: Vec::new(),
            resume: None,
            start: true,
        }
    }
}

/// What a person answers to the question of a run.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct AnswerRequest {
    /// The number of the question: what is asked meanwhile is not answered by it.
    #[serde(deserialize_with = "whole::read")]
    #[schema(minimum = 1, maximum = 1000000)]
    pub question: u32,
    /// One of its words, or what was read.
    #[schema(min_length = 1, max_length = 200)]
    pub answer: String,
}

/// The right to command, asked for or renewed.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct LeaseRequest {
    /// Who: a name for people. What a terminal or a page might obey is left out of it.
    #[schema(min_length = 1, max_length = 64)]
    pub name: String,
    /// For how long, in seconds, 30 when left out. Each order with its token begins them anew, and so does each 5 s of
    /// a wait with it (`wait_s`).
    #[serde(default = "lease_seconds", deserialize_with = "whole::read")]
    #[schema(minimum = 1, maximum = 3600, default = 30)]
    pub seconds: u32,
    /// Takes it from whoever has it, who is told.
    #[serde(default)]
    pub force: bool,
}

const fn lease_seconds() -> u32 {
    30
}
