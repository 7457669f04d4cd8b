//! Which readings are grossly wrong: single ones, or all after a count that slipped within a line.
//!
//! Source: Baarda, A testing procedure for use in geodetic networks (1968): data snooping, one
//! alternative hypothesis for each gross error that one parameter describes; Pope, The statistics of
//! residuals and the detection of outliers (1976), for a scale that has to be estimated. Of all
//! hypotheses the one that takes most out of χ² is judged, its parameter becomes an unknown of the
//! adjustment, and the rest is judged again, so that one gross error does not hide another.
//!
//! | symbol | name here |
//! |---|---|
//! | c, of a single reading or of all readings of a run from one on | [`GrossKind`] |
//! | ∇ = cᵀv / cᵀQ_v c | [`Gross::off`] |
//! | w = cᵀv / √(cᵀQ_v c) | [`Gross::times`] |
//! | α, of all hypotheses together | [`GROSS_FALSE_ALARMS`] |
//!
//! A single error and a slip are told apart by what they leave of χ²: both have one parameter. What
//! leaves nearly as little ([`ALIKE`]) is named as a rival ([`Gross::rivals`]): it cannot be told apart.
//!
//! The scale is the stated one, or that of the readings themselves where these scatter more. Of a slip
//! of a single reading at either end nobody can tell that it is one.
//!
//! Absent: gross errors that two parameters describe, such as a line read back to front; hypotheses
//! of which the readings see less than a thousandth.

use super::design::Design;
use super::scatter::scatter_limit;
use super::{Observation, Reading};
use crate::least_squares::orthonormal_columns;
use crate::significance::student_limit;

/// The share of sound calibrations in which any reading is held for wrong.
pub const GROSS_FALSE_ALARMS: f64 = 1e-4;
/// So many gross errors are looked for at most: with more, it is no matter of single readings.
const FOUND_MAX: usize = 5;
/// A hypothesis of which less than this share is seen is not judged.
const SEEN_MIN: f64 = 1e-3;
/// A rival takes as much out of χ² but for this: it is less likely by a factor of 100.
const ALIKE: f64 = 9.2;
/// Rivals that are named.
const RIVALS: usize = 2;
/// As good as a scale that is known.
const KNOWN: usize = 100_000;

/// What a gross error is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GrossKind {
    /// One reading is off.
    Reading,
    /// This reading and all later ones of its run are off by the same.
    Slip,
}

impl GrossKind {
    /// Whether a reading of the same run is off where `first` is the first that is.
    fn concerns(self, index: usize, first: usize) -> bool {
        match self {
            Self::Reading => index == first,
            Self::Slip => index >= first,
        }
    }
}

impl Gross {
    /// By reading, whether it is off.
    pub(super) fn column(&self, observations: &[Observation]) -> Vec<f64> {
        let own = observations.iter().enumerate();
        own.map(|(index, it)| {
            let is_off = it.run == self.run && self.kind.concerns(index, self.index);
            if is_off { 1.0 } else { 0.0 }
        })
        .collect()
    }
}

/// What would explain the readings nearly as well.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rival {
    /// What it is.
    pub kind: GrossKind,
    /// The reading, from 0; of a slip the first that is off.
    pub index: usize,
    /// Its run.
    pub run: usize,
}

/// A gross error.
#[derive(Clone, Debug, PartialEq)]
pub struct Gross {
    /// What it is.
    pub kind: GrossKind,
    /// The reading, from 0; of a slip the first that is off.
    pub index: usize,
    /// Its run.
    pub run: usize,
    /// By how much it is off, in its SI unit.
    pub off: f64,
    /// What was read, in its SI unit.
    pub seen: f64,
    /// The same in units of what is to be expected of it.
    pub times: f64,
    /// The `times` that all sound calibrations but [`GROSS_FALSE_ALARMS`] stay below.
    pub limit: f64,
    /// What would explain the readings nearly as well, the likeliest first.
    pub rivals: Vec<Rival>,
}

/// What snooping leaves.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Snooped {
    /// The gross errors, the most conspicuous first.
    pub found: Vec<Gross>,
    /// The scatter of the readings in units of their uncertainty with all of these taken out; `None`
    /// without readings to spare.
    pub ratio_left: Option<f64>,
    /// Readings − unknowns − gross errors.
    pub degrees_of_freedom: usize,
}

/// A hypothesis with what it explains.
#[derive(Clone, Copy, Debug)]
struct Explained {
    rival: Rival,
    /// cᵀv
    product: f64,
    /// cᵀQ_v c
    seen: f64,
}

impl Explained {
    /// What it takes out of χ².
    fn gain(&self) -> f64 {
        self.product * self.product / self.seen
    }
}

