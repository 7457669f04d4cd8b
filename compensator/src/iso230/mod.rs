//! Positioning accuracy and repeatability of a linear axis.
//!
//! Source: ISO 230-2:2014, clause 3 (definitions) and clause 6 (evaluation). Two open
//! implementations known to us get it wrong: E is taken from the wrong minimum, and R forgets
//! the term with the reversal value. The hand-worked tests stand against both mistakes.
//!
//! | symbol | name here |
//! |---|---|
//! | x̄_i↑, x̄_i↓ | [`TargetFigures::mean_forward`], [`TargetFigures::mean_reverse`] |
//! | s_i↑, s_i↓ (n − 1) | [`TargetFigures::s_forward`], [`TargetFigures::s_reverse`] |
//! | B_i = x̄_i↑ − x̄_i↓ | [`TargetFigures::reversal_value`] |
//! | R_i↑ = 4 s_i↑ | [`TargetFigures::repeatability_forward`] |
//! | R_i = max(2s_i↑ + 2s_i↓ + \|B_i\|, R_i↑, R_i↓) | [`TargetFigures::repeatability`] |
//! | B = max \|B_i\|, B̄ = mean B_i | [`Figures::reversal_value`], [`Figures::mean_reversal_value`] |
//! | M = max x̄_i − min x̄_i | [`Figures::mean_bidirectional_deviation_range`] |
//! | E, E↑, E↓ | [`Figures::systematic_deviation`] |
//! | R, R↑, R↓ | [`Figures::repeatability`] |
//! | A, A↑, A↓ | [`Figures::accuracy`] |
//!
//! Absent: axes beyond 2000 mm (5.3.3, fewer runs), rotary axes, the uncertainty budget of
//! ISO/TR 230-9.

mod means;
mod one_way;

use units::{Approach, Metres};

use self::means::BothSides;
pub use self::means::{MeanTarget, Means, evaluate_means};
pub use self::one_way::{OneWayFigures, OneWayTarget, evaluate_one_way, only_approach};

use self::one_way::{Direction, repeatability};
use crate::error_table::LinearSeries;
use crate::uncertainty::{mean, standard_deviation};

/// Coverage factor of ISO 230-2's figures.
const K: f64 = 2.0;
/// Runs per approach and targets that the standard asks for on an axis up to 2 m.
const RUNS_WANTED: usize = 5;
const TARGETS_WANTED: usize = 5;

/// Why a series cannot be evaluated as a whole; [`evaluate_means`] evaluates single measurements as far as they go.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum EvaluationError {
    /// Only one approach in the whole series.
    #[error(
        "ISO 230-2: only approach `{}` was measured; the bidirectional figures need every \
         target from both sides; `truestage iso230` gives the unidirectional ones", measured.symbol()
    )]
    OneApproach {
        /// The approach that is there.
        measured: Approach,
    },
    /// A target with fewer than two measurements from one side.
    #[error(
        "ISO 230-2: target {} mm has {seen} measurement(s) with approach `{}`; at least 2 are \
         needed for a standard deviation", units::Short(target.mm()), approach.symbol()
    )]
    TooFewRuns {
        /// The target.
        target: Metres,
        /// The side that lacks runs.
        approach: Approach,
        /// Measurements there.
        seen: usize,
    },
}

/// The figures of one target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TargetFigures {
    /// The target.
    pub target: Metres,
    /// Mean deviation, approached forward.
    pub mean_forward: Metres,
    /// Mean deviation, approached in reverse.
    pub mean_reverse: Metres,
    /// Standard deviation (n − 1), forward.
    pub s_forward: Metres,
    /// Standard deviation (n − 1), reverse.
    pub s_reverse: Metres,
    /// Mean forward − mean reverse, signed.
    pub reversal_value: Metres,
    /// 4 s forward.
    pub repeatability_forward: Metres,
    /// 4 s reverse.
    pub repeatability_reverse: Metres,
    /// Bidirectional repeatability at this target.
    pub repeatability: Metres,
}

impl TargetFigures {
    /// The mean of both approaches' mean deviations.
    pub fn mean_bidirectional(&self) -> Metres {
        (self.mean_forward + self.mean_reverse) / 2.0
    }
}

