//! Serial lines (classes 35, 36): garbage, split and merged messages, echo, late answers. None
//! of it may become a number.

use std::time::Duration;

use drivers::device::Alarm;
use mock_bus::fault::{Fault, FaultConfig};
use truestage::Failure;

use crate::scene::{Phase, STOPPING, Scene, Wanted, check, check_harmless};

fn laser() -> String {
    "laser".into()
}

fn now_and_then(fault: Fault, probability: f64) -> FaultConfig {
    let mut config = FaultConfig::permanent(fault);
    config.probability = probability;
    config
}

#[test]
fn messages_that_are_split_or_joined_do_no_harm() {
    let split = now_and_then(Fault::Split { port: laser() }, 0.5);
    check_harmless(Scene::during(Phase::Verify).inject(split));
    let merge = now_and_then(Fault::Merge { port: laser() }, 0.3);
    check_harmless(Scene::during(Phase::Verify).inject(merge));
}

#[test]
fn a_little_garbage_costs_a_sample_and_no_more() {
    let garbage = now_and_then(Fault::Garbage { port: laser() }, 0.05);
    let played = check_harmless(Scene::during(Phase::Calibrate).inject(garbage));
    let counters = played.bench.machine.devices().counters();
    let lines = counters
        .iter()
        .find(|(_, what, _)| *what == "garbage_lines");
    assert!(
        lines.is_some_and(|(_, _, count)| *count > 0),
        "{counters:?}"
    );
    let clean = check_harmless(Scene::during(Phase::Calibrate));
    let fitted = |played: &crate::scene::Played| {
        played
            .calibrated
            .borrow()
            .as_ref()
            .unwrap()
            .fitted
            .table
            .clone()
    };
    let (seen, expected) = (fitted(&played), fitted(&clean));
    for (seen, expected) in seen.nodes().iter().zip(expected.nodes()) {
        let apart = (seen.forward.unwrap() - expected.forward.unwrap()).abs();
        assert!(
            apart.nm() < 150.0,
            "garbage moved a node by {} nm",
            apart.nm()
        );
    }
}

#[test]
fn a_line_that_falls_silent_stops_the_run() {
    let wanted = Wanted {
        cause: |failure| {
            matches!(
                failure,
                Failure::Machine(machine::Failure::Alarm {
                    alarm: Alarm::StreamSilent { .. },
                    ..
                })
            )
        },
        words: &["laser:", "no sample"],
        within: Duration::from_millis(120),
        rest: Duration::from_millis(120) + STOPPING,
    };
    let silence = Fault::Silence { port: laser() };
    check(
        Scene::during(Phase::Calibrate)
            .after_ms(2500)
            .fault(silence),
        &wanted,
    );
}

#[test]
fn a_line_without_an_interferometer_is_refused_before_anything_is_measured() {
    let wanted = Wanted {
        cause: |failure| matches!(failure, Failure::Machine(machine::Failure::Device { .. })),
        words: &["interferometer", "good samples in a row", "last saw"],
        within: Duration::from_secs(5),
        rest: Duration::from_secs(5),
    };
    let silence = Fault::Silence { port: laser() };
    check(Scene::during(Phase::Calibrate).fault(silence), &wanted);
}

/// The Hall sensors behind the serial module instead of the one on CAN.
fn with_serial_module(scene: Scene) -> Scene {
    scene
        .machine(
            "[axis.x]\n",
            "[serial.adc]\npath = \"/dev/ttyUSB0\"\nbaud_bit_per_s = 9600\n\n\
             [analog.adam]\ndevice = \"dcon\"\nline = \"adc\"\naddress = 1\nchecksum = true\n\
             channels = [0, 1]\nfull_scale_v = [5.0, 5.0]\npoll_period_ms = 40.0\n\n[axis.x]\n",
        )
        .machine("analog = \"hall\"", "analog = \"adam\"")
        .machine("search_speed_mm_per_s = 0.5", "search_speed_mm_per_s = 0.1")
        .machine("time_limit_s = 60.0", "time_limit_s = 600.0")
        .machine(
            "standard_uncertainty_limit_um = 0.2",
            "standard_uncertainty_limit_um = 5.0",
        )
}

fn adc() -> String {
    "adc".into()
}

#[test]
fn a_serial_module_on_a_disturbed_line_gives_a_true_zero_or_none() {
    for fault in [
        FaultConfig::permanent(Fault::Echo { port: adc() }),
        now_and_then(Fault::Split { port: adc() }, 0.2),
        now_and_then(Fault::Garbage { port: adc() }, 0.02),
    ] {
        let name = format!("{fault:?}");
        let played = with_serial_module(Scene::during(Phase::Zero))
            .inject(fault)
            .play();
        played.was_delivered();
        match &played.result {
            Ok(()) => {
                let off = played.bench.true_position().abs();
                assert!(off.um() < 20.0, "{name}: zero is {} µm off", off.um());
            }
            // An answer that is late by a part of itself belongs to another place.
            Err(failure @ Failure::Refine { .. }) => {
                assert!(failure.to_string().contains("interference"), "{failure}");
                played.is_safe(Duration::from_secs(600));
            }
            Err(failure) => panic!("{name}: {failure}"),
        }
    }
}

#[test]
fn a_serial_module_that_falls_silent_or_answers_late_ends_the_search() {
    let wanted = Wanted {
        cause: |failure| {
            matches!(
                failure,
                Failure::Machine(machine::Failure::Alarm { .. } | machine::Failure::Device { .. })
            )
        },
        words: &["adam:"],
        within: Duration::from_secs(2),
        rest: Duration::from_secs(2) + STOPPING,
    };
    for fault in [
        Fault::Silence { port: adc() },
        Fault::LateAnswer {
            port: adc(),
            delay_ms: 900.0,
        },
    ] {
        let scene = with_serial_module(Scene::during(Phase::Zero))
            .after_ms(5000)
            .fault(fault);
        check(scene, &wanted);
    }
}
