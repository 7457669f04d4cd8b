//! The alignment platform's whole cycle, the same on every bus.

use tests::{PoseJudge, Setup, Stand, on_every_rig};
use truestage::Failure;
use truestage::emulated::HallDrift;
use truestage::platform::Pose;
use units::{Metres, Radians};

/// Zero, as found, calibrate, as left, power cycle, zero, as left, align.
fn cycle(stand: &mut Stand) -> Result<(), Failure> {
    let store = stand.store.clone();
    let machine = &mut stand.machine;
    machine.platform()?.zero(&store)?;
    let judge = stand.simulation(|it| PoseJudge::here(it));
    let machine = &mut stand.machine;
    let found = machine.platform()?.verify(&store, false)?;
    machine.platform()?.move_to(Pose::default())?;
    machine.platform()?.calibrate(&store)?;
    let left = machine.platform()?.verify(&store, true)?;
    assert!(left.is_within_tolerance(), "{} µm", left.largest.um());
    assert!(left.largest < found.largest);
    let truly = true_errors(stand, judge)?;
    stand.power_cycle(HallDrift::default())?;
    let machine = &mut stand.machine;
    machine.platform()?.zero(&store)?;
    let after = machine.platform()?.verify(&store, true)?;
    assert!(after.is_within_tolerance(), "{} µm", after.largest.um());
    let aligned = machine.platform()?.align(Pose {
        x: Metres::from_mm(0.7),
        y: Metres::from_mm(-1.1),
        angle: Radians::from_arcsec(600.0),
    })?;
    assert!(aligned.left <= Metres::from_um(0.5));
    println!(
        "{:?}: as found {:.3} µm, as left {:.3} µm (in truth {:.3} µm), after a power cycle {:.3} µm; \
         starts within {:.3} ms",
        stand.rig(),
        found.largest.um(),
        left.largest.um(),
        truly.um(),
        after.largest.um(),
        left.skew_max_s.unwrap_or(0.0) * 1e3
    );
    Ok(())
}

/// How many more poses are judged by the truth.
const POSES: u32 = 8;

/// The largest true error of compensated moves, which must be within a micrometre.
fn true_errors(stand: &mut Stand, judge: PoseJudge) -> Result<Metres, Failure> {
    let mut worst = Metres::ZERO;
    for pose in stand.machine.platform()?.verification_poses(POSES, 77)? {
        stand.machine.platform()?.move_to(pose)?;
        worst = worst.max(stand.simulation(move |it| judge.error(it, pose)));
    }
    assert!(worst <= Metres::from_um(1.0), "in truth {} µm", worst.um());
    Ok(worst)
}

#[test]
fn the_whole_cycle_brings_the_platform_within_two_micrometres_on_every_bus() {
    on_every_rig(&shortened(Setup::uvw(1)), cycle);
}

#[test]
fn the_same_cycle_runs_with_amplifiers_on_a_serial_line_in_place_of_the_drives() {
    on_every_rig(&shortened(Setup::uvw_copley(1)), cycle);
}

/// Fewer strokes and poses than it ships with: this is about the buses.
fn shortened(setup: Setup) -> Setup {
    setup
        .machine("step_mm = 0.25", "step_mm = 0.625")
        .machine("runs = 2", "runs = 1")
        .machine("poses = 20", "poses = 5")
}
