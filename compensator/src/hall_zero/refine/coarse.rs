//! What the plotted curves say before any fit: peak, level, and where the windows go.

use units::Volts;

use super::{Level, RefineError, RefineOptions, Side};
use crate::hall_zero::HallPoint;
use crate::hall_zero::profile::{Bin, profile, slopes};
use crate::uncertainty::median;

/// Windows reach this share of the half distance between the flanks, when not given.
pub(super) const WINDOW_SHARE: f64 = 0.3;

pub(super) fn bin_count(points: usize) -> usize {
    (points / 6).clamp(16, 400)
}

/// The first place where a polyline passes `level`, by linear interpolation.
pub(in crate::hall_zero) fn crossing(
    line: impl Iterator<Item = (f64, f64)>,
    level: f64,
) -> Option<f64> {
    let mut before: Option<(f64, f64)> = None;
    for (x, v) in line {
        if let Some((x0, v0)) = before
            && (v0 - level) * (v - level) <= 0.0
            && v0 != v
        {
            return Some(x0 + (x - x0) * (level - v0) / (v - v0));
        }
        before = Some((x, v));
    }
    None
}

/// What the profile says before any fit.
pub(super) struct Coarse {
    pub(super) bins: Vec<Bin>,
    pub(super) peak: f64,
    pub(super) level: f64,
    pub(super) left: f64,
    pub(super) right: f64,
    pub(super) centre: f64,
    pub(super) half_window: f64,
}

impl Coarse {
    pub(super) fn find(points: &[HallPoint], options: &RefineOptions) -> Result<Self, RefineError> {
        let bins = profile(points, bin_count(points.len()));
        let top = (0..bins.len()).max_by(|&a, &b| bins[a].peak.total_cmp(&bins[b].peak));
        let Some(top) = top.filter(|&top| top > 0 && top + 1 < bins.len()) else {
            let peak = Volts(
                points
                    .iter()
                    .map(|p| p.peak.value())
                    .fold(f64::MIN, f64::max),
            );
            return Err(RefineError::PeakAtEnd { peak });
        };
        let peak = bins[top].peak;
        let (left_part, right_part) = (&bins[..=top], &bins[top..]);
        let level = match options.level {
            Level::BelowPeak(depth) => peak - depth.value(),
            Level::Steepest => steepest_level(left_part, right_part, peak),
        };
        let outwards_left = left_part.iter().rev().map(|b| (b.x, b.peak));
        let outwards_right = right_part.iter().map(|b| (b.x, b.peak));
        let uncovered = |side, part: &[Bin]| RefineError::FlankNotCovered {
            side,
            lowest: Volts(part.iter().map(|b| b.peak).fold(f64::MAX, f64::min)),
            level: Volts(level),
        };
        let left =
            crossing(outwards_left, level).ok_or_else(|| uncovered(Side::Left, left_part))?;
        let right =
            crossing(outwards_right, level).ok_or_else(|| uncovered(Side::Right, right_part))?;
        let at = |x: f64| {
            let index = bins.partition_point(|b| b.x < x).min(bins.len() - 1);
            bins[index].slope
        };
        let mid = (at(left) + at(right)) / 2.0;
        let between = bins.iter().filter(|b| b.x >= left && b.x <= right);
        let centre = crossing(between.map(|b| (b.x, b.slope)), mid)
            .ok_or(RefineError::NoCentre { mid: Volts(mid) })?;
        // Half the smaller distance keeps the three windows apart.
        let apart = (centre - left).min(right - centre) / 2.0;
        let wanted = options
            .half_window
            .map_or(WINDOW_SHARE * (right - left) / 2.0, units::Metres::value);
        Ok(Self {
            peak,
            level,
            left,
            right,
            centre,
            half_window: wanted.min(apart),
            bins,
        })
    }
}

/// The level at which the flatter of both flanks is steepest.
fn steepest_level(left: &[Bin], right: &[Bin], peak: f64) -> f64 {
    let lowest = |part: &[Bin]| part.iter().map(|b| b.peak).fold(f64::MAX, f64::min);
    let depth = peak - lowest(left).max(lowest(right));
    let steepness = |part: &[Bin], level: f64| {
        let width = depth * 0.1;
        let near: Vec<f64> = slopes(part)
            .zip(part.windows(2))
            .filter(|(_, w)| ((w[0].peak + w[1].peak) / 2.0 - level).abs() < width)
            .map(|((_, slope, _), _)| slope.abs())
            .collect();
        median(&near).unwrap_or(0.0)
    };
    let candidates = (6..=16).map(|k| peak - depth * f64::from(k) * 0.05);
    let score = |level: f64| steepness(left, level).min(steepness(right, level));
    candidates
        .map(|level| (level, score(level)))
        .fold((peak - depth / 2.0, 0.0), |best, c| {
            if c.1 > best.1 { c } else { best }
        })
        .0
}
