//! What is left of ISO 230-2 where a target was measured only once from a side: the mean deviations and what
//! is made of them alone (E, M, B, B̄). R and A need standard deviations, which one measurement does not have.
//!
//! Source: ISO 230-2:2014, clause 3.
//!
//! | symbol | name here |
//! |---|---|
//! | x̄_i↑, x̄_i↓ | [`MeanTarget::forward`], [`MeanTarget::reverse`] |
//! | E, E↑, E↓ | [`Means::systematic_deviation`], [`Means::forward`], [`Means::reverse`] |
//! | M | [`Means::mean_bidirectional_deviation_range`] |
//! | B, B̄ | [`Means::reversal_value`], [`Means::mean_reversal_value`] |

use units::{Approach, Metres};

use super::{Conformity, EvaluationError, Extent, only_approach};
use crate::error_table::LinearSeries;
use crate::uncertainty::mean;

/// One target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeanTarget {
    /// The target.
    pub target: Metres,
    /// Mean deviation, approached forward; `None` where it never was.
    pub forward: Option<Metres>,
    /// The same in reverse.
    pub reverse: Option<Metres>,
}

impl MeanTarget {
    fn both(&self) -> Option<(Metres, Metres)> {
        self.forward.zip(self.reverse)
    }
}

/// What mean deviations tell; `None` where a side was not measured.
#[derive(Clone, Debug, PartialEq)]
pub struct Means {
    /// Each target, increasing.
    pub targets: Vec<MeanTarget>,
    /// E↑.
    pub forward: Option<Metres>,
    /// E↓.
    pub reverse: Option<Metres>,
    /// E.
    pub systematic_deviation: Option<Metres>,
    /// M.
    pub mean_bidirectional_deviation_range: Option<Metres>,
    /// B: the largest reversal value's magnitude.
    pub reversal_value: Option<Metres>,
    /// B̄: the mean reversal value (forward − reverse), signed.
    pub mean_reversal_value: Option<Metres>,
    /// How the measurement compares with what the standard asks.
    pub conformity: Conformity,
}

/// Evaluates the mean deviations of a series measured from one side or from both, every target at least once
/// from each.
///
/// # Errors
/// When a target was never reached from a side from which others were.
///
/// # Example
///
/// ```
/// use compensator::error_table::LinearSeries;
/// use compensator::iso230::evaluate_means;
///
/// let csv = "run,approach,target_mm,measured_mm\n\
///            1,+,0,0.001\n1,+,10,10.004\n1,-,10,10.006\n1,-,0,-0.001\n";
/// let means = evaluate_means(&LinearSeries::from_csv(csv, "measured.csv")?)?;
/// let um = |it: Option<units::Metres>| it.map(|it| (it.um() * 1e6).round() / 1e6);
/// assert_eq!(um(means.systematic_deviation), Some(7.0), "E, from -1 to 6");
/// assert_eq!(um(means.reversal_value), Some(2.0), "B, of 2 and -2");
/// assert_eq!(um(means.mean_reversal_value), Some(0.0));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn evaluate_means(series: &LinearSeries) -> Result<Means, EvaluationError> {
    let only = only_approach(series);
    let mut runs = usize::MAX;
    let mut side = |target, approach| {
        if only.is_some_and(|it| it != approach) {
            return Ok(None);
        }
        let all: Vec<f64> = series
            .deviations(target, approach)
            .map(|it| it.1.value())
            .collect();
        runs = runs.min(all.len());
        let seen = all.len();
        let lacking = EvaluationError::TooFewRuns {
            target,
            approach,
            seen,
        };
        mean(&all).map(|it| Some(Metres(it))).ok_or(lacking)
    };
    let mut targets = Vec::new();
    for target in series.targets() {
        targets.push(MeanTarget {
            target,
            forward: side(target, Approach::Forward)?,
            reverse: side(target, Approach::Reverse)?,
        });
    }
    Ok(of_targets(targets, runs))
}

