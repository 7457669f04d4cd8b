//! Drives that state no units of speed and acceleration: their first motion is slow and is measured.

use mock_bus::node::cia402_drive::Cia402DriveNode;
use tests::{Bench, Edit};
use truestage::Failure;
use units::{Metres, MetresPerSecond};

/// What counts/s and counts/s² one unit of the drive means.
#[derive(Clone, Copy)]
struct Units {
    speed: f64,
    acceleration: f64,
}

const STATED: &str = "speed_unit = \"counts_per_s\"\nacceleration_unit = \"counts_per_s2\"\n";

/// The shipped table whose drive states nothing, with `keys` in its machine file.
fn table(units: Units, keys: &str) -> Bench {
    let quirks = format!(
        "\n[nodes.device.quirks]\nspeed_unit = {:?}\nacceleration_unit = {:?}\n\n[nodes.device.rotary]\n",
        units.speed, units.acceleration
    );
    Bench::rotary(
        11,
        |text| {
            let keys = format!("position_range = \"to_last_count\"\n{keys}");
            text.edit("position_range = \"to_last_count\"", &keys)
        },
        |text| text.edit("\n[nodes.device.rotary]\n", &quirks),
    )
}

/// The zero, and how far the table truly turned, in degrees.
fn zeroed(bench: &mut Bench) -> (Result<(), Failure>, f64) {
    bench.emulated.simulation_mut().mark_travel(0);
    let ended = bench.machine.guarded(|machine| {
        machine.start()?;
        machine.rotary("c")?.zero()?;
        machine.shut_down()
    });
    let simulation = bench.emulated.simulation();
    let travel = simulation.travel(0).expect("the table turns");
    let turned = travel.since_mark.high - travel.since_mark.low;
    (ended, turned.to_degrees())
}

const COUNTS: Units = Units {
    speed: 1.0,
    acceleration: 1.0,
};

#[test]
fn a_drive_without_stated_units_is_zeroed_after_a_trial() {
    let mut bench = table(COUNTS, "");
    let (ended, _) = zeroed(&mut bench);
    ended.unwrap_or_else(|failure| panic!("{failure}"));
    let mut simulation = bench.emulated.simulation_mut();
    let drive: &mut Cia402DriveNode = simulation.node_mut("drive").expect("it has one");
    assert!(drive.homings().begun >= 2, "one was the trial");
}

#[test]
fn a_stated_unit_makes_the_trial_needless() {
    let mut bench = table(COUNTS, STATED);
    let (ended, _) = zeroed(&mut bench);
    ended.unwrap_or_else(|failure| panic!("{failure}"));
    let mut simulation = bench.emulated.simulation_mut();
    let drive: &mut Cia402DriveNode = simulation.node_mut("drive").expect("it has one");
    assert_eq!(drive.homings().begun, 1);
}

#[test]
fn another_unit_is_told_before_the_axis_is_fast() {
    let speeds = [0.1, 2.0, 6.17, 10.0, 1667.0].map(|unit| (unit, 1.0, "speed"));
    let ramps = [0.1, 0.3, 10.0].map(|unit| (1.0, unit, "acceleration"));
    for (speed, acceleration, what) in speeds.into_iter().chain(ramps) {
        let units = Units {
            speed,
            acceleration: speed * acceleration,
        };
        let mut bench = table(units, "");
        let (ended, turned) = zeroed(&mut bench);
        let text = ended.expect_err("another unit").to_string();
        let told = format!("times the {what} that was asked for");
        assert!(text.contains(&told), "{speed}, {acceleration}: {text}");
        // A hundredth of its travel, and the way in which it stops.
        assert!(turned < 2.0 * 3.6, "{speed}, {acceleration}: {turned} deg");
        println!("{speed} {acceleration}: {turned:.3} deg, {text}");
    }
}

#[test]
fn a_first_move_is_tried_as_well() {
    for (unit, agrees) in [(1.0, true), (0.1, false), (10.0, false)] {
        let quirks = format!(
            "axis = 0\nquirks = {{ speed_unit = {unit:?}, acceleration_unit = {unit:?} }}\n"
        );
        let mut bench = Bench::with(12, |text| text, |text| text.edit("axis = 0\n", &quirks));
        let before = bench.true_position();
        let ended = bench.machine.guarded(|machine| {
            machine.start()?;
            machine.enable("x")?;
            let speed = MetresPerSecond(0.05);
            machine.profile_move("x", Metres::from_mm(20.0), speed)?;
            machine.shut_down()
        });
        let moved = (bench.true_position() - before).mm();
        let ended: Result<(), String> = ended.map_err(|failure: Failure| failure.to_string());
        println!("{unit}: {moved:.3} mm, {ended:?}");
        assert_eq!(ended.is_ok(), agrees, "{unit}: {ended:?}");
        if !agrees {
            assert!(moved.abs() < 2.0 * 0.66, "{unit}: {moved} mm");
        }
    }
}
