//! From repeated runs to a table with uncertainties (steps 2 and 3 of the patent, done well).
//!
//! Each node is the mean of its measurements per approach. Its standard uncertainty is s/√n,
//! with s of that node or pooled over all nodes of the approach, combined with the instrument's
//! own. The means of the runs show thermal drift; how far the last run lies from the first is
//! the closure error.

use std::collections::BTreeMap;

use units::{Approach, Metres};

use super::robust::{self, MeasuredPoint, Robust};
use super::{ErrorTable, Node, TableError};
use crate::error_table::LinearSeries;
use crate::uncertainty::{combine, mean};

/// How the scatter behind a node's uncertainty is taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NodeScatter {
    /// One for all nodes of an approach: many degrees of freedom, assumes even scatter.
    Pooled,
    /// Each node's own; needs at least two measurements there.
    PerNode,
}

/// What a fit should do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FitOptions {
    /// How scatter is taken.
    pub scatter: NodeScatter,
    /// Standard uncertainty of the instrument itself, common to all its readings.
    pub u_instrument: Metres,
    /// In which share of sound series a point may be left out.
    pub outlier_false_alarms: f64,
    /// Largest share of points left out, 0 to 1.
    pub outlier_share_max: f64,
    /// The smallest scatter believed (the instrument's resolution).
    pub scatter_floor: Metres,
    /// Whether each run's own offset is taken out before the means are formed.
    pub remove_drift: bool,
    /// Largest closure error accepted, if one is set.
    pub closure_max: Option<Metres>,
}

impl Default for FitOptions {
    /// Pooled scatter, a perfect instrument of 1 nm resolution, points left out in one of 10 000
    /// sound series, at most 20 % of them; drift reported, not removed; no limit on closure.
    fn default() -> Self {
        Self {
            scatter: NodeScatter::Pooled,
            u_instrument: Metres::ZERO,
            outlier_false_alarms: 1e-4,
            outlier_share_max: 0.2,
            scatter_floor: Metres(1e-9),
            remove_drift: false,
            closure_max: None,
        }
    }
}

/// The offset of one run from the mean of all.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RunDrift {
    /// The run.
    pub run: u32,
    /// Mean of its residuals.
    pub offset: Metres,
}

/// How the axis moved under the measurement from run to run.
#[derive(Clone, Debug, PartialEq)]
pub struct Drift {
    /// Each run's offset, in order.
    pub runs: Vec<RunDrift>,
    /// Offset of the last run − offset of the first; `None` for a single run, which has no other to differ
    /// from.
    pub closure: Option<Metres>,
    /// Standard uncertainty of the closure from the scatter within the runs.
    pub u_closure: Option<Metres>,
}

/// A table and how it came about.
#[derive(Clone, Debug, PartialEq)]
pub struct Fitted {
    /// The table.
    pub table: ErrorTable,
    /// What was left out.
    pub robust: Robust,
    /// Drift from run to run.
    pub drift: Drift,
    /// Pooled standard deviation of a single measurement forward, if one was repeated.
    pub s_forward: Option<Metres>,
    /// The same in reverse.
    pub s_reverse: Option<Metres>,
    /// How the repetitions forward are counted.
    pub repeats_forward: Repeats,
    /// The same in reverse.
    pub repeats_reverse: Repeats,
}

/// How often the positions of one approach were measured, without what was left out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Repeats {
    /// Measurements at the position that has the fewest.
    pub fewest: usize,
    /// Degrees of freedom of the pooled scatter: all measurements less all positions.
    pub degrees_of_freedom: usize,
}

/// Why measurements give no table.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FitError {
    /// More outliers than the limit: the measurement as a whole is not to be believed.
    #[error(
        "error table: {} of the points ({:.0} %) lie far from the others of their target, the \
         limit is {:.0} %; the first is run {}, approach `{}`, target {} mm, off by {:.2} um. \
         Look for vibration, a loose reflector or an unsteady beam and measure again",
        points.len(), share * 100.0, limit * 100.0, points[0].run,
        points[0].approach.symbol(), units::Short(points[0].target.mm()), points[0].residual.um()
    )]
    TooManyOutliers {
        /// Share of points left out.
        share: f64,
        /// The limit.
        limit: f64,
        /// The points, never empty.
        points: Vec<MeasuredPoint>,
    },
    /// A target not measured in an approach that other targets have.
    #[error("error table: target {} mm was not measured with approach `{}`, others were",
        units::Short(target.mm()), approach.symbol())]
    MissingTarget {
        /// The target.
        target: Metres,
        /// The approach.
        approach: Approach,
    },
    /// One measurement only, where the scatter of each node is asked for.
    #[error("error table: target {} mm has one measurement with approach `{}`; per-node scatter \
         needs two", units::Short(target.mm()), approach.symbol())]
    TooFewRuns {
        /// The target.
        target: Metres,
        /// The approach.
        approach: Approach,
    },
    /// The last run lies too far from the first.
    #[error("error table: the axis drifted by {:.2} um from the first run to the last, the limit \
         is {:.2} um; let the machine warm up and measure again", closure.um(), limit.um())]
    Closure {
        /// Last − first.
        closure: Metres,
        /// The limit.
        limit: Metres,
    },
    /// The nodes do not form a table.
    #[error(transparent)]
    Table(#[from] TableError),
}

