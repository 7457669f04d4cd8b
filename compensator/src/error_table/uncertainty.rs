//! What makes the values of a table uncertain, beyond the scatter of its readings.
//!
//! Source: GUM 4.2 and 4.3; ISO 230-2:2014 annex A for what such a list has to name.
//!
//! | contribution | how it is found | what it does to the places of the axis |
//! |---|---|---|
//! | [`SCATTER`] of a reading | pooled over the positions of an approach, divided by √runs | independent |
//! | [`RUN_TO_RUN`] | standard deviation of the runs' offsets, divided by √runs | common offset |
//! | [`DATUM`] | scatter of a reading: the datum is one stop, approached forward | common offset |
//! | [`DRIFT`] | the offsets' trend from the datum to the middle of the runs, or what the closure exceeds three standard deviations of two stops by, whichever is more; it is not corrected, and so counts as a whole (GUM F.2.4.5) | common offset |
//! | [`INSTRUMENT`], and at the datum | given | independent; common offset |
//! | [`ZERO`] | given by whoever found it | common offset |
//! | [`CURVE`] | every position left out in turn: by how much the curve through the others misses it; the curve through all misses a quarter of that half-way. Steps miss anything up to that everywhere | between positions; common offset |
//! | [`SHORT_PERIOD`] | given | between positions |
//! | air, expansion, beam | [`LengthCorrection::contributions`](crate::length_correction::LengthCorrection::contributions) | common scale |
//!
//! Absent: what repeats in every run in the same way and shows at no position (Abbe offsets, a
//! gradient of temperature along the axis): who knows of it adds a line.

use units::{Approach, Metres};

use super::{ErrorTable, Fitted, Interpolation, Node, Repeats};
use crate::budget::{AxisBudget, BudgetError, Contribution, Correlation, Evaluation};
use crate::interpolation::segments;

/// Name of the scatter of single readings.
pub const SCATTER: &str = "scatter of a reading";
/// Name of what differs from run to run.
pub const RUN_TO_RUN: &str = "run to run";
/// Name of the one stop that all readings count from.
pub const DATUM: &str = "datum";
/// Name of what moved between datum and runs.
pub const DRIFT: &str = "drift";
/// Name of the instrument's own.
pub const INSTRUMENT: &str = "instrument";
/// Name of the instrument's own where it was set to zero.
pub const INSTRUMENT_AT_DATUM: &str = "instrument at the datum";
/// Name of the axis's origin.
pub const ZERO: &str = "zero";
/// Name of how the curve runs between positions.
pub const CURVE: &str = "curve between positions";
/// Name of what no position shows.
pub const SHORT_PERIOD: &str = "errors of short period";
/// Name of the scatter of the stop that is being made.
pub const ONE_STOP: &str = "one stop";
/// Name of what no position shows, where the calibration read it with a position.
pub const SHORT_PERIOD_READ: &str = "errors of short period at the positions";
/// Name of what lost motion does after an approach unlike those of the calibration.
pub const APPROACH: &str = "unlike approach";

/// Width of a rectangular distribution that begins at zero to its root mean square: 1/√3.
const RECTANGULAR: f64 = 0.577_350_269_189_625_8;
/// So many standard deviations of the difference of two stops a closure needs to show drift.
const CLOSURE_SIGMAS: f64 = 3.0;
/// So many neighbours to either side have a part in the curve through a position that is left out.
const NEIGHBOURS: usize = 4;

/// What is known of a calibration beside its readings.
#[derive(Clone, Debug, PartialEq)]
pub struct Circumstances {
    /// Standard uncertainty of one reading of the instrument that averaging does not take away.
    pub instrument: Metres,
    /// The largest difference of the same place after a run and before the first.
    pub closure: Metres,
    /// Standard uncertainty of the axis's origin, and its degrees of freedom where they are known.
    pub zero: (Metres, Option<f64>),
    /// Standard uncertainty of errors that repeat within less than the distance of positions.
    pub short_period: Metres,
    /// The curve that is drawn between positions.
    pub interpolation: Interpolation,
    /// What the corrections of the readings contribute, as shares of the distance from the datum.
    pub corrections: Vec<Contribution>,
}

