use nalgebra::{DMatrix, DVector};
use proptest::prelude::*;

use units::Radians;

use super::super::design::DesignError;
use super::super::plan::{Criterion, plan};
use super::super::rig::{Noise, Truth, centred};
use super::*;
use crate::rotary::{Placement, Reading};
use crate::uncertainty::{reduced_chi_square_limit, rms};

fn whole(_: usize, _: usize, reading: f64) -> Option<f64> {
    Some(reading)
}

fn solved(series: &RotarySeries) -> Solution {
    solve(series, &SolveOptions::default()).unwrap()
}

fn arcsec(values: &[Radians]) -> Vec<f64> {
    values.iter().map(|it| it.arcsec()).collect()
}

#[track_caller]
fn check_close(seen: &[f64], expected: &[f64], tolerance: f64) {
    assert_eq!(seen.len(), expected.len());
    for (at, (seen, expected)) in seen.iter().zip(expected).enumerate() {
        assert!(
            (seen - expected).abs() <= tolerance,
            "line {at}: {seen}, not {expected}"
        );
    }
}

/// G = 2, −1, −1 and A = 1, 0, −1 with constants 5 and −2:
/// V0[n] = G[n] + A[n] + 5 = 8, 4, 3; V1[n] = G[n + 1] + A[n] − 2 = −2, −3, −1.
#[test]
fn a_case_worked_by_hand_is_met() {
    let placement = |offset, readings: [f64; 3]| Placement {
        offset,
        readings: readings.map(|it| Some(Radians::from_arcsec(it))).to_vec(),
    };
    let placements = vec![
        placement(0, [8.0, 4.0, 3.0]),
        placement(1, [-2.0, -3.0, -1.0]),
    ];
    let solution = solved(&RotarySeries::new(3, placements).unwrap());
    check_close(&arcsec(&solution.table_error), &[2.0, -1.0, -1.0], 1e-12);
    check_close(&arcsec(&solution.deviations()), &[-2.0, 1.0, 1.0], 1e-12);
    let plate: Vec<f64> = solution
        .plate_error
        .iter()
        .map(|it| it.unwrap().arcsec())
        .collect();
    check_close(&plate, &[1.0, 0.0, -1.0], 1e-12);
    // No reading is left over to judge by, and √((9 − 1)/18) = 2/3.
    assert_eq!(
        (solution.degrees_of_freedom, solution.reading_noise_seen),
        (0, None)
    );
    assert!((solution.noise_amplification() - 2.0 / 3.0).abs() < 1e-15);
    assert!(solution.residual_rms.arcsec() < 1e-12);
}

/// The patent's own way: differences less their mean, added up, less the mean of the sums.
fn recursion(series: &RotarySeries) -> Vec<f64> {
    let placements = series.placements();
    let read = |at: usize| -> Vec<f64> {
        let readings = placements[at].readings.iter();
        centred(readings.map(|it| it.unwrap().arcsec()).collect())
    };
    let (first, second) = (read(0), read(1));
    let mut sum = 0.0;
    let mut table = Vec::new();
    for (a, b) in first.iter().zip(&second) {
        table.push(sum);
        sum += b - a;
    }
    assert!(sum.abs() < 1e-9, "the circle closes");
    centred(table)
}

#[test]
fn two_placements_one_line_apart_are_the_patents_recursion_to_rounding() {
    for lines in [2, 3, 4, 7, 36, 359, 360, 3600] {
        let mut noise = Noise(lines as u64);
        let truth = Truth::new(lines, &mut noise);
        let series = truth.series(&[0, 1], 0.05, &mut noise, whole);
        let expected = recursion(&series);
        // Rounding of 100″ is 1.4e-14; both ways add it up along the circle.
        let tolerance = 1e-13 * lines as f64;
        check_close(&arcsec(&solved(&series).table_error), &expected, tolerance);
    }
}

#[test]
fn noiseless_readings_give_back_table_and_plate_for_any_offsets() {
    for (lines, offsets) in [
        (12, vec![0, 5]),
        (45, vec![3, 17, 40]),
        (360, vec![0, 1, 77, 200, 359]),
    ] {
        let mut noise = Noise(7);
        let truth = Truth::new(lines, &mut noise);
        let series = truth.series(&offsets, 0.0, &mut noise, whole);
        let solution = solved(&series);
        check_close(&arcsec(&solution.table_error), &truth.table, 1e-10);
        let plate: Vec<f64> = solution
            .plate_error
            .iter()
            .map(|it| it.unwrap().arcsec())
            .collect();
        check_close(&plate, &truth.plate, 1e-10);
        assert!(solution.residual_rms.arcsec() < 1e-11);
        assert!(solution.outliers.is_empty());
    }
}

