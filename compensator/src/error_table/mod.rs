//! Linear axis: the table of its deviations, and the command that undoes them (system S3).
//!
//! Source: CN104076739A, steps 1–7: run step by step, read the laser interferometer at every
//! step, negate the errors into a compensation table, and for every job coordinate P find its
//! interval x_n and drive to P' = P + compensation(x_n). The patent holds for errors without
//! abrupt jumps; [`ErrorTable::judge_neighbours`] makes that a refusal which names the position.
//!
//! | symbol | name here |
//! |---|---|
//! | l_1 … l_n | distances between [`Node::position`]s |
//! | x_n | the interval between two nodes |
//! | error of x_n | [`Node::forward`], [`Node::reverse`]: deviations (actual − target) |
//! | compensation(x_n) | −deviation |
//! | P → P' | [`Compensation::set_point`] |
//!
//! Beyond the patent: both approaches apart with the lost motion between them, repeated runs
//! with standard uncertainties and named outliers, linear and monotone cubic interpolation, and
//! the exact inverse, proven unique when the compensation is made.
//!
//! Absent: periodic terms over a screw lead (system S1), storage, the machine's identity.

mod comp_file;
mod compensation;
mod curve;
mod datum_slip;
mod fit;
mod listed;
mod outliers;
mod robust;
mod series;
mod slip;
mod stand_off;
pub mod uncertainty;

use units::{Approach, Metres};

pub use crate::interpolation::Interpolation;
pub(crate) use curve::Curve;

pub use comp_file::{CompFileType, ROWS_MAX, comp_file};
pub use compensation::{Compensation, CompensationError, EndPolicy, LimitName, Limits, OutOfRange};
pub use datum_slip::{Shifts, slip_at_start};
pub use fit::{Drift, FitError, FitOptions, Fitted, NodeScatter, Repeats, RunDrift, analyse, fit};
pub use listed::TableFault;
pub use robust::{MeasuredPoint, Robust};
pub use series::{LinearFault, LinearSeries, Measurement, SeriesError};
pub use slip::{Change, SLIP_FALSE_ALARMS, Slip, find_slip};
pub use stand_off::{FALSE_ALARMS, StandOff};

/// One position of the table. Plain data, so that a store can write its own form of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Node {
    /// The target at which the deviations were measured.
    pub position: Metres,
    /// Mean deviation (actual − target) approached forward, if measured.
    pub forward: Option<Metres>,
    /// Mean deviation approached in reverse, if measured.
    pub reverse: Option<Metres>,
    /// Standard uncertainty of `forward`.
    pub u_forward: Option<Metres>,
    /// Standard uncertainty of `reverse`.
    pub u_reverse: Option<Metres>,
}

impl Node {
    /// The mean deviation for one approach, if measured.
    pub fn deviation(&self, approach: Approach) -> Option<Metres> {
        match approach {
            Approach::Forward => self.forward,
            Approach::Reverse => self.reverse,
        }
    }

    /// The standard uncertainty of that deviation.
    pub fn standard_uncertainty(&self, approach: Approach) -> Option<Metres> {
        match approach {
            Approach::Forward => self.u_forward,
            Approach::Reverse => self.u_reverse,
        }
    }
}

/// The mean difference between both approaches, reverse − forward.
///
/// ISO 230-2's mean reversal value is forward − reverse: the same with the other sign.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LostMotion {
    /// Mean over the nodes of (reverse − forward).
    pub mean: Metres,
    /// Its standard uncertainty, where every node has one; the instrument's own cancels in the
    /// difference.
    pub standard_uncertainty: Option<Metres>,
    /// Smallest and largest (reverse − forward) of any node.
    pub range: (Metres, Metres),
}

