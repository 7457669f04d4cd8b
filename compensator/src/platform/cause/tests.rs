use super::rig::{Machine, ONCE, OWN, TOLERANCE, as_is};
use super::*;

fn judged(machine: &Machine, (datum, sightings): &(Pose, Vec<Sighting>)) -> Verdict {
    judge(
        &machine.platform,
        &machine.homed,
        *datum,
        sightings,
        TOLERANCE,
    )
    .expect("every screw was moved")
}

/// What is said of a drawn machine that is mistaken in one thing.
fn said(
    seed: u64,
    order: [usize; 3],
    factors: [f64; 3],
    camera: impl Fn([f64; 3]) -> [f64; 3],
) -> Verdict {
    let mut machine = Machine::drawn(seed);
    let seen = machine.calibrated(order, factors, camera);
    judged(&machine, &seen)
}

/// Holds of every kind of platform: some seeds draw each.
fn every(seen: impl Fn(u64) -> Verdict, expected: impl Fn(&Cause) -> bool) {
    for seed in 0..12 {
        let verdict = seen(seed);
        let best = verdict.causes.first();
        let is_named = best.is_some_and(|it| expected(&it.cause));
        assert!(is_named, "seed {seed}: {verdict:?}");
        assert_eq!(verdict.causes.len(), 1, "seed {seed}: {verdict:?}");
    }
}

fn about(seen: f64, expected: f64) -> bool {
    (seen / expected - 1.0).abs() < 0.02
}

#[test]
fn a_sound_platform_has_no_cause() {
    for seed in 0..20 {
        let verdict = said(seed, OWN, ONCE, as_is);
        assert_eq!(verdict.causes, [], "seed {seed}");
        for (row, gains) in verdict.gains.iter().enumerate() {
            for (column, gain) in gains.iter().enumerate() {
                let expected = f64::from(u8::from(row == column));
                assert!((gain - expected).abs() < 0.02, "{:?}", verdict.gains);
            }
        }
    }
}

#[test]
fn a_camera_that_is_mirrored_is_named_with_its_turn() {
    let mirrored_y = |[x, y, angle]: [f64; 3]| [x, -y, -angle];
    let mirrored_x = |[x, y, angle]: [f64; 3]| [-x, y, -angle];
    let turned_by = |expected: f64| {
        move |cause: &Cause| {
            let Cause::CameraFrame { mirrored, turn } = cause else {
                return false;
            };
            let off = *turn - Radians::from_degrees(expected);
            *mirrored && (off - off.whole_turns()).abs() < Radians::from_degrees(0.5)
        }
    };
    every(|seed| said(seed, OWN, ONCE, mirrored_y), turned_by(0.0));
    every(|seed| said(seed, OWN, ONCE, mirrored_x), turned_by(180.0));
}

#[test]
fn a_camera_that_is_turned_is_named_with_its_turn() {
    for degrees in [-90.0_f64, 35.0, 90.0, 180.0] {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let camera = |[x, y, angle]: [f64; 3]| [cos * x - sin * y, sin * x + cos * y, angle];
        let expected = |cause: &Cause| {
            let Cause::CameraFrame { mirrored, turn } = cause else {
                return false;
            };
            let off = *turn + Radians::from_degrees(degrees);
            !*mirrored && (off - off.whole_turns()).abs() < Radians::from_degrees(0.5)
        };
        every(|seed| said(seed, OWN, ONCE, camera), expected);
    }
}

#[test]
fn units_of_the_camera_that_are_wrong_are_named_with_their_factor() {
    for k in [0.001, 0.1, 0.5, 1.5, 2.0, 10.0, 25.4, 1000.0] {
        let camera = |[x, y, angle]: [f64; 3]| [k * x, k * y, angle];
        let is_k =
            |cause: &Cause| matches!(cause, Cause::CameraLength { factor } if about(*factor, k));
        every(|seed| said(seed, OWN, ONCE, camera), is_k);
    }
    for k in [1.0 / 3600.0, 1.0 / 60.0, 0.5, 2.0, 57.296, 60.0, 3600.0] {
        let camera = |[x, y, angle]: [f64; 3]| [x, y, k * angle];
        let is_k =
            |cause: &Cause| matches!(cause, Cause::CameraAngle { factor } if about(*factor, k));
        every(|seed| said(seed, OWN, ONCE, camera), is_k);
    }
}

#[test]
fn screws_that_were_exchanged_are_named_with_their_order() {
    for order in [[1, 0, 2], [2, 1, 0], [0, 2, 1], [1, 2, 0], [2, 0, 1]] {
        let is_it = |cause: &Cause| matches!(cause, Cause::Exchanged { order: it } if *it == order);
        every(|seed| said(seed, order, ONCE, as_is), is_it);
    }
}

#[test]
fn a_screw_with_another_scale_is_named_with_its_factor() {
    for k in [-1.0, 0.1, 0.5, 1.25, 2.0, 2.5] {
        let is_k =
            |cause: &Cause| matches!(cause, Cause::Screw { which: 1, factor } if about(*factor, k));
        every(|seed| said(seed, OWN, [1.0, k, 1.0], as_is), is_k);
        let is_k = |cause: &Cause| matches!(cause, Cause::Screws { factor } if about(*factor, k));
        every(|seed| said(seed, OWN, [k; 3], as_is), is_k);
    }
}

#[test]
fn a_screw_that_moves_nothing_is_no_screw_of_another_scale() {
    let is_it = |cause: &Cause| matches!(cause, Cause::Still { which: 2 });
    every(|seed| said(seed, OWN, [1.0, 1.0, 0.0], as_is), is_it);
}

#[test]
fn two_mistakes_at_once_are_not_taken_for_one() {
    let mirrored = |[x, y, angle]: [f64; 3]| [3.0 * x, -3.0 * y, -angle];
    for seed in 0..12 {
        let verdict = said(seed, OWN, [1.0, 2.0, 1.0], mirrored);
        assert_eq!(verdict.causes, [], "seed {seed}");
    }
}

#[test]
fn too_few_stops_say_nothing() {
    let mut machine = Machine::drawn(1);
    let (datum, sightings) = machine.calibrated(OWN, ONCE, as_is);
    let without = |screw: usize| {
        let kept = sightings
            .iter()
            .filter(|it| it.commanded[screw] == Metres::ZERO);
        kept.cloned().collect::<Vec<_>>()
    };
    let (platform, homed) = (&machine.platform, &machine.homed);
    assert_eq!(judge(platform, homed, datum, &without(0), TOLERANCE), None);
    assert_eq!(judge(platform, homed, datum, &[], TOLERANCE), None);
    let mut nan = sightings.clone();
    nan[3].seen.x = Metres(f64::NAN);
    assert_eq!(judge(platform, homed, datum, &nan, TOLERANCE), None);
}