/// The budget of a fitted table.
///
/// # Errors
/// When the positions of an approach were measured once only, so that nothing is known of their
/// scatter; when a number can be none.
pub fn budget(fitted: &Fitted, known: Circumstances) -> Result<AxisBudget, BudgetError> {
    let table = &fitted.table;
    let mut lines = Vec::new();
    for (approach, scatter, repeats) in sides(fitted) {
        if table.knows(approach) {
            let scatter = scatter.ok_or(BudgetError::NoScatter { approach })?;
            lines.push(scatter_line(approach, scatter, repeats));
        }
    }
    lines.extend(run_lines(fitted));
    // The datum is approached forward; a table that knows the other side only has its scatter.
    let mut sides = sides(fitted).into_iter();
    let datum = sides.find_map(|(_, scatter, repeats)| Some((scatter?, repeats)));
    if let Some((scatter, repeats)) = datum {
        lines.push(Contribution {
            degrees_of_freedom: freedom(repeats.degrees_of_freedom),
            ..offset(DATUM, Evaluation::A, scatter)
        });
        let drift = drift(fitted, known.closure, scatter);
        lines.push(offset(DRIFT, Evaluation::B, drift));
    }
    lines.push(Contribution {
        correlation: Correlation::Independent,
        ..offset(INSTRUMENT, Evaluation::B, known.instrument)
    });
    lines.push(offset(INSTRUMENT_AT_DATUM, Evaluation::B, known.instrument));
    let (zero, degrees_of_freedom) = known.zero;
    lines.push(Contribution {
        degrees_of_freedom,
        ..offset(ZERO, Evaluation::A, zero)
    });
    lines.extend(known.corrections);
    lines.push(curve_line(fitted, known.interpolation));
    lines.push(Contribution {
        correlation: Correlation::BetweenPositions,
        ..offset(SHORT_PERIOD, Evaluation::B, known.short_period)
    });
    let positions = table.nodes().iter().map(|it| it.position).collect();
    AxisBudget::new(lines, positions)
}

/// The budget of where the point stands after a single corrected stop: with the zero that the axis
/// has now in place of the one that it was calibrated with, and the scatter of that stop.
///
/// The zero that the axis was calibrated with is the datum of the table, so that its error does not
/// outlive it.
///
/// The set-point of a stop lies beside its target by the deviation, and so elsewhere on a scale whose errors
/// repeat within micrometres: those of the stop and those of the positions that were read both count, at the
/// calibrated positions too.
///
/// After an approach unlike those of the calibration (shorter, after a turn, with another overshoot) nobody
/// knows how much of the lost motion is taken up: the point stands anywhere from where the table says to
/// where it says for the other side, `unlike_approach` further (rectangular, GUM 4.3.7; about its end, as it
/// is not corrected).
///
/// # Errors
/// When `zero` or `unlike_approach` can be no uncertainty.
pub fn budget_of_stops(
    calibrated: &AxisBudget,
    zero: Option<(Metres, Option<f64>)>,
    unlike_approach: Option<Metres>,
) -> Result<AxisBudget, BudgetError> {
    let mut lines = calibrated.contributions().to_vec();
    for line in lines.iter_mut().filter(|it| it.name == ZERO) {
        if let Some((zero, degrees_of_freedom)) = zero {
            line.value = zero.value();
            line.degrees_of_freedom = degrees_of_freedom;
        }
    }
    let short: Vec<Contribution> = lines
        .iter_mut()
        .filter(|it| it.name == SHORT_PERIOD)
        .map(|stop| {
            stop.correlation = Correlation::CommonOffset;
            Contribution {
                name: SHORT_PERIOD_READ.to_owned(),
                correlation: Correlation::Independent,
                ..stop.clone()
            }
        })
        .collect();
    lines.extend(short);
    let scatters = calibrated
        .contributions()
        .iter()
        .filter(|it| it.name == SCATTER);
    lines.extend(scatters.map(|it| Contribution {
        name: ONE_STOP.to_owned(),
        sensitivity: 1.0,
        correlation: Correlation::CommonOffset,
        ..it.clone()
    }));
    lines.extend(unlike_approach.map(|it| Contribution {
        sensitivity: RECTANGULAR,
        ..offset(APPROACH, Evaluation::B, it)
    }));
    AxisBudget::new(lines, calibrated.positions().to_vec())
}

/// `table` with the combined standard uncertainties of `budget`, which was made of it.
pub fn stated(table: &ErrorTable, budget: &AxisBudget) -> ErrorTable {
    let combined = |node: &Node, approach| {
        let known = node.deviation(approach).is_some();
        let at = budget.at(node.position, approach).filter(|_| known);
        at.map(|it| it.standard_uncertainty)
    };
    let nodes = table.nodes.iter().map(|node| Node {
        u_forward: combined(node, Approach::Forward),
        u_reverse: combined(node, Approach::Reverse),
        ..*node
    });
    ErrorTable {
        nodes: nodes.collect(),
    }
}

