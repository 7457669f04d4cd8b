//! Journals of three axes: each line by itself, and against those before it.

use machine::records::sound::{
    ANGLE_RAD, CELSIUS, ERROR_M, ERROR_U_M, Judged, KELVIN_U, LENGTH_M, PLACE_M, SECONDS, as_many,
    counted, increasing, is, letter, limits, model, number, numbers, once, optional, optionals,
    unsound,
};
use machine::records::{JournalHeader, Log};
use serde::{Deserialize, Serialize};

use compensator::volumetric::model::Chain;

use crate::volumetric::entries::MINUTES_MAX;
use crate::volumetric::sound::references as beams;
use crate::volumetric::{AXES, error_name};
use crate::volumetric::{
    LineEntry, LineReadEntry, LineReadingEntry, LineVoidEntry, OpticsName, VolumeCheckEntry,
    VolumePlanEntry, VolumeReferencesEntry,
};

/// A line of such a journal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "entry", rename_all = "snake_case")]
pub enum VolumeEntry {
    /// How the errors of three axes are to be found: the second line of such a run.
    VolumePlan(VolumePlanEntry),
    /// What their detectors read before the first line.
    VolumeReferences(VolumeReferencesEntry),
    /// A reading of a line.
    LineReading(LineReadingEntry),
    /// A line was read to its end.
    LineRead(LineReadEntry),
    /// What was read of a line does not count.
    LineVoid(LineVoidEntry),
    /// Which line a verification of three axes reads: the second line of such a run.
    VolumeCheck(VolumeCheckEntry),
}

/// What such a journal holds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct VolumeLog {
    /// How the errors are to be found.
    pub plan: Option<VolumePlanEntry>,
    /// What the detectors read first.
    pub references: Option<VolumeReferencesEntry>,
    /// Every reading, in the order they were made.
    pub readings: Vec<LineReadingEntry>,
    /// The lines that are whole.
    pub whole: Vec<LineReadEntry>,
    /// What a verification is.
    pub check: Option<VolumeCheckEntry>,
}

impl Log for VolumeLog {
    type Entry = VolumeEntry;

    const OPENED_BY: &'static [&'static str] = &["volume_plan", "volume_check"];

    fn judge(&self, _: &JournalHeader, entry: &VolumeEntry) -> Judged {
        match entry {
            VolumeEntry::VolumePlan(it) => plan(self, it),
            VolumeEntry::VolumeReferences(it) => references(self, it),
            VolumeEntry::LineReading(it) => reading(self, it),
            VolumeEntry::LineRead(it) => whole(self, it),
            VolumeEntry::LineVoid(it) => line(self, it.line),
            VolumeEntry::VolumeCheck(it) => check(self, it),
        }
    }

    fn take(&mut self, entry: VolumeEntry) {
        match entry {
            VolumeEntry::VolumePlan(it) => self.plan = Some(it),
            VolumeEntry::VolumeReferences(it) => self.references = Some(it),
            VolumeEntry::LineReading(it) => self.readings.push(it),
            VolumeEntry::LineRead(it) => self.whole.push(it),
            VolumeEntry::LineVoid(it) => {
                self.whole.retain(|read| read.line != it.line);
                self.readings.retain(|reading| reading.line != it.line);
            }
            VolumeEntry::VolumeCheck(it) => self.check = Some(it),
        }
    }

    fn keep_whole(&mut self, _: &JournalHeader) {
        // The zero of the interferometer is set for each line: half a line cannot be continued.
        let whole = &self.whole;
        let is_whole = |line: usize| whole.iter().any(|it| it.line == line);
        self.readings.retain(|it| is_whole(it.line));
    }
}

impl VolumeLog {
    /// Whether the line is whole.
    pub fn is_whole(&self, line: usize) -> bool {
        self.whole.iter().any(|it| it.line == line)
    }
}

