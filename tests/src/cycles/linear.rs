//! What the linear machine that ships does.

use truestage::linear::VerifyOptions;
use truestage::{CalibrateOptions, Failure};
use units::Metres;

use super::{Cycle, changed, cycle, started};
use crate::rig::Bench;
use crate::shipped::LINEAR;

pub(super) const WHOLE: Cycle = cycle("linear", &LINEAR, |text| text, linear);
pub(super) const PART: Cycle = cycle("linear", &LINEAR, fewer_runs, part_of_linear);

fn fewer_runs(text: String) -> String {
    changed(text, &[("runs = 3", "runs = 2")])
}

fn linear(bench: Bench) -> Result<Bench, Failure> {
    let verify = |calibration: Option<String>| VerifyOptions {
        compensated: calibration.is_some(),
        calibration,
        resume: None,
    };
    started(bench, |machine, store| {
        machine.linear("x")?.zero(store)?;
        machine.linear("x")?.verify(store, &verify(None))?;
        let calibrated = machine
            .linear("x")?
            .calibrate(store, &CalibrateOptions::default())?;
        machine
            .linear("x")?
            .verify(store, &verify(Some(calibrated.id)))?;
        Ok(())
    })
}

fn part_of_linear(bench: Bench) -> Result<Bench, Failure> {
    started(bench, |machine, store| {
        machine.linear("x")?.zero(store)?;
        machine
            .linear("x")?
            .calibrate(store, &CalibrateOptions::default())?;
        for mm in [12.5, 44.4, 31.0] {
            machine.linear("x")?.move_to(Metres::from_mm(mm))?;
        }
        Ok(())
    })
}