/// One figure for both approaches together and for each alone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Directional {
    /// Both approaches together.
    pub bidirectional: Metres,
    /// Forward alone (↑).
    pub forward: Metres,
    /// Reverse alone (↓).
    pub reverse: Metres,
}

/// Whether the measurement was made as the standard asks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Conformity {
    /// The fewest measurements of any target from any side.
    pub runs: usize,
    /// Runs from each side that the standard asks for.
    pub runs_wanted: usize,
    /// The number of targets.
    pub targets: usize,
    /// Targets per metre needed by the standard over the range measured, at least 5.
    pub targets_wanted: usize,
}

impl Conformity {
    /// Of so many runs over these targets.
    fn of(runs: usize, targets: impl Iterator<Item = Metres> + Clone) -> Self {
        let span = Extent::of(targets.clone()).range();
        let per_metre = (span.value() * TARGETS_WANTED as f64).ceil() as usize;
        Self {
            runs,
            runs_wanted: RUNS_WANTED,
            targets: targets.count(),
            targets_wanted: per_metre.max(TARGETS_WANTED),
        }
    }

    /// Five runs from each side, and five targets per metre, at least five.
    pub fn conforms(&self) -> bool {
        self.runs >= self.runs_wanted && self.targets >= self.targets_wanted
    }
}

/// The figures of an axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Figures {
    /// Each target, increasing.
    pub targets: Vec<TargetFigures>,
    /// B: the largest reversal value's magnitude.
    pub reversal_value: Metres,
    /// B̄: the mean reversal value, signed.
    pub mean_reversal_value: Metres,
    /// M: range of the mean bidirectional deviation.
    pub mean_bidirectional_deviation_range: Metres,
    /// E.
    pub systematic_deviation: Directional,
    /// R.
    pub repeatability: Directional,
    /// A.
    pub accuracy: Directional,
    /// The fewest measurements of any target from any side.
    pub runs: usize,
    /// How the measurement compares with what the standard asks.
    pub conformity: Conformity,
}

impl Figures {
    /// Whether there were the five runs and five targets (per metre) of the standard. The
    /// figures are calculated either way.
    pub fn conforms(&self) -> bool {
        self.conformity.conforms()
    }

    /// The largest mean deviation's magnitude: what "as found ±x µm" means.
    pub fn largest_deviation(&self) -> Metres {
        self.targets
            .iter()
            .flat_map(|target| [target.mean_forward, target.mean_reverse])
            .fold(Metres::ZERO, |largest, deviation| {
                largest.max(deviation.abs())
            })
    }
}

/// Evaluates a series measured from both sides, every target at least twice from each.
///
/// # Errors
/// When an approach is missing altogether, or a target has fewer than two runs from one side.
///
/// # Example
///
/// Two targets, two runs: at 0 mm the mean reached forward is 2 µm and reached in reverse −1 µm, at 10 mm they
/// are 4 µm and 5 µm.
///
/// ```
/// use compensator::error_table::LinearSeries;
/// use compensator::iso230::evaluate;
///
/// let csv = "run,approach,target_mm,measured_mm\n\
///            1,+,0,0.001\n1,+,10,10.004\n1,-,10,10.004\n1,-,0,-0.001\n\
///            2,+,0,0.003\n2,+,10,10.004\n2,-,10,10.006\n2,-,0,-0.001\n";
/// let figures = evaluate(&LinearSeries::from_csv(csv, "measured.csv")?)?;
/// assert!((figures.reversal_value.um() - 3.0).abs() < 1e-6, "B");
/// assert!((figures.systematic_deviation.bidirectional.um() - 6.0).abs() < 1e-6, "E");
/// let a = 6.0 + 2.0 * 2.0_f64.sqrt();
/// assert!((figures.accuracy.bidirectional.um() - a).abs() < 1e-6, "A");
/// assert!(!figures.conforms(), "the standard wants five runs and five targets");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn evaluate(series: &LinearSeries) -> Result<Figures, EvaluationError> {
    if let Some(measured) = only_approach(series) {
        return Err(EvaluationError::OneApproach { measured });
    }
    let mut runs = usize::MAX;
    let mut targets = Vec::new();
    for target in series.targets() {
        let (forward_count, mean_forward, s_forward) = side(series, target, Approach::Forward)?;
        let (reverse_count, mean_reverse, s_reverse) = side(series, target, Approach::Reverse)?;
        runs = runs.min(forward_count).min(reverse_count);
        targets.push(target_figures(
            target,
            mean_forward,
            mean_reverse,
            s_forward,
            s_reverse,
        ));
    }
    Ok(axis_figures(targets, runs))
}

