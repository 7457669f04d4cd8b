//! Journals of a platform: each line by itself, and against those before it.

use machine::records::sound::{
    ANGLE_RAD, ERROR_M, ERROR_U_M, Judged, LENGTH_M, PLACE_M, SECONDS, Unsound, approach, as_many,
    counted, is, number, numbers, once, optional, unsound,
};
use machine::records::{ClosureEntry, JournalHeader, Log, ThermometersEntry};
use serde::{Deserialize, Serialize};

use crate::platform::{ArrangementEntry, PoseEntry, PoseRecord, StrokeEntry};

/// A line of such a journal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "entry", rename_all = "snake_case")]
pub enum PlatformEntry {
    /// What a platform is made of: the second line.
    Arrangement(ArrangementEntry),
    /// A stroke of one screw.
    Stroke(StrokeEntry),
    /// A pose that was looked at.
    Pose(PoseEntry),
    /// A run is whole, and its first pose is still seen where it was.
    Closed(ClosureEntry),
    /// What the machine's thermometers showed.
    Thermometers(ThermometersEntry),
}

/// What such a journal holds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PlatformLog {
    /// What the platform is made of.
    pub arrangement: Option<ArrangementEntry>,
    /// Strokes of its screws.
    pub strokes: Vec<StrokeEntry>,
    /// Its poses.
    pub poses: Vec<PoseEntry>,
    /// How far each whole run had drifted at its end.
    pub closures: Vec<ClosureEntry>,
    /// What the machine's thermometers showed, where it has some.
    pub thermometers: Vec<ThermometersEntry>,
}

impl Log for PlatformLog {
    type Entry = PlatformEntry;

    const OPENED_BY: &'static [&'static str] = &["arrangement"];

    fn judge(&self, header: &JournalHeader, entry: &PlatformEntry) -> Judged {
        match entry {
            PlatformEntry::Arrangement(it) => arrangement(self, it),
            PlatformEntry::Stroke(it) => stroke(self, header, it),
            PlatformEntry::Pose(it) => pose(self, it),
            PlatformEntry::Closed(it) => it.judge(header),
            PlatformEntry::Thermometers(it) => it.judge(),
        }
    }

    fn take(&mut self, entry: PlatformEntry) {
        match entry {
            PlatformEntry::Arrangement(it) => self.arrangement = Some(it),
            PlatformEntry::Stroke(it) => self.strokes.push(it),
            PlatformEntry::Pose(it) => self.poses.push(it),
            PlatformEntry::Closed(it) => self.closures.push(it),
            PlatformEntry::Thermometers(it) => self.thermometers.push(it),
        }
    }

    fn keep_whole(&mut self, _: &JournalHeader) {
        // None is continued.
    }
}

fn arrangement(read: &PlatformLog, it: &ArrangementEntry) -> Judged {
    once("arrangement", read.arrangement.is_none())?;
    counted("axes", it.axes.len(), 1..=100)?;
    for (at, axis) in it.axes.iter().enumerate() {
        let is_new = !it.axes[..at].contains(axis);
        let expected = || "each axis once".to_owned();
        is(format_args!("axes[{at}]"), is_new, expected, || {
            format!("`{}` again", axis.escape_debug())
        })?;
    }
    number("edge_m", it.edge_m, &LENGTH_M)?;
    u_of("camera_u", it.camera_u.as_ref())?;
    optional("tolerance_m", it.tolerance_m, &LENGTH_M)
}

fn pose_of(place: &str, it: &PoseRecord) -> Judged {
    number(format_args!("{place}.x_m"), it.x_m, &PLACE_M)?;
    number(format_args!("{place}.y_m"), it.y_m, &PLACE_M)?;
    number(format_args!("{place}.angle_rad"), it.angle_rad, &ANGLE_RAD)
}

/// Of each part of a pose, where it is said.
fn u_of(place: &str, it: Option<&PoseRecord>) -> Judged {
    let Some(it) = it else {
        return Ok(());
    };
    number(format_args!("{place}.x_m"), it.x_m, &ERROR_U_M)?;
    number(format_args!("{place}.y_m"), it.y_m, &ERROR_U_M)?;
    let angle = it.angle_rad;
    number(format_args!("{place}.angle_rad"), angle, &ANGLE_RAD)?;
    let (expected, seen) = (|| "0 or more".to_owned(), || format!("{angle:e}"));
    is(
        format_args!("{place}.angle_rad"),
        angle >= 0.0,
        expected,
        seen,
    )
}

fn arranged(read: &PlatformLog) -> Result<&ArrangementEntry, Unsound> {
    let missing = || unsound("entry", "an arrangement before it", "none");
    read.arrangement.as_ref().ok_or_else(missing)
}

fn stroke(read: &PlatformLog, header: &JournalHeader, it: &StrokeEntry) -> Judged {
    let axes = &arranged(read)?.axes;
    let expected = || format!("one of {}", axes.join(", "));
    is("axis", axes.contains(&it.axis), expected, || {
        format!("`{}`", it.axis.escape_debug())
    })?;
    header.judge_run(it.run)?;
    approach("approach", it.approach)?;
    number("stroke_m", it.stroke_m, &PLACE_M)?;
    number("measured_m", it.measured_m, &PLACE_M)?;
    number(
        "measured_m − stroke_m",
        it.measured_m - it.stroke_m,
        &ERROR_M,
    )?;
    optional("measured_u_m", it.measured_u_m, &ERROR_U_M)?;
    pose_of("pose", &it.pose)?;
    number("at_s", it.at_s, &SECONDS)
}

fn pose(read: &PlatformLog, it: &PoseEntry) -> Judged {
    let screws = arranged(read)?.axes.len();
    if let Some(target) = &it.target {
        pose_of("target", target)?;
        as_many("set_points_m", it.set_points_m.len(), screws, "the axes")?;
    }
    counted("set_points_m", it.set_points_m.len(), 0..=screws)?;
    numbers("set_points_m", &it.set_points_m, &PLACE_M)?;
    pose_of("seen", &it.seen)?;
    u_of("seen_u", it.seen_u.as_ref())?;
    optional("skew_s", it.skew_s, &SECONDS)?;
    number("at_s", it.at_s, &SECONDS)
}
