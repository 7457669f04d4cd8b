//! What the program itself must refuse: targets beyond the limits, calibrations that are too
//! large or too steep, and those that make the axis worse (classes 48, 49).

use machine::records::CalibrationRecord;
use machine::records::Store;
use mock_bus::fault::{Fault, FaultConfig};
use tests::Bench;
use tests::seeds;
use truestage::CalibrateOptions;
use truestage::linear::LinearContent;
use truestage::linear::VerifyOptions;
use truestage::{Failure, Machine};
use units::Metres;

use crate::scene::shortened;

fn zeroed(seed: u64) -> Bench {
    let mut bench = Bench::with(seed, shortened, |text| text);
    bench.machine.start().unwrap();
    let store = bench.store.clone();
    bench.machine.linear("x").unwrap().zero(&store).unwrap();
    bench
}

fn calibrated(seed: u64) -> (Bench, CalibrationRecord<LinearContent>, String) {
    let mut bench = zeroed(seed);
    let store = bench.store.clone();
    let options = CalibrateOptions::default();
    let made = bench
        .machine
        .linear("x")
        .unwrap()
        .calibrate(&store, &options)
        .unwrap();
    (bench, made.record, made.id)
}

fn verify(machine: &mut Machine, store: &Store) -> Result<(), Failure> {
    let calibration = store.active("x")?.current;
    let options = VerifyOptions {
        compensated: true,
        calibration,
        resume: None,
    };
    machine.linear("x")?.verify(store, &options).map(|_| ())
}

#[test]
fn a_target_beyond_the_soft_limits_moves_nothing() {
    let mut bench = zeroed(1);
    let before = bench.true_position();
    for target_mm in [63.001, -3.001, 1e6, -1e6, f64::NAN, f64::INFINITY] {
        let refused = bench
            .machine
            .linear("x")
            .unwrap()
            .move_to(Metres::from_mm(target_mm));
        match refused {
            Err(failure @ Failure::Machine(machine::Failure::SoftLimit { .. })) => {
                assert!(
                    failure.to_string().contains("nothing was moved"),
                    "{failure}"
                );
            }
            other => panic!("{target_mm} mm: {other:?}"),
        }
        let until = bench.machine.now() + core::time::Duration::from_millis(200);
        bench.machine.run_until(until).unwrap();
        let moved = (bench.true_position() - before).abs();
        assert!(
            moved.nm() < 100.0,
            "{target_mm} mm moved it by {} nm",
            moved.nm()
        );
    }
    bench
        .machine
        .linear("x")
        .unwrap()
        .move_to(Metres::from_mm(62.9))
        .unwrap();
}

#[test]
fn an_axis_that_is_not_zeroed_moves_nothing() {
    let mut bench = Bench::new(1);
    bench.machine.start().unwrap();
    let before = bench.true_position();
    let refused = bench
        .machine
        .linear("x")
        .unwrap()
        .move_to(Metres::from_mm(1.0));
    assert!(
        matches!(
            refused,
            Err(Failure::Machine(machine::Failure::NotZeroed { .. }))
        ),
        "{refused:?}"
    );
    assert_eq!(bench.true_position(), before);
}

/// The record with its deviations passed through `change`, stored and activated.
fn activate(
    store: &Store,
    record: &CalibrationRecord<LinearContent>,
    change: impl Fn(usize, f64) -> f64,
) -> String {
    let mut changed = record.clone();
    let content = &mut changed.content;
    for (at, node) in content.nodes.iter_mut().enumerate() {
        node.forward_m = node.forward_m.map(|it| change(at, it));
        node.reverse_m = node.reverse_m.map(|it| change(at, it));
    }
    // It would have to follow from the nodes.
    content.lost_motion_m = None;
    let id = store.save(&changed).unwrap();
    store.activate("x", &id).unwrap();
    id
}

#[track_caller]
fn check_refused_at_load(change: impl Fn(usize, f64) -> f64, words: &[&str]) {
    let (mut bench, record, good) = calibrated(1);
    let store = bench.store.clone();
    activate(&store, &record, change);
    let failure = bench
        .machine
        .linear("x")
        .unwrap()
        .load_active(&store)
        .unwrap_err();
    let text = failure.to_string();
    for word in words {
        assert!(text.contains(word), "`{word}` is not in: {text}");
    }
    assert_eq!(failure.exit_code(), 3, "{failure:?}");
    assert_eq!(store.rollback("x").unwrap(), good);
    assert_eq!(
        bench
            .machine
            .linear("x")
            .unwrap()
            .load_active(&store)
            .unwrap(),
        Some(good)
    );
}