/// The deviations of a linear axis at strictly increasing positions.
///
/// # Example
///
/// ```
/// use compensator::error_table::{ErrorTable, Node};
/// use units::{Approach, Metres};
///
/// let node = |mm: f64, forward_um: f64, reverse_um: f64| Node {
///     position: Metres::from_mm(mm),
///     forward: Some(Metres::from_um(forward_um)),
///     reverse: Some(Metres::from_um(reverse_um)),
///     u_forward: None,
///     u_reverse: None,
/// };
/// let table = ErrorTable::new(vec![node(0.0, 1.0, 3.0), node(3.0, -1.0, 3.0)])?;
/// let lost_motion = table.lost_motion().expect("both approaches are known");
/// assert!((lost_motion.mean.um() - 3.0).abs() < 1e-12, "the mean of 2 µm and 4 µm");
/// assert!(table.knows(Approach::Reverse));
/// # Ok::<(), compensator::error_table::TableError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct ErrorTable {
    nodes: Vec<Node>,
}

/// Why nodes do not form a table. `index` counts the nodes from 0.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum TableError {
    /// Fewer than two nodes.
    #[error("error table: {seen} node(s); at least 2 are needed")]
    TooFewNodes {
        /// Nodes given.
        seen: usize,
    },
    /// A NaN, an infinity or a negative uncertainty.
    #[error("error table, node {index}: a value is not finite or an uncertainty is negative")]
    NotFinite {
        /// Which node.
        index: usize,
    },
    /// A position not beyond the one before it.
    #[error("error table, node {index}: position {} mm does not follow {} mm",
        units::Short(seen.mm()), units::Short(previous.mm()))]
    NotIncreasing {
        /// Which node.
        index: usize,
        /// Its position.
        seen: Metres,
        /// The position before it.
        previous: Metres,
    },
    /// An approach present at some nodes only.
    #[error("error table, node {index}: approach `{}` is measured at some nodes only",
        approach.symbol())]
    Gap {
        /// The first node that differs from node 0.
        index: usize,
        /// The approach.
        approach: Approach,
    },
    /// No approach at all.
    #[error("error table: no deviation in either approach")]
    Empty,
}

impl ErrorTable {
    /// Checks `nodes` and takes them.
    ///
    /// # Errors
    /// When there are fewer than two, values are not finite, positions do not increase, or an
    /// approach is measured at some nodes only.
    pub fn new(nodes: Vec<Node>) -> Result<Self, TableError> {
        let [first, .., _] = nodes.as_slice() else {
            return Err(TableError::TooFewNodes { seen: nodes.len() });
        };
        for (index, node) in nodes.iter().enumerate() {
            if !is_sound(node) {
                return Err(TableError::NotFinite { index });
            }
            for approach in [Approach::Forward, Approach::Reverse] {
                if node.deviation(approach).is_some() != first.deviation(approach).is_some() {
                    return Err(TableError::Gap { index, approach });
                }
            }
        }
        if first.forward.is_none() && first.reverse.is_none() {
            return Err(TableError::Empty);
        }
        for (index, pair) in nodes.windows(2).enumerate() {
            let (previous, seen) = (pair[0].position, pair[1].position);
            if seen <= previous {
                return Err(TableError::NotIncreasing {
                    index: index + 1,
                    seen,
                    previous,
                });
            }
        }
        Ok(Self { nodes })
    }

    /// The nodes, increasing.
    pub fn nodes(&self) -> &[Node] {
        &self.nodes
    }

    /// First and last position.
    pub fn range(&self) -> (Metres, Metres) {
        (
            self.nodes[0].position,
            self.nodes[self.nodes.len() - 1].position,
        )
    }

    /// Whether the table knows this approach.
    pub fn knows(&self, approach: Approach) -> bool {
        self.nodes[0].deviation(approach).is_some()
    }

    /// The largest magnitude of any deviation.
    pub fn largest(&self) -> Metres {
        let deviations = self
            .nodes
            .iter()
            .flat_map(|n| [n.forward, n.reverse])
            .flatten();
        deviations.fold(Metres::ZERO, |largest, d| largest.max(d.abs()))
    }