fn side(
    series: &LinearSeries,
    target: Metres,
    approach: Approach,
) -> Result<(usize, Metres, Metres), EvaluationError> {
    let deviations: Vec<f64> = series
        .deviations(target, approach)
        .map(|(_, deviation)| deviation.value())
        .collect();
    let seen = deviations.len();
    match (mean(&deviations), standard_deviation(&deviations)) {
        (Some(mean), Some(s)) => Ok((seen, Metres(mean), Metres(s))),
        _ => Err(EvaluationError::TooFewRuns {
            target,
            approach,
            seen,
        }),
    }
}

fn target_figures(
    target: Metres,
    mean_forward: Metres,
    mean_reverse: Metres,
    s_forward: Metres,
    s_reverse: Metres,
) -> TargetFigures {
    let reversal_value = mean_forward - mean_reverse;
    let repeatability_forward = repeatability(s_forward);
    let repeatability_reverse = repeatability(s_reverse);
    let across = (s_forward + s_reverse) * K + reversal_value.abs();
    TargetFigures {
        target,
        mean_forward,
        mean_reverse,
        s_forward,
        s_reverse,
        reversal_value,
        repeatability_forward,
        repeatability_reverse,
        repeatability: across.max(repeatability_forward).max(repeatability_reverse),
    }
}

fn axis_figures(targets: Vec<TargetFigures>, runs: usize) -> Figures {
    let largest = targets.iter().map(|t| t.repeatability);
    let means: Vec<_> = targets
        .iter()
        .map(|t| (t.mean_forward, t.mean_reverse))
        .collect();
    let means = BothSides::of(&means);
    let forward = Direction::of(targets.iter().map(|t| (t.mean_forward, t.s_forward)));
    let reverse = Direction::of(targets.iter().map(|t| (t.mean_reverse, t.s_reverse)));
    let conformity = Conformity::of(runs, targets.iter().map(|t| t.target));
    Figures {
        reversal_value: means.reversal_value,
        mean_reversal_value: means.mean_reversal_value,
        mean_bidirectional_deviation_range: means.mean_bidirectional_deviation_range,
        systematic_deviation: Directional {
            bidirectional: means.systematic_deviation,
            forward: forward.means.range(),
            reverse: reverse.means.range(),
        },
        repeatability: Directional {
            bidirectional: Extent::of(largest).high,
            forward: forward.repeatability,
            reverse: reverse.repeatability,
        },
        accuracy: Directional {
            bidirectional: forward.band.with(reverse.band).range(),
            forward: forward.band.range(),
            reverse: reverse.band.range(),
        },
        runs,
        conformity,
        targets,
    }
}

/// The smallest and largest of some lengths.
#[derive(Clone, Copy, Debug)]
struct Extent {
    low: Metres,
    high: Metres,
}

impl Extent {
    fn of(values: impl Iterator<Item = Metres>) -> Self {
        let none = Self {
            low: Metres(f64::INFINITY),
            high: Metres(f64::NEG_INFINITY),
        };
        values.fold(none, |e, v| Self {
            low: e.low.min(v),
            high: e.high.max(v),
        })
    }

    fn with(self, other: Self) -> Self {
        Self {
            low: self.low.min(other.low),
            high: self.high.max(other.high),
        }
    }

