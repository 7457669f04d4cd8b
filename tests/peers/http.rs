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
