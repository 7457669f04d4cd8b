//! What the rotary table that ships does.

use machine::records::Store;
use truestage::rotary::Way;
use truestage::{CalibrateOptions, Failure, Machine};
use units::Radians;

use super::{Cycle, changed, cycle, started};
use crate::hand::Hand;
use crate::rig::Bench;
use crate::shipped::ROTARY;

pub(super) const WHOLE: Cycle = cycle("rotary", &ROTARY, |text| text, rotary);
pub(super) const PART: Cycle = cycle("rotary", &ROTARY, few_placements, part_of_rotary);

fn few_placements(text: String) -> String {
    let changes = [
        ("placements = 4 ", "offsets = [0, 73, 162] "),
        ("optimise = ", "# "),
        ("amplification_limit = 3.0", "amplification_limit = 5.0"),
    ];
    changed(text, &changes)
}

fn hand_of(bench: &Bench) -> Hand<'static> {
    let emulated = bench.emulated.clone();
    Hand::new(move |lines| emulated.simulation_mut().turn_plate(lines))
}

fn calibrated(machine: &mut Machine, store: &Store, hand: &mut Hand<'_>) -> Result<(), Failure> {
    machine.rotary("c")?.zero()?;
    let options = CalibrateOptions::default();
    machine.rotary("c")?.calibrate(store, &options, hand)?;
    Ok(())
}

fn rotary(bench: Bench) -> Result<Bench, Failure> {
    let mut hand = hand_of(&bench);
    started(bench, |machine, store| {
        calibrated(machine, store, &mut hand)?;
        machine.rotary("c")?.verify(store, true, &mut hand)?;
        Ok(())
    })
}

fn part_of_rotary(bench: Bench) -> Result<Bench, Failure> {
    let mut hand = hand_of(&bench);
    started(bench, |machine, store| {
        calibrated(machine, store, &mut hand)?;
        machine
            .rotary("c")?
            .move_to(Radians::from_degrees(123.4), Way::Shortest)?;
        Ok(())
    })
}