    fn range(self) -> Metres {
        self.high - self.low
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error_table::Measurement;

    /// A series from (target mm, deviations forward µm, deviations reverse µm).
    fn series(points: &[(f64, &[f64], &[f64])]) -> LinearSeries {
        let mut measurements = Vec::new();
        let runs = points
            .iter()
            .map(|p| p.1.len().max(p.2.len()))
            .max()
            .unwrap();
        for run in 0..runs {
            let mut push = |approach, mm: f64, deviation: Option<&f64>| {
                if let Some(um) = deviation {
                    measurements.push(Measurement {
                        run: run as u32,
                        approach,
                        target: Metres::from_mm(mm),
                        measured: Metres(mm * 1e-3 + um * 1e-6),
                    });
                }
            };
            points
                .iter()
                .for_each(|p| push(Approach::Forward, p.0, p.1.get(run)));
            points
                .iter()
                .rev()
                .for_each(|p| push(Approach::Reverse, p.0, p.2.get(run)));
        }
        LinearSeries::new(measurements).unwrap()
    }

    fn check_um(name: &str, seen: Metres, expected_um: f64) {
        assert!(
            (seen.um() - expected_um).abs() < 1e-6,
            "{name}: {} um",
            seen.um()
        );
    }

    /// Two targets, two runs; with two values a ± d the standard deviation is d·√2.
    ///
    /// target 0:  ↑ 1, 3   → x̄ 2,  s √2      ↓ −1, −1 → x̄ −1, s 0
    /// target 10: ↑ 4, 4   → x̄ 4,  s 0       ↓ 4, 6   → x̄ 5,  s √2
    ///
    /// B_1 = 2 − (−1) = 3, B_2 = 4 − 5 = −1.  B = 3, B̄ = (3 − 1)/2 = 1.
    /// x̄_1 = 0.5, x̄_2 = 4.5: M = 4.
    /// E↑ = 4 − 2 = 2, E↓ = 5 − (−1) = 6, E = max(2,4,−1,5) − min(…) = 5 − (−1) = 6.
    /// R_1 = max(2√2 + 0 + 3, 4√2, 0) = max(5.828, 5.657) = 2√2 + 3 (the reversal term wins)
    /// R_2 = max(0 + 2√2 + 1, 0, 4√2) = max(3.828, 5.657) = 4√2 (one direction wins)
    /// R = 2√2 + 3, R↑ = 4√2, R↓ = 4√2.
    /// A↑ = max(2 + 2√2, 4) − min(2 − 2√2, 4) = 4.828 − (−0.828) = 4√2
    /// A↓ = max(−1, 5 + 2√2) − min(−1, 5 − 2√2) = 6 + 2√2
    /// A  = max(4.828, 7.828) − min(−0.828, −1) = 5 + 2√2 + 1 = 6 + 2√2.
    #[test]
    fn the_figures_of_a_hand_worked_case_are_met() {
        let root = 2.0_f64.sqrt();
        let f = evaluate(&series(&[
            (0.0, &[1.0, 3.0], &[-1.0, -1.0]),
            (10.0, &[4.0, 4.0], &[4.0, 6.0]),
        ]))
        .unwrap();
        check_um("s_1 forward", f.targets[0].s_forward, root);
        check_um("B_1", f.targets[0].reversal_value, 3.0);
        check_um("B_2", f.targets[1].reversal_value, -1.0);
        check_um("R_1", f.targets[0].repeatability, 2.0 * root + 3.0);
        check_um("R_2", f.targets[1].repeatability, 4.0 * root);
        check_um("B", f.reversal_value, 3.0);
        check_um("B mean", f.mean_reversal_value, 1.0);
        check_um("M", f.mean_bidirectional_deviation_range, 4.0);
        check_um("E forward", f.systematic_deviation.forward, 2.0);
        check_um("E reverse", f.systematic_deviation.reverse, 6.0);
        check_um("E", f.systematic_deviation.bidirectional, 6.0);
        check_um("R", f.repeatability.bidirectional, 2.0 * root + 3.0);
        check_um("R forward", f.repeatability.forward, 4.0 * root);
        check_um("R reverse", f.repeatability.reverse, 4.0 * root);
        check_um("A forward", f.accuracy.forward, 4.0 * root);
        check_um("A reverse", f.accuracy.reverse, 6.0 + 2.0 * root);
        check_um("A", f.accuracy.bidirectional, 6.0 + 2.0 * root);
    }

    /// No scatter, pure lost motion: ↑ 0, 0, 0; ↓ −5, −5, −5 at every target.
    /// Every mean ↑ is 0, every mean ↓ −5: E↑ = E↓ = 0, but E = 0 − (−5) = 5.
    /// R_i = |B_i| = 5 although every s is 0; A = 5; M = 0.
    /// (Taking E's minimum from one direction gives 0; forgetting R_i's term gives R = 0.)
    #[test]
    fn lost_motion_alone_shows_in_e_r_and_a_but_not_in_m() {
        let f = evaluate(&series(&[
            (0.0, &[0.0, 0.0, 0.0], &[-5.0, -5.0, -5.0]),
            (5.0, &[0.0, 0.0, 0.0], &[-5.0, -5.0, -5.0]),
        ]))
        .unwrap();
        check_um("E", f.systematic_deviation.bidirectional, 5.0);
        check_um("E forward", f.systematic_deviation.forward, 0.0);
        check_um("R", f.repeatability.bidirectional, 5.0);
        check_um("A", f.accuracy.bidirectional, 5.0);
        check_um("M", f.mean_bidirectional_deviation_range, 0.0);
        check_um("B mean", f.mean_reversal_value, 5.0);
    }

    /// The extremes of A sit in different directions: ↑ has the highest upper bound, ↓ the
    /// lowest lower bound. ↑ 10 ± 1 → s = √2 (two values), ↓ −10 ± 2 → s = 2√2 at one target;
    /// A = (10 + 2√2) − (−10 − 4√2) = 20 + 6√2, while A↑ = 4√2 and A↓ = 8√2.
    #[test]
    fn the_accuracy_spans_both_directions_bounds() {
        let root = 2.0_f64.sqrt();
        let f = evaluate(&series(&[(0.0, &[9.0, 11.0], &[-8.0, -12.0])])).unwrap();
        check_um("A", f.accuracy.bidirectional, 20.0 + 6.0 * root);
        check_um("A forward", f.accuracy.forward, 4.0 * root);
        check_um("A reverse", f.accuracy.reverse, 8.0 * root);
        check_um("E", f.systematic_deviation.bidirectional, 20.0);
    }

    #[test]
    fn fewer_than_five_runs_or_targets_is_said_and_not_refused() {
        let few = [1.0, 2.0, 3.0, 2.0];
        let five = [1.0, 2.0, 3.0, 2.0, 1.0];
        let at = |runs: &'static [f64], targets: usize, step_mm: f64| {
            let points: Vec<(f64, &[f64], &[f64])> = (0..targets)
                .map(|i| (i as f64 * step_mm, runs, runs))
                .collect();
            evaluate(&series(&points)).unwrap()
        };
        let few: &'static [f64] = Box::leak(Box::new(few));
        let five: &'static [f64] = Box::leak(Box::new(five));
        assert!(at(five, 5, 10.0).conforms());
        assert!(!at(few, 5, 10.0).conforms());
        assert_eq!(at(few, 5, 10.0).runs, 4);
        assert!(!at(five, 4, 10.0).conforms());
        // 1.2 m in 5 steps: the standard wants 6 targets there.
        assert!(!at(five, 5, 300.0).conforms());
        assert_eq!(at(five, 5, 300.0).conformity.targets_wanted, 6);
    }

