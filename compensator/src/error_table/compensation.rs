//! From the table to the set-point: the exact inverse, with everything proven when it is made.
//!
//! The actual position is actual(c) = c + deviation(c). Where |d deviation/dc| < 1 this map is
//! strictly increasing, so exactly one command reaches each target. The slope's extremes are
//! computed in closed form for the interpolant that is really used, not sampled.
//!
//! The patent's step function is no continuous map: next to a step of +Δ the targets in a gap of
//! width Δ are reached by no command, next to −Δ by two. [`Compensation::set_point`] then does
//! what the patent does, P' = P + compensation(interval of P), judged by the target; what is
//! checked for it is that no step is larger than `slope` times the interval it ends.

use units::{Approach, Metres, MetresPerSecond};

use super::curve::Curve;
use super::{ErrorTable, Interpolation};
use crate::interpolation::{Segment, segments};

/// What a correction may do at most.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Largest magnitude of the deviation corrected.
    pub size: Metres,
    /// Largest |d deviation/dx|, dimensionless, below 1.
    pub slope: f64,
    /// Largest change of the correction per time.
    pub rate: MetresPerSecond,
}

/// What is commanded outside the table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum EndPolicy {
    /// Targets outside the first and last node are refused.
    Refuse,
    /// The first and last node's deviations hold on for ever.
    Hold,
    /// They fade linearly to nothing over this distance.
    FadeOut(Metres),
}

/// The names of what must be a positive number to make a compensation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LimitName {
    /// [`Limits::size`].
    Size,
    /// [`Limits::slope`].
    Slope,
    /// [`Limits::rate`].
    Rate,
    /// The distance of [`EndPolicy::FadeOut`].
    FadeOut,
}

/// Why a table cannot be used to compensate.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum CompensationError {
    /// A limit that is not positive and finite, or a slope limit of 1 and more.
    #[error("compensation: limit {name:?} is {seen}; it must be positive (the slope below 1)",
        seen = units::Short(*seen))]
    Limit {
        /// Which limit.
        name: LimitName,
        /// Its value in SI units.
        seen: f64,
    },
    /// A deviation larger than the limit.
    #[error(
        "compensation: the deviation at {} mm (approach `{}`) is {:.3} um, the limit {:.3} um; \
         millimetres taken for micrometres, or the table of another axis?",
        units::Short(position.mm()), approach.symbol(), seen.um(), limit.um()
    )]
    TooLarge {
        /// Where.
        position: Metres,
        /// In which approach.
        approach: Approach,
        /// The deviation.
        seen: Metres,
        /// The limit.
        limit: Metres,
    },
    /// A slope above the limit.
    #[error(
        "compensation: between {} mm and {} mm (approach `{}`) the deviation has a slope of \
         {:.1} um/mm, the limit is {:.1} um/mm",
        units::Short(from.mm()), units::Short(to.mm()), approach.symbol(), seen * 1e3, limit * 1e3
    )]
    TooSteep {
        /// Start of the piece.
        from: Metres,
        /// Its end.
        to: Metres,
        /// In which approach.
        approach: Approach,
        /// The largest magnitude of the slope there.
        seen: f64,
        /// The limit.
        limit: f64,
    },
    /// A slope of 1 or more: several commands, or none, reach a target.
    #[error(
        "compensation: between {} mm and {} mm (approach `{}`) the deviation has a slope of \
         {seen:.3}; from 1 on the correction has no unique inverse",
        units::Short(from.mm()), units::Short(to.mm()), approach.symbol()
    )]
    NotInvertible {
        /// Start of the piece.
        from: Metres,
        /// Its end.
        to: Metres,
        /// In which approach.
        approach: Approach,
        /// The largest magnitude of the slope there.
        seen: f64,
    },
}

/// A position or approach for which there is no compensation.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum OutOfRange {
    /// Outside the table, and the policy is to refuse.
    #[error("compensation: {} mm is outside the calibrated {} to {} mm",
        units::Short(seen.mm()), units::Short(first.mm()), units::Short(last.mm()))]
    Position {
        /// The position asked for (or NaN).
        seen: Metres,
        /// Lowest position allowed.
        first: Metres,
        /// Highest position allowed.
        last: Metres,
    },
    /// The table was measured from the other side only.
    #[error("compensation: approach `{}` was not calibrated", approach.symbol())]
    Approach {
        /// The approach asked for.
        approach: Approach,
    },
}

#[derive(Clone, Debug)]
struct Side {
    curve: Curve,
    /// Targets and commands accepted, as (lowest, highest).
    targets: (f64, f64),
    commands: (f64, f64),
}

