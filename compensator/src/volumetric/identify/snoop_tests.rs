use super::design::Design;
use super::rig::{Measured, Rig};
use super::snoop::snoop;
use super::*;
use crate::noise::Noise;

/// Half a wavelength of a helium-neon laser.
const HALF_WAVELENGTH_M: f64 = 0.316_4e-6;
/// Of the shipped machine, nothing but an error function that is on no other lever tells the tilt of
/// z about x: with these tools it moves what the straightness of z along y moves.
const UNSEEN: usize = 14;

/// What a metre of path more or less is with these optics.
fn per_metre_of_path(optics: Optics) -> f64 {
    match optics {
        Optics::Linear => 1.0,
        Optics::Straightness(_) => 36.0,
        Optics::Angle(_) => 1.0 / 0.03,
    }
}

fn moved(observation: &mut Observation, by: f64) {
    match &mut observation.reading {
        Reading::Length { deviation, .. } => *deviation += Metres(by),
        Reading::Angle { deviation, .. } => *deviation += Radians(by),
    }
}

/// The same readings as noise alone, `factor` times what is stated: each its own, and what they have in common.
fn noise_alone(observations: &mut [Observation], factor: f64, noise: &mut Noise) {
    let is_shared = observations.iter().any(|it| it.common != 0.0);
    let shared = if is_shared { noise.normal() } else { 0.0 };
    for it in observations {
        let error = factor * (it.u_by_itself() * noise.normal() + it.common * shared);
        match &mut it.reading {
            Reading::Length { deviation, .. } => *deviation = Metres(error),
            Reading::Angle { deviation, .. } => *deviation = Radians(error),
        }
    }
}

/// How often something is found in `tries` sound calibrations.
fn alarms(rig: &Rig, (tries, seed): (u64, u64), factor: f64, false_alarms: f64) -> usize {
    let mut measured = rig.measured(seed);
    let mut noise = Noise(seed);
    let is_alarm = |_: &u64| {
        noise_alone(&mut measured.observations, factor, &mut noise);
        let design = Design::new(&measured.plan, &measured.observations).unwrap();
        let snooped = snoop(&design, &measured.observations, false_alarms);
        !snooped.found.is_empty()
    };
    (0..tries).filter(is_alarm).count()
}

/// A laser of which 1 ppm is not known: five times what one reading is uncertain by at the end of a line.
fn with_one_laser() -> Rig {
    Rig {
        in_common: 1e-6,
        ..Rig::default()
    }
}

/// Bonferroni's bound holds from above: of 60, at most 12 are expected at 0.2, and 25 are exceeded
/// once in 30 000 times. With noise larger than stated it is alike, as far as
/// the limit of the ratio lets it pass.
#[test]
fn sound_readings_alarm_no_more_often_than_is_stated() {
    let (alone, shared) = (Rig::default(), with_one_laser());
    for (rig, seed, factor) in [
        (&alone, 1, 1.0),
        (&alone, 2, 0.5),
        (&alone, 3, 1.3),
        (&shared, 5, 1.0),
    ] {
        let seen = alarms(rig, (60, seed), factor, 0.2);
        assert!(seen <= 25, "{seen} at {factor}");
    }
    assert!(alarms(&alone, (60, 4), 1.0, GROSS_FALSE_ALARMS) <= 1);
}

/// 2 are expected of 20 000; more than 8 once in 4000 times.
#[test]
#[ignore = "a count of minutes"]
fn the_rate_of_false_alarms_over_many_calibrations() {
    let (alone, shared) = (Rig::default(), with_one_laser());
    for (rig, seed, factor) in [(&alone, 101, 1.0), (&alone, 102, 1.3), (&shared, 103, 1.0)] {
        let seen = alarms(rig, (20_000, seed), factor, GROSS_FALSE_ALARMS);
        let common = rig.in_common;
        println!(
            "{seen} of 20000 at {GROSS_FALSE_ALARMS}, noise {factor} times as stated, {common} in common"
        );
        assert!(seen <= 8, "{seen}");
    }
}

