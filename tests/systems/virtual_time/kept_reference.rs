//! A program that is started again finds which axes still have their zero: those whose drives prove that they kept their
//! reference, and no other. What the emulated stage truly is at tells whether that was right.

use core::time::Duration;
use std::cell::RefCell;
use std::rc::Rc;

use drivers::device::DriveCommand;
use machine::{Observer, Stage};
use mock_bus::fault::{Fault, FaultConfig};
use tests::{Bench, Edit, Shipped, VOLUMETRIC};
use truestage::Machine;
use truestage::emulated::HallDrift;
use units::{Metres, Radians};

const MARK: &str = "{ by = \"mark\", object = \"0x2F00:02\" }";
const BIT: &str = "{ by = \"homed_bit\", object = \"0x6041:00\", bit = 15 }";
const ABSOLUTE: &str = "{ by = \"absolute_encoder\", object = \"0x6063:00\" }";
/// Each count of the stage, and what its servo holds.
const STANDS: Metres = Metres(50e-9);

/// Keeps what it is warned of.
struct Warned(Rc<RefCell<Vec<String>>>);

impl Observer for Warned {
    fn progress(&mut self, _stage: Stage, _axis: &str, _done: u64, _total: u64) {}

    fn warning(&mut self, text: &str) {
        self.0.borrow_mut().push(text.to_owned());
    }
}

fn proving(text: String, proof: &str) -> String {
    text.edit(
        "\n[axis.x]\n",
        &format!("\n[axis.x]\nkept_zero = {proof}\n"),
    )
}

/// A drive with a bit of its own for it, and what else is said of it.
fn drive(text: String, more: &str) -> String {
    let first = "axis = 0\n";
    text.edit(first, &format!("{first}homed_bit = 15\n{more}\n"))
}

/// A stage whose drive proves its reference so.
fn stage(proof: &str, more: &str) -> Bench {
    Bench::with(61, |text| proving(text, proof), |text| drive(text, more))
}

fn zeroed(bench: &mut Bench) {
    let store = bench.store.clone();
    let zeroed = bench.machine.guarded(|machine| {
        machine.start()?;
        machine.linear("x")?.zero(&store)
    });
    zeroed.unwrap_or_else(|failure| panic!("{failure}"));
}

/// The stage goes to a place, and where on its scale it truly is then.
fn taken_to(bench: &mut Bench, mm: f64) -> Metres {
    let moved = bench.machine.guarded(|machine| {
        machine.command("x", DriveCommand::Enable, "enable", Duration::from_secs(5))?;
        machine.linear("x")?.move_to(Metres::from_mm(mm))
    });
    moved.unwrap_or_else(|failure| panic!("{failure}"));
    bench.emulated.simulation().truth().scale_position()
}

/// The program was killed and comes again; what it is told then.
fn again(bench: &mut Bench) -> Vec<String> {
    let loaded = bench.loaded.clone();
    again_as(bench, &loaded)
}

fn again_as(bench: &mut Bench, loaded: &truestage::config::Loaded) -> Vec<String> {
    let warned = Rc::new(RefCell::new(Vec::new()));
    bench.machine = Machine::new(loaded, Box::new(bench.emulated.transport()));
    bench.machine.observe(Box::new(Warned(Rc::clone(&warned))));
    let started = bench.machine.start();
    started.unwrap_or_else(|failure| panic!("{failure}"));
    warned.take()
}

fn has_its_zero(bench: &Bench) -> bool {
    bench.machine.is_zeroed("x")
}

/// It has no zero, and the warning says why.
fn has_lost_it(bench: &mut Bench, why: &str) {
    let told = again(bench);
    assert!(!has_its_zero(bench));
    assert_eq!(told.len(), 1, "{told:?}");
    assert!(told[0].contains(why), "{told:?}");
    // What was not believed once is not asked again as long as nobody has zeroed.
    assert!(!has_its_zero(bench));
}

fn powered_off_and_on(bench: &mut Bench) {
    bench.power_cycle(HallDrift::default());
    let back = bench.machine.now() + Duration::from_secs(2);
    // Its drive has boot up: the machine of before says so.
    let _ = bench.machine.run_until(back);
}

#[test]
fn each_proof_gives_a_program_that_comes_again_its_zero() {
    for proof in [MARK, BIT, ABSOLUTE] {
        let mut bench = stage(proof, "");
        assert!(again(&mut bench).is_empty(), "{proof}: nothing was noted");
        assert!(!has_its_zero(&bench), "{proof}");
        zeroed(&mut bench);
        let before = taken_to(&mut bench, 12.0);
        let stated = bench.machine.linear("x").unwrap().course();
        for time in 0..3 {
            assert!(again(&mut bench).is_empty(), "{proof}, start {time}");
            assert!(has_its_zero(&bench), "{proof}, start {time}");
            taken_to(&mut bench, 20.0 + f64::from(time));
            let after = taken_to(&mut bench, 12.0);
            let off = (after - before).abs();
            assert!(off < STANDS, "{proof}: {off:?} off");
        }
        let course = bench.machine.linear("x").unwrap().course();
        assert_eq!(
            course.zero_uncertainty(),
            stated.zero_uncertainty(),
            "{proof}: as uncertain as it was found"
        );
        assert!(course.zero_uncertainty().is_some());
    }
}

