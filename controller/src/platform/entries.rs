//! What a journal says of a platform.

use compensator::platform::Pose;
use compensator::screw::Stroke;
use serde::{Deserialize, Serialize};
use units::{Approach, Metres, Radians};

/// A pose, metres and radians.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PoseRecord {
    pub x_m: f64,
    pub y_m: f64,
    pub angle_rad: f64,
}

impl From<Pose> for PoseRecord {
    fn from(pose: Pose) -> Self {
        Self {
            x_m: pose.x.value(),
            y_m: pose.y.value(),
            angle_rad: pose.angle.value(),
        }
    }
}

impl From<PoseRecord> for Pose {
    fn from(record: PoseRecord) -> Self {
        Self {
            x: Metres(record.x_m),
            y: Metres(record.y_m),
            angle: Radians(record.angle_rad),
        }
    }
}

/// What the numbers of a platform's run stand for; written right behind the header.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ArrangementEntry {
    /// The screws' axes, in the order in which set-points are given.
    pub axes: Vec<String>,
    /// Where errors of the angle count as lengths, metres.
    pub edge_m: f64,
    /// How far from its target a pose may be, metres, where that is judged.
    pub tolerance_m: Option<f64>,
    /// What the configuration says of the camera, where its pictures are the measure; `None` in files of earlier programs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera_u: Option<PoseRecord>,
}

/// A stroke of one screw, seen by the camera.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StrokeEntry {
    /// Which axis.
    pub axis: String,
    /// Which run, from 1.
    pub run: u32,
    /// `+` or `-`.
    pub approach: char,
    /// Where the screw was commanded to, metres.
    pub stroke_m: f64,
    /// Where the camera's pose says that it pushed the platform, metres.
    pub measured_m: f64,
    /// Standard uncertainty of that by what pictures do not repeat, metres; `None` of a single one, and in files of earlier
    /// programs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub measured_u_m: Option<f64>,
    /// That pose, seen from the pose zero.
    pub pose: PoseRecord,
    /// Monotonic time of the machine, seconds.
    pub at_s: f64,
}

impl StrokeEntry {
    /// As a model is fitted to it.
    pub(crate) fn stroke(&self) -> Stroke {
        let side = match self.approach {
            '-' => Approach::Reverse,
            _ => Approach::Forward,
        };
        Stroke {
            approach: side,
            stroke: Metres(self.stroke_m),
            deviation: Metres(self.measured_m - self.stroke_m),
        }
    }
}

/// A pose that was looked at.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PoseEntry {
    /// Where the platform was told to be; `None` where only its place was asked for.
    pub target: Option<PoseRecord>,
    /// What each screw was commanded, in the order of the configuration, metres.
    pub set_points_m: Vec<f64>,
    /// Where the camera saw it.
    pub seen: PoseRecord,
    /// Standard uncertainty of each part of that, by the camera itself and by what its pictures do not repeat, those of the
    /// zero among them; `None` where a single picture does not tell it, and in files of earlier programs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub seen_u: Option<PoseRecord>,
    /// From the start of the first screw to that of the last, seconds.
    pub skew_s: Option<f64>,
    /// Monotonic time of the machine, seconds.
    pub at_s: f64,
}

impl PoseEntry {
    /// A look without a move.
    pub fn looked(seen: Pose, at_s: f64) -> Self {
        Self {
            target: None,
            set_points_m: Vec::new(),
            seen: seen.into(),
            seen_u: None,
            skew_s: None,
            at_s,
        }
    }
}