/// The same least squares with a matrix of all readings and all unknowns.
struct Dense {
    table: Vec<f64>,
    amplification: Vec<f64>,
    /// Directions of the unknowns that no reading sees, but for those every series has.
    unseen: usize,
    degrees_of_freedom: usize,
    residual_rms: f64,
}

fn dense(series: &RotarySeries) -> Dense {
    let (lines, placements) = (series.lines(), series.placements());
    let unknowns = 2 * lines + placements.len();
    let mut rows: Vec<(Vec<usize>, f64)> = Vec::new();
    for (at, placement) in placements.iter().enumerate() {
        for (line, reading) in placement.readings.iter().enumerate() {
            if let Some(reading) = reading {
                let position = (line + placement.offset) % lines;
                rows.push((
                    vec![position, lines + line, 2 * lines + at],
                    reading.arcsec(),
                ));
            }
        }
    }
    let mut matrix = DMatrix::zeros(rows.len().max(unknowns), unknowns);
    let mut right = DVector::zeros(rows.len().max(unknowns));
    for (row, (columns, reading)) in rows.iter().enumerate() {
        columns
            .iter()
            .for_each(|column| matrix[(row, *column)] = 1.0);
        right[row] = *reading;
    }
    // The eigenvalues of the normal equations are 0 or of the size of 1.
    let eigen = (matrix.transpose() * &matrix).symmetric_eigen();
    let seen = |it: f64| it > 1e-7;
    let rank = eigen.eigenvalues.iter().filter(|it| seen(**it)).count();
    let inverted = eigen
        .eigenvalues
        .map(|it| if seen(it) { 1.0 / it } else { 0.0 });
    let square = &eigen.eigenvectors * DMatrix::from_diagonal(&inverted);
    let inverse = square * eigen.eigenvectors.transpose() * matrix.transpose();
    let solution = &inverse * &right;
    let residual = &right - &matrix * &solution;
    let gradient = matrix.transpose() * &residual;
    assert!(
        gradient.amax() < 1e-9,
        "the reference is no least squares: {}",
        gradient.amax()
    );
    let never_read = (0..lines)
        .filter(|line| placements.iter().all(|it| it.readings[*line].is_none()))
        .count();
    let mut of_table = inverse.rows(0, lines).into_owned();
    for mut column in of_table.column_iter_mut() {
        let mean = column.mean();
        column.add_scalar_mut(-mean);
    }
    Dense {
        table: centred(solution.rows(0, lines).iter().copied().collect()),
        amplification: of_table.row_iter().map(|row| row.norm()).collect(),
        unseen: unknowns - rank - 2 - never_read,
        degrees_of_freedom: rows.len() - rank,
        residual_rms: residual.norm() / (rows.len() as f64).sqrt(),
    }
}