    /// The mean lost motion, or `None` when one approach is unknown.
    ///
    /// Its uncertainty takes the nodes' uncertainties as independent, which is on the safe side
    /// where they contain an instrument's common part.
    pub fn lost_motion(&self) -> Option<LostMotion> {
        let differences: Option<Vec<f64>> = self
            .nodes
            .iter()
            .map(|n| Some((n.reverse? - n.forward?).value()))
            .collect();
        let differences = differences?;
        let variance: Option<f64> = self
            .nodes
            .iter()
            .flat_map(|n| [n.u_forward, n.u_reverse])
            .map(|u| Some(u?.value() * u?.value()))
            .sum();
        let count = differences.len() as f64;
        let low = differences.iter().copied().fold(f64::INFINITY, f64::min);
        let high = differences
            .iter()
            .copied()
            .fold(f64::NEG_INFINITY, f64::max);
        Some(LostMotion {
            mean: Metres(differences.iter().sum::<f64>() / count),
            standard_uncertainty: variance.map(|variance| Metres(variance.sqrt() / count)),
            range: (Metres(low), Metres(high)),
        })
    }
}

fn is_sound(node: &Node) -> bool {
    let uncertainty = |u: Option<Metres>| u.is_none_or(|u| u.is_finite() && u >= Metres::ZERO);
    let deviation = |d: Option<Metres>| d.is_none_or(Metres::is_finite);
    node.position.is_finite()
        && deviation(node.forward)
        && deviation(node.reverse)
        && uncertainty(node.u_forward)
        && uncertainty(node.u_reverse)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn node(mm: f64, forward: Option<f64>, reverse: Option<f64>) -> Node {
        Node {
            position: Metres::from_mm(mm),
            forward: forward.map(Metres::from_um),
            reverse: reverse.map(Metres::from_um),
            u_forward: forward.map(|_| Metres::from_um(0.3)),
            u_reverse: reverse.map(|_| Metres::from_um(0.4)),
        }
    }

    fn both(mm: f64, forward: f64, reverse: f64) -> Node {
        node(mm, Some(forward), Some(reverse))
    }

    #[test]
    fn nodes_out_of_order_or_not_finite_or_with_gaps_are_refused() {
        let error = |nodes| ErrorTable::new(nodes).unwrap_err();
        assert_eq!(
            error(vec![both(0.0, 0.0, 0.0)]),
            TableError::TooFewNodes { seen: 1 }
        );
        assert!(matches!(
            error(vec![both(0.0, 0.0, 0.0), both(0.0, 1.0, 1.0)]),
            TableError::NotIncreasing { index: 1, .. }
        ));
        assert_eq!(
            error(vec![both(0.0, 0.0, 0.0), both(1.0, f64::NAN, 0.0)]),
            TableError::NotFinite { index: 1 }
        );
        assert_eq!(
            error(vec![both(0.0, 0.0, 0.0), node(1.0, Some(1.0), None)]),
            TableError::Gap {
                index: 1,
                approach: Approach::Reverse
            }
        );
        assert_eq!(
            error(vec![node(0.0, None, None), node(1.0, None, None)]),
            TableError::Empty
        );
    }

    /// Differences 2 and 4 µm: mean 3. Variances 0.09 + 0.16 at each of two nodes:
    /// √0.5/2 = 0.3536 µm.
    #[test]
    fn the_lost_motion_is_the_mean_of_reverse_minus_forward() {
        let table = ErrorTable::new(vec![both(0.0, 1.0, 3.0), both(3.0, -1.0, 3.0)]).unwrap();
        let lost = table.lost_motion().unwrap();
        assert!((lost.mean.um() - 3.0).abs() < 1e-12);
        let u = lost.standard_uncertainty.unwrap();
        assert!((u.um() - 0.5_f64.sqrt() / 2.0).abs() < 1e-12);
        assert!((lost.range.1.um() - 4.0).abs() < 1e-12);
    }

    #[test]
    fn the_lost_motion_of_one_sided_data_is_unknown_not_zero() {
        let table =
            ErrorTable::new(vec![node(0.0, Some(1.0), None), node(3.0, Some(2.0), None)]).unwrap();
        assert_eq!(table.lost_motion(), None);
        assert!(!table.knows(Approach::Reverse));
    }
}
