//! The examples that need no machine, as somebody who reads them runs them.

use std::process::Command;

use crate::programs::program;

/// What example `name` prints.
#[track_caller]
fn printed(name: &str) -> String {
    let output = Command::new(program(&format!("examples/{name}"))).output();
    let output = output.expect("it can be started");
    assert!(output.status.success(), "{output:?}");
    String::from_utf8(output.stdout).expect("it prints text")
}

#[test]
fn a_device_of_ones_own_is_read_and_its_silence_told() {
    let text = printed("device");
    assert!(text.contains("12.345 mm"), "{text}");
    assert!(text.contains("waited 200ms for the answer to P"), "{text}");
}

#[test]
fn measured_data_become_set_points() {
    let text = printed("fit");
    assert!(text.contains("as found: A = "), "{text}");
    assert!(text.contains("to 30 mm: 29.97"), "{text}");
}

#[test]
fn an_emulated_stage_goes_through_its_cycle() {
    let text = printed("emulated");
    assert!(text.contains("the tolerance is 2.000 um"), "{text}");
}
