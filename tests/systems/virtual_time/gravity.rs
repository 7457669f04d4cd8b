//! An axis that gravity pulls, by the plant's truth: no stop and no end lets the axis fall.

use core::time::Duration;

use tests::{Bench, Edit};
use truestage::Failure;
use units::{Metres, MetresPerSecond};

/// What the servo holds, and what a brake gives way by while it falls in.
const STANDS: Metres = Metres(20e-6);

/// A stage that stands upright, with a brake; `keys` say what its drive does.
fn stage(keys: &str) -> Bench {
    let keys = format!("\n[axis.x]\ngravity = true\n{keys}\n");
    let weight = "weight = { gravity_m_per_s2 = -9.81, has_brake = true, brake_engage_ms = 30, \
                  brake_release_ms = 1 }";
    Bench::with(
        7,
        |text| text.edit("\n[axis.x]\n", &keys),
        |text| {
            let text = text.edit("axis = 0\n", "axis = 0\nbrake_engage_ms = 50\n");
            text.edit(
                "[plant.stage.motion]\n",
                &format!("[plant.stage.motion]\n{weight}\n"),
            )
        },
    )
}

/// How far the axis sinks when a move to 3 mm ends by `end`.
#[track_caller]
fn check(keys: &str, end: impl FnOnce(&mut Bench)) {
    let mut bench = stage(keys);
    let moved = bench.machine.guarded(|machine| {
        machine.start()?;
        machine.enable("x")?;
        let speed = MetresPerSecond(0.01);
        Ok::<(), Failure>(machine.profile_move("x", Metres::from_mm(3.0), speed)?)
    });
    moved.unwrap_or_else(|failure| panic!("{failure}"));
    let before = bench.true_position();
    end(&mut bench);
    let later = bench.machine.now() + Duration::from_secs(2);
    // An end switches supervision off; time passes all the same.
    bench.machine.run_until(later).expect("nothing ends this");
    let sunk = before - bench.true_position();
    assert!(sunk.abs() < STANDS, "{keys}: sunk by {} um", sunk.um());
}

const STAYS: &str = "option_codes = { quick_stop = 6 }";

#[test]
fn a_quick_stop_holds_an_axis_up() {
    check(STAYS, |bench| bench.machine.make_safe());
}

#[test]
fn an_orderly_end_closes_the_brake_first() {
    for keys in [STAYS, "drive_brake = true"] {
        check(keys, |bench| {
            let ended = bench.machine.shut_down();
            ended.unwrap_or_else(|failure| panic!("{failure}"));
        });
    }
}
