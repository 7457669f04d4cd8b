//! `kill -9` of a service that moves a stage: at whatever moment, the drive stops in time by itself, and the next service
//! goes on from there.

use core::time::Duration;
use std::path::PathBuf;

use drivers::transport::Transport;
use drivers::transport::live::Live;
use drivers::transport::lockstep::lend_hand;
use nix::sys::signal::Signal;
use serde_json::{Value, json};
use tests::{Edit, Rig};

use crate::programs::{Bench, Process, live_rigs, number};
use crate::serve::{ask, keep};

/// `watch_master_ms`, the heartbeat before it that was not sent any more, and what braking takes.
const STOPPED_WITHIN: Duration = Duration::from_millis(500 + 100 + 100);
/// A servo that holds its place.
const STANDS_MM: f64 = 1e-3;

/// Somebody who only looks: time passes while it waits.
struct Watcher {
    clock: PathBuf,
    time: Live,
}

impl Watcher {
    fn of(bench: &Bench) -> Self {
        let time = Live::builder(bench.clock("a watcher")).build();
        Self {
            clock: bench.folder().join("clock"),
            time: time.expect("it has no port to open"),
        }
    }

    /// Where the stage truly is, in millimetres.
    fn true_mm(&self) -> f64 {
        let truth = lend_hand(&self.clock, "truth").expect("the truth");
        let truth: Value = serde_json::from_str(&truth).expect("an object");
        number(&truth["position_mm"])
    }

    fn wait(&mut self, span: Duration) {
        self.time.sleep_until(self.time.now() + span);
    }
}

/// A few are asked in every run, and one on `SocketCAN`, where each takes longest: whose socket is closed does not
/// depend on the instant. `INSTANTS=200` for more.
fn instants(rig: Rig) -> u32 {
    let wanted = std::env::var("INSTANTS").ok();
    let usual = if rig == Rig::Vcan { 1 } else { 4 };
    wanted.map_or(usual, |it| it.parse().expect("INSTANTS is a number"))
}

/// Kills the service when `beat` more answers have come: at another moment of the machine each time.
fn killed_after(bench: &Bench, service: Process, beats: u32) {
    for _ in 0..beats {
        ask(bench.folder(), "GET /v1/axes/x", &json!({}));
    }
    service.signal(Signal::SIGKILL);
    assert_eq!(service.end().code, None);
}

/// A zero, and then a slow way through the whole travel, which has begun.
fn moving(bench: &Bench) -> Process {
    let service = keep(bench);
    bench.run(&["zero", "machine.toml"]).with_code(0);
    let body = json!({"targets": {"x": "60mm"}, "speed": "1mm/s", "uncompensated": true});
    let (status, motion) = ask(bench.folder(), "POST /v1/motions", &body);
    assert_eq!(status, 201, "{motion}");
    let encoder_mm = || {
        let (_, axis) = ask(bench.folder(), "GET /v1/axes/x", &json!({}));
        number(&axis["encoder"]["value"])
    };
    while encoder_mm() < 0.05 {}
    service
}

#[test]
fn the_drive_of_a_service_that_is_killed_stops_in_time_and_the_next_service_goes_on() {
    for rig in live_rigs() {
        let bench = Bench::new(rig);
        bench.configure("machine.toml", |text| {
            text.edit("move_timeout_s = 10.0", "move_timeout_s = 100000.0")
        });
        for instant in 0..instants(rig) {
            killed_after(&bench, moving(&bench), instant * 7 % 40);
            let mut watcher = Watcher::of(&bench);
            let killed_at = watcher.true_mm();
            watcher.wait(STOPPED_WITHIN);
            let stopped_at = watcher.true_mm();
            watcher.wait(Duration::from_secs(3));
            let later = watcher.true_mm();
            // It moved at a millimetre a second, and went on until its drive missed the heartbeat.
            let went_on = stopped_at - killed_at;
            assert!(
                went_on > 0.2 && went_on < 0.7,
                "instant {instant}: it went on by {went_on} mm from {killed_at} mm"
            );
            assert!(
                (later - stopped_at).abs() < STANDS_MM,
                "instant {instant}: killed at {killed_at} mm, it was at {stopped_at} mm when it should stand and went \
                 on to {later} mm"
            );
        }
        // Whoever comes next zeroes and moves as if nothing had been.
        let service = keep(&bench);
        bench.run(&["zero", "machine.toml"]).with_code(0);
        let moved = bench.run(&["move", "machine.toml", "x=5mm", "--uncompensated"]);
        let moved = moved.with_code(0);
        let place = number(&moved["moves"][0]["encoder_mm"]);
        assert!((place - 5.0).abs() < 0.001, "{moved}");
        service.signal(Signal::SIGTERM);
        assert_eq!(service.end().code, Some(0));
    }
}