/// A change of some readings, as the adjustment sees it.
#[derive(Clone, Debug, Default)]
struct Shift {
    whole: Vec<f64>,
    /// Of it, what the unknowns take up.
    known: Vec<f64>,
    /// cᵀv
    product: f64,
}

impl Shift {
    fn add(&mut self, other: &Self) {
        self.whole.resize(other.whole.len(), 0.0);
        self.known.resize(other.known.len(), 0.0);
        add(&mut self.whole, &other.whole);
        add(&mut self.known, &other.known);
        self.product += other.product;
    }

    /// `None` where the readings hardly see it.
    fn explained(&self, rival: Rival) -> Option<Explained> {
        let square: f64 = self.whole.iter().map(|it| it * it).sum();
        let seen = square - self.known.iter().map(|it| it * it).sum::<f64>();
        (seen > SEEN_MIN * square).then_some(Explained {
            rival,
            product: self.product,
            seen,
        })
    }
}

fn add(sum: &mut [f64], other: &[f64]) {
    sum.iter_mut().zip(other).for_each(|(to, it)| *to += it);
}

/// The adjustment as it stands.
struct Adjusted {
    /// Orthonormal columns that span what the unknowns can explain, by reading.
    explained: Vec<Vec<f64>>,
    residuals: Vec<f64>,
    /// By reading, what one SI unit of it is among the residuals.
    units: Vec<Vec<f64>>,
    /// By run, its readings.
    runs: Vec<(usize, Vec<usize>)>,
    freedom: usize,
}

/// With `false_alarms` as the share of sound calibrations in which something is found.
pub(super) fn snoop(design: &Design, observations: &[Observation], false_alarms: f64) -> Snooped {
    if design.values.len() <= design.columns() {
        return Snooped::default();
    }
    let mut adjusted = Adjusted::new(design, observations);
    let mut found = Vec::new();
    while found.len() < FOUND_MAX {
        let Some((gross, best)) = adjusted.judge(observations, false_alarms) else {
            break;
        };
        adjusted.take_out(best.rival);
        found.push(gross);
    }
    adjusted.left(found)
}

/// What is left of the readings without those that were found to be wrong.
pub(super) fn without(design: &Design, observations: &[Observation], found: Vec<Gross>) -> Snooped {
    if design.values.len() <= design.columns() {
        return Snooped::default();
    }
    let mut adjusted = Adjusted::new(design, observations);
    for it in &found {
        let (kind, index, run) = (it.kind, it.index, it.run);
        adjusted.take_out(Rival { kind, index, run });
    }
    adjusted.left(found)
}

impl Adjusted {
    fn new(design: &Design, observations: &[Observation]) -> Self {
        let columns = design.columns();
        let explained = orthonormal_columns(&design.rows, columns);
        let mut residuals = design.values.clone();
        for column in 0..columns {
            let part: f64 = explained
                .iter()
                .zip(&design.values)
                .map(|(q, y)| q[column] * y)
                .sum();
            for (rest, q) in residuals.iter_mut().zip(&explained) {
                *rest -= part * q[column];
            }
        }
        let mut runs: Vec<(usize, Vec<usize>)> = Vec::new();
        for (index, it) in observations.iter().enumerate() {
            match runs.iter_mut().find(|(run, _)| *run == it.run) {
                Some((_, own)) => own.push(index),
                None => runs.push((it.run, vec![index])),
            }
        }
        Self {
            freedom: residuals.len().saturating_sub(columns),
            units: design.whitening.of_each(),
            explained,
            residuals,
            runs,
        }
    }

    /// With `found` taken out already.
    fn left(&self, found: Vec<Gross>) -> Snooped {
        let freedom = self.freedom;
        Snooped {
            found,
            ratio_left: (freedom > 0).then(|| (self.squares() / freedom as f64).sqrt()),
            degrees_of_freedom: freedom,
        }
    }

    fn squares(&self) -> f64 {
        self.residuals.iter().map(|it| it * it).sum()
    }

    /// The hypothesis that explains most, where that is more than chance does.
    fn judge(&self, observations: &[Observation], false_alarms: f64) -> Option<(Gross, Explained)> {
        let all = self.hypotheses();
        let by_gain = |a: &&Explained, b: &&Explained| a.gain().total_cmp(&b.gain());
        let best = *all.iter().max_by(by_gain)?;
        let chance = false_alarms / all.len() as f64;
        let (times, limit) = self.judged(&best, chance)?;
        let Rival { kind, index, run } = best.rival;
        let off = best.product / best.seen;
        let gross = Gross {
            kind,
            index,
            run,
            off,
            seen: value(observations[index].reading),
            times,
            limit,
            rivals: self.rivals(&all, &best),
        };
        Some((gross, best))
    }

