//! Readings that are grossly wrong, named by the lines that the operator set up, with what to do.

use core::fmt;

use compensator::volumetric::Point;
use compensator::volumetric::identify::{Gross, GrossKind, Observation};
use units::Metres;

use super::off::Off;
use crate::volumetric::{VolumeLog, VolumePlanEntry};

/// A reading of a line that contradicts the others, or all of its readings from one on.
#[derive(Clone, Debug, PartialEq)]
pub struct GrossReading {
    /// Which line, from 1, as the page counts them.
    pub line: usize,
    /// What that is for.
    pub purpose: String,
    /// Whether the machine's own detectors read it.
    pub by_detectors: bool,
    /// Which reading of the line, from 1; of a slip the first that is off.
    pub number: usize,
    /// Where it was read.
    pub at: Point,
    /// One reading, or all from there on.
    pub kind: GrossKind,
    /// What was read.
    pub seen: Off,
    /// By how much that is off.
    pub off: Off,
    /// The same in units of its standard uncertainty.
    pub times: f64,
    /// What sound readings stay below.
    pub limit: f64,
    /// Other lines, from 1, of which one may be wrong instead.
    pub rivals: Vec<usize>,
}

impl GrossReading {
    /// What `gross` says of the lines of `plan`, of which those that are whole were evaluated.
    pub(super) fn of(
        gross: &Gross,
        plan: &VolumePlanEntry,
        read: &VolumeLog,
        observations: &[Observation],
    ) -> Option<Self> {
        let whole = read.whole.iter().map(|it| it.line);
        let whole: Vec<usize> = whole.filter(|it| *it < plan.lines.len()).collect();
        let line = *whole.get(gross.run)?;
        let entry = plan.lines.get(line)?;
        let observation = observations.get(gross.index)?;
        let before = observations[..gross.index].iter();
        let rivals = gross.rivals.iter();
        Some(Self {
            line: line + 1,
            purpose: entry.purpose.clone(),
            by_detectors: entry.by_detectors,
            number: before.filter(|it| it.run == gross.run).count() + 1,
            at: observation.at,
            kind: gross.kind,
            seen: Off::of(observation.reading, gross.seen),
            off: Off::of(observation.reading, gross.off),
            times: gross.times.abs(),
            limit: gross.limit,
            rivals: rivals
                .filter_map(|it| Some(whole.get(it.run)? + 1))
                .collect(),
        })
    }

    /// The lines, from 1, that have to be measured again: its own, and those that may be wrong instead.
    pub(super) fn lines(&self) -> impl Iterator<Item = usize> {
        core::iter::once(self.line).chain(self.rivals.iter().copied())
    }
}

impl fmt::Display for GrossReading {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [x, y, z] = [self.at.x, self.at.y, self.at.z].map(Metres::mm);
        let Self {
            line,
            purpose,
            number,
            seen,
            off,
            times,
            limit,
            ..
        } = self;
        let expected = seen.less(off);
        let place = format!("reading {number} at ({x:.3}, {y:.3}, {z:.3}) mm");
        let whole = format!(
            "seen {seen}, expected {expected}, {off} off, {times:.1} times its standard uncertainty where sound \
             readings stay below {limit:.1}"
        );
        match self.kind {
            GrossKind::Reading => write!(
                f,
                "line {line} ({purpose}), {place} does not fit the others: {whole}; something was knocked, or the \
                 beam was disturbed, when it was read"
            ),
            GrossKind::Slip => write!(
                f,
                "line {line} ({purpose}) slipped: from {place} on all are off by the same: {whole}; the count \
                 slipped, or an optic moved, while the line was read"
            ),
        }?;
        for rival in &self.rivals {
            write!(
                f,
                " (or line {rival} is wrong instead, which explains it nearly as well)"
            )?;
        }
        Ok(())
    }
}
