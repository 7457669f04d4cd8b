use proptest::prelude::*;

use super::*;
use crate::error_table::Node;

const KINDS: [Interpolation; 2] = [Interpolation::Linear, Interpolation::MonotoneCubic];

fn table(points: &[(f64, f64)]) -> ErrorTable {
    let nodes = points.iter().map(|&(mm, um)| Node {
        position: Metres::from_mm(mm),
        forward: Some(Metres::from_um(um)),
        reverse: None,
        u_forward: None,
        u_reverse: None,
    });
    ErrorTable::new(nodes.collect()).unwrap()
}

fn limits() -> Limits {
    Limits {
        size: Metres::from_um(50.0),
        slope: 0.05,
        rate: MetresPerSecond(1e-3),
    }
}

fn make(
    points: &[(f64, f64)],
    kind: Interpolation,
    ends: EndPolicy,
) -> Result<Compensation, CompensationError> {
    Compensation::new(table(points), kind, limits(), ends)
}

/// The patent's shape of table: 60 mm in 20 intervals of 3 mm, errors up to ±10 µm.
fn patent_points() -> Vec<(f64, f64)> {
    (0..=20)
        .map(|i| (3.0 * f64::from(i), 10.0 * (f64::from(i) * 0.37).sin()))
        .collect()
}

fn check_inverse(c: &Compensation, target_mm: f64) {
    let target = Metres::from_mm(target_mm);
    let command = c.set_point(target, Approach::Forward).unwrap();
    let actual = command + c.deviation(command, Approach::Forward).unwrap();
    let error = (actual - target).abs();
    assert!(
        error.value() <= 3e-17,
        "{target_mm} mm: off by {:e} m",
        error.value()
    );
}

#[test]
fn the_set_point_is_the_exact_inverse_in_and_outside_the_table() {
    for kind in KINDS {
        for ends in [EndPolicy::Hold, EndPolicy::FadeOut(Metres::from_mm(5.0))] {
            let c = make(&patent_points(), kind, ends).unwrap();
            for i in -1000..=7000 {
                check_inverse(&c, f64::from(i) * 0.01 + 0.003_7);
            }
        }
    }
}

#[test]
fn the_patents_step_function_corrects_by_the_interval_of_the_target() {
    let c = make(
        &[(0.0, 0.0), (3.0, 2.0), (6.0, -1.0)],
        Interpolation::PiecewiseConstant,
        EndPolicy::Refuse,
    )
    .unwrap();
    let correction = |mm: f64| {
        let target = Metres::from_mm(mm);
        (c.set_point(target, Approach::Forward).unwrap() - target).um()
    };
    // P' = P + compensation(x_n), compensation = −error; the error of an interval is what was
    // measured at the step that ends it.
    assert!((correction(0.001) + 2.0).abs() < 1e-9);
    assert!((correction(3.0) + 2.0).abs() < 1e-9);
    assert!((correction(3.001) - 1.0).abs() < 1e-9);
    assert!((correction(6.0) - 1.0).abs() < 1e-9);
}

#[test]
fn the_measured_deviation_is_met_at_every_node() {
    for kind in KINDS {
        let c = make(&patent_points(), kind, EndPolicy::Refuse).unwrap();
        for (mm, um) in patent_points() {
            let seen = c.deviation(Metres::from_mm(mm), Approach::Forward).unwrap();
            assert!(
                (seen.um() - um).abs() < 1e-9,
                "{kind:?} at {mm} mm: {} um",
                seen.um()
            );
        }
    }
}