/// A table made ready to be applied: no allocation and a constant time per call.
///
/// # Example
///
/// The patent's step function corrects by the interval that the target lies in.
///
/// ```
/// use compensator::error_table::{
///     Compensation, EndPolicy, ErrorTable, Interpolation, Limits, Node,
/// };
/// use units::{Approach, Metres, MetresPerSecond};
///
/// let nodes = [(0.0, 0.0), (3.0, 2.0), (6.0, -1.0)].map(|(mm, um)| Node {
///     position: Metres::from_mm(mm),
///     forward: Some(Metres::from_um(um)),
///     reverse: None,
///     u_forward: None,
///     u_reverse: None,
/// });
/// let limits = Limits {
///     size: Metres::from_um(50.0),
///     slope: 0.05,
///     rate: MetresPerSecond(1e-3),
/// };
/// let (steps, ends) = (Interpolation::PiecewiseConstant, EndPolicy::Refuse);
/// let compensation = Compensation::new(ErrorTable::new(nodes.to_vec())?, steps, limits, ends)?;
/// let command = compensation.set_point(Metres::from_mm(1.0), Approach::Forward)?;
/// assert!((command.mm() - 0.998).abs() < 1e-12, "2 µm less");
/// assert!(compensation.set_point(Metres::from_mm(7.0), Approach::Forward).is_err());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Compensation {
    table: ErrorTable,
    interpolation: Interpolation,
    limits: Limits,
    ends: EndPolicy,
    forward: Option<Side>,
    reverse: Option<Side>,
    steepest: f64,
}

impl Compensation {
    /// Proves that `table` can be undone within `limits` and prepares it.
    ///
    /// # Errors
    /// When a limit is no limit, or a deviation or a slope of the interpolant exceeds it; with
    /// the place, approach, value and limit.
    pub fn new(
        table: ErrorTable,
        interpolation: Interpolation,
        limits: Limits,
        ends: EndPolicy,
    ) -> Result<Self, CompensationError> {
        check_limits(&limits, ends)?;
        let mut steepest = 0.0;
        let mut side = |approach| {
            table
                .knows(approach)
                .then(|| {
                    make_side(
                        &table,
                        approach,
                        interpolation,
                        &limits,
                        ends,
                        &mut steepest,
                    )
                })
                .transpose()
        };
        let (forward, reverse) = (side(Approach::Forward)?, side(Approach::Reverse)?);
        Ok(Self {
            table,
            interpolation,
            limits,
            ends,
            forward,
            reverse,
            steepest,
        })
    }

    /// The deviation (actual − command) expected for a command reached from `approach`.
    ///
    /// # Errors
    /// When the approach is not calibrated, or the command lies outside under
    /// [`EndPolicy::Refuse`].
    #[inline]
    pub fn deviation(&self, command: Metres, approach: Approach) -> Result<Metres, OutOfRange> {
        let side = self.side(approach)?;
        within(command, side.commands)?;
        Ok(Metres(side.curve.deviation(command.value())))
    }

    /// The command for which command + deviation(command) = `target`, exactly.
    ///
    /// For [`Interpolation::PiecewiseConstant`] it is target − deviation(target) instead.
    /// Under [`EndPolicy::Refuse`] every target from the first to the last node is accepted;
    /// the command may then lie outside the nodes by the end node's own deviation, never more.
    ///
    /// # Errors
    /// When the approach is not calibrated, or the target lies outside under
    /// [`EndPolicy::Refuse`], or is NaN.
    #[inline]
    pub fn set_point(&self, target: Metres, approach: Approach) -> Result<Metres, OutOfRange> {
        let side = self.side(approach)?;
        within(target, side.targets)?;
        Ok(Metres(side.curve.command(target.value())))
    }

    /// The table this was made from.
    pub fn table(&self) -> &ErrorTable {
        &self.table
    }

    /// The interpolation in use.
    pub fn interpolation(&self) -> Interpolation {
        self.interpolation
    }

    /// The limits it was checked against.
    pub fn limits(&self) -> Limits {
        self.limits
    }

    /// What happens outside the table.
    pub fn end_policy(&self) -> EndPolicy {
        self.ends
    }

    /// The largest magnitude of d deviation/dx anywhere, dimensionless.
    pub fn steepest_slope(&self) -> f64 {
        self.steepest
    }

    /// The speed above which the correction would have to change faster than the rate limit.
    pub fn speed_max(&self) -> MetresPerSecond {
        MetresPerSecond(self.limits.rate.value() / self.steepest)
    }