    /// How conspicuous it is, and its limit, where it is beyond it.
    fn judged(&self, best: &Explained, chance: f64) -> Option<(f64, f64)> {
        let stated = best.gain().sqrt();
        let known = student_limit(chance, KNOWN);
        // A comparison with NaN is false, so that it is not judged.
        let is_beyond = stated > known;
        if !is_beyond {
            return None;
        }
        let before = self.squares() / self.freedom.max(1) as f64;
        let left = self.freedom.saturating_sub(1);
        let rest = (self.squares() - best.gain()).max(0.0) / left.max(1) as f64;
        // What scatters beyond the limit is refused whatever is found: here it is only named.
        let is_refused = before.sqrt() > scatter_limit(self.freedom);
        if rest <= 1.0 || left == 0 || is_refused {
            return Some((stated, known));
        }
        let (times, limit) = (stated / rest.sqrt(), student_limit(chance, left));
        (times > limit).then_some((times, limit))
    }

    /// The likeliest of each other run.
    fn rivals(&self, all: &[Explained], best: &Explained) -> Vec<Rival> {
        let enough = best.gain() - ALIKE;
        let mut near: Vec<&Explained> = all.iter().filter(|it| it.gain() > enough).collect();
        near.sort_by(|a, b| b.gain().total_cmp(&a.gain()));
        let mut rivals: Vec<Rival> = Vec::new();
        for it in near {
            let rival = it.rival;
            let is_new = rivals.iter().all(|known| known.run != rival.run);
            if rival.run != best.rival.run && is_new {
                rivals.push(rival);
            }
        }
        rivals.truncate(RIVALS);
        rivals
    }

    fn hypotheses(&self) -> Vec<Explained> {
        let each: Vec<Shift> = self.units.iter().map(|it| self.shift(it)).collect();
        let mut all = Vec::new();
        for (run, own) in &self.runs {
            let rival = |kind, index| Rival {
                kind,
                index,
                run: *run,
            };
            let readings = own
                .iter()
                .map(|index| each[*index].explained(rival(GrossKind::Reading, *index)));
            all.extend(readings.flatten());
            // One that leaves a single reading on either side is that reading's.
            let steps = 2..own.len().saturating_sub(1);
            let mut together = Shift::default();
            for at in (steps.start..own.len()).rev() {
                together.add(&each[own[at]]);
                if steps.contains(&at) {
                    all.extend(together.explained(rival(GrossKind::Slip, own[at])));
                }
            }
        }
        all
    }

    /// What a change of these readings, by one SI unit each, is in the adjustment.
    fn shift(&self, unit: &[f64]) -> Shift {
        let first = unit.iter().position(|it| *it != 0.0).unwrap_or(0);
        let mut known = vec![0.0; self.explained[first].len()];
        let mut product = 0.0;
        for (at, it) in unit.iter().enumerate().filter(|(_, it)| **it != 0.0) {
            product += it * self.residuals[at];
            for (sum, q) in known.iter_mut().zip(&self.explained[at]) {
                *sum += it * q;
            }
        }
        Shift {
            whole: unit.to_vec(),
            known,
            product,
        }
    }

    /// Makes its parameter an unknown.
    fn take_out(&mut self, Rival { kind, index, run }: Rival) {
        let shifted = self.runs.iter().filter(|it| it.0 == run);
        let shifted = shifted.flat_map(|(_, own)| own.iter().copied());
        let mut column = vec![0.0; self.residuals.len()];
        for at in shifted.filter(|it| kind.concerns(*it, index)) {
            add(&mut column, &self.units[at]);
        }
        // Twice, so that rounding leaves nothing of what is explained already.
        for _ in 0..2 {
            self.leave_out_explained(&mut column);
        }
        let length = column.iter().map(|it| it * it).sum::<f64>().sqrt();
        let pairs = column.iter().zip(&self.residuals);
        let part: f64 = pairs.map(|(c, v)| c * v).sum::<f64>() / length;
        for (at, it) in column.iter().enumerate() {
            let unit = it / length;
            self.residuals[at] -= part * unit;
            self.explained[at].push(unit);
        }
        self.freedom = self.freedom.saturating_sub(1);
    }

    fn leave_out_explained(&self, column: &mut [f64]) {
        let columns = self.explained.first().map_or(0, Vec::len);
        let mut parts = vec![0.0; columns];
        for (row, it) in self.explained.iter().zip(column.iter()) {
            for (sum, q) in parts.iter_mut().zip(row) {
                *sum += q * it;
            }
        }
        for (row, it) in self.explained.iter().zip(column.iter_mut()) {
            *it -= row
                .iter()
                .zip(&parts)
                .map(|(q, part)| q * part)
                .sum::<f64>();
        }
    }
}

/// What was read, in its SI unit.
fn value(reading: Reading) -> f64 {
    match reading {
        Reading::Length { deviation, .. } => deviation.value(),
        Reading::Angle { deviation, .. } => deviation.value(),
    }
}
