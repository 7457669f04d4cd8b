use super::super::rig::{Noise, row};
use super::*;

fn um(value: f64) -> Metres {
    Metres::from_um(value)
}

#[track_caller]
fn check_um(seen: Metres, expected: f64) {
    assert!((seen.um() - expected).abs() < 1e-9, "{} um", seen.um());
}

fn golden() -> PatentRule {
    PatentRule::of_errors(um(500.0), um(1500.0), um(2.02), um(2.62), um(2.29))
}

/// The patent's figures: means 2.02 at 500 µm, 2.62 at 1500 µm, 2.29 over all.
#[test]
fn the_golden_numbers_come_out() {
    check_um(golden().addition(um(1600.0), Approach::Forward), 0.96);
    check_um(golden().addition(um(1600.0), Approach::Reverse), 3.25);
}

/// 3 × 18 rows with the patent's means; the middle one follows from 3 · 2.29 − 2.02 − 2.62.
fn rows(approach: Approach, sign_of_strokes: f64) -> Vec<Stroke> {
    let mut rows = Vec::new();
    for (stroke, mean) in [(500.0, 2.02), (1000.0, 2.23), (1500.0, 2.62)] {
        for k in 0..18 {
            let scatter = 0.05 * (f64::from(k) - 8.5);
            rows.push(row(approach, sign_of_strokes * stroke, mean + scatter));
        }
    }
    rows
}

#[test]
fn the_figures_of_a_file_are_those_of_its_column() {
    for approach in [Approach::Forward, Approach::Reverse] {
        let estimate = estimate(&rows(approach, 1.0)).unwrap();
        assert!((estimate.slope * 1e3 - 0.60).abs() < 1e-9, "um/mm");
        check_um(estimate.mean_all, 2.29);
        check_um(estimate.mean_at_m, 2.02);
        check_um(estimate.mean_at_n, 2.62);
        check_um(estimate.at_m, 500.0);
        check_um(estimate.at_n, 1500.0);
        assert_eq!(estimate.rows, 54);
    }
}

#[test]
fn every_row_counts_whatever_its_approach() {
    let mut mixed = rows(Approach::Forward, 1.0);
    for it in mixed.iter_mut().step_by(3) {
        it.approach = Approach::Reverse;
    }
    let estimate = estimate(&mixed).unwrap();
    check_um(estimate.mean_all, 2.29);
    assert!((estimate.slope * 1e3 - 0.60).abs() < 1e-9);
}

/// The patent's screw: a reverse move of 500 to 1500 µm falls short by 2.02 to 2.62 µm. Reached
/// in reverse at −500 to −1500 µm, the nut stands above its target: deviation +2.02 to +2.62.
#[test]
fn the_door_turns_deviations_into_what_a_move_falls_short_by() {
    let estimate = estimate(&rows(Approach::Reverse, -1.0)).unwrap();
    let rule = PatentRule::of_model(&estimate.model());
    assert!((rule.gain - 0.6e-3).abs() < 1e-12);
    check_um(rule.addition(um(1600.0), Approach::Forward), 0.96);
    check_um(rule.addition(um(-1600.0), Approach::Reverse), 3.25);
    let (slope, lost_motion) = golden().slope_and_lost_motion();
    assert!((slope - estimate.slope).abs() < 1e-12);
    check_um(lost_motion, estimate.mean_all.um());
}

/// Each direction has its own m and n: the second is not divided by the first's.
#[test]
fn each_screw_is_divided_by_its_own_strokes() {
    let second = [
        row(Approach::Forward, 1000.0, 2.0),
        row(Approach::Forward, 4000.0, 3.5),
    ];
    let estimate = estimate(&second).unwrap();
    assert!((estimate.slope * 1e3 - 0.5).abs() < 1e-12);
    assert_eq!(estimate.uncertainty, None);
    assert_eq!(estimate.model().covariance, None);
}

/// 4 rows at m, 9 at n: u = s·√(1/4 + 1/9)/(n − m) = s·0.6009/1000.
#[test]
fn unequal_repeats_are_weighed_as_they_are() {
    let scattered = |stroke: f64, mean: f64, count: usize| {
        let offsets = (0..count).map(move |k| k as f64 - (count as f64 - 1.0) / 2.0);
        offsets.map(move |o| row(Approach::Forward, stroke, mean + 0.1 * o))
    };
    let mut rows: Vec<Stroke> = scattered(500.0, 2.0, 4).collect();
    rows.extend(scattered(1500.0, 3.0, 9));
    let estimate = estimate(&rows).unwrap();
    assert!((estimate.slope * 1e3 - 1.0).abs() < 1e-9);
    check_um(estimate.mean_all, (4.0 * 2.0 + 9.0 * 3.0) / 13.0);
    let u = estimate.uncertainty.unwrap();
    // Squares of −1.5…1.5 and −4…4 steps of 0.1: (5 + 60)·0.01 over 3 + 8.
    check_um(u.scatter, (0.65_f64 / 11.0).sqrt());
    assert_eq!(u.degrees_of_freedom, 11);
    check_um(u.mean_all, u.scatter.um() / 13.0_f64.sqrt());
    let expected = u.scatter.um() * (1.0_f64 / 4.0 + 1.0 / 9.0).sqrt() / 1000.0;
    assert!((u.slope - expected).abs() < 1e-12);
}

/// Seeds 0 to 3999, 3 strokes of 12 rows from either side: the squares of (estimate − truth)/u
/// average 1 within three standard deviations of such an average.
#[test]
fn the_uncertainties_are_honest() {
    let mut squares = [0.0; 2];
    for seed in 0..4000 {
        let mut noise = Noise(seed);
        let mut rows = Vec::new();
        for stroke in [500.0, 1000.0, 1500.0] {
            for k in 0..12 {
                let approach = [Approach::Forward, Approach::Reverse][k % 2];
                let lost = [0.0, 2.0][k % 2];
                let um = 1.0 + lost + 0.6e-3 * stroke + 0.3 * noise.normal();
                rows.push(row(approach, stroke, um));
            }
        }
        let estimate = estimate(&rows).unwrap();
        let u = estimate.uncertainty.unwrap();
        squares[0] += ((estimate.slope - 0.6e-3) / u.slope).powi(2);
        squares[1] += ((estimate.mean_all - um(2.6)) / u.mean_all).powi(2);
    }
    // 30 degrees of freedom: mean 30/28 = 1.07, standard deviation of one square 1.6.
    for square in squares {
        let mean = square / 4000.0;
        assert!(
            (mean - 1.07).abs() < 3.0 * 1.6 / 4000.0_f64.sqrt(),
            "{mean}"
        );
    }
}

/// Why the rule is read for positions: added move by move, there and back again leaves the screw
/// short of where it began by all of the lost motion.
#[test]
fn added_move_by_move_the_rule_walks_away_at_every_reversal() {
    let rule = golden();
    let mut commanded = 0.0;
    for _ in 0..5 {
        for (approach, sign) in [(Approach::Forward, 1.0), (Approach::Reverse, -1.0)] {
            commanded += sign * (1600.0 + rule.addition(um(1600.0), approach).um());
        }
    }
    assert!((commanded + 5.0 * 2.29).abs() < 1e-9, "{commanded} um");
}

#[test]
fn one_stroke_has_no_slope() {
    let rows = [row(Approach::Forward, 500.0, 2.0); 3];
    assert_eq!(estimate(&rows), Err(FitError::OneStroke));
    assert_eq!(estimate(&[]), Err(FitError::OneStroke));
}
