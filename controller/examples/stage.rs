//! A stage in a program: zeroes it, loads its calibration, moves there, and says what became of it.
//!
//! `cargo run --example stage -- machine.toml x 12.5`
#![expect(clippy::print_stdout, reason = "an example shows where the stage is")]
use machine::records::Lease;
use truestage::{Machine, config, ports};
use units::Metres;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let words: Vec<String> = std::env::args().collect();
    let [_, file, axis, target_mm] = words.as_slice() else {
        return Err("usage: stage MACHINE.toml AXIS MILLIMETRES".into());
    };
    let target = Metres::from_mm(target_mm.parse()?);
    let loaded = config::load(file.as_ref())?;
    let store = loaded.config.machine.store();
    // Nobody else drives this machine meanwhile.
    let _lease = Lease::take(&store, "move")?;
    let ports = ports::open(&loaded.config, &Default::default(), ports::Use::Motion, 1.0)?;
    let mut machine = Machine::new(&loaded, Box::new(ports));
    // Whatever fails in here, every axis is stopped and switched off before the failure comes out.
    let moved = machine.guarded(|machine| {
        machine.start()?;
        machine.linear(axis)?.zero(&store)?;
        machine.linear(axis)?.load_active(&store)?;
        let moved = machine.linear(axis)?.move_and_read(target)?;
        machine.shut_down()?;
        Ok(moved)
    })?;
    let (encoder_mm, set_point_mm) = (moved.encoder.mm(), moved.set_point.mm());
    println!("{axis}: encoder at {encoder_mm:.6} mm, was sent to {set_point_mm:.6} mm");
    println!("corrected: {:?}", moved.corrected);
    Ok(())
}