#[test]
fn without_a_proof_a_zero_does_not_outlast_the_program() {
    let mut bench = Bench::with(61, |text| text, |text| drive(text, ""));
    zeroed(&mut bench);
    assert!(again(&mut bench).is_empty());
    assert!(!has_its_zero(&bench));
    assert!(!bench.store.root().join("zeros").exists());
}

#[test]
fn a_drive_that_was_without_power_has_no_zero() {
    for (proof, why) in [
        (MARK, "the mark"),
        (BIT, "not homed"),
        (ABSOLUTE, "counts farther apart"),
    ] {
        let mut bench = stage(proof, "");
        zeroed(&mut bench);
        // Where it stands when its counter begins anew.
        taken_to(&mut bench, 7.0);
        // The program is not there to see it.
        bench.machine = Machine::new(&bench.loaded, Box::new(bench.emulated.transport()));
        powered_off_and_on(&mut bench);
        has_lost_it(&mut bench, why);
        zeroed(&mut bench);
        assert!(
            again(&mut bench).is_empty() && has_its_zero(&bench),
            "{proof}: zeroed anew"
        );
    }
}

#[test]
fn an_absolute_encoder_keeps_it_without_power() {
    let mut bench = stage(ABSOLUTE, "absolute_encoder = true");
    zeroed(&mut bench);
    let before = taken_to(&mut bench, 12.0);
    taken_to(&mut bench, 30.0);
    bench.machine = Machine::new(&bench.loaded, Box::new(bench.emulated.transport()));
    powered_off_and_on(&mut bench);
    assert!(again(&mut bench).is_empty() && has_its_zero(&bench));
    let off = (taken_to(&mut bench, 12.0) - before).abs();
    assert!(off < STANDS, "{off:?}");
}

#[test]
fn a_zero_that_was_broken_off_leaves_none() {
    for proof in [MARK, BIT, ABSOLUTE] {
        let mut bench = stage(proof, "");
        zeroed(&mut bench);
        // The next one homes the drive on its limit switch, and does not find what it looks for then.
        let store = bench.store.clone();
        let stuck = Fault::InputInverted { channel: 0 };
        let fault = FaultConfig::permanent(stuck);
        let stuck = bench.emulated.simulation_mut().inject(fault);
        let stuck = stuck.unwrap_or_else(|error| panic!("{error}"));
        let refused = bench
            .machine
            .guarded(|machine| machine.linear("x")?.zero(&store));
        assert!(refused.is_err(), "{proof}");
        bench.emulated.simulation_mut().end_fault(stuck);
        assert!(again(&mut bench).is_empty(), "{proof}: nothing is noted");
        assert!(!has_its_zero(&bench), "{proof}");
    }
}

#[test]
fn who_homes_the_drive_behind_our_back_takes_its_zero() {
    for (proof, why) in [
        (MARK, "the mark"),
        (BIT, "another program"),
        (ABSOLUTE, "farther apart"),
    ] {
        let mut bench = stage(proof, "");
        zeroed(&mut bench);
        let notes = bench.store.root().join("zeros");
        let kept = std::fs::read(notes.join("x.json")).expect("it was noted");
        // Another program, with records elsewhere, homes on the limit switch.
        let elsewhere = tempfile::tempdir().expect("a temporary folder can be made");
        let loaded = tests::shipped_config(&tests::LINEAR, elsewhere.path(), |text| {
            proving(text, proof)
        });
        again_as(&mut bench, &loaded);
        let zero = loaded.config.axis["x"].zero.as_ref().expect("it has one");
        let home = drivers::device::AxisCommand::HomeNegativeLimit {
            position: Metres::from_mm(zero.negative_limit_mm + 0.5),
            speed: units::MetresPerSecond(0.01),
        };
        let homed = bench.machine.guarded(|machine| {
            machine.command("x", DriveCommand::Enable, "enable", Duration::from_secs(5))?;
            Ok(machine.command("x", home, "home", Duration::from_secs(60))?)
        });
        homed.unwrap_or_else(|failure| panic!("{failure}"));
        bench.machine.make_safe();
        assert_eq!(
            std::fs::read(notes.join("x.json")).ok(),
            Some(kept),
            "nobody has touched it"
        );
        has_lost_it(&mut bench, why);
    }
}