/// Fits the table alone; see [`analyse`].
///
/// # Errors
/// As [`analyse`].
pub fn fit(series: &LinearSeries, options: &FitOptions) -> Result<ErrorTable, FitError> {
    analyse(series, options).map(|fitted| fitted.table)
}

/// Fits a table and reports outliers, drift and scatter with it.
///
/// One approach alone is allowed; the table then knows only that one.
///
/// # Errors
/// Too many outliers, a target missing in one approach, or closure above its limit.
///
/// # Example
///
/// ```
/// use compensator::error_table::{FitOptions, LinearSeries, analyse};
///
/// // Two runs, the second 1 µm below the first.
/// let csv = "run,approach,target_mm,measured_mm\n\
///            1,+,0,0.0005\n1,+,10,10.0005\n2,+,0,-0.0005\n2,+,10,9.9995\n";
/// let fitted = analyse(&LinearSeries::from_csv(csv, "x.csv")?, &FitOptions::default())?;
/// let closure = fitted.drift.closure.expect("there are two runs");
/// assert!((closure.um() + 1.0).abs() < 1e-6, "last − first");
/// let u = fitted.table.nodes()[0].u_forward.expect("each target was repeated");
/// assert!((u.um() - 0.5).abs() < 1e-6, "s/√2, with s = 1 µm/√2");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn analyse(series: &LinearSeries, options: &FitOptions) -> Result<Fitted, FitError> {
    let (bad, robust) = robust::find(series, options.outlier_false_alarms, options.scatter_floor);
    if robust.share > options.outlier_share_max {
        return Err(FitError::TooManyOutliers {
            share: robust.share,
            limit: options.outlier_share_max,
            points: robust.outliers,
        });
    }
    let mut cells = Cells::new(series, &bad);
    let drift = cells.drift();
    if let (Some(limit), Some(closure)) = (options.closure_max, drift.closure)
        && closure.abs() > limit
    {
        return Err(FitError::Closure { closure, limit });
    }
    if options.remove_drift {
        cells.remove(&drift);
    }
    let s_forward = cells.pooled_sd(Approach::Forward);
    let s_reverse = cells.pooled_sd(Approach::Reverse);
    let approaches = [
        (Approach::Forward, s_forward),
        (Approach::Reverse, s_reverse),
    ];
    let mut nodes: Vec<Node> = series.targets().into_iter().map(empty_node).collect();
    for (approach, pooled) in approaches {
        if cells.groups.keys().any(|key| key.1 == approach) {
            for (index, node) in nodes.iter_mut().enumerate() {
                let values = cells
                    .groups
                    .get(&(index, approach))
                    .map_or(&[][..], Vec::as_slice);
                fill(node, approach, values, pooled, options)?;
            }
        }
    }
    let table = ErrorTable::new(nodes)?;
    let (s_forward, s_reverse) = (s_forward.map(Metres), s_reverse.map(Metres));
    Ok(Fitted {
        table,
        robust,
        drift,
        s_forward,
        s_reverse,
        repeats_forward: cells.repeats(Approach::Forward),
        repeats_reverse: cells.repeats(Approach::Reverse),
    })
}

fn empty_node(position: Metres) -> Node {
    Node {
        position,
        forward: None,
        reverse: None,
        u_forward: None,
        u_reverse: None,
    }
}

fn fill(
    node: &mut Node,
    approach: Approach,
    values: &[(u32, f64)],
    pooled: Option<f64>,
    options: &FitOptions,
) -> Result<(), FitError> {
    let target = node.position;
    let deviations: Vec<f64> = values.iter().map(|(_, d)| *d).collect();
    let centre = mean(&deviations).ok_or(FitError::MissingTarget { target, approach })?;
    let scatter = match options.scatter {
        NodeScatter::Pooled => pooled,
        NodeScatter::PerNode => Some(
            crate::uncertainty::standard_deviation(&deviations)
                .ok_or(FitError::TooFewRuns { target, approach })?,
        ),
    };
    let own = scatter.map(|s| s / (deviations.len() as f64).sqrt());
    let u = own.map(|own| Metres(combine(&[own, options.u_instrument.value()])));
    match approach {
        Approach::Forward => (node.forward, node.u_forward) = (Some(Metres(centre)), u),
        Approach::Reverse => (node.reverse, node.u_reverse) = (Some(Metres(centre)), u),
    }
    Ok(())
}

