//! The rotary table: calibrate → zero → compensate → verify, judged by the plant's truth.

use core::f64::consts::TAU;

use tests::{Bench, Hand};
use truestage::Failure;
use truestage::cycle::CalibrateOptions;
use units::Radians;

const AXIS: &str = "c";

fn hand(bench: &Bench) -> Hand<'static> {
    let emulated = bench.emulated.clone();
    Hand::new(move |lines| emulated.simulation_mut().turn_plate(lines))
}

/// rms, in arcsec, of true angle less target over `steps` places of a turn that begin `beside` of a
/// step from the zero, when the table is sent where its calibration says; less the mean, because
/// where the zero is no placement of a plate tells.
fn error(bench: &Bench, steps: u32, beside: f64) -> f64 {
    let compensation = bench.machine.rotary_compensation(AXIS);
    let simulation = bench.emulated.simulation();
    let truth = simulation.truth();
    let table = truth.table().expect("it is one");
    let errors: Vec<f64> = (0..steps)
        .map(|step| {
            let target = Radians(TAU * (f64::from(step) + beside) / f64::from(steps));
            let sent = compensation.map_or(target, |it| it.set_point(target).unwrap());
            (sent - table.encoder_error(sent) - target).arcsec()
        })
        .collect();
    let mean = errors.iter().sum::<f64>() / errors.len() as f64;
    (errors.iter().map(|it| (it - mean).powi(2)).sum::<f64>() / errors.len() as f64).sqrt()
}

fn calibrated(bench: &mut Bench) -> Result<truestage::cycle::rotary::RotaryCalibrated, Failure> {
    let store = bench.store.clone();
    bench.machine.start()?;
    bench.machine.zero_rotary(AXIS)?;
    let mut hand = hand(bench);
    let options = CalibrateOptions::default();
    bench.machine.calibrate_rotary(AXIS, &store, &options, &mut hand)
}

#[test]
fn one() {
    let mut bench = Bench::rotary(1, |text| text, |text| text);
    let start = bench.machine.now();
    let found = error(&bench, 360, 0.0);
    let it = calibrated(&mut bench).unwrap_or_else(|it| panic!("{it}"));
    println!(
        "found {found} at lines {} between {} scatter {} closure {} noise {:?} u {} took {:?} outliers {}",
        error(&bench, 360, 0.0),
        error(&bench, 360, 0.5),
        it.scatter.unwrap().arcsec(),
        it.closure.arcsec(),
        it.solution.reading_noise_seen.map(|it| it.arcsec()),
        it.solution.standard_uncertainty().unwrap()[0].arcsec(),
        bench.machine.now().since(start),
        it.solution.outliers.len()
    );
    let store = bench.store.clone();
    let mut hand = hand(&bench).lies_at(232.0);
    let verified = bench.machine.verify_rotary(AXIS, &store, true, &mut hand).unwrap_or_else(|it| panic!("{it}"));
    println!("{} {} noise {:?}", verified.found.largest.arcsec(), verified.left.as_ref().unwrap().largest.arcsec(), verified.noise.map(|it| it.arcsec()));
    println!("{} {}", verified.found.rms.arcsec(), verified.left.as_ref().unwrap().rms.arcsec());
}
