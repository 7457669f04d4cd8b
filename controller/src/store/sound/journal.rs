//! Lines of journals: each by itself, and against those before it.

use super::super::journal::{Entry, JournalHeader, ReadJournal};
use super::calibration::environment;
use super::{
    ANGLE_RAD, ANGLE_U_RAD, COUNT_MAX, ERROR_M, ERROR_U_M, Judged, LENGTH_M, PLACE_M, SECONDS,
    SPEED_RAD_PER_S, TURNS_RAD, VOLTS, approach, as_many, counted, is, number, numbers, once,
    optional, optionals, unsound, volume,
};
use crate::linear::{PointEntry, ZeroEntry};
use crate::platform::{ArrangementEntry, PoseEntry, PoseRecord, StrokeEntry};
use crate::rotary::{JudgedEntry, PlacementEntry, PlatePlanEntry, SweepEntry};
use crate::store::ClosureEntry;

/// Passes over a plate, and runs, at most.
const PASSES_MAX: usize = 10_000;

/// The first line.
pub(in crate::store) fn header(it: &JournalHeader) -> Judged {
    counted("runs", it.runs as usize, 0..=PASSES_MAX)?;
    counted("targets_m", it.targets_m.len(), 0..=COUNT_MAX)?;
    numbers("targets_m", &it.targets_m, &PLACE_M)?;
    let u = it.instrument.standard_uncertainty_m;
    number("instrument.standard_uncertainty_m", u, &ERROR_U_M)
}

/// A line that follows those of `read`.
pub(in crate::store) fn entry(read: &ReadJournal, entry: &Entry) -> Judged {
    match entry {
        Entry::Point(it) => point(read, it),
        Entry::Zero(it) => zero(it),
        Entry::Closed(it) => closure(read, it),
        Entry::Arrangement(it) => arrangement(read, it),
        Entry::Stroke(it) => stroke(read, it),
        Entry::Pose(it) => pose(read, it),
        Entry::PlatePlan(it) => plate_plan(read, it),
        Entry::Sweep(it) => sweep(read, it),
        Entry::Placed(it) => placed(read, it),
        Entry::Judged(it) => judged(read, it),
        Entry::Misplaced { offset } => at_offset(plan_of(read)?, *offset),
        Entry::VolumePlan(it) => volume::plan(&read.volume, it),
        Entry::VolumeReferences(it) => volume::references(&read.volume, it),
        Entry::LineReading(it) => volume::reading(&read.volume, it),
        Entry::LineRead(it) => volume::whole(&read.volume, it),
        Entry::VolumeCheck(it) => volume::check(&read.volume, it),
        Entry::Header(_) | Entry::Resumed { .. } | Entry::Failed { .. } | Entry::Complete => Ok(()),
    }
}

fn run(read: &ReadJournal, seen: u32) -> Judged {
    let most = (read.header.runs as usize).max(1);
    counted("run", seen as usize, 1..=most)
}

fn point(read: &ReadJournal, it: &PointEntry) -> Judged {
    run(read, it.run)?;
    approach("approach", it.approach)?;
    let places = [
        ("target_m", it.target_m),
        ("set_point_m", it.set_point_m),
        ("encoder_m", it.encoder_m),
        ("measured_m", it.measured_m),
    ];
    for (key, seen) in places {
        number(key, seen, &PLACE_M)?;
    }
    let targets = &read.header.targets_m;
    let is_target = targets.is_empty() || targets.contains(&it.target_m);
    let expected = || "one of the header's targets_m".to_owned();
    is("target_m", is_target, expected, || {
        format!("{:e}", it.target_m)
    })?;
    number("scatter_m", it.scatter_m, &ERROR_U_M)?;
    number("at_s", it.at_s, &SECONDS)?;
    environment("environment", &it.environment)
}

fn zero(it: &ZeroEntry) -> Judged {
    number("origin_m", it.origin_m, &PLACE_M)?;
    let u = it.standard_uncertainty_m;
    number("standard_uncertainty_m", u, &ERROR_U_M)?;
    number("patent_p0_m", it.patent_p0_m, &PLACE_M)?;
    number("peak_max_v", it.peak_max_v, &VOLTS)?;
    number("mid_v", it.mid_v, &VOLTS)?;
    number("at_s", it.at_s, &SECONDS)
}

fn closure(read: &ReadJournal, it: &ClosureEntry) -> Judged {
    run(read, it.run)?;
    number("start_m", it.start_m, &ERROR_M)?;
    number("closure_m", it.closure_m, &ERROR_M)
}

fn arrangement(read: &ReadJournal, it: &ArrangementEntry) -> Judged {
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
    optional("tolerance_m", it.tolerance_m, &LENGTH_M)
}

fn pose_of(place: &str, it: &PoseRecord) -> Judged {
    number(format_args!("{place}.x_m"), it.x_m, &PLACE_M)?;
    number(format_args!("{place}.y_m"), it.y_m, &PLACE_M)?;
    number(format_args!("{place}.angle_rad"), it.angle_rad, &ANGLE_RAD)
}

fn arranged(read: &ReadJournal) -> Result<&ArrangementEntry, super::Unsound> {
    let missing = || unsound("entry", "an arrangement before it", "none");
    read.arrangement.as_ref().ok_or_else(missing)
}