    #[inline]
    fn side(&self, approach: Approach) -> Result<&Side, OutOfRange> {
        let side = match approach {
            Approach::Forward => &self.forward,
            Approach::Reverse => &self.reverse,
        };
        side.as_ref().ok_or(OutOfRange::Approach { approach })
    }
}

#[inline]
fn within(seen: Metres, (first, last): (f64, f64)) -> Result<(), OutOfRange> {
    if seen.value() >= first && seen.value() <= last {
        Ok(())
    } else {
        Err(OutOfRange::Position {
            seen,
            first: Metres(first),
            last: Metres(last),
        })
    }
}

fn check_limits(limits: &Limits, ends: EndPolicy) -> Result<(), CompensationError> {
    let fade = match ends {
        EndPolicy::FadeOut(distance) => distance.value(),
        EndPolicy::Refuse | EndPolicy::Hold => 1.0,
    };
    let checks = [
        (LimitName::Size, limits.size.value(), f64::MAX),
        (LimitName::Slope, limits.slope, 1.0_f64.next_down()),
        (LimitName::Rate, limits.rate.value(), f64::MAX),
        (LimitName::FadeOut, fade, f64::MAX),
    ];
    for (name, seen, highest) in checks {
        if !(seen > 0.0 && seen <= highest) {
            return Err(CompensationError::Limit { name, seen });
        }
    }
    Ok(())
}

fn make_side(
    table: &ErrorTable,
    approach: Approach,
    interpolation: Interpolation,
    limits: &Limits,
    ends: EndPolicy,
    steepest: &mut f64,
) -> Result<Side, CompensationError> {
    let nodes: Vec<f64> = table.nodes().iter().map(|n| n.position.value()).collect();
    let values: Vec<f64> = table
        .nodes()
        .iter()
        .filter_map(|n| n.deviation(approach))
        .map(Metres::value)
        .collect();
    check_sizes(&nodes, &values, approach, limits.size)?;
    let stepped = interpolation == Interpolation::PiecewiseConstant;
    let mut pieces = segments(&nodes, &values, interpolation);
    let (first, last) = (nodes[0], nodes[nodes.len() - 1]);
    let (mut before, mut after) = (values[0], values[values.len() - 1]);
    let outer = match ends {
        EndPolicy::Refuse => {
            let (low, high) = (first - before, last - after);
            ((first, last), (low.min(first), high.max(last)))
        }
        EndPolicy::Hold => (EVERYWHERE, EVERYWHERE),
        EndPolicy::FadeOut(distance) => {
            let distance = distance.value();
            pieces.insert(0, Segment::line(first - distance, 0.0, first, before));
            pieces.push(Segment::line(last, after, last + distance, 0.0));
            (before, after) = (0.0, 0.0);
            (EVERYWHERE, EVERYWHERE)
        }
    };
    let mut previous = before;
    for piece in &pieces {
        // A step counts as if it were spread over the interval it ends.
        let step = (piece.constant - previous).abs() / piece.width;
        previous = piece.value(piece.width);
        let slope = if stepped {
            piece.steepest().max(step)
        } else {
            piece.steepest()
        };
        check_slope(piece, slope, approach, limits.slope)?;
        *steepest = steepest.max(slope);
    }
    let curve = Curve::new(&pieces, before, after, stepped);
    Ok(Side {
        curve,
        targets: outer.0,
        commands: outer.1,
    })
}

const EVERYWHERE: (f64, f64) = (f64::MIN, f64::MAX);

/// Neither kind of interpolant leaves the interval of its nodes' values, so the nodes decide.
fn check_sizes(
    nodes: &[f64],
    values: &[f64],
    approach: Approach,
    limit: Metres,
) -> Result<(), CompensationError> {
    match nodes
        .iter()
        .zip(values)
        .find(|(_, value)| value.abs() > limit.value())
    {
        Some((position, value)) => Err(CompensationError::TooLarge {
            position: Metres(*position),
            approach,
            seen: Metres(*value),
            limit,
        }),
        None => Ok(()),
    }
}

fn check_slope(
    piece: &Segment,
    seen: f64,
    approach: Approach,
    limit: f64,
) -> Result<(), CompensationError> {
    let (from, to) = (Metres(piece.start), Metres(piece.end()));
    if seen >= 1.0 {
        Err(CompensationError::NotInvertible {
            from,
            to,
            approach,
            seen,
        })
    } else if seen > limit {
        Err(CompensationError::TooSteep {
            from,
            to,
            approach,
            seen,
            limit,
        })
    } else {
        Ok(())
    }
}

#[cfg(test)]
#[path = "compensation_tests.rs"]
mod tests;
