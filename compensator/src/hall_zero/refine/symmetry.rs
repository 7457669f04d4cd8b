//! Whether curve 1 is even and curve 2 odd, as the two groups of magnets make them.

use units::Metres;

use super::{RefineError, Sensor};
use crate::hall_zero::profile::Bin;
use crate::uncertainty::rms;

/// How uneven curve 1 (or even curve 2) may be, as a share of its range.
const ASYMMETRY_MAX: f64 = 0.2;

/// How far both curves are from a symmetry, as shares of their ranges.
struct Symmetry {
    peak_even: f64,
    peak_odd: f64,
    slope_even: f64,
    slope_odd: f64,
}

impl Symmetry {
    /// Around `centre`, over distances up to `reach`.
    fn around(bins: &[Bin], centre: f64, reach: f64) -> Option<Self> {
        let value = |x: f64, f: fn(&Bin) -> f64| {
            let right = bins.partition_point(|b| b.x < x);
            let (a, b) = (bins.get(right.checked_sub(1)?)?, bins.get(right)?);
            Some(f(a) + (f(b) - f(a)) * (x - a.x) / (b.x - a.x))
        };
        let departures = |f: fn(&Bin) -> f64| {
            let middle = value(centre, f)?;
            let pairs: Vec<(f64, f64)> = (1..=20)
                .map(|k| reach * f64::from(k) / 20.0)
                .filter_map(|d| {
                    Some((
                        value(centre - d, f)? - middle,
                        value(centre + d, f)? - middle,
                    ))
                })
                .collect();
            let largest = pairs
                .iter()
                .map(|(l, r)| l.abs().max(r.abs()))
                .fold(f64::MIN_POSITIVE, f64::max);
            let odd_part: Vec<f64> = pairs.iter().map(|(l, r)| (l - r) / 2.0).collect();
            let even_part: Vec<f64> = pairs.iter().map(|(l, r)| (l + r) / 2.0).collect();
            Some((rms(&odd_part) / largest, rms(&even_part) / largest))
        };
        let (peak_even, peak_odd) = departures(|b| b.peak)?;
        let (slope_even, slope_odd) = departures(|b| b.slope)?;
        Some(Self {
            peak_even,
            peak_odd,
            slope_even,
            slope_odd,
        })
    }
}

/// Refuses curves that are not even (V1) and odd (V2) around the origin, and those that are the
/// other way round about another centre.
pub(super) fn check_symmetry(bins: &[Bin], origin: f64, width: f64) -> Result<(), RefineError> {
    let (low, high) = (bins[0].x, bins[bins.len() - 1].x);
    let reach_at = |centre: f64| 0.98 * (centre - low).min(high - centre);
    let Some(here) = Symmetry::around(bins, origin, reach_at(origin).min(width)) else {
        return Ok(());
    };
    let right = here.peak_even + here.slope_odd;
    for bin in bins {
        let reach = reach_at(bin.x);
        if reach < 0.3 * (high - low) {
            continue;
        }
        let Some(there) = Symmetry::around(bins, bin.x, reach) else {
            continue;
        };
        let swapped = there.peak_odd + there.slope_even;
        if swapped < 0.2 && swapped < 0.5 * right {
            return Err(RefineError::Swapped {
                around: Metres(bin.x),
            });
        }
    }
    for (sensor, asymmetry) in [
        (Sensor::Peak, here.peak_even),
        (Sensor::Slope, here.slope_odd),
    ] {
        if asymmetry > ASYMMETRY_MAX {
            return Err(RefineError::Asymmetric { sensor, asymmetry });
        }
    }
    Ok(())
}