#[test]
fn what_is_no_encoder_of_its_own_proves_nothing() {
    let mut bench = stage(ABSOLUTE, "increments_are_homed = true");
    again(&mut bench);
    let warned = Rc::new(RefCell::new(Vec::new()));
    bench.machine.observe(Box::new(Warned(Rc::clone(&warned))));
    zeroed(&mut bench);
    let told = warned.take();
    assert!(
        told[0].contains("changed with the position when the drive was homed"),
        "{told:?}"
    );
    assert!(has_its_zero(&bench), "as long as the program lives");
    assert!(again(&mut bench).is_empty() && !has_its_zero(&bench));
}

#[test]
fn a_fault_that_is_reset_gives_no_zero_back() {
    for proof in [MARK, BIT, ABSOLUTE] {
        let mut bench = stage(proof, "");
        zeroed(&mut bench);
        // It moves, the program dies, and something is in the way.
        let target = Metres::from_mm(50.0);
        let (speed, acceleration) = (
            units::MetresPerSecond(0.1),
            units::MetresPerSecondSquared(1.0),
        );
        let moving = drivers::device::AxisCommand::MoveTo {
            target,
            speed,
            acceleration,
        };
        bench
            .machine
            .begin("x", moving)
            .unwrap_or_else(|failure| panic!("{failure}"));
        let until = bench.machine.now() + Duration::from_millis(100);
        bench
            .machine
            .run_until(until)
            .unwrap_or_else(|failure| panic!("{failure}"));
        let blocked = FaultConfig::permanent(Fault::BlockedAxis { axis: 0 });
        let blocked = bench.emulated.simulation_mut().inject(blocked);
        let blocked = blocked.unwrap_or_else(|error| panic!("{error}"));
        bench.machine = Machine::new(&bench.loaded, Box::new(bench.emulated.transport()));
        let until = bench.machine.now() + Duration::from_millis(300);
        bench
            .machine
            .run_until(until)
            .unwrap_or_else(|failure| panic!("{failure}"));
        bench.emulated.simulation_mut().end_fault(blocked);
        has_lost_it(&mut bench, "the drive reports error 0x8611");
        let reset = bench.machine.reset_fault("x");
        reset.unwrap_or_else(|failure| panic!("{failure}"));
        for _ in 0..2 {
            assert!(again(&mut bench).is_empty(), "{proof}: nothing is noted");
            assert!(
                !has_its_zero(&bench),
                "{proof}: what was found wrong is believed"
            );
        }
    }
}

#[test]
fn a_proof_that_proves_nothing_is_refused() {
    let refused = |shipped: Shipped, head: &str, proof: &str, says: &str| {
        let text = shipped
            .machine
            .edit(head, &format!("{head}kept_zero = {proof}\n"));
        let refused = truestage::config::parse(&text, "machine.toml");
        let told = refused.expect_err("it is refused").to_string();
        assert!(told.contains(says), "{told}");
    };
    let position = "{ by = \"absolute_encoder\", object = \"0x6064:00\" }";
    let x = "\n[axis.x]\n";
    refused(
        tests::LINEAR,
        x,
        position,
        "is not an encoder's own position",
    );
    refused(VOLUMETRIC, x, ABSOLUTE, "has no zero of its own");
    refused(
        tests::ROTARY,
        "\n[rotary.c]\n",
        ABSOLUTE,
        "homed on its encoder's index mark",
    );
    let ready = "{ by = \"homed_bit\", object = \"0x6041:00\", bit = 9 }";
    refused(tests::LINEAR, x, ready, "means something else in CiA 402");
    let target = "{ by = \"mark\", object = \"0x607A:00\" }";
    refused(tests::LINEAR, x, target, "a mark would change it");
    let counts_on = tests::ROTARY.machine.edit(
        "position_range = \"to_last_count\"",
        &format!("kept_zero = {MARK}\nposition_range = \"counts_on\""),
    );
    let told = truestage::config::parse(&counts_on, "machine.toml").expect_err("it is refused");
    assert!(
        told.to_string().contains("it begins anew within a turn"),
        "{told}"
    );
}

#[test]
fn sides_of_a_gantry_and_screws_of_a_platform_keep_none() {
    for (text, axis, says) in [
        (
            tests::GANTRY.machine,
            "x1",
            "may be moved without the other",
        ),
        (tests::UVW.machine, "u", "what its camera saw"),
    ] {
        let head = format!("\n[axis.{axis}]\n");
        let text = text.edit(&head, &format!("{head}kept_zero = {MARK}\n"));
        let refused = truestage::config::parse(&text, "machine.toml");
        let told = refused.expect_err("it is refused").to_string();
        assert!(told.contains(says), "{told}");
    }
}