/// The patent's example: 60 mm in 20 intervals of 3 mm. Its errors change almost linearly from
/// interval to interval, and it reports ±1 µm after correction.
#[test]
fn the_patents_example_is_met_by_steps_and_beaten_by_lines_and_cubics() {
    let truth_um = |mm: f64| 10.0 * (mm / 32.0).sin();
    let points: Vec<(f64, f64)> = (0..=20)
        .map(|i| (3.0 * f64::from(i), truth_um(3.0 * f64::from(i))))
        .collect();
    let left = |kind| {
        let c = make(&points, kind, EndPolicy::Refuse).unwrap();
        (0..600)
            .map(|i| 0.05 + f64::from(i) * 0.1)
            .fold(0.0_f64, |worst, mm| {
                let command = c.set_point(Metres::from_mm(mm), Approach::Forward).unwrap();
                let actual_mm = command.mm() + truth_um(command.mm()) * 1e-3;
                worst.max((actual_mm - mm).abs() * 1e3)
            })
    };
    let steps = left(Interpolation::PiecewiseConstant);
    let (lines, cubics) = (
        left(Interpolation::Linear),
        left(Interpolation::MonotoneCubic),
    );
    assert!(steps < 1.0 && steps > 0.5, "steps: {steps} um");
    assert!(
        lines < 0.02 && cubics < 0.02,
        "lines: {lines} um, cubics: {cubics} um"
    );
}

#[test]
fn nothing_outside_the_table_is_corrected_silently() {
    let c = make(&patent_points(), Interpolation::Linear, EndPolicy::Refuse).unwrap();
    // Every calibrated target is reachable, even where its command lies just outside.
    assert!(c.set_point(Metres::ZERO, Approach::Forward).is_ok());
    assert!(
        c.set_point(Metres::from_mm(60.0), Approach::Forward)
            .is_ok()
    );
    let error = c
        .set_point(Metres::from_mm(60.001), Approach::Forward)
        .unwrap_err();
    assert_eq!(
        error.to_string(),
        "compensation: 60.001 mm is outside the calibrated 0 to 60 mm"
    );
    assert!(c.set_point(Metres(f64::NAN), Approach::Forward).is_err());
    assert!(
        c.deviation(Metres(f64::INFINITY), Approach::Forward)
            .is_err()
    );
    let error = c.set_point(Metres::ZERO, Approach::Reverse).unwrap_err();
    assert_eq!(
        error,
        OutOfRange::Approach {
            approach: Approach::Reverse
        }
    );
}

#[test]
fn a_fading_end_is_nothing_beyond_its_distance() {
    let ends = EndPolicy::FadeOut(Metres::from_mm(4.0));
    let c = make(&[(0.0, 4.0), (10.0, -8.0)], Interpolation::Linear, ends).unwrap();
    let at = |mm: f64| {
        c.deviation(Metres::from_mm(mm), Approach::Forward)
            .unwrap()
            .um()
    };
    assert!((at(-1.0) - 3.0).abs() < 1e-9);
    assert!((at(12.0) + 4.0).abs() < 1e-9);
    assert_eq!((at(-4.1), at(14.1)), (0.0, 0.0));
}

#[test]
fn a_deviation_that_is_too_large_is_refused_with_its_place() {
    let error = make(
        &[(0.0, 0.0), (100.0, 51.0)],
        Interpolation::Linear,
        EndPolicy::Hold,
    );
    assert!(matches!(error, Err(CompensationError::TooLarge { .. })));
    assert!(
        error
            .unwrap_err()
            .to_string()
            .contains("at 100 mm (approach `+`) is 51.000 um")
    );
}

#[test]
fn a_slope_above_the_limit_is_refused_for_the_interpolant_really_used() {
    // 10 µm over 0.3 mm: 0.0333 as a line, up to 1.5 times as much as a cubic with flat ends.
    let points = [(0.0, 0.0), (0.3, 0.0), (0.6, 10.0), (0.9, 10.0)];
    assert!(make(&points, Interpolation::Linear, EndPolicy::Hold).is_ok());
    let cubic = make(&points, Interpolation::MonotoneCubic, EndPolicy::Hold);
    let Ok(cubic) = cubic else {
        panic!("0.05 is just allowed: {cubic:?}")
    };
    assert!((cubic.steepest_slope() - 0.05).abs() < 1e-12);
    let steeper = [(0.0, 0.0), (0.3, 0.0), (0.6, 10.1), (0.9, 10.1)];
    assert!(make(&steeper, Interpolation::Linear, EndPolicy::Hold).is_ok());
    let error = make(&steeper, Interpolation::MonotoneCubic, EndPolicy::Hold).unwrap_err();
    assert!(
        matches!(error, CompensationError::TooSteep { .. }),
        "{error}"
    );
}

