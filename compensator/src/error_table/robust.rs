//! Which measured points do not belong: a burst of vibration, a door, a passing truck.
//!
//! Each deviation is compared with the median of its own target and approach after the offset of
//! its run is taken out (two sweeps of Tukey's median polish), in units of the scatter of all
//! points together (median absolute deviation). A node must have been measured at least three
//! times for its points to be judged: of two that disagree, nobody can say which is wrong.
//!
//! What stands out so is only suspected: of few points the median says little of their scatter. Suspects are left
//! out where least squares (a mean for each node, an offset for each run) prove it against the scatter of the
//! others (`outliers.rs`).

use units::{Approach, Metres};

use super::outliers::Additive;

use crate::error_table::LinearSeries;
use crate::uncertainty::{median, robust_sigma};

/// Sweeps of the median polish; it has settled after two when outliers are few.
const SWEEPS: usize = 2;

/// From so many scatters on a point is suspected. Whether it is left out is decided by a test.
const SUSPECTED: f64 = 6.0;

/// Name of one measured point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeasuredPoint {
    /// Its run.
    pub run: u32,
    /// Its approach.
    pub approach: Approach,
    /// Its target.
    pub target: Metres,
    /// Its deviation from the others of the same target and approach.
    pub residual: Metres,
}

/// What was left out of a fit, so that it can be reported and measured again.
#[derive(Clone, Debug, PartialEq)]
pub struct Robust {
    /// The points left out.
    pub outliers: Vec<MeasuredPoint>,
    /// Points that could be judged.
    pub judged: usize,
    /// Outliers / all points.
    pub share: f64,
    /// The scatter the points were judged by.
    pub sigma: Metres,
}

/// Residuals of every measurement from its node's and its run's medians.
pub(super) struct Polished {
    /// One per measurement, metres.
    pub(super) residuals: Vec<f64>,
    /// How often each measurement's node was measured.
    pub(super) repeats: Vec<usize>,
}

/// Two-way median polish: deviation = node + run + residual.
pub(super) fn polish(series: &LinearSeries) -> Polished {
    let measurements = series.measurements();
    let mut residuals: Vec<f64> = measurements.iter().map(|m| m.deviation().value()).collect();
    let mut nodes: Vec<Vec<usize>> = Vec::new();
    for target in series.targets() {
        for approach in [Approach::Forward, Approach::Reverse] {
            nodes.push(indices(series, |m| {
                m.target == target && m.approach == approach
            }));
        }
    }
    let runs: Vec<Vec<usize>> = series
        .runs()
        .into_iter()
        .map(|run| indices(series, |m| m.run == run))
        .collect();
    for _ in 0..SWEEPS {
        nodes.iter().for_each(|group| centre(&mut residuals, group));
        runs.iter().for_each(|group| centre(&mut residuals, group));
    }
    nodes.iter().for_each(|group| centre(&mut residuals, group));
    let mut repeats = vec![0; residuals.len()];
    for group in &nodes {
        group.iter().for_each(|&i| repeats[i] = group.len());
    }
    Polished { residuals, repeats }
}

fn indices(
    series: &LinearSeries,
    belongs: impl Fn(&crate::error_table::Measurement) -> bool,
) -> Vec<usize> {
    let all = series.measurements().iter().enumerate();
    all.filter(|(_, m)| belongs(m)).map(|(i, _)| i).collect()
}

fn centre(residuals: &mut [f64], group: &[usize]) {
    let values: Vec<f64> = group.iter().map(|&i| residuals[i]).collect();
    if let Some(middle) = median(&values) {
        group.iter().for_each(|&i| residuals[i] -= middle);
    }
}

/// Names the measurements that are further from their node than noise brings any of a series in a share
/// `false_alarms` of sound ones, by index.
///
/// `floor` is the smallest scatter believed, so that noiseless data have no outliers by rounding.
pub(super) fn find(
    series: &LinearSeries,
    false_alarms: f64,
    floor: Metres,
) -> (Vec<usize>, Robust) {
    let Polished { residuals, repeats } = polish(series);
    let judged: Vec<usize> = (0..residuals.len()).filter(|&i| repeats[i] >= 3).collect();
    // The median of n points takes their scatter with it; n/(n − 1) gives back most of that.
    let widened: Vec<f64> = judged
        .iter()
        .map(|&i| residuals[i] * (repeats[i] as f64 / (repeats[i] - 1) as f64).sqrt())
        .filter(|r| *r != 0.0)
        .collect();
    let sigma = robust_sigma(&widened).unwrap_or(0.0).max(floor.value());
    let suspects: Vec<usize> = judged
        .iter()
        .copied()
        .filter(|&i| residuals[i].abs() > SUSPECTED * sigma)
        .collect();
    let bad = Additive::new(series).proven(suspects, false_alarms);
    let outliers = bad
        .iter()
        .map(|&i| {
            let m = series.measurements()[i];
            let residual = Metres(residuals[i]);
            MeasuredPoint {
                run: m.run,
                approach: m.approach,
                target: m.target,
                residual,
            }
        })
        .collect();
    let share = bad.len() as f64 / residuals.len() as f64;
    (
        bad,
        Robust {
            outliers,
            judged: judged.len(),
            share,
            sigma: Metres(sigma),
        },
    )
}
