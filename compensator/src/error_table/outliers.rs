//! Are suspected points outliers? A test by least squares.
//!
//! The model is additive: a mean for each position and approach, an offset for each run. Leaving out m of the N
//! points lowers the sum of squares; by how much noise does is Fisher's F with m and ν − m degrees of freedom.
//! There are N over m sets of that size, of which the suspects may be the most conspicuous one, so that the
//! probability of one set is multiplied by their number (Bonferroni); the sizes share the rate of false alarms as
//! ½, ¼, ⅛ … of it. Of a set that is proven as a whole each point must be proven beside the others, too: a
//! point that is not is kept, and the rest is judged again.
//!
//! Absent: outliers that nobody suspects.

use std::collections::BTreeMap;

use units::Approach;
use units::portable::{exp, ln};

use crate::error_table::LinearSeries;
use crate::significance::f_tail;

/// Sweeps of the two steps of the additive model; without missing points one does.
const SWEEPS: usize = 20;

/// The deviations of a series by node and run.
pub(super) struct Additive {
    /// Node, run and deviation in metres of each measurement.
    points: Vec<(usize, u32, f64)>,
}

/// What is left of some points.
struct Left {
    squares: f64,
    freedom: usize,
}

impl Additive {
    pub(super) fn new(series: &LinearSeries) -> Self {
        let targets = series.targets();
        let points = series.measurements().iter().map(|m| {
            let side = usize::from(m.approach == Approach::Reverse);
            let node = 2 * targets.partition_point(|it| *it < m.target) + side;
            (node, m.run, m.deviation().value())
        });
        Self {
            points: points.collect(),
        }
    }

    /// Those of the `suspects` that are outliers, where a sound series has any in a share `false_alarms` of
    /// cases; indices of measurements, increasing.
    pub(super) fn proven(&self, mut suspects: Vec<usize>, false_alarms: f64) -> Vec<usize> {
        let all = self.left(&[]);
        while !suspects.is_empty() {
            let rest = self.left(&suspects);
            if self.is_noise(&suspects, (&all, &rest), false_alarms) {
                return Vec::new();
            }
            let Some(at) = self.unproven(&suspects, &rest, false_alarms) else {
                break;
            };
            suspects.remove(at);
        }
        suspects
    }

    /// Whether noise may make as conspicuous a set of this size in more than its share of sound series.
    fn is_noise(&self, set: &[usize], (all, rest): (&Left, &Left), false_alarms: f64) -> bool {
        let size = set.len() as f64;
        let ln_sets: f64 = (0..set.len())
            .map(|it| ln((self.points.len() - it) as f64) - ln(it as f64 + 1.0))
            .sum();
        let share = ln(false_alarms) - size * core::f64::consts::LN_2 - ln_sets;
        // A comparison with NaN is false; of many points both may be too small for a number.
        let is_proven = chance(all, rest, set.len()) <= exp(share);
        !is_proven
    }

    /// The place among `set` of the point that is the least conspicuous one beside the others, if it is not
    /// proven.
    fn unproven(&self, set: &[usize], rest: &Left, false_alarms: f64) -> Option<usize> {
        let beside_others = |at: usize| {
            let mut others = set.to_vec();
            others.remove(at);
            chance(&self.left(&others), rest, 1)
        };
        let least = (0..set.len()).map(|at| (at, beside_others(at)));
        let (at, chance) = least.max_by(|a, b| a.1.total_cmp(&b.1))?;
        let is_proven = chance < false_alarms / self.points.len() as f64;
        (!is_proven).then_some(at)
    }

    /// What the model leaves of the points but those `without`, which increase.
    fn left(&self, without: &[usize]) -> Left {
        let is_used = |(at, _): &(usize, _)| without.binary_search(at).is_err();
        let used: Vec<(usize, u32, f64)> = (self.points.iter().enumerate())
            .filter(is_used)
            .map(|(_, it)| *it)
            .collect();
        let (mut nodes, mut runs) = (BTreeMap::new(), BTreeMap::new());
        for _ in 0..SWEEPS {
            nodes = means(&used, |it| it.0, |it| it.2 - of(&runs, it.1));
            runs = means(&used, |it| it.1, |it| it.2 - of(&nodes, it.0));
        }
        let rests = used
            .iter()
            .map(|it| it.2 - of(&nodes, it.0) - of(&runs, it.1));
        let parameters = nodes.len() + runs.len().saturating_sub(1);
        Left {
            squares: rests.map(|it| it * it).sum(),
            freedom: used.len().saturating_sub(parameters),
        }
    }
}

/// The probability that noise is lowered so much by leaving out `size` points; 1 where nobody can say.
fn chance(all: &Left, rest: &Left, size: usize) -> f64 {
    if rest.freedom == 0 {
        return 1.0;
    }
    let explained = (all.squares - rest.squares).max(0.0) / size as f64;
    f_tail(
        explained / (rest.squares / rest.freedom as f64),
        size,
        rest.freedom,
    )
}

fn of<K: Ord>(means: &BTreeMap<K, f64>, key: K) -> f64 {
    means.get(&key).copied().unwrap_or(0.0)
}

fn means<K: Ord>(
    points: &[(usize, u32, f64)],
    key: impl Fn(&(usize, u32, f64)) -> K,
    value: impl Fn(&(usize, u32, f64)) -> f64,
) -> BTreeMap<K, f64> {
    let mut sums: BTreeMap<K, (f64, usize)> = BTreeMap::new();
    for it in points {
        let sum = sums.entry(key(it)).or_default();
        sum.0 += value(it);
        sum.1 += 1;
    }
    let mean = |(key, (sum, count))| (key, sum / count as f64);
    sums.into_iter().map(mean).collect()
}