fn sides(fitted: &Fitted) -> [(Approach, Option<Metres>, Repeats); 2] {
    [
        (Approach::Forward, fitted.s_forward, fitted.repeats_forward),
        (Approach::Reverse, fitted.s_reverse, fitted.repeats_reverse),
    ]
}

fn offset(name: &str, evaluation: Evaluation, value: Metres) -> Contribution {
    let length = (value.value(), "m");
    Contribution::new(name, evaluation, length, Correlation::CommonOffset)
}

fn freedom(count: usize) -> Option<f64> {
    (count > 0).then_some(count as f64)
}

fn scatter_line(approach: Approach, scatter: Metres, repeats: Repeats) -> Contribution {
    Contribution {
        sensitivity: (repeats.fewest.max(1) as f64).sqrt().recip(),
        degrees_of_freedom: freedom(repeats.degrees_of_freedom),
        correlation: Correlation::Independent,
        approach: Some(approach),
        ..offset(SCATTER, Evaluation::A, scatter)
    }
}

fn run_lines(fitted: &Fitted) -> Option<Contribution> {
    let offsets: Vec<f64> = fitted
        .drift
        .runs
        .iter()
        .map(|it| it.offset.value())
        .collect();
    let scatter = crate::uncertainty::standard_deviation(&offsets)?;
    Some(Contribution {
        sensitivity: (offsets.len() as f64).sqrt().recip(),
        degrees_of_freedom: freedom(offsets.len() - 1),
        ..offset(RUN_TO_RUN, Evaluation::A, Metres(scatter))
    })
}

/// How far the mean of the runs may have moved from the datum.
fn drift(fitted: &Fitted, closure: Metres, scatter: Metres) -> Metres {
    let runs = fitted.drift.runs.len() as f64;
    // The first run's middle lies half a run behind the datum, the last one's runs − ½.
    let to_the_middle = if runs > 1.0 {
        runs / (2.0 * (runs - 1.0))
    } else {
        0.0
    };
    let trend = fitted.drift.closure.unwrap_or(Metres::ZERO).abs() * to_the_middle;
    let two_stops = 2.0 * scatter.value() * scatter.value() * CLOSURE_SIGMAS * CLOSURE_SIGMAS;
    let excess = (closure.value() * closure.value() - two_stops).max(0.0);
    trend.max(Metres(excess.sqrt()))
}

fn curve_line(fitted: &Fitted, interpolation: Interpolation) -> Contribution {
    let misses: Vec<f64> = sides(fitted)
        .into_iter()
        .flat_map(|(approach, scatter, repeats)| {
            let noise = scatter.map_or(0.0, |it| {
                it.value() * it.value() / repeats.fewest.max(1) as f64
            });
            // A position and half of each neighbour: 1 + ¼ + ¼ variances.
            misses(&fitted.table, approach, interpolation)
                .into_iter()
                .map(move |miss| miss * miss - 1.5 * noise)
        })
        .collect();
    let mean = crate::uncertainty::mean(&misses).unwrap_or(0.0).max(0.0);
    let (sensitivity, correlation) = match interpolation {
        Interpolation::PiecewiseConstant => (RECTANGULAR, Correlation::CommonOffset),
        Interpolation::Linear | Interpolation::MonotoneCubic => {
            (0.25, Correlation::BetweenPositions)
        }
    };
    Contribution {
        sensitivity,
        degrees_of_freedom: freedom(misses.len()),
        correlation,
        ..offset(CURVE, Evaluation::A, Metres(mean.sqrt()))
    }
}

/// Each inner position's deviation less that of the curve through the others. Of two positions
/// alone nothing is known but how far they are apart.
fn misses(table: &ErrorTable, approach: Approach, interpolation: Interpolation) -> Vec<f64> {
    let nodes: Vec<(f64, f64)> = table
        .nodes()
        .iter()
        .filter_map(|it| Some((it.position.value(), it.deviation(approach)?.value())))
        .collect();
    if let [(_, first), (_, last)] = nodes.as_slice() {
        return vec![last - first];
    }
    let miss = |index: usize| {
        let from = index.saturating_sub(NEIGHBOURS);
        let to = (index + NEIGHBOURS + 1).min(nodes.len());
        let others = (from..to).filter(|it| *it != index).map(|it| nodes[it]);
        let (places, values): (Vec<f64>, Vec<f64>) = others.unzip();
        let (place, value) = nodes[index];
        let pieces = segments(&places, &values, interpolation);
        let piece = pieces.iter().find(|it| it.end() >= place);
        piece.map_or(0.0, |it| value - it.value(place - it.start))
    };
    (1..nodes.len().saturating_sub(1)).map(miss).collect()
}

#[cfg(test)]
#[path = "uncertainty_tests.rs"]
mod tests;