/// Lines, nodes of an axis, places of a line, thermometers, at most.
const LINES_MAX: usize = 10_000;
const NODES_MAX: usize = 2_000;
const POINTS_MAX: usize = 100_000;
const THERMOMETERS_MAX: usize = 1_000;
/// A direction's length is 1 but for rounding.
const ROUNDING: f64 = 1e-6;

fn plan(read: &VolumeLog, it: &VolumePlanEntry) -> Judged {
    once("volume_plan", read.plan.is_none())?;
    model("chain", it.chain.parse::<Chain>())?;
    let corners = [
        ("low_m", it.low_m),
        ("high_m", it.high_m),
        ("tool_m", it.tool_m),
        ("zero_m", it.zero_m),
        ("fixed_m", it.fixed_m),
    ];
    for (key, place) in corners {
        numbers(key, &place, &PLACE_M)?;
    }
    for (at, nodes) in it.nodes_m.iter().enumerate() {
        let place = format!("nodes_m[{at}]");
        increasing(&place, &[it.low_m[at], it.high_m[at]])?;
        counted(&place, nodes.len(), 0..=NODES_MAX)?;
        numbers(&place, nodes, &PLACE_M)?;
        increasing(&place, nodes)?;
    }
    for (at, name) in it.functions.iter().enumerate() {
        let is_error = error_name(name).is_some() && !it.functions[..at].contains(name);
        let expected = || "an error of three axes (e_yx, e_ax …), each once".to_owned();
        is(format_args!("functions[{at}]"), is_error, expected, || {
            format!("`{}`", name.escape_debug())
        })?;
    }
    counted("lines", it.lines.len(), 0..=LINES_MAX)?;
    for (at, line) in it.lines.iter().enumerate() {
        planned(&format!("lines[{at}]"), line)?;
    }
    number("thermometer_u_k", it.thermometer_u_k, &KELVIN_U)?;
    optional(
        "warm_up_min",
        it.warm_up_min,
        &limits(0.0, MINUTES_MAX, "min"),
    )?;
    let drives = it.drives.len();
    let expected = || "none, or those of x, y and z".to_owned();
    is("drives", drives == 0 || drives == 3, expected, || {
        drives.to_string()
    })?;
    warmth(it)
}

fn planned(place: &str, it: &LineEntry) -> Judged {
    let key = |key: &str| format!("{place}.{key}");
    numbers(&key("from_m"), &it.from_m, &PLACE_M)?;
    numbers(&key("to_m"), &it.to_m, &PLACE_M)?;
    numbers(&key("tool_m"), &it.tool_m, &PLACE_M)?;
    counted(&key("points"), it.points, 0..=POINTS_MAX)?;
    counted(&key("angle"), it.angle.unwrap_or(0), 0..=LINES_MAX)?;
    match (it.optics, it.sees) {
        (OpticsName::Linear, None) => Ok(()),
        (OpticsName::Linear, Some(seen)) => Err(unsound(
            key("sees"),
            "null: it looks along",
            format!("`{seen}`"),
        )),
        (OpticsName::Straightness | OpticsName::Angular, seen) => {
            letter(&key("sees"), seen.unwrap_or('?'), &AXES)
        }
    }
}

fn warmth(it: &VolumePlanEntry) -> Judged {
    for (at, own) in it.expansions.iter().enumerate() {
        letter(&format!("expansions[{at}].axis"), own.axis, &AXES)?;
        for (n, thermometer) in own.thermometers.iter().enumerate() {
            let place = format!("expansions[{at}].thermometers[{n}]");
            counted(&place, *thermometer, 0..=THERMOMETERS_MAX)?;
        }
    }
    for (at, own) in it.bends.iter().enumerate() {
        let place = |key: &str| format!("bends[{at}].{key}");
        letter(&place("axis"), own.axis, &AXES)?;
        letter(&place("towards"), own.towards, &AXES)?;
        counted(&place("over"), own.over, 0..=THERMOMETERS_MAX)?;
        counted(
            &place("under"),
            own.under.unwrap_or(0),
            0..=THERMOMETERS_MAX,
        )?;
        let ends = [own.low_m, own.high_m];
        numbers(&place("low_m, high_m"), &ends, &PLACE_M)?;
        increasing(&place("low_m, high_m"), &ends)?;
        let from = own.seen_from_m.unwrap_or_default();
        numbers(&place("seen_from_m"), &from, &PLACE_M)?;
    }
    Ok(())
}