#[test]
fn a_calibration_that_is_too_large_is_refused_when_it_is_loaded() {
    check_refused_at_load(
        |_, deviation| deviation + 80e-6,
        &["axis x", "deviation at 0 mm", "limit 50.000 um"],
    );
}

#[test]
fn a_calibration_that_jumps_is_refused_when_it_is_loaded() {
    let jump = |at: usize, deviation| {
        if at == 4 {
            deviation + 30e-6
        } else {
            deviation
        }
    };
    check_refused_at_load(jump, &["axis x", "neighbours"]);
}

#[test]
fn a_calibration_with_the_wrong_sign_is_found_out_and_the_one_before_is_used_again() {
    for seed in 1..=3 {
        let (mut bench, record, good) = calibrated(seed);
        let store = bench.store.clone();
        let wrong = activate(&store, &record, |_, deviation| -deviation);
        bench
            .machine
            .linear("x")
            .unwrap()
            .load_active(&store)
            .unwrap();
        let failure = bench
            .machine
            .guarded(|machine| verify(machine, &store))
            .unwrap_err();
        match &failure {
            Failure::MadeWorse {
                before,
                after,
                in_use,
                ..
            } => {
                assert!(after.um() > 1.5 * before.um(), "{failure}");
                assert!(good.starts_with(in_use.as_deref().unwrap()), "{failure}");
            }
            other => panic!("seed {seed}: {other}"),
        }
        assert!(
            failure.to_string().contains("MAKES THE AXIS WORSE"),
            "{failure}"
        );
        assert!(
            failure.to_string().contains("its SIGN is wrong"),
            "{failure}"
        );
        let active = store.active("x").unwrap();
        assert_eq!(
            active.current.as_deref(),
            Some(good.as_str()),
            "not {wrong}"
        );
        bench.machine.start().unwrap();
        bench.machine.linear("x").unwrap().zero(&store).unwrap();
        verify(&mut bench.machine, &store).unwrap();
    }
}

/// Whatever the means of its few runs are, and however good the calibration is.
#[test]
fn a_stage_that_shakes_is_no_reason_to_give_up_a_calibration() {
    for seed in seeds("1..12") {
        let (mut bench, _, good) = calibrated(seed);
        let store = bench.store.clone();
        // It proves itself first: one that is new may be given up.
        verify(&mut bench.machine, &store).unwrap();
        let shakes = Fault::Vibration {
            amplitude_um: 5.0 * (seed % 12 + 1) as f64,
        };
        let mut emulated = bench.emulated.simulation_mut();
        let injected = emulated.inject(FaultConfig::permanent(shakes));
        injected.expect("the machine can shake");
        drop(emulated);
        let verified = verify(&mut bench.machine, &store);
        // So much may look like another scale, too; which is no reason either.
        let is_blamed = matches!(
            verified,
            Err(Failure::MadeWorse { .. } | Failure::NewIsWorse(_))
        );
        assert!(!is_blamed, "seed {seed}: {verified:?}");
        let active = store.active("x").unwrap().current;
        assert_eq!(active.as_deref(), Some(good.as_str()), "seed {seed}");
    }
}

#[test]
fn a_first_calibration_that_makes_it_worse_leaves_none_behind() {
    let (mut bench, record, _) = calibrated(2);
    let fresh = truestage::for_tests::store_in(bench.folder.path(), "fresh");
    activate(&fresh, &record, |_, deviation| -deviation);
    bench
        .machine
        .linear("x")
        .unwrap()
        .load_active(&fresh)
        .unwrap();
    let failure = bench
        .machine
        .guarded(|machine| verify(machine, &fresh))
        .unwrap_err();
    assert!(
        matches!(failure, Failure::MadeWorse { in_use: None, .. }),
        "{failure:?}"
    );
    assert!(
        failure.to_string().contains("no calibration now"),
        "{failure}"
    );
    assert_eq!(fresh.active("x").unwrap().current, None);
    assert!(bench.machine.linear("x").unwrap().compensation().is_none());
}

#[test]
fn a_good_calibration_stays_in_use() {
    let (mut bench, _, good) = calibrated(3);
    let store = bench.store.clone();
    verify(&mut bench.machine, &store).unwrap();
    assert_eq!(store.active("x").unwrap().current, Some(good));
}
