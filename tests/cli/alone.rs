//! The examples that need no machine, as somebody who reads them runs them.

use std::process::Command;

use crate::programs::program;

#[track_caller]
fn check(name: &str, promised: &str) {
    let mut command = Command::new(program(&format!("examples/{name}")));
    let output = command.output().expect("it can be started");
    let printed = String::from_utf8_lossy(&output.stdout);
    let said = String::from_utf8_lossy(&output.stderr);
    let well = output.status.success();
    assert!(well && printed.contains(promised), "{printed}{said}");
}

#[test]
fn an_emulated_stage_is_within_its_tolerance_after_its_whole_cycle() {
    check("emulated", "um as left, the tolerance is");
}

#[test]
fn measured_data_become_a_table_that_brings_the_stage_to_its_target() {
    check("fit", "within 10 um:");
}
