//! The zero of a gantry: how far its stage is turned, and where it stands afterwards, judged by the plant's truth.
//!
//! `SEEDS=1..200 cargo test -p tests --test systems coverage_of_gantries -- --ignored --nocapture` counts over a range
//! and prints it; `TELL=1` before it prints each stage.

use std::cell::Cell;
use std::rc::Rc;

use machine::records::read_journal;
use mock_bus::fault::{Fault, FaultConfig};
use tests::{Bench, Coverage, Edit, GANTRY, judged_of_each, normal, seeds};
use truestage::Failure;
use truestage::emulated::Emulated;
use truestage::linear::LinearLog;
use units::Metres;
use wire::cia402::PowerState;

use super::zero_uncertainty::{Drawn, patient};

/// The distance as it is configured, and how well that is known.
const DISTANCE_MM: f64 = 400.0;
const DISTANCE_U_MM: f64 = 0.1;

/// A gantry with sides of all sorts, whose distance is what is stated of it.
fn bench(seed: u64, drawn: &Drawn, machine: impl Fn(String) -> String) -> Bench {
    let mut state = seed ^ 0x6A17_0000;
    let distance_mm = DISTANCE_MM + DISTANCE_U_MM * normal(&mut state);
    let emulated = |text: String| {
        let distance = format!("distance_mm = {distance_mm}");
        drawn
            .emulated(&text)
            .edit_first("distance_mm = 400.0", &distance)
    };
    Bench::shaped(&GANTRY, seed, |text| machine(patient(text)), emulated)
}

/// What a zero says, and what is true.
#[derive(Debug)]
struct Judged {
    /// The angle told less that at which the stage truly stood where both drives showed the same, in units of the
    /// standard uncertainty stated.
    angle: f64,
    /// The angle at which it stands where both show the same now, in units of what is stated of that.
    straight: f64,
    /// The angle that was told, microradians.
    told_urad: f64,
}

fn judged(bench: &mut Bench) -> Result<Judged, Failure> {
    let store = bench.store.clone();
    let zeroed = bench.machine.guarded(|machine| {
        machine.start()?;
        machine.linear("x1")?.zero_gantry(&store)
    })?;
    let it = zeroed.entry;
    let simulation = bench.emulated.simulation();
    let truth = simulation.truth().gantry().expect("it is one");
    let scales = truth.scale_positions();
    let mut now = [Metres::ZERO; 2];
    let mut before = [Metres::ZERO; 2];
    for side in [0, 1] {
        let axis = &it.axes[side];
        let count = bench.machine.config().axis[axis].motion.resolution_nm * 1e-9;
        let shown = bench.machine.reading(axis)?.expect("it was read").position;
        // Where on its scale the drive's zero lies: a whole count, as all that an encoder shows.
        let zero = Metres((scales[side].value() / count).round() * count) - shown;
        now[side] = zero;
        // And where it lay before: the drive's zero was moved by whole counts.
        before[side] = zero - Metres((it.origins_m[side] / count).round() * count);
    }
    let angle_at = |zeros: [Metres; 2]| truth.angle_at(zeros).value();
    Ok(Judged {
        angle: (it.angle_rad - angle_at(before)) / it.standard_uncertainty_rad,
        straight: angle_at(now) / it.zero_u_rad,
        told_urad: it.angle_rad * 1e6,
    })
}

/// What is stated of the angle told, and of where it stands now.
fn count(seeds: impl Iterator<Item = u64> + Send) -> [Coverage; 2] {
    let all = judged_of_each(seeds, &|seed| {
        let drawn = Drawn::new(seed);
        let it = judged(&mut bench(seed, &drawn, |text| text))?;
        if std::env::var("TELL").is_ok() {
            println!("{seed}: {drawn:?}: {it:.2?}");
        }
        Ok::<_, Failure>([it.angle, it.straight])
    });
    [0, 1].map(|which| {
        let count: Coverage = all.iter().map(|it| it[which]).collect();
        let name = ["the angle told", "where it stands now"][which];
        println!("{name}, gantries {count}");
        count
    })
}

/// Of 12 right ones more than three lie beyond 2u once in 500 times (binomial, 0.05 each).
#[test]
fn the_angle_of_a_gantry_lies_within_what_it_states_and_so_does_the_stage_afterwards() {
    for count in count(7_001..=7_012) {
        assert_eq!(count.count(), 12);
        assert!(count.within() >= 9, "{count}");
    }
}

#[test]
#[ignore = "many gantries: for whoever wants the rates, over SEEDS=FIRST..LAST"]
fn coverage_of_gantries() {
    for count in count(seeds("1..200")) {
        count.judge_share(count.count() as f64);
    }
}

const SHIPPED: Drawn = Drawn {
    repeatability_nm: 25.0,
    bandwidth_hz: 60.0,
    lost_motion_um: 1.0,
    noise_mv: 0.2,
};

#[test]
fn the_sign_is_that_of_the_side_that_is_named() {
    let told = |machine: fn(String) -> String| judged(&mut bench(3, &SHIPPED, machine)).unwrap();
    let second = told(|text| text);
    let first = told(|text| text.edit("positive = \"x2\"", "positive = \"x1\""));
    assert!(second.told_urad.abs() > 5.0, "{second:?}");
    assert!(
        (second.told_urad + first.told_urad).abs() < 1e-9,
        "{first:?}"
    );
}