fn references(read: &VolumeLog, it: &VolumeReferencesEntry) -> Judged {
    once("volume_references", read.references.is_none())?;
    beams(&it.content)?;
    counted(
        "temperatures_c",
        it.temperatures_c.len(),
        0..=THERMOMETERS_MAX,
    )?;
    numbers("temperatures_c", &it.temperatures_c, &CELSIUS)?;
    number("at_s", it.at_s, &SECONDS)
}

/// A line of the plan; a verification has only one.
fn line(read: &VolumeLog, seen: usize) -> Judged {
    let count = read.plan.as_ref().map_or(1, |it| it.lines.len());
    let expected = || format!("one of {count} lines, from 0");
    is("line", seen < count, expected, || seen.to_string())
}

fn reading(read: &VolumeLog, it: &LineReadingEntry) -> Judged {
    line(read, it.line)?;
    numbers("at_m", &it.at_m, &PLACE_M)?;
    numbers("tool_m", &it.tool_m, &PLACE_M)?;
    match (it.along, it.about) {
        (Some(along), None) => {
            let square: f64 = along.iter().map(|it| it * it).sum();
            let expected = || "a direction of length 1".to_owned();
            let is_unit = (square - 1.0).abs() <= ROUNDING;
            is("along", is_unit, expected, || format!("{along:?}"))?;
        }
        (None, Some(about)) => letter("about", about, &AXES)?,
        _ => {
            let expected = "either of them";
            return Err(unsound("along, about", expected, "both or none"));
        }
    }
    number("read_si", it.read_si, &ERROR_M)?;
    number("deviation_si", it.deviation_si, &ERROR_M)?;
    // Beyond it no square is anything any more.
    number("u_si", it.u_si, &limits(1e-15, 1.0, "m or rad"))?;
    optional("scatter_m", it.scatter_m, &ERROR_U_M)?;
    numbers("sideways_m", it.sideways_m.as_flattened(), &ERROR_M)?;
    numbers("roll_rad", &it.roll_rad, &ANGLE_RAD)?;
    let shift = it.beam_shift_m.unwrap_or_default();
    numbers("beam_shift_m", shift.as_flattened(), &ERROR_M)?;
    counted(
        "temperatures_c",
        it.temperatures_c.len(),
        0..=THERMOMETERS_MAX,
    )?;
    optionals("temperatures_c", &it.temperatures_c, &CELSIUS)?;
    numbers(
        "correction_m",
        &it.correction_m.unwrap_or_default(),
        &ERROR_M,
    )?;
    number("at_s", it.at_s, &SECONDS)
}

fn whole(read: &VolumeLog, it: &LineReadEntry) -> Judged {
    line(read, it.line)?;
    let is_new = !read.is_whole(it.line);
    let expected = || "each line once".to_owned();
    is("line", is_new, expected, || format!("{} again", it.line))?;
    let before = read.references.as_ref();
    let thermometers = before.map_or(it.temperatures_c.len(), |it| it.temperatures_c.len());
    let of = "the thermometers of the references";
    as_many("temperatures_c", it.temperatures_c.len(), thermometers, of)?;
    numbers("temperatures_c", &it.temperatures_c, &CELSIUS)?;
    number("at_s", it.at_s, &SECONDS)
}

fn check(read: &VolumeLog, it: &VolumeCheckEntry) -> Judged {
    once("volume_check", read.check.is_none())?;
    numbers("from_m", &it.from_m, &PLACE_M)?;
    numbers("to_m", &it.to_m, &PLACE_M)?;
    numbers("tool_m", &it.tool_m, &PLACE_M)?;
    number("limit_m", it.limit_m, &LENGTH_M)
}