/// `true` when there was a solution to compare.
fn check_against_dense(series: &RotarySeries) -> bool {
    let expected = dense(series);
    let options = SolveOptions {
        outlier_threshold: f64::INFINITY,
        ..SolveOptions::default()
    };
    match solve(series, &options) {
        Ok(solution) => {
            assert_eq!(expected.unseen, 0, "solved what cannot be seen");
            check_close(&arcsec(&solution.table_error), &expected.table, 1e-8);
            check_close(&solution.amplification, &expected.amplification, 1e-8);
            assert_eq!(solution.degrees_of_freedom, expected.degrees_of_freedom);
            let apart = solution.residual_rms.arcsec() - expected.residual_rms;
            assert!(apart.abs() < 1e-9, "{apart}");
            true
        }
        Err(SolveError::Unobservable { .. }) => {
            assert_ne!(expected.unseen, 0, "refused what can be seen");
            false
        }
        Err(error) => panic!("{error}"),
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn with_anything_missing_it_is_the_dense_least_squares_or_is_refused_with_it(
        lines in 3_usize..14,
        places in prop::collection::vec(0_usize..1000, 2..5),
        missing in prop::collection::vec(0_usize..1000, 0..14),
        wiped in prop::option::of(0_usize..1000),
        seed in 0_u64..1000,
    ) {
        let mut offsets: Vec<usize> = places.iter().map(|it| it % lines).collect();
        offsets.sort_unstable();
        offsets.dedup();
        prop_assume!(Design::new(lines, &offsets, f64::INFINITY).is_ok());
        let mut noise = Noise(seed);
        let truth = Truth::new(lines, &mut noise);
        let total = lines * offsets.len();
        let gone = |at: usize, line: usize| {
            missing.iter().any(|it| it % total == at * lines + line)
                || wiped.is_some_and(|it| it % lines == line)
        };
        let series = truth.series(&offsets, 0.5, &mut noise, |at, line, reading| {
            (!gone(at, line)).then_some(reading)
        });
        check_against_dense(&series);
    }
}

#[test]
fn a_plate_with_a_smudged_line_and_two_single_gaps_is_solved_like_the_dense_one() {
    let mut noise = Noise(3);
    let truth = Truth::new(30, &mut noise);
    let gone = [(0, 4), (2, 11)];
    let series = truth.series(&[0, 1, 8, 12], 0.05, &mut noise, |at, line, reading| {
        (line != 17 && !gone.contains(&(at, line))).then_some(reading)
    });
    assert!(check_against_dense(&series));
    let solution = solved(&series);
    assert_eq!(solution.plate_error[17], None);
    assert_eq!(solution.missing.len(), 6);
    assert_eq!(
        solution.missing[0],
        Reading {
            placement: 0,
            offset: 0,
            line: 4
        }
    );
    // Each position has lost one of its four readings at most, and says so.
    let whole = solution.design.rms_amplification();
    assert!(solution.noise_amplification() > whole);
    assert!(solution.noise_amplification() < 1.2 * whole);
    // 2 · 29 readings too many, less one for each gap; line 17's fourth gap is its own error.
    assert_eq!(solution.degrees_of_freedom, 58 - 5);
}

#[test]
fn two_placements_cannot_bear_a_gap_and_the_reading_is_named() {
    let mut noise = Noise(4);
    let truth = Truth::new(24, &mut noise);
    let series = truth.series(&[0, 1], 0.0, &mut noise, |at, line, reading| {
        (!(at == 1 && line == 9)).then_some(reading)
    });
    let error = solve(&series, &SolveOptions::default()).unwrap_err();
    let reading = Reading {
        placement: 1,
        offset: 1,
        line: 9,
    };
    assert_eq!(error, SolveError::Unobservable { reading });
    assert!(
        error
            .to_string()
            .contains("line 9 at plate offset 1 is needed"),
        "{error}"
    );
}

#[test]
fn a_position_that_was_never_read_is_refused() {
    let mut noise = Noise(5);
    let truth = Truth::new(24, &mut noise);
    let series = truth.series(&[0, 1, 5, 11], 0.01, &mut noise, |at, line, reading| {
        let position = (line + [0, 1, 5, 11][at]) % 24;
        (position != 20).then_some(reading)
    });
    let error = solve(&series, &SolveOptions::default()).unwrap_err();
    assert!(matches!(error, SolveError::Unobservable { .. }), "{error}");
}

#[test]
fn offsets_of_no_use_are_refused() {
    let mut noise = Noise(6);
    let truth = Truth::new(24, &mut noise);
    let series = truth.series(&[0, 12], 0.01, &mut noise, whole);
    let error = solve(&series, &SolveOptions::default()).unwrap_err();
    assert!(matches!(
        error,
        SolveError::Design(DesignError::Unobservable { .. })
    ));
}

#[test]
fn a_table_error_known_too_badly_is_refused_with_its_place() {
    let mut noise = Noise(6);
    let truth = Truth::new(24, &mut noise);
    let offsets = [0, 1, 5, 11];
    // Position 20 keeps one reading of four.
    let series = truth.series(&offsets, 0.01, &mut noise, |at, line, reading| {
        (at == 0 || (line + offsets[at]) % 24 != 20).then_some(reading)
    });
    let usual = solved(&series);
    let worst = usual.amplification[20];
    assert!(usual.amplification.iter().all(|it| *it <= worst));
    assert!(worst > 1.05 * usual.design.worst().1, "{worst}");
    let options = SolveOptions {
        amplification_max: worst / 1.01,
        ..SolveOptions::default()
    };
    let error = solve(&series, &options).unwrap_err();
    assert!(
        matches!(error, SolveError::Amplified { position: 20, .. }),
        "{error}"
    );
}

#[test]
fn more_gaps_than_can_be_bridged_are_refused_with_their_number() {
    let mut noise = Noise(8);
    let truth = Truth::new(3600, &mut noise);
    let offsets = [0, 1, 8, 77, 1200, 2111];
    let series = truth.series(&offsets, 0.0, &mut noise, |at, line, reading| {
        (at == 0 || line % 5 != 1).then_some(reading)
    });
    let error = solve(&series, &SolveOptions::default()).unwrap_err();
    assert_eq!(error, SolveError::TooManyMissing { seen: 3600 });
}

const FOUR: [usize; 4] = [0, 1, 8, 26];

#[test]
fn bad_readings_are_found_named_and_left_out() {
    for seed in 0..20 {
        let mut noise = Noise(seed);
        let truth = Truth::new(360, &mut noise);
        // Small and huge ones, two on one line, two at one position of the table.
        let bad = [
            (0, 20, 1.0),
            (1, 20, -40.0),
            (2, 100, 3.0),
            (3, 82, -2.0),
            (2, 359, -0.9),
        ];
        let series = truth.series(&FOUR, 0.05, &mut noise, |at, line, reading| {
            let spoilt = bad.iter().find(|it| (it.0, it.1) == (at, line));
            Some(reading + spoilt.map_or(0.0, |it| it.2))
        });
        let solution = solved(&series);
        let mut named: Vec<_> = solution
            .outliers
            .iter()
            .map(|it| (it.reading.placement, it.reading.line))
            .collect();
        named.sort_unstable();
        let expected = [(0, 20), (1, 20), (2, 100), (2, 359), (3, 82)];
        assert_eq!(named, expected, "seed {seed}");
        for outlier in &solution.outliers {
            let at = (outlier.reading.placement, outlier.reading.line);
            let size = bad.iter().find(|it| (it.0, it.1) == at).unwrap().2;
            assert!(
                (outlier.residual.arcsec() - size).abs() < 0.5,
                "seed {seed}: {outlier:?}"
            );
            assert_eq!(outlier.reading.offset, FOUR[at.0]);
        }
        let errors = solution.table_error.iter().zip(&truth.table);
        let largest = errors
            .map(|(a, b)| (a.arcsec() - b).abs())
            .fold(0.0, f64::max);
        assert!(largest < 0.25, "seed {seed}: {largest}");
        assert_eq!(solution.degrees_of_freedom, 2 * 359 - 5);
    }
}

#[test]
fn good_readings_are_not_called_bad() {
    let mut false_alarms = 0;
    for seed in 100..400 {
        let mut noise = Noise(seed);
        let (lines, offsets) = match seed % 3 {
            0 => (12, vec![0, 1, 4]),
            1 => (36, vec![0, 1, 7, 11]),
            _ => (360, FOUR.to_vec()),
        };
        let truth = Truth::new(lines, &mut noise);
        let series = truth.series(&offsets, 0.05, &mut noise, whole);
        false_alarms += solved(&series).outliers.len();
    }
    assert_eq!(false_alarms, 0, "of 300 series");
}

#[test]
fn one_reading_in_fifty_may_be_bad_and_one_in_ten_is_refused() {
    let mut noise = Noise(50);
    let truth = Truth::new(360, &mut noise);
    let offsets = plan(360, 6, Criterion::Worst).unwrap().offsets().to_vec();
    let mut spoil = |every: usize| {
        let mut dirt = Noise(51);
        truth.series(&offsets, 0.05, &mut noise, |at, line, reading| {
            let bad = (at * 360 + line * 7) % every == 3;
            Some(if bad {
                reading + 4.0 + 20.0 * dirt.uniform()
            } else {
                reading
            })
        })
    };
    let solution = solved(&spoil(50));
    assert_eq!(solution.outliers.len(), 6 * 360 / 50);
    let noise_seen = solution.reading_noise_seen.unwrap().arcsec();
    assert!((noise_seen - 0.05).abs() < 0.004, "{noise_seen}");
    let error = solve(&spoil(10), &SolveOptions::default()).unwrap_err();
    assert!(
        matches!(error, SolveError::TooManyOutliers { .. }),
        "{error}"
    );
}

/// χ² of the error by the covariance of complete readings, Σ_k |Ê(k)|² Σ|w_j − w̄|²/(Nσ²) over
/// all k but 0: N − 1 degrees of freedom.
fn chi_square(solution: &Solution, truth: &Truth, sigma: f64) -> f64 {
    let lines = truth.table.len();
    let errors: Vec<f64> = solution
        .table_error
        .iter()
        .zip(&truth.table)
        .map(|(seen, truth)| seen.arcsec() - truth)
        .collect();
    (1..lines)
        .map(|k| {
            let (mut re, mut im) = (0.0, 0.0);
            for (n, error) in errors.iter().enumerate() {
                let phase = core::f64::consts::TAU * ((k * n) % lines) as f64 / lines as f64;
                re += error * phase.cos();
                im += error * phase.sin();
            }
            let amplification = solution.design.amplification(k.min(lines - k));
            (re * re + im * im) / (amplification.powi(2) * lines as f64 * sigma * sigma)
        })
        .sum()
}

#[test]
fn four_planned_placements_reach_a_few_hundredths_of_an_arcsecond_and_say_so() {
    const SIGMA: f64 = 0.05;
    let design = plan(360, 4, Criterion::Worst).unwrap();
    let (mut total, mut pulls) = (0.0, 0.0);
    for seed in 1..=20 {
        let mut noise = Noise(seed);
        let truth = Truth::new(360, &mut noise);
        let series = truth.series(design.offsets(), SIGMA, &mut noise, whole);
        let options = SolveOptions {
            reading_noise: Some(Radians::from_arcsec(SIGMA)),
            ..SolveOptions::default()
        };
        let solution = solve(&series, &options).unwrap();
        let errors: Vec<f64> = solution
            .table_error
            .iter()
            .zip(&truth.table)
            .map(|(seen, truth)| seen.arcsec() - truth)
            .collect();
        assert!(rms(&errors) <= 0.04, "seed {seed}: {}", rms(&errors));

        let seen = solution.reading_noise_seen.unwrap().arcsec();
        assert!(
            (seen / SIGMA - 1.0).abs() < 0.1,
            "seed {seed}: noise {seen}"
        );
        let propagated = solution.uncertainty_propagated().unwrap();
        assert!((propagated[7].arcsec() - SIGMA * design.rms_amplification()).abs() < 1e-12);
        let exact = chi_square(&solution, &truth, SIGMA) / 359.0;
        assert!(
            exact < reduced_chi_square_limit(359, 3.5),
            "seed {seed}: {exact}"
        );
        // By the noise that the residuals say, as a user has it.
        let chi_square = exact * 359.0 * (SIGMA / seen).powi(2);
        total += chi_square;
        let u = solution.standard_uncertainty().unwrap();
        let pull = |at: usize| errors[at] / u[at].arcsec();
        pulls += (0..360).map(|at| pull(at).powi(2)).sum::<f64>();
    }
    // 20 · 359 degrees of freedom: a standard deviation of the mean of 1.7 %, and 1.2 % of the
    // noise seen, which counts twice.
    let (mean, pulls) = (total / (20.0 * 359.0), pulls / (20.0 * 360.0));
    assert!((mean - 1.0).abs() < 0.09, "{mean}");
    assert!((pulls - 1.0).abs() < 0.12, "{pulls}");
}

#[test]
fn the_uncertainty_stays_honest_with_lines_missing() {
    const SIGMA: f64 = 0.05;
    let mut pulls = vec![0.0; 60];
    for seed in 0..400 {
        let mut noise = Noise(9000 + seed);
        let truth = Truth::new(60, &mut noise);
        let series = truth.series(&[0, 1, 14], SIGMA, &mut noise, |at, line, reading| {
            let smudged = (30..34).contains(&line) || (at == 1 && (5..12).contains(&line));
            (!smudged).then_some(reading)
        });
        let options = SolveOptions {
            reading_noise: Some(Radians::from_arcsec(SIGMA)),
            ..SolveOptions::default()
        };
        let solution = solve(&series, &options).unwrap();
        let u = solution.uncertainty_propagated().unwrap();
        for (at, pull) in pulls.iter_mut().enumerate() {
            let error = solution.table_error[at].arcsec() - truth.table[at];
            *pull += (error / u[at].arcsec()).powi(2) / 400.0;
        }
    }
    // Each is χ²(400)/400: a standard deviation of 7 %.
    for (at, pull) in pulls.iter().enumerate() {
        assert!((pull - 1.0).abs() < 0.3, "position {at}: {pull}");
    }
}
