//! The Hall sensors and their inputs (classes 28, 29): each fault by its name, no zero made.

use std::time::Duration;

use machine::Finding;
use mock_bus::fault::Fault;
use truestage::Failure;

use crate::scene::{Phase, Scene, Wanted, check};

/// The fault is there from the beginning of zeroing on.
#[track_caller]
fn check_named(fault: Fault, words: &[&str]) {
    let wanted = Wanted {
        cause: |failure| matches!(failure, Failure::Search { .. }),
        words,
        within: Duration::from_secs(60),
        rest: Duration::from_secs(60),
    };
    let mut played = check(Scene::during(Phase::Zero).fault(fault), &wanted);
    let machine = &mut played.bench.machine;
    assert!(!machine.is_zeroed("x"));
    let refused = machine.linear("x").unwrap().move_to(units::Metres::ZERO);
    assert!(
        matches!(
            refused,
            Err(Failure::Machine(machine::Failure::NotZeroed { .. }))
        ),
        "{refused:?}"
    );
}

#[test]
fn an_input_at_its_rail_is_named() {
    check_named(
        Fault::InputRail { channel: 0 },
        &["peak sensor", "saturated"],
    );
    check_named(
        Fault::InputRail { channel: 1 },
        &["slope sensor", "saturated"],
    );
}

#[test]
fn an_open_wire_is_named() {
    check_named(Fault::InputOpen { channel: 0 }, &["peak sensor", "open"]);
    check_named(Fault::InputOpen { channel: 1 }, &["slope sensor", "open"]);
}

#[test]
fn an_input_that_is_stuck_is_named() {
    check_named(Fault::InputStuck { channel: 0 }, &["peak sensor", "stuck"]);
    check_named(Fault::InputStuck { channel: 1 }, &["slope sensor", "stuck"]);
}

#[test]
fn swapped_sensors_are_named() {
    check_named(Fault::InputsSwapped, &["swapped"]);
}

#[test]
fn an_inverted_sensor_is_named() {
    check_named(
        Fault::InputInverted { channel: 0 },
        &["peak sensor", "inverted"],
    );
    check_named(
        Fault::InputInverted { channel: 1 },
        &["slope sensor", "inverted"],
    );
}

#[test]
fn an_analog_module_that_falls_silent_ends_the_search() {
    let fault = Fault::StopPdos {
        node: "hall_adc".into(),
    };
    let wanted = Wanted {
        cause: |failure| {
            matches!(
                failure,
                Failure::Machine(machine::Failure::Explained {
                    finding: Finding::NoProcessData { .. },
                    ..
                })
            )
        },
        words: &["hall: node 2 lives", "no sample"],
        within: Duration::from_millis(40),
        rest: Duration::from_millis(140),
    };
    check(
        Scene::during(Phase::Zero).after_ms(3000).fault(fault),
        &wanted,
    );
}
