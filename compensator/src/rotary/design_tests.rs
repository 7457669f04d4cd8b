use super::*;

fn design(lines: usize, offsets: &[usize]) -> Design {
    Design::new(lines, offsets, f64::INFINITY).unwrap()
}

/// Relative.
#[track_caller]
fn check_near(seen: f64, expected: f64, tolerance: f64) {
    assert!(
        (seen - expected).abs() <= tolerance * expected,
        "{seen}, not {expected}"
    );
}

/// Two readings of each line one line apart: per harmonic 1/(√2 |sin(πk/N)|), which is √2 times
/// the 1/|2 sin(πk/N)| by which the noise of the difference of the two placements is amplified.
#[test]
fn the_patents_pair_amplifies_slow_harmonics() {
    let pair = design(360, &[0, 1]);
    for harmonic in 1..=180 {
        let sine = (PI * harmonic as f64 / 360.0).sin();
        check_near(pair.amplification(harmonic), 0.5_f64.sqrt() / sine, 1e-12);
    }
    assert_eq!(pair.worst().0, 1);
    check_near(pair.worst().1, 81.03, 1e-4);
}

#[test]
fn theory_gives_the_rms_amplification_of_a_pair_and_of_all_placements() {
    for lines in [2, 3, 5, 12, 100, 360, 3600] {
        let pair = design(lines, &[0, 1]).rms_amplification();
        check_near(pair, rms_amplification_of_a_pair(lines), 1e-12);
        let turned = design(lines, &[lines - 1, 0]).rms_amplification();
        check_near(turned, pair, 1e-12);
        if lines <= 360 {
            let all: Vec<usize> = (0..lines).collect();
            let all = design(lines, &all).rms_amplification();
            check_near(all, rms_amplification_of_all(lines), 1e-12);
        }
    }
    check_near(rms_amplification_of_a_pair(360), 7.7459, 1e-4);
    check_near(rms_amplification_of_all(360), 0.05263, 1e-3);
}

#[test]
fn the_information_of_a_harmonic_is_the_scatter_of_its_phase_factors() {
    let (lines, offsets) = (15, [0, 4, 5, 11]);
    let design = design(lines, &offsets);
    for k in 1..=7 {
        let phase = |s: usize| 2.0 * PI * (k * s) as f64 / lines as f64;
        let (re, im) = offsets.iter().fold((0.0, 0.0), |(re, im), s| {
            (re + phase(*s).cos() / 4.0, im + phase(*s).sin() / 4.0)
        });
        let scatter: f64 = offsets
            .iter()
            .map(|s| (phase(*s).cos() - re).powi(2) + (phase(*s).sin() - im).powi(2))
            .sum();
        check_near(design.amplification(k), 1.0 / scatter.sqrt(), 1e-12);
    }
}

#[test]
fn an_offset_prime_to_the_lines_is_as_good_as_one() {
    let one = design(360, &[0, 1]);
    let seven = design(360, &[3, 10]);
    check_near(seven.rms_amplification(), one.rms_amplification(), 1e-12);
    check_near(seven.worst().1, one.worst().1, 1e-12);
    assert_eq!(seven.worst().0, 103, "7 · 103 = 2 · 360 + 1");
}

#[track_caller]
fn check_refused(lines: usize, offsets: &[usize], says: &str) {
    let error = Design::new(lines, offsets, 1e4).unwrap_err().to_string();
    assert!(error.contains(says), "{error}");
}

#[test]
fn offsets_that_leave_a_harmonic_unobservable_are_refused_by_its_number() {
    check_refused(360, &[0, 180], "harmonic 2 and its multiples");
    check_refused(360, &[1, 3, 5], "harmonic 180 and its multiples");
    check_refused(
        12,
        &[0, 4, 8],
        "differ by multiples of 4 only, which divides the 12 lines",
    );
    check_refused(360, &[7, 7 + 24, 7 + 60], "harmonic 30 and");
    assert!(Design::new(360, &[0, 24, 61], 1e4).is_ok());
}

#[test]
fn offsets_that_amplify_beyond_the_limit_are_refused() {
    assert!(Design::new(360, &[0, 1], 81.1).is_ok());
    let error = Design::new(360, &[0, 1], 81.0).unwrap_err();
    assert!(matches!(error, DesignError::Amplified { harmonic: 1, .. }));
    assert!(Design::new(360, &[0, 1], f64::NAN).is_err());
}

#[test]
fn what_are_no_offsets_is_refused() {
    check_refused(1, &[0, 1], "a plate with 1 line(s)");
    check_refused(8, &[3], "1 placement(s)");
    check_refused(8, &[0, 8], "offset 8 is repeated or is not one of 0 to 7");
    check_refused(8, &[0, 3, 3], "offset 3 is repeated");
}

/// What is at the lines above the limit is there below it, too: the limit is where telling ends.
#[test]
fn a_harmonic_above_the_limit_looks_like_one_below_it() {
    for lines in [5_usize, 12, 36, 37] {
        let at = |harmonic: usize, line: usize| {
            let turns = (harmonic * line % lines) as f64 / lines as f64;
            units::portable::cos(core::f64::consts::TAU * turns)
        };
        let alike = |a: usize, b: usize| (0..lines).all(|it| (at(a, it) - at(b, it)).abs() < 1e-12);
        let limit = harmonic_max(lines);
        for harmonic in 1..=limit {
            assert!((1..harmonic).all(|lower| !alike(harmonic, lower)));
            assert!(alike(lines - harmonic, harmonic), "{lines}: {harmonic}");
        }
        assert!(2 * limit < lines && 2 * (limit + 1) >= lines);
    }
}
