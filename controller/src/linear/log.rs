//! Journals of a linear axis: each line by itself, and against those before it.

use machine::records::sound::{ERROR_U_M, Judged, PLACE_M, SECONDS, VOLTS, approach, is, number};
use machine::records::{ClosureEntry, JournalHeader, Log};
use serde::{Deserialize, Serialize};

use crate::linear::{PointEntry, ZeroEntry};

/// A line of such a journal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "entry", rename_all = "snake_case")]
pub enum LinearEntry {
    /// A measured point.
    Point(PointEntry),
    /// A zero.
    Zero(ZeroEntry),
    /// A run is whole, and the place of its datum still reads what it should.
    Closed(ClosureEntry),
}

/// What such a journal holds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LinearLog {
    /// Its points, in the order they were measured.
    pub points: Vec<PointEntry>,
    /// Its zeros.
    pub zeros: Vec<ZeroEntry>,
    /// How far each whole run had drifted at its end.
    pub closures: Vec<ClosureEntry>,
}

impl Log for LinearLog {
    type Entry = LinearEntry;

    const OPENED_BY: &'static [&'static str] = &[];

    fn judge(&self, header: &JournalHeader, entry: &LinearEntry) -> Judged {
        match entry {
            LinearEntry::Point(it) => point(header, it),
            LinearEntry::Zero(it) => zero(it),
            LinearEntry::Closed(it) => it.judge(header),
        }
    }

    fn take(&mut self, entry: LinearEntry) {
        match entry {
            LinearEntry::Point(it) => self.points.push(it),
            LinearEntry::Zero(it) => self.zeros.push(it),
            LinearEntry::Closed(it) => self.closures.push(it),
        }
    }

    fn keep_whole(&mut self, header: &JournalHeader) {
        // The datum of a continued measurement is a new one, so that only runs whose end was seen to
        // agree with their own datum are kept.
        let whole = header.targets_m.len() * 2;
        let points = core::mem::take(&mut self.points);
        let count = |run: u32| points.iter().filter(|point| point.run == run).count();
        self.closures.retain(|closure| count(closure.run) == whole);
        let is_kept = |run: u32| self.closures.iter().any(|closure| closure.run == run);
        self.points = points.into_iter().filter(|it| is_kept(it.run)).collect();
    }
}

fn point(header: &JournalHeader, it: &PointEntry) -> Judged {
    header.judge_run(it.run)?;
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
    let targets = &header.targets_m;
    let is_target = targets.is_empty() || targets.contains(&it.target_m);
    let expected = || "one of the header's targets_m".to_owned();
    is("target_m", is_target, expected, || {
        format!("{:e}", it.target_m)
    })?;
    number("scatter_m", it.scatter_m, &ERROR_U_M)?;
    number("at_s", it.at_s, &SECONDS)?;
    it.environment.judge("environment")
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

#[cfg(test)]
mod tests;
