use super::super::design::{rms_amplification_of_a_pair, rms_amplification_of_all};
use super::*;

#[test]
fn two_placements_are_the_patents_and_all_are_all() {
    let pair = plan(360, 2, Criterion::Worst).unwrap();
    assert_eq!(pair.offsets(), [0, 1]);
    assert!((pair.rms_amplification() - rms_amplification_of_a_pair(360)).abs() < 1e-9);
    let all = plan(9, 9, Criterion::Rms).unwrap();
    assert!((all.rms_amplification() - rms_amplification_of_all(9)).abs() < 1e-12);
}

#[test]
fn what_cannot_be_planned_is_refused() {
    for (lines, placements) in [(1, 2), (360, 1), (360, 0), (12, 13), (1_000_000, 4)] {
        let error = plan(lines, placements, Criterion::Worst).unwrap_err();
        assert!(!matches!(error, PlanError::Design(_)), "{error}");
    }
}

/// The best of all sets that contain 0.
fn exhaustive(lines: usize, placements: usize) -> (f64, f64) {
    let mut best = (f64::INFINITY, f64::INFINITY);
    for chosen in 0_u32..1 << (lines - 1) {
        if chosen.count_ones() as usize != placements - 1 {
            continue;
        }
        let mut offsets = vec![0];
        offsets.extend((1..lines).filter(|line| chosen >> (line - 1) & 1 == 1));
        if let Ok(design) = Design::new(lines, &offsets, f64::INFINITY) {
            best.0 = design.worst().1.min(best.0);
            best.1 = design.rms_amplification().min(best.1);
        }
    }
    best
}

#[test]
fn small_plans_are_the_best_there_are() {
    for (lines, placements) in [(7, 3), (12, 3), (13, 4), (15, 4), (16, 5), (18, 3)] {
        let (worst, rms) = exhaustive(lines, placements);
        let planned = plan(lines, placements, Criterion::Worst).unwrap();
        assert!(
            planned.worst().1 <= worst * (1.0 + 1e-6),
            "{planned:?}, not {worst}"
        );
        let planned = plan(lines, placements, Criterion::Rms).unwrap();
        assert!(
            planned.rms_amplification() <= rms * (1.0 + 1e-9),
            "{planned:?}, not {rms}"
        );
    }
}

/// {0, 1, 3} modulo 7 and {0, 1, 3, 9} modulo 13 are perfect difference sets: every harmonic is
/// amplified alike, 1/√(P − (P − 1)/P).
#[test]
fn a_perfect_difference_set_is_found_where_there_is_one() {
    for (lines, placements) in [(7, 3), (13, 4), (21, 5), (31, 6)] {
        let count = placements as f64;
        let best = 1.0 / (count - (count - 1.0) / count).sqrt();
        let planned = plan(lines, placements, Criterion::Worst).unwrap();
        assert!((planned.worst().1 - best).abs() < 1e-9, "{planned:?}");
        assert!(
            (planned.amplification(1) - best).abs() < 1e-9,
            "{planned:?}"
        );
    }
}

#[test]
fn large_plans_are_sound_and_always_the_same() {
    for criterion in [Criterion::Worst, Criterion::Rms] {
        let planned = plan(360, 4, criterion).unwrap();
        assert_eq!(planned, plan(360, 4, criterion).unwrap());
        assert_eq!(planned.offsets()[0], 0);
        assert!(planned.offsets().is_sorted() && planned.offsets().len() == 4);
        assert!(planned.worst().1 < 3.0, "{:?}", planned.worst());
        assert!(
            planned.rms_amplification() < 0.7,
            "{}",
            planned.rms_amplification()
        );
    }
}

#[test]
fn the_sidon_sequence_begins_as_published() {
    let begin: Vec<usize> = sidon_sequence().take(10).collect();
    assert_eq!(begin, [1, 3, 7, 12, 20, 30, 44, 65, 80, 96]);
}