fn of_targets(targets: Vec<MeanTarget>, runs: usize) -> Means {
    let one_way = |of: fn(&MeanTarget) -> Option<Metres>| {
        let all: Vec<_> = targets.iter().filter_map(of).collect();
        (!all.is_empty()).then(|| Extent::of(all.into_iter()).range())
    };
    let both: Vec<_> = targets.iter().filter_map(MeanTarget::both).collect();
    let both = (!both.is_empty()).then(|| BothSides::of(&both));
    Means {
        forward: one_way(|it| it.forward),
        reverse: one_way(|it| it.reverse),
        systematic_deviation: both.map(|it| it.systematic_deviation),
        mean_bidirectional_deviation_range: both.map(|it| it.mean_bidirectional_deviation_range),
        reversal_value: both.map(|it| it.reversal_value),
        mean_reversal_value: both.map(|it| it.mean_reversal_value),
        conformity: Conformity::of(runs, targets.iter().map(|it| it.target)),
        targets,
    }
}

/// What the mean deviations of targets that were reached from both sides tell together.
#[derive(Clone, Copy, Debug)]
pub(super) struct BothSides {
    /// E.
    pub(super) systematic_deviation: Metres,
    /// M.
    pub(super) mean_bidirectional_deviation_range: Metres,
    /// B.
    pub(super) reversal_value: Metres,
    /// B̄.
    pub(super) mean_reversal_value: Metres,
}

impl BothSides {
    /// Of x̄_i↑ and x̄_i↓ of at least one target.
    pub(super) fn of(means: &[(Metres, Metres)]) -> Self {
        let reversals = means.iter().map(|(forward, reverse)| *forward - *reverse);
        let middles = means
            .iter()
            .map(|(forward, reverse)| (*forward + *reverse) / 2.0);
        let sides = means
            .iter()
            .flat_map(|(forward, reverse)| [*forward, *reverse]);
        let largest = reversals
            .clone()
            .map(Metres::abs)
            .fold(Metres::ZERO, Metres::max);
        let sum: Metres = reversals.sum();
        Self {
            systematic_deviation: Extent::of(sides).range(),
            mean_bidirectional_deviation_range: Extent::of(middles).range(),
            reversal_value: largest,
            mean_reversal_value: sum / means.len() as f64,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn means(rows: &str) -> Result<Means, EvaluationError> {
        let text = format!("run,approach,target_mm,measured_mm\n{rows}");
        evaluate_means(&LinearSeries::from_csv(&text, "m.csv").unwrap())
    }

    #[test]
    fn where_all_can_be_said_it_is_what_the_whole_evaluation_says() {
        let rows = "1,+,0,0.001\n1,+,10,10.004\n1,-,10,10.006\n1,-,0,-0.002\n\
                    2,+,0,0.003\n2,+,10,10.001\n2,-,10,10.006\n2,-,0,0.001\n";
        let text = format!("run,approach,target_mm,measured_mm\n{rows}");
        let series = LinearSeries::from_csv(&text, "m.csv").unwrap();
        let whole = super::super::evaluate(&series).unwrap();
        let means = means(rows).unwrap();
        assert_eq!(
            means.systematic_deviation,
            Some(whole.systematic_deviation.bidirectional)
        );
        assert_eq!(means.forward, Some(whole.systematic_deviation.forward));
        assert_eq!(means.reverse, Some(whole.systematic_deviation.reverse));
        assert_eq!(means.reversal_value, Some(whole.reversal_value));
        assert_eq!(means.mean_reversal_value, Some(whole.mean_reversal_value));
        let range = whole.mean_bidirectional_deviation_range;
        assert_eq!(means.mean_bidirectional_deviation_range, Some(range));
        assert_eq!(means.conformity, whole.conformity);
    }

    #[test]
    fn of_one_side_nothing_is_said_of_the_other_or_of_both() {
        let means = means("1,-,10,10.006\n1,-,0,-0.001\n").unwrap();
        assert!((means.reverse.unwrap().um() - 7.0).abs() < 1e-6);
        let none = [
            means.forward,
            means.systematic_deviation,
            means.reversal_value,
            means.mean_reversal_value,
            means.mean_bidirectional_deviation_range,
        ];
        assert_eq!(none, [None; 5]);
        assert_eq!(means.conformity.runs, 1);
    }

    #[test]
    fn a_target_that_lacks_a_side_is_named() {
        let refused = means("1,+,0,0.001\n1,+,10,10.004\n1,-,10,10.006\n").unwrap_err();
        let (target, approach) = (Metres(0.0), Approach::Reverse);
        let wanted = EvaluationError::TooFewRuns {
            target,
            approach,
            seen: 0,
        };
        assert_eq!(refused, wanted);
    }
}
