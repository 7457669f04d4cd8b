//! The rotary table's whole cycle, the same on every bus.

use tests::{Emulator, Hand, Setup, Stand, on_every_rig, with_emulated_line_signal};
use truestage::CalibrateOptions;
use truestage::Failure;
use truestage::emulated::HallDrift;
use truestage::for_tests::with_line_signal;
use truestage::rotary::{SweepOptions, Way};
use units::{Approach, Radians, RadiansPerSecond};

const AXIS: &str = "c";
const SEED: u64 = 41;

fn hand_of(emulator: &Emulator) -> Hand<'_> {
    Hand::new(|lines| emulator.simulation(move |machine| machine.turn_plate(lines)))
}

/// Zero, calibrate in three placements, as found and as left in a fifth, power cycle, zero, as left
/// again, moves.
fn cycle(stand: &mut Stand) -> Result<(), Failure> {
    let Stand {
        machine,
        store,
        emulator,
    } = stand;
    let mut hand = hand_of(emulator);
    machine.rotary(AXIS)?.zero()?;
    let options = CalibrateOptions::default();
    let calibrated = machine
        .rotary(AXIS)?
        .calibrate(store, &options, &mut hand)?;
    let missing = calibrated.solution.missing.len();
    let left = machine.rotary(AXIS)?.verify(store, true, &mut hand)?;
    let figures = left.left.clone().expect("it was compensated");
    println!(
        "as found {:.3}, as left {:.3} arcsec at most; {missing} readings missing, table error {:.3}",
        left.found.largest.arcsec(),
        figures.largest.arcsec(),
        calibrated.content.largest_error().arcsec(),
    );
    assert!(left.is_within_tolerance());
    assert!(left.found.largest.arcsec() > 8.0);
    drop(hand);
    stand.power_cycle(HallDrift::default())?;
    let Stand {
        machine,
        store,
        emulator,
    } = stand;
    let mut hand = hand_of(emulator).lies_at(200.5);
    machine.rotary(AXIS)?.load_active(store)?;
    machine.rotary(AXIS)?.zero()?;
    let after = machine.rotary(AXIS)?.verify(store, true, &mut hand)?;
    assert!(after.is_within_tolerance());
    for (degrees, way) in [(123.4, Way::Shortest), (-400.0, Way::Turns)] {
        let moved = machine
            .rotary(AXIS)?
            .move_to(Radians::from_degrees(degrees), way)?;
        assert!((moved.expected - moved.target).abs().arcsec() < 0.3);
    }
    Ok(())
}

#[test]
fn the_whole_cycle_brings_the_table_within_three_tenths_of_an_arcsecond_on_every_bus() {
    on_every_rig(&slow(Setup::rotary(SEED)), cycle);
}

/// Voltage and angle of one SYNC go together whatever carries them.
fn sweep_by_photodiode(stand: &mut Stand) -> Result<(), Failure> {
    let mut table = stand.machine.rotary(AXIS)?;
    table.zero()?;
    for approach in [Approach::Forward, Approach::Reverse] {
        let options = SweepOptions {
            lines: 72,
            approach,
            speed: Some(RadiansPerSecond(10_f64.to_radians())),
            phase: None,
        };
        let seen = table.sweep(&options)?;
        assert_eq!(seen.read(), 72, "{approach:?}: {:?}", seen.missing);
    }
    Ok(())
}

#[test]
fn a_plate_that_passes_a_photodiode_is_read_alike_on_every_bus() {
    let setup =
        Setup::rotary(SEED).shaped(|text| with_line_signal(&text), with_emulated_line_signal);
    on_every_rig(&setup, sweep_by_photodiode);
}

/// As slow as a host needs that runs it much faster than real time, and has other things to do; and
/// one placement less.
fn slow(setup: Setup) -> Setup {
    setup
        .machine(
            "speed_deg_per_s = 60.0\nreading",
            "speed_deg_per_s = 30.0\nreading",
        )
        .machine("placements = 4 ", "offsets = [0, 73, 162] ")
        .machine("optimise = ", "# ")
        .machine("amplification_limit = 3.0", "amplification_limit = 5.0")
}