/// The limit switches repeat to 20 µm either way: the angle is found again to some 60 µrad, not better.
#[test]
fn a_zero_is_compared_with_the_angle_at_acceptance_and_with_the_zero_before() {
    let accepted = |text: String| {
        let keys =
            "turn_limit_mrad = 10.0\nangle_at_acceptance_urad = 5000.0\nangle_limit_urad = 200.0";
        text.edit("turn_limit_mrad = 10.0", keys)
    };
    let mut bench = bench(5, &SHIPPED, accepted);
    let store = bench.store.clone();
    let mut zero = || {
        bench.machine.guarded(|machine| {
            machine.start()?;
            let zeroed = machine.linear("x2")?.zero_gantry(&store)?;
            machine.shut_down()?;
            Ok::<_, Failure>(zeroed)
        })
    };
    let first = zero().unwrap_or_else(|failure| panic!("{failure}"));
    assert!(first.previous.is_none());
    assert!(
        !first.entry.is_within_limit(),
        "it is some 5 mrad off: {:?}",
        first.entry
    );
    let second = zero().unwrap_or_else(|failure| panic!("{failure}"));
    let before = second.previous.expect("it was zeroed before");
    assert_eq!(before, first.entry);
    let change = second.entry.angle_rad - before.angle_rad;
    assert!(change.abs() < 4.0 * 60e-6, "{change}");
    let read = read_journal::<LinearLog>(&second.journal).unwrap();
    assert!(read.complete);
    assert_eq!(read.log.rotations, std::slice::from_ref(&second.entry));
    assert_eq!(read.header.axis, "beam");
    for (axis, side) in second.entry.axes.iter().zip(&second.sides) {
        let read = read_journal::<LinearLog>(&side.journal).unwrap();
        assert_eq!((&read.header.axis, read.log.zeros.len()), (axis, 1));
    }
}

#[test]
fn one_side_alone_is_refused_before_anything_moves() {
    let mut bench = bench(6, &SHIPPED, |text| text);
    let store = bench.store.clone();
    let places = |bench: &Bench| {
        let simulation = bench.emulated.simulation();
        simulation
            .truth()
            .gantry()
            .expect("it is one")
            .scale_positions()
    };
    let before = places(&bench);
    let refused = bench.machine.guarded(|machine| {
        machine.start()?;
        machine.linear("x1")?.zero(&store)
    });
    let failure = refused.unwrap_err();
    assert_eq!(failure.exit_code(), 2);
    assert!(failure.to_string().contains("--axis beam"), "{failure}");
    let after = places(&bench);
    for (a, b) in before.iter().zip(after) {
        assert!((*a - b).abs() < Metres::from_um(1.0));
    }
}

/// Both sides go to their limit switches together: what the stage is turned by on the way is what it was turned by
/// before, and what the switches differ by; and no more than the search's limit afterwards.
#[test]
fn the_stage_is_never_turned_further_than_is_stated() {
    let mut bench = bench(8, &SHIPPED, |text| text);
    let store = bench.store.clone();
    let emulated = bench.emulated.clone();
    let largest = Rc::new(Cell::new(0.0_f64));
    let seen = largest.clone();
    machine::attend(&mut bench.machine, Box::new(Watching { emulated, seen }));
    let zeroed = bench.machine.guarded(|machine| {
        machine.start()?;
        machine.linear("x1")?.zero_gantry(&store)
    });
    zeroed.unwrap_or_else(|failure| panic!("{failure}"));
    let largest = largest.get();
    assert!((1e-3..5e-3).contains(&largest), "{largest} rad");
}

/// Sees how far the stage is turned, all the time.
struct Watching {
    emulated: Emulated,
    seen: Rc<Cell<f64>>,
}

impl machine::Attendant for Watching {
    fn attend(&mut self, _: &mut machine::Machine) -> Result<(), machine::Failure> {
        let simulation = self.emulated.simulation();
        let truth = simulation.truth().gantry().expect("it is one");
        self.seen
            .set(self.seen.get().max(truth.angle().value().abs()));
        Ok(())
    }
}

/// The second side is held fast while both go to their limit switches.
#[test]
fn a_side_that_is_held_fast_stops_both_and_neither_counts_as_zeroed() {
    let mut bench = bench(9, &SHIPPED, |text| text);
    let store = bench.store.clone();
    let held = FaultConfig {
        from_s: 2.0,
        ..FaultConfig::permanent(Fault::BlockedAxis { axis: 1 })
    };
    let injected = bench.emulated.simulation_mut().inject(held);
    injected.expect("it has such an axis");
    let failed = bench.machine.guarded(|machine| {
        machine.start()?;
        machine.linear("x1")?.zero_gantry(&store)
    });
    let failure = failed.unwrap_err();
    assert_eq!(failure.exit_code(), 4, "{failure}");
    assert!(failure.to_string().contains("x2"), "{failure}");
    for axis in ["x1", "x2"] {
        assert!(!bench.machine.is_zeroed(axis), "{axis}");
        let power = bench.machine.power_state(axis).unwrap();
        assert!(
            power != Some(PowerState::OperationEnabled),
            "{axis}: {power:?}"
        );
    }
    let journal = store
        .newest_run("zero", "beam")
        .unwrap()
        .expect("it was begun");
    let read = read_journal::<LinearLog>(&journal).unwrap();
    assert!(!read.complete && read.failure.is_some() && read.log.rotations.is_empty());
}
