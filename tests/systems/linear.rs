//! The linear stage's whole cycle, the same on every bus.

use std::time::Instant;

use mock_bus::plant::DriftLimits;
use tests::{Setup, Stand, on_every_rig};
use truestage::CalibrateOptions;
use truestage::Failure;
use truestage::emulated::HallDrift;
use truestage::for_tests::Verified;
use truestage::linear::VerifyOptions;
use units::{Metres, Volts};

const SEED: u64 = 1;
const DRIFT: DriftLimits = DriftLimits {
    offset: Volts(0.1),
    gain: 0.03,
    gain_per_m: 0.0,
};

fn verify(stand: &mut Stand, calibration: Option<&str>) -> Result<Verified, Failure> {
    let options = VerifyOptions {
        compensated: calibration.is_some(),
        calibration: calibration.map(str::to_owned),
        resume: None,
    };
    stand.machine.linear("x")?.verify(&stand.store, &options)
}

#[track_caller]
fn assert_within_tolerance(verified: &Verified) {
    let accuracy = verified.figures.accuracy.bidirectional;
    assert!(
        verified.is_within_tolerance() && accuracy <= Metres::from_um(2.0),
        "A = {} µm",
        accuracy.um()
    );
}

/// Zero, as found, calibrate, as left, power cycle, zero, verify.
fn cycle(stand: &mut Stand) -> Result<(), Failure> {
    let store = stand.store.clone();
    stand.machine.linear("x")?.zero(&store)?;
    let found = verify(stand, None)?;
    let largest = found.figures.largest_deviation();
    assert!(largest >= Metres::from_um(8.0), "only {} µm", largest.um());
    let options = CalibrateOptions::default();
    let calibrated = stand.machine.linear("x")?.calibrate(&store, &options)?;
    assert_within_tolerance(&verify(stand, Some(&calibrated.id))?);
    stand.power_cycle(HallDrift::random(SEED, 1, DRIFT))?;
    stand.machine.linear("x")?.zero(&store)?;
    let shift = stand.machine.linear("x")?.displacement_at_zero()?;
    assert!(shift.abs() <= Metres::from_um(0.5), "{} nm", shift.nm());
    assert_within_tolerance(&verify(stand, Some(&calibrated.id))?);
    Ok(())
}

#[test]
fn the_whole_cycle_brings_the_stage_within_two_micrometres_on_every_bus() {
    let begun = Instant::now();
    on_every_rig(&Setup::new(SEED), |stand| {
        let from = begun.elapsed();
        cycle(stand)?;
        let wall_s = (begun.elapsed() - from).as_secs_f64();
        let lived_s = stand.machine.now().seconds();
        println!(
            "{:?}: {lived_s:.1} s of the machine's life in {wall_s:.2} s",
            stand.rig()
        );
        Ok(())
    });
}
