//! Straight lines through the rows of a path, with corners that the axes can follow.
//!
//! From row to row every axis has one speed. At row `i` the speeds change by Δv: not at once, but from `h_i` before
//! the row's time until `h_i` after it, by the cubic step s(u) = 3u² − 2u³, u from 0 to 1. So the acceleration has no
//! steps; its largest value is 0.75 Δv / h, that of the jerk 1.5 Δv / h². As the step is symmetrical the path is on the
//! next line again at the time at which it would have been there, and it passes the corner at a distance of 3/16 h |Δv|, or less
//! where the speed changes as well as its direction. Nowhere is it farther from the two lines than that. Two roundings never overlap.
//!
//! h is as large as the limits of acceleration and jerk want, and no larger than the distance that was allowed and
//! the times between the rows make it. Where it is smaller than the limits want, the path cannot be driven; whoever judges its points finds that
//! out. On a straight line, and where the path stands, nothing is left however large h is.
//!
//! The path begins at rest: the first row's step is driven from its beginning, so that all rows come `h_0` later than
//! they say, and the path ends `h_n` after its last row.

use units::Metres;

use super::limits::AxisLimits;
use super::rows::interval;

/// In u, where the step is half done: 2 (u³ − u⁴/2).
const CORNER: f64 = 3.0 / 16.0;
/// Directions that differ by less are one.
const STRAIGHT: f64 = 1e-12;

/// A row at which speeds change.
#[derive(Clone, Copy, Debug, Default)]
struct Step {
    /// Half of how long that takes, seconds.
    half: f64,
    /// What the axes' limits want it to be.
    wanted: f64,
    /// What the distance that is allowed makes it at most.
    allowed: f64,
    /// By how much the speeds change, in the space of all axes, mm/s; of a corner only what carries the path beside it.
    change: f64,
    /// Whether the path leaves its lines there.
    is_corner: bool,
}

/// A corner that would have to be rounded more than is allowed.
#[derive(Clone, Debug, PartialEq)]
pub struct TightCorner {
    /// The line of its row in the file, counted from 1.
    pub line: usize,
    /// When the path passes it, in seconds from its beginning.
    pub at_s: f64,
    /// So many seconds before and after that it is rounded.
    pub half_s: f64,
    /// How far from it the path would have to pass.
    pub wants: Metres,
}

/// The lines through some rows.
pub(super) struct Blended<'a> {
    times: &'a [f64],
    /// By axis, mm.
    positions: &'a [Vec<f64>],
    steps: Vec<Step>,
}

impl<'a> Blended<'a> {
    /// Through two rows or more, past each corner within `blend_mm`.
    pub(super) fn new(
        times: &'a [f64],
        positions: &'a [Vec<f64>],
        blend_mm: f64,
        limits: &[AxisLimits],
    ) -> Self {
        let mut blended = Self {
            times,
            positions,
            steps: Vec::new(),
        };
        let steps = (0..times.len()).map(|row| blended.step(row, blend_mm, limits));
        let steps: Vec<Step> = steps.collect();
        blended.steps = apart(&steps, times);
        blended
    }

    /// Speed of an axis from row number `row` to the next one; 0 before the first and behind the last.
    fn speed(&self, axis: usize, row: Option<usize>) -> f64 {
        let Some(row) = row.filter(|it| it + 1 < self.times.len()) else {
            return 0.0;
        };
        let values = &self.positions[axis];
        (values[row + 1] - values[row]) / (self.times[row + 1] - self.times[row])
    }

    fn speeds_around(&self, axis: usize, row: usize) -> [f64; 2] {
        [row.checked_sub(1), Some(row)].map(|it| self.speed(axis, it))
    }