fn stroke(read: &ReadJournal, it: &StrokeEntry) -> Judged {
    let axes = &arranged(read)?.axes;
    let expected = || format!("one of {}", axes.join(", "));
    is("axis", axes.contains(&it.axis), expected, || {
        format!("`{}`", it.axis.escape_debug())
    })?;
    run(read, it.run)?;
    approach("approach", it.approach)?;
    number("stroke_m", it.stroke_m, &PLACE_M)?;
    number("measured_m", it.measured_m, &PLACE_M)?;
    number(
        "measured_m − stroke_m",
        it.measured_m - it.stroke_m,
        &ERROR_M,
    )?;
    pose_of("pose", &it.pose)?;
    number("at_s", it.at_s, &SECONDS)
}

fn pose(read: &ReadJournal, it: &PoseEntry) -> Judged {
    let screws = arranged(read)?.axes.len();
    if let Some(target) = &it.target {
        pose_of("target", target)?;
        as_many("set_points_m", it.set_points_m.len(), screws, "the axes")?;
    }
    counted("set_points_m", it.set_points_m.len(), 0..=screws)?;
    numbers("set_points_m", &it.set_points_m, &PLACE_M)?;
    pose_of("seen", &it.seen)?;
    optional("skew_s", it.skew_s, &SECONDS)?;
    number("at_s", it.at_s, &SECONDS)
}

fn plate_plan(read: &ReadJournal, it: &PlatePlanEntry) -> Judged {
    once("plate_plan", read.plate_plan.is_none())?;
    let lines = it.lines as usize;
    counted("lines", lines, 2..=COUNT_MAX)?;
    counted("offsets", it.offsets.len(), 1..=lines)?;
    let around = super::limits(0.0, f64::from(it.lines), "lines");
    numbers("offsets", &it.offsets, &around)?;
    for (at, offset) in it.offsets.iter().enumerate() {
        let is_new = !it.offsets[..at].contains(offset);
        let expected = || "each offset once".to_owned();
        let place = format_args!("offsets[{at}]");
        is(place, is_new, expected, || format!("{offset} again"))?;
    }
    counted("passes", it.passes as usize, 1..=PASSES_MAX)?;
    number("speed_rad_per_s", it.speed_rad_per_s, &SPEED_RAD_PER_S)
}

fn plan_of(read: &ReadJournal) -> Result<&PlatePlanEntry, super::Unsound> {
    let missing = || unsound("entry", "a plate_plan before it", "none");
    read.plate_plan.as_ref().ok_or_else(missing)
}

fn at_offset(plan: &PlatePlanEntry, offset: f64) -> Judged {
    let expected = || "one of the plan's offsets".to_owned();
    let known = plan.offsets.contains(&offset);
    is("offset", known, expected, || format!("{offset:e}"))
}

fn sweep(read: &ReadJournal, it: &SweepEntry) -> Judged {
    let plan = plan_of(read)?;
    let lines = plan.lines as usize;
    at_offset(plan, it.offset)?;
    // One beyond the last is the first repeated.
    counted("pass", it.pass as usize, 1..=plan.passes as usize + 1)?;
    approach("approach", it.approach)?;
    number("phase_rad", it.phase_rad, &ANGLE_RAD)?;
    as_many(
        "deviations_rad",
        it.deviations_rad.len(),
        lines,
        "the lines",
    )?;
    optionals("deviations_rad", &it.deviations_rad, &ANGLE_RAD)?;
    let lists = [
        ("missing", &it.missing),
        ("doubled", &it.doubled),
        ("overwritten", &it.overwritten),
    ];
    for (key, list) in lists {
        counted(key, list.len(), 0..=lines)?;
        let beyond = list.iter().find(|it| **it as usize >= lines);
        let expected = || format!("positions below {lines}, the lines");
        let seen = || beyond.map_or(String::new(), u32::to_string);
        is(key, beyond.is_none(), expected, seen)?;
    }
    numbers("strays_rad", &it.strays_rad, &TURNS_RAD)?;
    number("at_s", it.at_s, &SECONDS)
}

fn placed(read: &ReadJournal, it: &PlacementEntry) -> Judged {
    at_offset(plan_of(read)?, it.offset)?;
    let is_read = read.sweeps.iter().any(|own| own.offset == it.offset);
    let expected = || "passes of this placement before it".to_owned();
    is("entry", is_read, expected, || "none".to_owned())?;
    let is_new = read.placements.iter().all(|own| own.offset != it.offset);
    let expected = || "each placement once".to_owned();
    is("offset", is_new, expected, || {
        format!("{} again", it.offset)
    })?;
    number("closure_rad", it.closure_rad, &ANGLE_RAD)?;
    number("at_s", it.at_s, &SECONDS)
}

fn judged(read: &ReadJournal, it: &JudgedEntry) -> Judged {
    once("judged", read.judged.is_none())?;
    let lines = plan_of(read)?.lines as usize;
    as_many("found_rad", it.found_rad.len(), lines, "the lines")?;
    optionals("found_rad", &it.found_rad, &ANGLE_RAD)?;
    if let Some(left) = &it.left_rad {
        as_many("left_rad", left.len(), lines, "the lines")?;
        optionals("left_rad", left, &ANGLE_RAD)?;
    }
    number("tolerance_rad", it.tolerance_rad, &ANGLE_U_RAD)
}
