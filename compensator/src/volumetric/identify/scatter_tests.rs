use super::standard_tests::{NODES, arm, design, measure, truth, working_tool};
use super::tests::Chance;
use super::*;
use crate::volumetric::function::Shape;

/// Half a wavelength of a helium-neon laser.
const HALF_WAVELENGTH_M: f64 = 0.316_4e-6;

/// The lines of the shipped machine on a chain, what was read along them, and how it is evaluated.
fn run(chain: &str, shape: Shape, seed: u64) -> (StandardDesign, Plan, Vec<Observation>) {
    let design = design(chain, &[working_tool(), arm()], [true, false, false]);
    let mut chance = Chance(seed);
    let truth = truth(chain, &design.without_effect, shape, &mut chance);
    let observations = measure(&truth, &design, &mut chance);
    let plan = design.plan(NODES, Point::ZERO, shape);
    (design, plan, observations)
}

fn moved(observation: &mut Observation, by: f64) {
    match &mut observation.reading {
        Reading::Length { deviation, .. } => *deviation += Metres(by),
        Reading::Angle { deviation, .. } => *deviation += Radians(by),
    }
}

/// What a metre of path more or less is with these optics.
fn per_metre_of_path(optics: Optics) -> f64 {
    match optics {
        Optics::Linear => 1.0,
        Optics::Straightness(_) => 36.0,
        Optics::Angle(_) => 1.0 / 0.03,
    }
}

/// As it would scatter with uncertainties stated `factor` times as large.
fn stated(observation: &mut Observation, factor: f64) {
    match &mut observation.reading {
        Reading::Length { u, .. } => *u = *u * factor,
        Reading::Angle { u, .. } => *u = *u * factor,
    }
}

#[test]
fn sound_readings_are_refused_no_more_often_than_is_stated() {
    const TRIES: usize = 20_000;
    let mut chance = Chance(7);
    for spare in [1, 2, 3, 5, 9, 10, 30, 100] {
        let limit = scatter_limit(spare);
        let mut refused = 0;
        for _ in 0..TRIES {
            let squares: f64 = (0..spare).map(|_| chance.normal().powi(2)).sum();
            refused += usize::from((squares / spare as f64).sqrt() > limit);
        }
        // 0.7 are expected at the worst number of spare readings.
        assert!(refused <= 4, "{refused} of {TRIES} with {spare} spare");
    }
    assert_eq!(scatter_limit(300), SCATTER_RATIO_MAX);
}

#[test]
fn sound_machines_of_every_chain_and_of_noise_up_to_half_as_much_again_pass() {
    let chains = ["FXYZ", "XFYZ", "YXFZ", "FZYX", "ZFXY"];
    for (seed, chain) in (500..).zip(chains) {
        let (_, plan, mut observations) = run(chain, Shape::Spline, seed);
        for factor in [0.67, 3.0] {
            observations.iter_mut().for_each(|it| stated(it, factor));
            let found = plan.identify(&observations).unwrap();
            assert_eq!(found.scattered(&observations), None, "{chain}, {factor}");
        }
    }
}

/// On any line: positionings are checked by diagonals only.
#[test]
fn lost_half_wavelengths_and_a_reading_one_millimetre_off_are_refused() {
    let (design, plan, sound) = run("FXYZ", Shape::Spline, 11);
    for run in (0..design.lines.len()).step_by(5) {
        let own = |it: &&mut Observation| it.run == run;
        let mut jumped = sound.clone();
        let jump = 30.0 * HALF_WAVELENGTH_M * per_metre_of_path(design.lines[run].optics);
        let own_of = jumped.iter_mut().filter(own);
        own_of.skip(10).for_each(|it| moved(it, jump));
        let mut off = sound.clone();
        off.iter_mut()
            .filter(own)
            .nth(5)
            .into_iter()
            .for_each(|it| moved(it, 1e-3));
        let found = plan.identify(&jumped).unwrap();
        let jump = found.scattered(&jumped);
        assert!(jump.is_some(), "line {run}: {:?}", found.birge_ratio);
        let found = plan.identify(&off).unwrap();
        let worst = found.scattered(&off).expect("it is off");
        let named = worst.worst.first().expect("one is named");
        assert_eq!(named.run, run, "{worst:?}");
        let index = off.iter().position(|it| it.run == run).unwrap() + 5;
        assert_eq!(named.index, index, "line {run}: {worst:?}");
        assert!(
            (named.off / 1e-3 - 1.0).abs() < 0.01,
            "line {run}: {named:?}"
        );
    }
}

#[test]
fn without_spare_readings_nothing_is_judged() {
    let (_, plan, mut observations) = run("FXYZ", Shape::Spline, 3);
    let mut found = plan.identify(&observations).unwrap();
    moved(&mut observations[0], 1.0);
    found.birge_ratio = None;
    assert_eq!(found.scattered(&observations), None);
}
