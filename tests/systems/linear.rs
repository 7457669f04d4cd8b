//! The linear stage: calibrate → zero → compensate → verify.

use tests::Bench;
use truestage::cycle::{CalibrateOptions, VerifyOptions};
use units::Metres;

fn as_found() -> VerifyOptions {
    VerifyOptions { compensated: false, calibration: None, resume: None }
}

#[test]
fn the_whole_cycle_brings_the_stage_within_two_micrometres() {
    let mut bench = Bench::new(1);
    let store = bench.store.clone();
    let (found, left) = bench
        .machine
        .guarded(|machine| {
            machine.start()?;
            machine.zero("x", &store)?;
            let found = machine.verify("x", &store, &as_found())?;
            let calibrated = machine.calibrate("x", &store, &CalibrateOptions::default())?;
            let calibration = Some(calibrated.id);
            let options = VerifyOptions { compensated: true, calibration, resume: None };
            let left = machine.verify("x", &store, &options)?;
            machine.shut_down()?;
            Ok((found, left))
        })
        .unwrap_or_else(|failure| panic!("{failure}"));
    let largest = truestage::text::largest_deviation(&found.figures);
    assert!(largest >= Metres::from_um(8.0), "as found only {} µm", largest.um());
    let accuracy = left.figures.accuracy.bidirectional;
    assert!(accuracy <= Metres::from_um(2.0), "as left {} µm", accuracy.um());
}
