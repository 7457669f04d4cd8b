use proptest::prelude::*;

use super::super::rig::Noise;
use super::*;

const LIMITS: PeriodicLimits = PeriodicLimits {
    size: Radians::from_arcsec(60.0),
    slope: 0.05,
};

/// A sum of harmonics below half of the lines, arcseconds.
fn truth(angle: f64) -> f64 {
    1.5 + 6.0 * (angle + 0.3).cos() + 2.0 * (2.0 * angle).sin() + 0.5 * (17.0 * angle + 1.0).cos()
}

fn truth_slope(angle: f64) -> f64 {
    -6.0 * (angle + 0.3).sin() + 4.0 * (2.0 * angle).cos() - 8.5 * (17.0 * angle + 1.0).sin()
}

fn table(lines: usize, u_arcsec: f64) -> PeriodicTable {
    let at = |line: usize| truth(TAU * line as f64 / lines as f64);
    let deviations = (0..lines)
        .map(|line| Radians::from_arcsec(at(line)))
        .collect();
    PeriodicTable::new(
        deviations,
        Some(vec![Radians::from_arcsec(u_arcsec); lines]),
    )
    .unwrap()
}

fn made(lines: usize, interpolation: PeriodicInterpolation) -> PeriodicCompensation {
    PeriodicCompensation::new(table(lines, 0.1), interpolation, LIMITS).unwrap()
}

fn arcsec(compensation: &PeriodicCompensation, angle: f64) -> f64 {
    compensation.deviation(Radians(angle)).unwrap().arcsec()
}

#[test]
fn a_band_limited_deviation_is_met_between_the_lines() {
    for lines in [36, 37, 360] {
        let made = made(lines, PeriodicInterpolation::BandLimited);
        let bound = made.interpolation_error().arcsec();
        assert!(bound < 2e-6, "{lines}: {bound}");
        let (mut slope, mut largest) = (0.0_f64, 0.0_f64);
        for step in 0..5000 {
            let angle = TAU * f64::from(step) / 5000.0;
            let apart = (arcsec(&made, angle) - truth(angle)).abs();
            assert!(
                apart <= bound + 1e-11,
                "{lines} lines, {angle}: {apart} of {bound}"
            );
            slope = slope.max(truth_slope(angle).abs());
            largest = largest.max(truth(angle).abs());
        }
        let seen = Radians(made.steepest_slope()).arcsec();
        assert!((seen / slope - 1.0).abs() < 1e-3, "{seen} {slope}");
        let seen = made.largest().arcsec();
        assert!((seen / largest - 1.0).abs() < 1e-3, "{seen} {largest}");
    }
}

/// The highest harmonic of an even number of lines is a cosine: +1, −1, +1 …, and 0 between.
#[test]
fn the_highest_harmonic_of_an_even_table_is_a_cosine() {
    let deviations = (0..8).map(|line| Radians(if line % 2 == 0 { 1e-5 } else { -1e-5 }));
    let table = PeriodicTable::new(deviations.collect(), None).unwrap();
    let made =
        PeriodicCompensation::new(table, PeriodicInterpolation::BandLimited, LIMITS).unwrap();
    for step in 0..100 {
        let angle = TAU * f64::from(step) / 100.0;
        let seen = made.deviation(Radians(angle)).unwrap().value();
        assert!((seen - 1e-5 * (4.0 * angle).cos()).abs() < 1e-11);
    }
    assert_eq!(made.standard_uncertainty(Radians(0.3)), Ok(None));
}

