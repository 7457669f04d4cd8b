//! Both curves as means over equal bins of position: what a person sees in a plot.

use crate::hall_zero::HallPoint;

/// Means of the points in one bin; bins without points are left out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Bin {
    /// Mean position in metres.
    pub(super) x: f64,
    /// Mean V1.
    pub(super) peak: f64,
    /// Mean V2.
    pub(super) slope: f64,
}

/// The profile of `points` in about `bins` bins, increasing in position.
pub(super) fn profile(points: &[HallPoint], bins: usize) -> Vec<Bin> {
    let positions = || points.iter().map(|p| p.position.value());
    let low = positions().fold(f64::INFINITY, f64::min);
    let high = positions().fold(f64::NEG_INFINITY, f64::max);
    let width = (high - low) / bins as f64;
    if !(width > 0.0 && width.is_finite()) {
        return Vec::new();
    }
    let mut sums = vec![(0_usize, 0.0, 0.0, 0.0); bins];
    for p in points {
        let index = (((p.position.value() - low) / width) as usize).min(bins - 1);
        let sum = &mut sums[index];
        sum.0 += 1;
        sum.1 += p.position.value();
        sum.2 += p.peak.value();
        sum.3 += p.slope.value();
    }
    sums.into_iter()
        .filter(|sum| sum.0 > 0)
        .map(|(n, x, peak, slope)| {
            let n = n as f64;
            Bin {
                x: x / n,
                peak: peak / n,
                slope: slope / n,
            }
        })
        .collect()
}

/// (position, slope of V1, slope of V2) between neighbouring bins.
pub(super) fn slopes(profile: &[Bin]) -> impl Iterator<Item = (f64, f64, f64)> {
    profile.windows(2).map(|w| {
        let width = w[1].x - w[0].x;
        let middle = (w[0].x + w[1].x) / 2.0;
        (
            middle,
            (w[1].peak - w[0].peak) / width,
            (w[1].slope - w[0].slope) / width,
        )
    })
}
