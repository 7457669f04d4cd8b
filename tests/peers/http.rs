//! Strangers judge the service's HTTP interface: schemathesis asks what its seed draws, and a client that
//! openapi-python-client has generated runs a whole cycle.

use std::path::PathBuf;

use serde_json::{Value, json};
use tests::{Rig, rigs};

use crate::peer::{Peer, can_import};

/// Enough that each operation is asked, and each parameter is wrong at least once.
const REQUESTS: u64 = 500;

/// Where cargo puts the programs.
pub(crate) fn programs() -> PathBuf {
    let test = std::env::current_exe().expect("a process knows its program");
    let folder = test.ancestors().nth(2).expect("target/PROFILE/deps/TEST");
    for name in ["truestage", "mock-bus"] {
        assert!(
            folder.join(name).exists(),
            "{name} is not in {}: run `cargo build --workspace --bins` first, as tests/run does",
            folder.display()
        );
    }
    folder.to_owned()
}

#[test]
fn strangers_find_no_fault_with_the_interface_and_move_nothing_past_a_limit() {
    // Which bus the machine is on makes no difference to HTTP.
    if !rigs().contains(&Rig::Pty) {
        return;
    }
    if !can_import("schemathesis, openapi_python_client") {
        let why = "schemathesis and openapi-python-client are not installed: run tests/run";
        return tests::not_run("the judges of the HTTP interface", why);
    }
    let programs = programs();
    let requests = REQUESTS.to_string();
    let words = [&programs.to_string_lossy(), "--requests", &*requests];
    let report = Peer::start("http_judges.py", &words).finish();
    assert_eq!(report["failures"], 0, "{report}");
    let asked = report["requests"].as_u64();
    assert!(asked.is_some_and(|it| it >= REQUESTS), "{report}");
    println!(
        "{} requests, {} failures",
        report["requests"], report["failures"]
    );
    // Something moved, and what was refused was refused for its own sake.
    assert!(report["set_points"].as_u64() > Some(100), "{report}");
    assert_eq!(report["beyond"], json!([]), "{report}");
    assert_eq!(report["beyond_mm"], 0.0, "{report}");
    assert_eq!(
        report["cycle"]["is_verified"],
        Value::Bool(true),
        "{report}"
    );
}

#[test]
fn the_library_of_prometheus_reads_what_a_machine_in_real_time_says() {
    if !rigs().contains(&Rig::Pty) {
        return;
    }
    if !can_import("prometheus_client") {
        let why = "prometheus_client is not installed: run tests/run";
        return tests::not_run("the reader of metrics", why);
    }
    let programs = programs();
    let words = [&*programs.to_string_lossy()];
    let metrics = Peer::start("metrics_judge.py", &words).finish();
    // It leaves `_total` out of a counter's name.
    for (name, kind, samples) in [
        ("sync_lateness_seconds", "summary", 5),
        ("syncs", "counter", 1),
        ("sync_overruns", "counter", 1),
        ("bus_load_ratio", "gauge", 1),
        ("bus_errors", "counter", 1),
        ("running", "gauge", 1),
    ] {
        let metric = &metrics[format!("truestage_{name}")];
        assert_eq!(metric["kind"], kind, "{name}: {metrics}");
        let said = metric["samples"].as_array().map_or(0, Vec::len);
        assert_eq!(said, samples, "{name}: {metric}");
        assert!(metric["what"].as_str().is_some_and(|it| !it.is_empty()));
    }
    let lateness = &metrics["truestage_sync_lateness_seconds"]["samples"];
    let named = |name: &str| {
        let samples = lateness.as_array().expect("a list").iter();
        let name = format!("truestage_sync_lateness_seconds{name}");
        let found = samples.filter(|it| it[0] == name.as_str());
        found.filter_map(|it| it[2].as_f64()).collect::<Vec<_>>()
    };
    let (quantiles, counts) = (named(""), named("_count"));
    assert!(quantiles.len() == 3 && quantiles.is_sorted(), "{lateness}");
    assert!(counts[0] > 100.0 && named("_sum")[0] > 0.0, "{lateness}");
}