    #[test]
    fn one_sided_data_and_single_runs_are_refused_with_the_reason() {
        let error = evaluate(&series(&[(0.0, &[1.0, 2.0], &[])])).unwrap_err();
        assert_eq!(
            error,
            EvaluationError::OneApproach {
                measured: Approach::Forward
            }
        );
        let error = evaluate(&series(&[
            (0.0, &[1.0, 2.0], &[1.0, 1.0]),
            (5.0, &[1.0, 2.0], &[1.0]),
        ]))
        .unwrap_err();
        assert_eq!(
            error.to_string(),
            "ISO 230-2: target 5 mm has 1 measurement(s) with approach `-`; at least 2 are \
             needed for a standard deviation"
        );
    }

    #[test]
    fn a_constant_added_to_every_deviation_changes_no_figure_but_the_means() {
        let base = evaluate(&series(&[
            (0.0, &[1.0, 3.0], &[0.0, 1.0]),
            (9.0, &[2.0, 2.5], &[1.0, 4.0]),
        ]));
        let moved = evaluate(&series(&[
            (0.0, &[101.0, 103.0], &[100.0, 101.0]),
            (9.0, &[102.0, 102.5], &[101.0, 104.0]),
        ]));
        let (base, moved) = (base.unwrap(), moved.unwrap());
        check_um(
            "A",
            moved.accuracy.bidirectional,
            base.accuracy.bidirectional.um(),
        );
        check_um(
            "E",
            moved.systematic_deviation.reverse,
            base.systematic_deviation.reverse.um(),
        );
        check_um(
            "R",
            moved.repeatability.bidirectional,
            base.repeatability.bidirectional.um(),
        );
    }
}