    fn step(&self, row: usize, blend_mm: f64, limits: &[AxisLimits]) -> Step {
        let (mut wanted, mut change) = (0.0_f64, 0.0);
        let (mut along, mut before, mut after) = (0.0, 0.0, 0.0);
        for (axis, limits) in limits.iter().enumerate().take(self.positions.len()) {
            let [from, to] = self.speeds_around(axis, row);
            let differs = to - from;
            let acceleration = limits.acceleration.value() * 1e3;
            let jerk = limits.jerk.value() * 1e3;
            wanted = wanted.max(0.75 * differs.abs() / acceleration);
            wanted = wanted.max((1.5 * differs.abs() / jerk).sqrt());
            change += differs * differs;
            along += from * to;
            before += from * from;
            after += to * to;
        }
        let both = f64::sqrt(before * after);
        let is_corner = along < both * (1.0 - STRAIGHT);
        // Where the path goes on, what one speed has across the other's direction carries it beside the corner, and not
        // that one is higher.
        let across = f64::sqrt((before * after - along * along).max(0.0));
        let beside = f64::sqrt(2.0) * across / f64::sqrt(before.min(after));
        let change = match along > 0.0 {
            true => f64::sqrt(change).min(beside),
            false => f64::sqrt(change),
        };
        let allowed = match is_corner && change > 0.0 {
            true => blend_mm / (CORNER * change),
            false => f64::INFINITY,
        };
        let last = self.times.last().copied().unwrap_or_default();
        Step {
            half: wanted.min(allowed).min(last),
            wanted,
            allowed,
            change,
            is_corner,
        }
    }

    /// How long it takes, in seconds.
    pub(super) fn takes(&self) -> f64 {
        let [first, last] = [self.steps.first(), self.steps.last()];
        let halves: f64 = [first, last].into_iter().flatten().map(|it| it.half).sum();
        self.times.last().copied().unwrap_or_default() + halves
    }

    /// By how much later than they say the rows come.
    pub(super) fn delay(&self) -> f64 {
        self.steps.first().map_or(0.0, |it| it.half)
    }

    /// Where an axis is so many seconds after the beginning, mm.
    pub(super) fn at(&self, axis: usize, seconds: f64) -> f64 {
        let time = seconds - self.delay();
        let row = interval(self.times, time);
        let values = &self.positions[axis];
        for near in [row, row + 1] {
            let (half, since) = (self.steps[near].half, time - self.times[near]);
            if since.abs() < half {
                let [from, to] = self.speeds_around(axis, near);
                let u = (since + half) / (2.0 * half);
                let stepped = 2.0 * half * (to - from) * (u * u * u - u * u * u * u / 2.0);
                return values[near] + from * since + stepped;
            }
        }
        let last = self.times.len() - 1;
        match time {
            it if it <= 0.0 => values[0],
            it if it >= self.times[last] => values[last],
            _ => values[row] + self.speed(axis, Some(row)) * (time - self.times[row]),
        }
    }

    /// The corner that is passed at the largest distance: its row, and the distance, mm.
    pub(super) fn widest(&self) -> Option<(usize, f64)> {
        let corners = self.steps.iter().enumerate().filter(|it| it.1.is_corner);
        let passed = corners.map(|(row, it)| (row, CORNER * it.half * it.change));
        passed.max_by(|one, other| one.1.total_cmp(&other.1))
    }

    /// When a row is passed, in seconds from the beginning.
    pub(super) fn passes(&self, row: usize) -> f64 {
        self.times[row] + self.delay()
    }

    /// The corners that the axes cannot follow at the speed of the rows, as what is allowed is too little; `lines` are
    /// those of the rows.
    pub(super) fn tight(&self, lines: &[usize]) -> Vec<TightCorner> {
        let corners = self.steps.iter().zip(lines).enumerate();
        let corners = corners.filter(|(_, (it, _))| it.wanted > it.allowed);
        let told = corners.map(|(row, (step, line))| TightCorner {
            line: *line,
            at_s: self.passes(row),
            half_s: step.half,
            wants: Metres::from_mm(CORNER * step.wanted * step.change),
        });
        told.collect()
    }
}

/// The same, none longer than the times between the rows have room for: two that would overlap give way in proportion.
fn apart(steps: &[Step], times: &[f64]) -> Vec<Step> {
    let share = |row: usize| {
        let both = steps[row].half + steps[row + 1].half;
        let span = times[row + 1] - times[row];
        if both > span { span / both } else { 1.0 }
    };
    let each = steps.iter().enumerate().map(|(row, step)| {
        let before = row.checked_sub(1).map_or(1.0, share);
        let after = if row + 1 < steps.len() {
            share(row)
        } else {
            1.0
        };
        Step {
            half: step.half * before.min(after),
            ..*step
        }
    });
    each.collect()
}

#[cfg(test)]
mod tests;