/// The good deviations by node index and approach, each with its run.
struct Cells {
    groups: BTreeMap<(usize, Approach), Vec<(u32, f64)>>,
}

impl Cells {
    fn new(series: &LinearSeries, bad: &[usize]) -> Self {
        let targets = series.targets();
        let mut groups: BTreeMap<(usize, Approach), Vec<(u32, f64)>> = BTreeMap::new();
        for (index, m) in series.measurements().iter().enumerate() {
            if bad.binary_search(&index).is_ok() {
                continue;
            }
            let node = targets.partition_point(|t| *t < m.target);
            groups
                .entry((node, m.approach))
                .or_default()
                .push((m.run, m.deviation().value()));
        }
        Self { groups }
    }

    /// Each run's mean residual from the means of its nodes.
    ///
    /// A node missing from a run pulls its mean by the other runs' offsets; repeating the two
    /// steps of the additive model takes that out.
    fn drift(&self) -> Drift {
        let mut offsets: BTreeMap<u32, f64> = BTreeMap::new();
        let mut scatter = 0.0;
        let mut sizes: BTreeMap<u32, usize> = BTreeMap::new();
        for _ in 0..20 {
            let mut sums: BTreeMap<u32, (f64, usize)> = BTreeMap::new();
            let mut squares = (0.0, 0_usize);
            for values in self.groups.values() {
                let offset = |run: &u32| offsets.get(run).copied().unwrap_or(0.0);
                let levelled: Vec<f64> = values.iter().map(|(run, d)| d - offset(run)).collect();
                let centre = mean(&levelled).expect("a group exists only with a value in it");
                for ((run, d), level) in values.iter().zip(&levelled) {
                    let sum = sums.entry(*run).or_default();
                    sum.0 += d - centre;
                    sum.1 += 1;
                    squares.0 += (level - centre) * (level - centre);
                }
                squares.1 += values.len() - 1;
            }
            offsets = sums
                .iter()
                .map(|(run, (sum, n))| (*run, sum / *n as f64))
                .collect();
            sizes = sums.into_iter().map(|(run, (_, n))| (run, n)).collect();
            scatter = (squares.0 / squares.1.max(1) as f64).sqrt();
        }
        let runs: Vec<RunDrift> = offsets
            .iter()
            .map(|(run, o)| RunDrift {
                run: *run,
                offset: Metres(*o),
            })
            .collect();
        let own = |run: u32| scatter / (sizes.get(&run).copied().unwrap_or(1) as f64).sqrt();
        let ends = match runs.as_slice() {
            [first, .., last] => Some((*first, *last)),
            _ => None,
        };
        Drift {
            closure: ends.map(|(first, last)| last.offset - first.offset),
            u_closure: ends.map(|(first, last)| Metres(combine(&[own(first.run), own(last.run)]))),
            runs,
        }
    }

    fn remove(&mut self, drift: &Drift) {
        for (run, deviation) in self.groups.values_mut().flatten() {
            let own = drift.runs.iter().find(|r| r.run == *run);
            *deviation -= own.map_or(0.0, |r| r.offset.value());
        }
    }

    fn repeats(&self, approach: Approach) -> Repeats {
        let counts = self.groups.iter().filter(|(key, _)| key.1 == approach);
        let counts: Vec<usize> = counts.map(|(_, values)| values.len()).collect();
        Repeats {
            fewest: counts.iter().copied().min().unwrap_or(0),
            degrees_of_freedom: counts.iter().map(|it| it.saturating_sub(1)).sum(),
        }
    }

    /// √(Σ squares / Σ (n − 1)) over the nodes of one approach; `None` if none was repeated.
    fn pooled_sd(&self, approach: Approach) -> Option<f64> {
        let (mut squares, mut freedom) = (0.0, 0);
        for (_, values) in self.groups.iter().filter(|(key, _)| key.1 == approach) {
            let deviations: Vec<f64> = values.iter().map(|(_, d)| *d).collect();
            let centre = mean(&deviations)?;
            squares += deviations
                .iter()
                .map(|d| (d - centre) * (d - centre))
                .sum::<f64>();
            freedom += deviations.len() - 1;
        }
        (freedom > 0).then(|| (squares / freedom as f64).sqrt())
    }
}

#[cfg(test)]
#[path = "fit_tests.rs"]
mod tests;
