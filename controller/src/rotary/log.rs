//! Journals of a rotary table: each line by itself, and against those before it.

use compensator::uncertainty::median;
use machine::records::sound::{
    ANGLE_RAD, ANGLE_U_RAD, COUNT_MAX, Judged, PASSES_MAX, SECONDS, SPEED_RAD_PER_S, TURNS_RAD,
    Unsound, approach, as_many, counted, is, limits, number, numbers, once, optional, optionals,
    unsound,
};
use machine::records::{JournalHeader, Log, ThermometersEntry};
use serde::{Deserialize, Serialize};

use crate::rotary::SightedAt;
use crate::rotary::{JudgedEntry, PlacementEntry, PlatePlanEntry, SightedEntry, SweepEntry};

/// A line of such a journal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "entry", rename_all = "snake_case")]
pub enum PlateEntry {
    /// How a plate is to be read: the second line.
    PlatePlan(PlatePlanEntry),
    /// A pass over the lines of a plate.
    Sweep(SweepEntry),
    /// A person read a line of the plate.
    Sighted(SightedEntry),
    /// A placement of a plate was read whole.
    Placed(PlacementEntry),
    /// What a verification with a plate found.
    Judged(JudgedEntry),
    /// What the machine's thermometers showed.
    Thermometers(ThermometersEntry),
    /// A placement turned out to be another one than was asked for: it must be read again.
    Misplaced {
        /// By how many lines the plate was to be turned.
        offset: f64,
    },
    /// A person gave up what he had read of a placement: it must be read again.
    Discarded {
        /// By how many lines the plate was to be turned.
        offset: f64,
    },
}

/// What such a journal holds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PlateLog {
    /// How the plate is read.
    pub plan: Option<PlatePlanEntry>,
    /// Passes over it.
    pub sweeps: Vec<SweepEntry>,
    /// Its placements that were read whole.
    pub placements: Vec<PlacementEntry>,
    /// What a verification with it found.
    pub judged: Option<JudgedEntry>,
    /// What the machine's thermometers showed, where it has some.
    pub thermometers: Vec<ThermometersEntry>,
}

impl Log for PlateLog {
    type Entry = PlateEntry;

    const OPENED_BY: &'static [&'static str] = &["plate_plan"];

    fn judge(&self, _: &JournalHeader, entry: &PlateEntry) -> Judged {
        match entry {
            PlateEntry::PlatePlan(it) => plate_plan(self, it),
            PlateEntry::Sweep(it) => sweep(self, it),
            PlateEntry::Sighted(it) => sighted(self, it),
            PlateEntry::Placed(it) => placed(self, it),
            PlateEntry::Judged(it) => judged(self, it),
            PlateEntry::Thermometers(it) => it.judge(),
            PlateEntry::Misplaced { offset } | PlateEntry::Discarded { offset } => {
                at_offset(plan_of(self)?, *offset)
            }
        }
    }

    fn take(&mut self, entry: PlateEntry) {
        match entry {
            PlateEntry::PlatePlan(it) => self.plan = Some(it),
            PlateEntry::Sweep(it) => self.sweeps.push(it),
            PlateEntry::Sighted(it) => self.see(&it),
            PlateEntry::Placed(it) => {
                self.find_phase(it.offset);
                self.placements.push(it);
            }
            PlateEntry::Judged(it) => self.judged = Some(it),
            PlateEntry::Thermometers(it) => self.thermometers.push(it),
            PlateEntry::Misplaced { offset } | PlateEntry::Discarded { offset } => {
                self.forget(offset);
            }
        }
    }

    fn keep_whole(&mut self, _: &JournalHeader) {
        // What a person has read is not read again; that nothing moved meanwhile shows when it is closed.
        if self.plan.as_ref().is_some_and(|it| it.sighted.is_some()) {
            return;
        }
        let placed = |offset: f64| self.placements.iter().any(|it| it.offset == offset);
        self.sweeps.retain(|it| placed(it.offset));
    }
}

impl PlateLog {
    /// The passes over the plate in the placement at `offset`.
    pub(super) fn sweeps_at(&self, offset: f64) -> impl Iterator<Item = &SweepEntry> {
        self.sweeps.iter().filter(move |it| it.offset == offset)
    }

