//! The figures of one approach alone, of which ISO 230-2 has E↑, R↑ and A↑ (or E↓, R↓ and A↓).
//!
//! Source: ISO 230-2:2014, clause 3, the unidirectional definitions. Both directions of a bidirectional series
//! are made of these, too.

use units::{Approach, Metres};

use super::{Conformity, EvaluationError, Extent, K, side};
use crate::error_table::LinearSeries;

/// What one direction shows over all targets.
#[derive(Clone, Copy, Debug)]
pub(super) struct Direction {
    /// Of the mean deviations.
    pub(super) means: Extent,
    /// From the lowest x̄ − 2s to the highest x̄ + 2s.
    pub(super) band: Extent,
    /// The largest 4s.
    pub(super) repeatability: Metres,
}

impl Direction {
    /// By the mean deviation and standard deviation of each target.
    pub(super) fn of(targets: impl Iterator<Item = (Metres, Metres)> + Clone) -> Self {
        let low = Extent::of(targets.clone().map(|(mean, s)| mean - s * K)).low;
        let high = Extent::of(targets.clone().map(|(mean, s)| mean + s * K)).high;
        Self {
            means: Extent::of(targets.clone().map(|(mean, _)| mean)),
            band: Extent { low, high },
            repeatability: Extent::of(targets.map(|(_, s)| repeatability(s))).high,
        }
    }
}

/// R_i↑ = 4 s_i↑.
pub(super) fn repeatability(s: Metres) -> Metres {
    s * (2.0 * K)
}

/// One target, reached from one side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OneWayTarget {
    /// The target.
    pub target: Metres,
    /// x̄_i: the mean deviation.
    pub mean: Metres,
    /// s_i, with n − 1.
    pub s: Metres,
    /// R_i = 4 s_i.
    pub repeatability: Metres,
}

/// The unidirectional figures of an axis. What needs both sides (A, R, E, M, B) is not there.
#[derive(Clone, Debug, PartialEq)]
pub struct OneWayFigures {
    /// From which side all targets were reached.
    pub approach: Approach,
    /// Each target, increasing.
    pub targets: Vec<OneWayTarget>,
    /// E↑ or E↓.
    pub systematic_deviation: Metres,
    /// R↑ or R↓.
    pub repeatability: Metres,
    /// A↑ or A↓.
    pub accuracy: Metres,
    /// How the measurement compares with what the standard asks.
    pub conformity: Conformity,
}

/// The approach of a series in which every target was reached from the same side.
pub fn only_approach(series: &LinearSeries) -> Option<Approach> {
    let all = series.measurements();
    let first = all.first()?.approach;
    all.iter().all(|it| it.approach == first).then_some(first)
}

/// Evaluates what was measured with this approach, every target at least twice.
///
/// # Errors
/// When a target has fewer than two runs from that side.
///
/// # Example
///
/// ```
/// use compensator::error_table::LinearSeries;
/// use compensator::iso230::evaluate_one_way;
/// use units::Approach;
///
/// let csv = "run,approach,target_mm,measured_mm\n\
///            1,+,0,0.001\n1,+,10,10.004\n2,+,0,0.003\n2,+,10,10.004\n";
/// let series = LinearSeries::from_csv(csv, "measured.csv")?;
/// let figures = evaluate_one_way(&series, Approach::Forward)?;
/// assert!((figures.systematic_deviation.um() - 2.0).abs() < 1e-6, "E↑");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn evaluate_one_way(
    series: &LinearSeries,
    approach: Approach,
) -> Result<OneWayFigures, EvaluationError> {
    let mut runs = usize::MAX;
    let mut targets = Vec::new();
    for target in series.targets() {
        let (count, mean, s) = side(series, target, approach)?;
        runs = runs.min(count);
        targets.push(OneWayTarget {
            target,
            mean,
            s,
            repeatability: repeatability(s),
        });
    }
    let direction = Direction::of(targets.iter().map(|it| (it.mean, it.s)));
    let conformity = Conformity::of(runs, targets.iter().map(|it| it.target));
    Ok(OneWayFigures {
        approach,
        systematic_deviation: direction.means.range(),
        repeatability: direction.repeatability,
        accuracy: direction.band.range(),
        conformity,
        targets,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const FORWARD: &str = "1,+,0,0.001\n1,+,10,10.004\n";
    const REVERSE: &str = "1,-,10,10.006\n1,-,0,-0.002\n";

    fn series(runs: &[String]) -> LinearSeries {
        let text = runs.concat();
        LinearSeries::from_csv(
            &format!("run,approach,target_mm,measured_mm\n{text}"),
            "m.csv",
        )
        .unwrap()
    }

    fn run(number: u32, rows: &str) -> String {
        rows.replace("1,+", &format!("{number},+"))
            .replace("1,-", &format!("{number},-"))
    }

    /// target 0: 1, 3 → x̄ 2, s √2; target 10: 4, 4 → x̄ 4, s 0. E↑ = 2, R↑ = 4√2,
    /// A↑ = max(2 + 2√2, 4) − min(2 − 2√2, 4) = 4√2.
    #[test]
    fn the_figures_of_one_direction_are_those_of_a_hand_worked_case() {
        let later = run(2, FORWARD).replace("0,0.001", "0,0.003");
        let data = series(&[FORWARD.to_owned(), later]);
        assert_eq!(only_approach(&data), Some(Approach::Forward));
        let figures = evaluate_one_way(&data, Approach::Forward).unwrap();
        let root = 2.0_f64.sqrt();
        for (seen, wanted) in [
            (figures.systematic_deviation, 2.0),
            (figures.repeatability, 4.0 * root),
            (figures.accuracy, 4.0 * root),
            (figures.targets[0].s, root),
            (figures.targets[1].mean, 4.0),
        ] {
            assert!((seen.um() - wanted).abs() < 1e-6, "{} um", seen.um());
        }
        assert!(!figures.conformity.conforms());
    }

    #[test]
    fn each_direction_of_both_is_what_it_is_alone() {
        let rows = [
            FORWARD.to_owned(),
            REVERSE.to_owned(),
            run(2, FORWARD).replace("10.004", "10.001"),
            run(2, REVERSE).replace("-0.002", "0.001"),
        ];
        let both = series(&rows);
        assert_eq!(only_approach(&both), None);
        let figures = super::super::evaluate(&both).unwrap();
        let forward = evaluate_one_way(&both, Approach::Forward).unwrap();
        let reverse = evaluate_one_way(&both, Approach::Reverse).unwrap();
        assert_eq!(figures.accuracy.forward, forward.accuracy);
        assert_eq!(figures.accuracy.reverse, reverse.accuracy);
        assert_eq!(figures.repeatability.forward, forward.repeatability);
        let deviation = figures.systematic_deviation.reverse;
        assert_eq!(deviation, reverse.systematic_deviation);
    }

    #[test]
    fn one_run_says_nothing_of_repeatability() {
        let data = series(&[FORWARD.to_owned()]);
        let refused = evaluate_one_way(&data, Approach::Forward).unwrap_err();
        assert!(matches!(
            refused,
            EvaluationError::TooFewRuns { seen: 1, .. }
        ));
    }
}
