//! Stops of a service whose disk is slow: strace delays each sync of its files.

use core::time::Duration;
use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::Instant;

use nix::sys::signal::Signal;
use serde_json::{Value, json};
use tests::left_out;

use crate::programs::{Bench, Process, live_rigs, number};
use crate::serve::{ask, fetch, fetch_with, keep};

/// How long a sync takes.
const DELAY: Duration = Duration::from_millis(1500);

/// Lets each sync of `service` take [`DELAY`]; `None` where strace is missing or must not.
fn slow_down(service: &Process) -> Option<Child> {
    let inject = format!("inject=fdatasync:delay_enter={}", DELAY.as_micros());
    let mut strace = Command::new("strace");
    strace.args(["-f", "-q", "-o", "/dev/null", "-e", "trace=fdatasync"]);
    strace.args(["-e", &inject, "-p", &service.id().to_string()]);
    let mut strace = strace.stderr(Stdio::null()).spawn().ok()?;
    while !is_traced(service.id()) {
        if !matches!(strace.try_wait(), Ok(None)) {
            return None;
        }
        thread::yield_now();
    }
    Some(strace)
}

/// Whether every thread of the process is traced.
fn is_traced(id: u32) -> bool {
    let threads = fs::read_dir(format!("/proc/{id}/task")).expect("it runs");
    threads.flatten().all(|thread| {
        let status = fs::read_to_string(thread.path().join("status")).unwrap_or_default();
        !status.contains("\nTracerPid:\t0\n")
    })
}

fn await_key(folder: &Path) {
    let has_key = |text: String| text.contains("\ntruestage_idempotency_keys 1\n");
    while !has_key(fetch(folder, "GET /metrics", &json!({})).1) {
        thread::yield_now();
    }
}

#[test]
fn a_stop_voids_a_motion_on_a_slow_disk() {
    for rig in live_rigs() {
        let bench = Bench::new(rig);
        let service = keep(&bench);
        let folder = bench.folder();
        bench.run(&["zero", "machine.toml"]).with_code(0);
        let Some(mut strace) = slow_down(&service) else {
            left_out("a motion waits for a slow disk", "strace cannot trace here");
            return;
        };
        let body = json!({"targets": {"x": "8mm"}, "uncompensated": true});
        let key = "idempotency-key: key\r\n";
        let begun = Instant::now();
        let (motion, stopped) = thread::scope(|scope| {
            let asking = scope.spawn(|| fetch_with(folder, "POST /v1/motions", key, &body));
            await_key(folder);
            let asked = Instant::now();
            let (status, _) = ask(folder, "POST /v1/stop", &json!({}));
            let taken = asked.elapsed();
            assert_eq!(status, 200);
            (asking.join().expect("it is answered"), taken)
        });
        assert!(begun.elapsed() >= DELAY, "nothing was slow");
        println!("{rig:?}: the stop was answered after {stopped:?}");
        assert!(
            stopped < DELAY / 2,
            "the stop waited for the disk: {stopped:?}"
        );
        let (status, motion) = (motion.0, serde_json::from_str::<Value>(&motion.1));
        let motion = motion.expect("an object");
        assert_eq!(
            (status, &motion["state"]),
            (201, &json!("stopped")),
            "{motion:#}"
        );
        let (_, axis) = ask(folder, "GET /v1/axes/x", &json!({}));
        assert!(number(&axis["encoder"]["value"]).abs() < 0.01, "{axis:#}");
        strace.kill().expect("it runs");
        strace.wait().expect("it ends");
        service.signal(Signal::SIGTERM);
        assert_eq!(service.end().code, Some(0));
    }
}