#[test]
fn another_configuration_means_other_places() {
    let mut bench = stage(MARK, "");
    zeroed(&mut bench);
    let folder = bench.folder.path().to_owned();
    let other = tests::shipped_config(&tests::LINEAR, &folder, |text| {
        proving(text, MARK).edit("\nspeed_mm_per_s = 200.0", "\nspeed_mm_per_s = 190.0")
    });
    let told = again_as(&mut bench, &other);
    assert!(!has_its_zero(&bench));
    assert!(told[0].contains("configuration"), "{told:?}");
}

#[test]
fn a_zero_whose_uncertainty_nobody_knows_is_found_again() {
    let mut bench = stage(MARK, "");
    zeroed(&mut bench);
    std::fs::remove_dir_all(bench.store.runs()).expect("they are there");
    assert!(again(&mut bench).is_empty());
    let course = bench.machine.linear("x").unwrap().course();
    assert_eq!(course.zero_uncertainty(), None);
    assert!(!has_its_zero(&bench));
    assert!(again(&mut bench).is_empty() && !has_its_zero(&bench));
}

#[test]
fn a_note_that_is_no_note_is_none() {
    let mut bench = stage(MARK, "");
    zeroed(&mut bench);
    let note = bench.store.root().join("zeros/x.json");
    let text = std::fs::read_to_string(&note).expect("it was noted");
    for broken in [
        String::new(),
        text.edit("\"axis\":\"x\"", "\"axis\":\"y\""),
        "\u{0}".repeat(100),
    ] {
        std::fs::write(&note, &broken).expect("there is room");
        again(&mut bench);
        assert!(!has_its_zero(&bench), "{broken}");
    }
    std::fs::write(&note, text).expect("there is room");
    assert!(again(&mut bench).is_empty() && has_its_zero(&bench));
}

#[test]
fn an_encoder_that_failed_takes_it_and_the_next_start_does_not_give_it_back() {
    let mut bench = stage(MARK, "");
    zeroed(&mut bench);
    let fault = FaultConfig::times(
        Fault::Emergency {
            port: "can0".into(),
            node_id: 1,
            code: 0x7305,
            register: 0x81,
        },
        1,
    );
    let failed = bench.emulated.simulation_mut().inject(fault);
    failed.unwrap_or_else(|error| panic!("{error}"));
    let until = bench.machine.now() + Duration::from_secs(1);
    assert!(bench.machine.run_until(until).is_err());
    bench.machine.make_safe();
    assert!(again(&mut bench).is_empty() && !has_its_zero(&bench));
}

fn angle(bench: &Bench) -> Radians {
    let simulation = bench.emulated.simulation();
    simulation.truth().table().expect("it is one").angle()
}

#[test]
fn a_table_keeps_its_index_over_many_turns() {
    let mut bench = Bench::rotary(
        62,
        |text| {
            text.edit(
                "\n[rotary.c]\n",
                &format!("\n[rotary.c]\nkept_zero = {MARK}\n"),
            )
        },
        |text| text,
    );
    super::rotary::started(&mut bench);
    let turned = |bench: &mut Bench, deg: f64| {
        let moved = bench.machine.guarded(|machine| {
            machine.turning("c")?.command(
                DriveCommand::Enable.into(),
                "enable",
                Duration::from_secs(5),
            )?;
            machine
                .rotary("c")?
                .turn_to(Radians::from_degrees(deg), truestage::rotary::Way::Forward)
        });
        moved.unwrap_or_else(|failure| panic!("{failure}"));
    };
    for deg in [120.0, 240.0, 0.0, 120.0] {
        turned(&mut bench, deg);
    }
    let before = angle(&bench);
    assert!(again(&mut bench).is_empty());
    assert!(bench.machine.is_zeroed("c"));
    turned(&mut bench, 300.0);
    turned(&mut bench, 120.0);
    let after = angle(&bench);
    let off = (after - before).value().sin().abs();
    assert!(off < Radians::from_arcsec(0.5).value(), "{off} rad");
}

#[test]
fn three_axes_keep_theirs_each_by_itself() {
    let shipped: &Shipped = &VOLUMETRIC;
    let mut bench = Bench::shaped(
        shipped,
        63,
        |text| {
            ["x", "z"].into_iter().fold(text, |text, axis| {
                let head = format!("\n[axis.{axis}]\n");
                text.edit(&head, &format!("{head}kept_zero = {MARK}\n"))
            })
        },
        |text| text,
    );
    let zeroed = bench.machine.guarded(|machine| {
        machine.start()?;
        machine.volumetric()?.zero()
    });
    zeroed.unwrap_or_else(|failure| panic!("{failure}"));
    again(&mut bench);
    let kept = ["x", "y", "z"].map(|axis| bench.machine.is_zeroed(axis));
    assert_eq!(kept, [true, false, true]);
}