#[test]
fn the_bound_of_the_interpolation_holds_for_the_roughest_table() {
    let mut noise = Noise(1);
    let lines = 90;
    let values: Vec<f64> = (0..lines).map(|_| 1e-6 * noise.normal()).collect();
    let table = PeriodicTable::new(values.iter().copied().map(Radians).collect(), None).unwrap();
    let made =
        PeriodicCompensation::new(table, PeriodicInterpolation::BandLimited, LIMITS).unwrap();
    // The trigonometric interpolant by its cardinal function (even number of nodes).
    let cardinal = |x: f64| {
        let half = (x / 2.0).tan();
        if half.abs() < 1e-12 {
            1.0
        } else {
            (45.0 * x).sin() / (90.0 * half)
        }
    };
    let mut largest = 0.0_f64;
    for step in 0..997 {
        let angle = TAU * f64::from(step) / 997.0;
        let exact: f64 = (0..lines)
            .map(|line| values[line] * cardinal(angle - TAU * line as f64 / lines as f64))
            .sum();
        largest = largest.max((made.deviation(Radians(angle)).unwrap().value() - exact).abs());
    }
    let bound = made.interpolation_error().value();
    assert!(largest <= bound, "{largest} of {bound}");
    assert!(
        largest > bound / 1000.0,
        "the bound says nothing: {largest} of {bound}"
    );
    assert!(bound < 1e-3 * 1e-6, "{bound}");
}

#[test]
fn straight_lines_meet_the_lines_and_their_middles() {
    let made = made(36, PeriodicInterpolation::Linear);
    let values = arcsec(&made, 0.0);
    assert!((values - truth(0.0)).abs() < 1e-12);
    let step = TAU / 36.0;
    for line in 0..36 {
        let start = step * f64::from(line);
        let middle = (truth(start) + truth(start + step)) / 2.0;
        assert!(
            (arcsec(&made, start + step / 2.0) - middle).abs() < 1e-10,
            "line {line}"
        );
    }
    assert_eq!(made.interpolation_error(), Radians::ZERO);
}

#[test]
fn the_uncertainty_between_the_lines_is_that_of_the_lines() {
    let made = made(360, PeriodicInterpolation::BandLimited);
    let u = made.standard_uncertainty(Radians(1.2345)).unwrap().unwrap();
    assert!((u.arcsec() - 0.1).abs() < 1e-12);
    // A straight line does not follow the 17th harmonic: h²/8 · 17² · 0.5″ = 0.55″ at most.
    let coarse = self::made(36, PeriodicInterpolation::Linear);
    let step = TAU / 36.0;
    let at_line = coarse
        .standard_uncertainty(Radians(7.0 * step))
        .unwrap()
        .unwrap();
    assert!((at_line.arcsec() - 0.1).abs() < 1e-9);
    let (mut squares, mut expected) = (0.0, 0.0);
    for line in 0..36 {
        let middle = (f64::from(line) + 0.5) * step;
        let u = coarse
            .standard_uncertainty(Radians(middle))
            .unwrap()
            .unwrap()
            .arcsec();
        squares += (arcsec(&coarse, middle) - truth(middle)).powi(2);
        expected += u * u;
    }
    let ratio = (squares / expected).sqrt();
    assert!(
        (0.3..1.5).contains(&ratio),
        "errors are {ratio} of what is stated"
    );
}

#[test]
fn a_table_too_large_too_steep_or_not_invertible_is_refused_with_its_place() {
    let refused = |table: &PeriodicTable, size: f64, slope: f64| {
        let size = Radians::from_arcsec(size);
        let limits = PeriodicLimits { size, slope };
        let made =
            PeriodicCompensation::new(table.clone(), PeriodicInterpolation::BandLimited, limits);
        made.map(|_| ()).unwrap_err()
    };
    let good = table(36, 0.1);
    assert!(matches!(
        refused(&good, 5.0, 0.1),
        PeriodicError::TooLarge { .. }
    ));
    let text = refused(&good, 60.0, 1e-5).to_string();
    assert!(
        text.contains("arcsec per degree, the limit is 0.036"),
        "{text}"
    );
    assert!(matches!(
        refused(&good, 60.0, 1.0),
        PeriodicError::Limits { .. }
    ));
    assert!(matches!(
        refused(&good, f64::NAN, 0.1),
        PeriodicError::Limits { .. }
    ));
    // 0.3 rad up and down within three of 36 lines.
    let mut values = vec![Radians::ZERO; 36];
    values[7] = Radians(0.3);
    let steep = PeriodicTable::new(values, None).unwrap();
    let PeriodicError::NotInvertible { position, .. } = refused(&steep, 1e6, 0.99) else {
        panic!("it has several inverses")
    };
    assert!((position.value() - 7.0 * TAU / 36.0).abs() < 0.2);
}