    /// A pass of a person grows line by line.
    fn see(&mut self, it: &SightedEntry) {
        let lines = self.plan.as_ref().map_or(0, |it| it.lines as usize);
        let pass = (it.offset, it.pass, it.approach);
        let is_own = |own: &SweepEntry| (own.offset, own.pass, own.approach) == pass;
        let at = self.sweeps.iter().rposition(is_own).unwrap_or_else(|| {
            self.sweeps.push(SweepEntry {
                offset: it.offset,
                pass: it.pass,
                approach: it.approach,
                deviations_rad: vec![None; lines],
                ..SweepEntry::default()
            });
            self.sweeps.len() - 1
        });
        let position = position_of(it.line, it.offset, lines);
        let sweep = &mut self.sweeps[at];
        sweep.deviations_rad[position as usize] = it.deviation_rad;
        sweep.missing.retain(|at| *at != position);
        if it.deviation_rad.is_none() {
            sweep.missing.push(position);
        }
    }

    /// What the deviations of a placement have in common, once a person has read it whole: where the
    /// table's error was seen, from the table positions.
    fn find_phase(&mut self, offset: f64) {
        let Some((plan, at)) = self.plan.as_ref().and_then(|it| Some((it, it.sighted?))) else {
            return;
        };
        let beside = offset.fract() * core::f64::consts::TAU / f64::from(plan.lines);
        for sweep in self.sweeps.iter_mut().filter(|it| it.offset == offset) {
            let read: Vec<f64> = sweep.deviations_rad.iter().flatten().copied().collect();
            sweep.phase_rad = match at {
                SightedAt::Position => beside,
                SightedAt::Line => median(&read).unwrap_or(beside),
            };
        }
    }

    fn forget(&mut self, offset: f64) {
        self.sweeps.retain(|it| it.offset != offset);
        self.placements.retain(|it| it.offset != offset);
    }
}

fn plate_plan(read: &PlateLog, it: &PlatePlanEntry) -> Judged {
    once("plate_plan", read.plan.is_none())?;
    let lines = it.lines as usize;
    counted("lines", lines, 2..=COUNT_MAX)?;
    counted("offsets", it.offsets.len(), 1..=lines)?;
    let around = limits(0.0, f64::from(it.lines), "lines");
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

fn plan_of(read: &PlateLog) -> Result<&PlatePlanEntry, Unsound> {
    let missing = || unsound("entry", "a plate_plan before it", "none");
    read.plan.as_ref().ok_or_else(missing)
}

fn at_offset(plan: &PlatePlanEntry, offset: f64) -> Judged {
    let expected = || "one of the plan's offsets".to_owned();
    let known = plan.offsets.contains(&offset);
    is("offset", known, expected, || format!("{offset:e}"))
}

fn sweep(read: &PlateLog, it: &SweepEntry) -> Judged {
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

/// The table position at which a line of the plate is read.
pub(super) fn position_of(line: u32, offset: f64, lines: usize) -> u32 {
    let turned = i64::from(line) + offset.floor() as i64;
    turned.rem_euclid(lines.max(1) as i64) as u32
}

fn sighted(read: &PlateLog, it: &SightedEntry) -> Judged {
    let plan = plan_of(read)?;
    let expected = || "a plan with `sighted` before it".to_owned();
    let of_a_person = plan.sighted.is_some();
    is("entry", of_a_person, expected, || "one without".to_owned())?;
    at_offset(plan, it.offset)?;
    counted("pass", it.pass as usize, 1..=plan.passes as usize + 1)?;
    approach("approach", it.approach)?;
    counted("line", it.line as usize, 0..=plan.lines as usize - 1)?;
    optional("deviation_rad", it.deviation_rad, &ANGLE_RAD)
}

fn placed(read: &PlateLog, it: &PlacementEntry) -> Judged {
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

fn judged(read: &PlateLog, it: &JudgedEntry) -> Judged {
    once("judged", read.judged.is_none())?;
    optional("noise_rad", it.noise_rad, &ANGLE_U_RAD)?;
    let lines = plan_of(read)?.lines as usize;
    as_many("found_rad", it.found_rad.len(), lines, "the lines")?;
    optionals("found_rad", &it.found_rad, &ANGLE_RAD)?;
    if let Some(left) = &it.left_rad {
        as_many("left_rad", left.len(), lines, "the lines")?;
        optionals("left_rad", left, &ANGLE_RAD)?;
    }
    number("tolerance_rad", it.tolerance_rad, &ANGLE_U_RAD)
}

#[cfg(test)]
mod tests;
