//! The whole cycle on an emulated stage in virtual time: what a test of your own program can do on
//! any computer, with no hardware.
//!
//! `cargo run --release --example emulated`
#![expect(clippy::print_stdout, reason = "an example shows what it measured")]
use truestage::emulated::Emulated;
use truestage::linear::VerifyOptions;
use truestage::{CalibrateOptions, Machine, config};

const MACHINE: &str = include_str!("../../configs/machines/linear.toml");
const STAGE: &str = include_str!("../../configs/emulated/linear.toml");
/// The same seed is the same stage, on every computer.
const SEED: u64 = 7;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = tempfile::tempdir()?;
    let mut loaded = config::parse(MACHINE, "linear.toml")?;
    loaded.config.machine.data_dir = folder.path().to_owned();
    let store = loaded.config.machine.store();
    let emulated = Emulated::new(STAGE, SEED, &loaded.config)?;
    let mut machine = Machine::new(&loaded, Box::new(emulated.transport()));
    let verified = machine.guarded(|machine| {
        machine.start()?;
        machine.linear("x")?.zero(&store)?;
        let made = machine
            .linear("x")?
            .calibrate(&store, &CalibrateOptions::default())?;
        let as_left = VerifyOptions {
            compensated: true,
            calibration: Some(made.id),
            resume: None,
        };
        let verified = machine.linear("x")?.verify(&store, &as_left)?;
        machine.shut_down()?;
        Ok(verified)
    })?;
    let accuracy = verified.figures.accuracy.bidirectional;
    let (seen_um, limit_um) = (accuracy.um(), verified.tolerance.um());
    println!("A = {seen_um:.3} um as left, the tolerance is {limit_um:.3} um");
    println!(
        "{:.0} s passed on the emulated stage",
        machine.now().seconds()
    );
    assert!(verified.is_within_tolerance());
    Ok(())
}