/// What was found first of readings of which those from `from` on, in `run`, are `by` off.
fn first_found(
    sound: &Measured,
    run: usize,
    own: core::ops::Range<usize>,
    by: f64,
) -> Option<Gross> {
    let mut observations = sound.observations.clone();
    let of_run = observations
        .iter_mut()
        .filter(|it| it.run == run)
        .enumerate();
    of_run
        .filter(|(at, _)| own.contains(at))
        .for_each(|(_, it)| moved(it, by));
    sound
        .plan
        .snoop(&observations)
        .unwrap()
        .found
        .first()
        .cloned()
}

/// On every line of a machine drawn by chance: named by line and reading, with its size.
#[test]
fn a_reading_that_is_off_is_named_with_its_size() {
    let sound = Rig::default().measured(21);
    for (run, line) in sound.design.lines.iter().enumerate() {
        let own = sound
            .observations
            .iter()
            .position(|it| it.run == run)
            .unwrap();
        let at = 3;
        let by = 20.0 * HALF_WAVELENGTH_M * per_metre_of_path(line.optics);
        let found = first_found(&sound, run, at..at + 1, by);
        if run == UNSEEN {
            assert_eq!(found, None, "nothing else tells it");
            continue;
        }
        let found = found.unwrap_or_else(|| panic!("line {run}"));
        assert_eq!((found.run, found.index), (run, own + at), "{found:?}");
        assert_eq!(found.kind, GrossKind::Reading, "{found:?}");
        assert!((found.off / by - 1.0).abs() < 0.3, "{by}: {found:?}");
    }
}

/// 30 half wavelengths lost within a line made every Birge ratio 30, and a tool 5 to 8 µm off.
#[test]
fn a_slip_within_a_line_is_named_as_one_with_its_first_reading() {
    let sound = Rig::default().measured(22);
    for (run, line) in sound.design.lines.iter().enumerate() {
        let all: Vec<usize> = (0..sound.observations.len())
            .filter(|at| sound.observations[*at].run == run)
            .collect();
        let by = -30.0 * HALF_WAVELENGTH_M * per_metre_of_path(line.optics);
        for from in [2, all.len() / 2, all.len() - 2] {
            let found = first_found(&sound, run, from..all.len(), by);
            if run == UNSEEN {
                assert_eq!(found, None, "nothing else tells it");
                continue;
            }
            let found = found.unwrap_or_else(|| panic!("line {run}"));
            let seen = (found.kind, found.run, found.index);
            assert_eq!(seen, (GrossKind::Slip, run, all[from]), "{found:?}");
        }
    }
}

/// Three of them, in lines of three kinds: all are found, and what is left is as stated.
#[test]
fn one_error_does_not_hide_another() {
    let mut sound = Rig::default().measured(23);
    let runs = [1, 9, 17];
    for (n, run) in runs.into_iter().enumerate() {
        let by = 40.0 * HALF_WAVELENGTH_M * per_metre_of_path(sound.design.lines[run].optics);
        let own = sound.observations.iter_mut().filter(|it| it.run == run);
        own.skip(3)
            .take(if n == 1 { 1 } else { 99 })
            .for_each(|it| moved(it, by));
    }
    let snooped = sound.plan.snoop(&sound.observations).unwrap();
    let mut seen: Vec<usize> = snooped.found.iter().map(|it| it.run).collect();
    seen.sort_unstable();
    assert_eq!(seen, runs, "{snooped:?}");
    assert!(snooped.ratio_left.unwrap() < 1.5, "{snooped:?}");
}

/// As many unknowns as readings: nothing contradicts anything.
#[test]
fn without_spare_readings_nothing_is_named() {
    let mut sound = Rig::default().measured(24);
    sound.observations.retain(|it| it.run < 4);
    moved(&mut sound.observations[3], 1e-3);
    let snooped = sound.plan.snoop(&sound.observations).unwrap();
    assert_eq!(snooped, Snooped::default());
}