#[test]
fn what_has_no_unique_inverse_is_refused_whatever_the_interpolation() {
    let points = [(0.0, 0.0), (0.01, -10.5), (5.0, 0.0)];
    for kind in [Interpolation::PiecewiseConstant, KINDS[0], KINDS[1]] {
        let error = make(&points, kind, EndPolicy::Hold).unwrap_err();
        assert!(
            matches!(error, CompensationError::NotInvertible { .. }),
            "{kind:?}: {error}"
        );
    }
}

#[test]
fn a_fade_that_is_too_short_is_refused_as_too_steep() {
    let ends = EndPolicy::FadeOut(Metres::from_um(100.0));
    let error = make(&[(0.0, 8.0), (100.0, 0.0)], Interpolation::Linear, ends).unwrap_err();
    assert!(
        matches!(error, CompensationError::TooSteep { .. }),
        "{error}"
    );
}

#[test]
fn limits_that_are_none_are_refused() {
    let with = |limits| {
        Compensation::new(
            table(&patent_points()),
            Interpolation::Linear,
            limits,
            EndPolicy::Hold,
        )
    };
    assert!(
        with(Limits {
            slope: 1.0,
            ..limits()
        })
        .is_err()
    );
    assert!(
        with(Limits {
            size: Metres(f64::NAN),
            ..limits()
        })
        .is_err()
    );
    assert!(
        with(Limits {
            rate: MetresPerSecond(0.0),
            ..limits()
        })
        .is_err()
    );
}

#[test]
fn the_speed_limit_follows_from_rate_and_slope() {
    // 10 µm over 10 mm is 1e-3; 1 mm/s of correction allows 1 m/s of travel.
    let c = make(
        &[(0.0, 0.0), (10.0, 10.0)],
        Interpolation::Linear,
        EndPolicy::Hold,
    )
    .unwrap();
    assert!((c.speed_max().value() - 1.0).abs() < 1e-12);
}

#[test]
fn node_distances_from_a_micrometre_to_a_metre_are_found_right() {
    let points = [
        (0.0, 0.0),
        (0.001, 0.00002),
        (0.002, 0.0),
        (1000.0, 20.0),
        (2000.0, 0.0),
    ];
    for kind in KINDS {
        let c = make(&points, kind, EndPolicy::Refuse).unwrap();
        for (mm, um) in points {
            let seen = c.deviation(Metres::from_mm(mm), Approach::Forward).unwrap();
            assert!((seen.um() - um).abs() < 1e-9, "{kind:?} at {mm}");
        }
    }
}

proptest! {
    #[test]
    fn the_inverse_is_exact_and_increasing_for_any_table_that_is_accepted(
        steps in prop::collection::vec((0.02_f64..8.0, -40.0_f64..40.0), 2..40),
        shares in prop::collection::vec(0.0_f64..1.0, 1..40),
    ) {
        let mut mm = -20.0;
        let points: Vec<(f64, f64)> = steps.iter().map(|&(step, um)| { mm += step; (mm, um) }).collect();
        let wide = Limits { size: Metres::from_mm(1.0), slope: 0.999, rate: MetresPerSecond(1.0) };
        for kind in KINDS {
            let made = Compensation::new(table(&points), kind, wide, EndPolicy::Hold);
            let Ok(c) = made else { continue };
            let mut targets: Vec<f64> =
                shares.iter().map(|s| (points[0].0 + s * (mm - points[0].0)) * 1e-3).collect();
            targets.sort_by(f64::total_cmp);
            let mut previous = f64::NEG_INFINITY;
            for target in targets {
                let command = c.set_point(Metres(target), Approach::Forward).unwrap();
                let deviation = c.deviation(command, Approach::Forward).unwrap();
                let error = ((command + deviation).value() - target).abs();
                prop_assert!(error <= 1e-15, "{kind:?} at {target}: {error:e}");
                prop_assert!(command.value() >= previous - 1e-15);
                previous = command.value();
            }
        }
    }
}