#[test]
fn what_makes_no_table_is_refused() {
    let new = PeriodicTable::new;
    let zeros = |count| vec![Radians::ZERO; count];
    assert_eq!(
        new(zeros(1), None),
        Err(PeriodicError::TooFewLines { seen: 1 })
    );
    assert_eq!(
        new(zeros(3), Some(zeros(2))),
        Err(PeriodicError::Uncertainties { seen: 2, lines: 3 })
    );
    let mut bad = zeros(3);
    bad[1] = Radians(f64::NAN);
    assert_eq!(
        new(bad.clone(), None),
        Err(PeriodicError::NotFinite { line: 1 })
    );
    bad[1] = Radians(-1.0);
    assert_eq!(
        new(zeros(3), Some(bad)),
        Err(PeriodicError::NotFinite { line: 1 })
    );
    let made = made(36, PeriodicInterpolation::Linear);
    for angle in [f64::NAN, f64::INFINITY] {
        assert!(made.set_point(Radians(angle)).is_err());
        assert!(made.deviation(Radians(angle)).is_err());
    }
}

#[test]
fn the_seam_is_a_place_like_any_other() {
    for interpolation in [
        PeriodicInterpolation::BandLimited,
        PeriodicInterpolation::Linear,
    ] {
        let made = made(36, interpolation);
        let around = |angle: f64| arcsec(&made, angle);
        for near in [1e-15, 1e-12, 1e-9, 1e-6] {
            let rise = around(near) - around(-near);
            let allowed = 2.0 * near * Radians(made.steepest_slope()).arcsec() * 1.01 + 1e-11;
            assert!(rise.abs() <= allowed, "{near}: {rise}");
            assert!((around(TAU - near) - around(-near)).abs() < 1e-9);
        }
    }
}

proptest! {
    #[test]
    fn the_set_point_is_the_exact_inverse_on_any_turn(
        values in prop::collection::vec(-1.0_f64..1.0, 2..40),
        targets in prop::collection::vec(0.0_f64..1.0, 20),
        turns in -1000_i32..1000,
        straight in any::<bool>(),
        scale in 1e-6_f64..0.5,
    ) {
        // As steep as the limit allows, or gentle: slopes up to 0.5 of what has an inverse.
        let steepness = values.len() as f64 * values.len() as f64;
        let deviations = values.iter().map(|it| Radians(it * scale / steepness)).collect();
        let table = PeriodicTable::new(deviations, None).unwrap();
        let interpolation = if straight {
            PeriodicInterpolation::Linear
        } else {
            PeriodicInterpolation::BandLimited
        };
        let limits = PeriodicLimits { size: Radians(1.0), slope: 0.999 };
        let made = PeriodicCompensation::new(table, interpolation, limits);
        prop_assume!(made.is_ok());
        let made = made.unwrap();
        for part in targets {
            let target = Radians((part + f64::from(turns)) * TAU);
            let command = made.set_point(target).unwrap();
            let actual = command + made.deviation(command).unwrap();
            let rounding = 4.0 * f64::EPSILON * (target.abs().value() + TAU);
            prop_assert!((actual - target).abs().value() <= rounding, "{target} {command}");
            let turned = made.set_point(Radians(part * TAU)).unwrap();
            let apart = (command - target) - (turned - Radians(part * TAU));
            prop_assert!(apart.abs().value() <= rounding);
            prop_assert!((command - target).abs() <= Radians(made.largest().value() + rounding));
        }
    }
}
