//! `kill -9` of a service that moves a stage: at whatever moment, the drive stops in time by itself, and the next service
//! goes on from there, with the run that was under way.

use core::time::Duration;
use std::path::PathBuf;

use drivers::transport::lockstep::lend_hand;
use nix::sys::signal::Signal;
use serde_json::{Value, json};
use tests::{Edit, Rig, VOLUMETRIC, random};

use crate::held::Steps;
use crate::programs::{Bench, Process, check_error, live_rigs, number};
use crate::serve::{ask, fetch, keep};
use crate::volumetric_live::small;

/// `watch_master_ms`, the heartbeat before it that was not sent any more, and what braking takes.
const STOPPED_WITHIN: Duration = Duration::from_millis(500 + 100 + 100);
/// A servo that holds its place.
const STANDS_MM: f64 = 1e-3;

/// Somebody who only looks: time passes while it waits.
pub(crate) struct Watcher {
    clock: PathBuf,
    time: Steps,
}

impl Watcher {
    pub(crate) fn of(bench: &Bench) -> Self {
        Self {
            clock: bench.folder().join("clock"),
            time: Steps::of(bench),
        }
    }

    /// Where the stage truly is, in millimetres.
    fn true_mm(&self) -> f64 {
        number(&self.truth()["position_mm"])
    }

    /// Where the tool of three axes truly is, in millimetres.
    fn true_tool_mm(&self) -> [f64; 3] {
        let truth = self.truth();
        ["x_mm", "y_mm", "z_mm"].map(|key| number(&truth[key]))
    }

    pub(crate) fn truth(&self) -> Value {
        let truth = lend_hand(&self.clock, "truth").expect("the truth");
        serde_json::from_str(&truth).expect("an object")
    }

    /// Does what a hand at the machine could do.
    pub(crate) fn lend_hand(&self, words: &str) {
        lend_hand(&self.clock, words).expect("it is done");
    }

    pub(crate) fn wait(&mut self, span: Duration) {
        self.time.pass(span);
    }
}

/// A few are asked in every run, and one on `SocketCAN`, where each takes longest: whose socket is closed does not
/// depend on the instant. `INSTANTS=200` for more.
fn instants(rig: Rig) -> u32 {
    let wanted = std::env::var("INSTANTS").ok();
    let usual = if rig == Rig::Vcan { 1 } else { 2 };
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
    let has_begun = || {
        // On a busy computer it may be told that it asks too often.
        let (_, axis) = ask(bench.folder(), "GET /v1/axes/x", &json!({}));
        axis["encoder"]["value"]
            .as_f64()
            .is_some_and(|it| it > 0.05)
    };
    while !has_begun() {}
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

/// Its drive never misses a heartbeat: the next service sends them before the watch has run out.
#[test]
fn what_a_killed_service_left_in_motion_is_stopped_by_one_that_comes_at_once() {
    for rig in live_rigs() {
        let bench = Bench::new(rig);
        bench.configure("machine.toml", |text| {
            // Longer than anybody needs to start a service.
            let watch = "heartbeat_consumer_ms = 150\nwatch_master_ms = ";
            text.edit("move_timeout_s = 10.0", "move_timeout_s = 100000.0")
                .edit(
                    &format!("{watch}500\n\n[axis.x.identity]"),
                    &format!("{watch}20000\n\n[axis.x.identity]"),
                )
        });
        killed_after(&bench, moving(&bench), 3);
        let service = keep(&bench);
        let mut watcher = Watcher::of(&bench);
        let stopped_at = watcher.true_mm();
        watcher.wait(Duration::from_secs(3));
        let later = watcher.true_mm();
        // It holds the time up while it only looks.
        drop(watcher);
        assert!(
            (later - stopped_at).abs() < STANDS_MM,
            "it was at {stopped_at} mm when the next service listened, and went on to {later} mm"
        );
        let (_, axis) = ask(bench.folder(), "GET /v1/axes/x", &json!({}));
        assert_eq!(axis["state"], "Disabled", "{axis:#}");
        let (_, counted) = fetch(bench.folder(), "GET /metrics", &json!({}));
        let by_the_start = counted
            .lines()
            .find(|it| it.contains("found enabled, and stopped"));
        assert!(
            by_the_start.is_some_and(|it| it.ends_with(" 1")),
            "{by_the_start:?}"
        );
        service.signal(Signal::SIGTERM);
        assert_eq!(service.end().code, Some(0));
    }
}

/// The emulated drive has a variable that it forgets without power.
#[test]
fn a_service_that_comes_again_moves_without_a_zero_where_the_drive_proves_that_it_kept_it() {
    for rig in live_rigs() {
        let bench = Bench::new(rig);
        bench.configure("machine.toml", |text| {
            text.edit("move_timeout_s = 10.0", "move_timeout_s = 100000.0")
                .edit(
                    "\n[axis.x]\n",
                    "\n[axis.x]\nkept_zero = { by = \"mark\", object = \"0x2F00:01\" }\n",
                )
        });
        killed_after(&bench, moving(&bench), 5);
        Watcher::of(&bench).wait(STOPPED_WITHIN);
        let service = keep(&bench);
        let (_, axis) = ask(bench.folder(), "GET /v1/axes/x", &json!({}));
        assert_eq!(
            (&axis["homed"], &axis["state"]),
            (&json!(true), &json!("Disabled")),
            "{axis:#}"
        );
        let off = bench.run(&["move", "machine.toml", "x=5mm", "--uncompensated"]);
        let off = off.with_code(3);
        check_error(&off, &["switched off", "truestage enable"]);
        let on = bench
            .run(&["enable", "machine.toml", "--axis", "x"])
            .with_code(0);
        assert_eq!(on["axes"][0]["state"], "Standstill", "{on}");
        let moved = bench.run(&["move", "machine.toml", "x=5mm", "--uncompensated"]);
        let moved = moved.with_code(0);
        let there = Watcher::of(&bench).true_mm();
        bench.run(&["zero", "machine.toml"]).with_code(0);
        let again = bench.run(&["move", "machine.toml", "x=5mm", "--uncompensated"]);
        again.with_code(0);
        let off = Watcher::of(&bench).true_mm() - there;
        assert!(
            off.abs() < 0.005,
            "{off} mm beside where a new zero brings it: {moved}"
        );
        service.signal(Signal::SIGTERM);
        assert_eq!(service.end().code, Some(0));
        // Whoever ends a service in order takes nothing from the drive, either.
        let service = keep(&bench);
        let (_, axis) = ask(bench.folder(), "GET /v1/axes/x", &json!({}));
        assert_eq!(axis["homed"], true, "{axis:#}");
        service.signal(Signal::SIGTERM);
        assert_eq!(service.end().code, Some(0));
    }
}

/// So fast the axis goes from one position of a calibration to the next, which is nearly all of the time.
const SLOWLY_MM_PER_S: f64 = 1.0;
/// A kill comes so long after the run was begun at most, in seconds of the machine.
const WITHIN_S: f64 = 8.0;
/// What the stage must have gone in a hundredth of a second to be in motion.
const IN_MOTION_MM: f64 = 0.004;

/// A machine whose calibrations take minutes.
fn slow_bench(rig: Rig) -> Bench {
    let bench = Bench::new(rig);
    bench.configure("machine.toml", |text| {
        text.edit("speed_mm_per_s = 200.0", "speed_mm_per_s = 1.0")
            .edit("move_timeout_s = 10.0", "move_timeout_s = 100000.0")
    });
    bench
}

/// The runs that the service at `bench` knows.
fn runs(bench: &Bench) -> Vec<Value> {
    let (status, runs) = ask(bench.folder(), "GET /v1/runs", &json!({}));
    assert_eq!(status, 200, "{runs}");
    runs.as_array().expect("a list").clone()
}

/// The one run that was left; it can go on.
#[track_caller]
fn found(bench: &Bench, instant: u32) -> Value {
    let all = runs(bench);
    let [run] = &all[..] else {
        panic!("instant {instant}: one run was under way, the service found {all:?}");
    };
    assert_eq!(
        (&run["kind"], &run["state"], &run["can_resume"]),
        (&json!("calibrate"), &json!("paused"), &json!(true)),
        "instant {instant}: {run}"
    );
    run.clone()
}

/// Begins a calibration, or lets `left` go on, and kills the service in a motion of it.
fn killed_in_a_run(bench: &Bench, service: Process, left: Option<&Value>, state: &mut u64) {
    bench.run(&["zero", "machine.toml"]).with_code(0);
    let begun = match left {
        None => ask(
            bench.folder(),
            "POST /v1/runs",
            &json!({"kind": "calibrate", "start": true}),
        ),
        Some(run) => {
            let id = run["id"].as_str().expect("it has a name");
            let resume = format!("POST /v1/runs/{id}/resume");
            ask(bench.folder(), &resume, &json!({}))
        }
    };
    assert!(begun.0 < 300, "{begun:?}");
    let mut watcher = Watcher::of(bench);
    let is_moving = |_: &u32| {
        watcher.wait(Duration::from_secs_f64(random(state) * WITHIN_S));
        let before = watcher.true_mm();
        watcher.wait(Duration::from_millis(10));
        (watcher.true_mm() - before).abs() > IN_MOTION_MM
    };
    let moving = (0..10).find(is_moving);
    assert!(moving.is_some(), "it does not move: {:?}", runs(bench));
    // It goes on by itself until the signal is there: whatever it does just then.
    drop(watcher);
    service.signal(Signal::SIGKILL);
    assert_eq!(service.end().code, None);
}

/// How far the stage went on; it must stand in time.
fn stopped(bench: &Bench, instant: u32) -> f64 {
    let mut watcher = Watcher::of(bench);
    let killed_at = watcher.true_mm();
    watcher.wait(STOPPED_WITHIN);
    let stopped_at = watcher.true_mm();
    watcher.wait(Duration::from_secs(3));
    let later = watcher.true_mm();
    assert!(
        (later - stopped_at).abs() < STANDS_MM,
        "instant {instant}: killed at {killed_at} mm, it was at {stopped_at} mm when it should stand and went on to \
         {later} mm"
    );
    let went_on = (stopped_at - killed_at).abs();
    let farthest = STOPPED_WITHIN.as_secs_f64() * SLOWLY_MM_PER_S;
    assert!(
        went_on < farthest,
        "instant {instant}: it went on by {went_on} mm"
    );
    went_on
}

#[test]
fn the_run_of_a_service_that_is_killed_in_motion_is_found_each_time_and_goes_on() {
    for rig in live_rigs() {
        let bench = slow_bench(rig);
        let (mut state, mut left) = (u64::from(std::process::id()), None::<Value>);
        println!("seed {state}");
        let (mut farthest, mut resumed) = (0.0_f64, 0);
        let mut service = keep(&bench);
        for instant in 0..instants(rig) {
            // One that was found goes on or is begun anew.
            let goes_on = left.take().filter(|_| random(&mut state) < 0.5);
            resumed += u32::from(goes_on.is_some());
            killed_in_a_run(&bench, service, goes_on.as_ref(), &mut state);
            farthest = farthest.max(stopped(&bench, instant));
            service = keep(&bench);
            let run = found(&bench, instant);
            if let Some(before) = &goes_on {
                assert_eq!(run["journal"], before["journal"], "instant {instant}");
            }
            left = Some(run);
        }
        println!(
            "{rig:?}: killed at {} instants in motion, {resumed} of them in a run that went on; the run was found each \
             time, and no stage went on by more than {farthest:.3} mm at {SLOWLY_MM_PER_S} mm/s",
            instants(rig)
        );
        // Minutes of the machine, for which no bus matters; on `SocketCAN` it would be the longest test of all.
        if rig != Rig::Vcan {
            goes_on_to_its_end(&bench, &left.expect("there was an instant"));
        }
        service.signal(Signal::SIGTERM);
        assert_eq!(service.end().code, Some(0));
    }
}

/// The last one that was found becomes a calibration.
fn goes_on_to_its_end(bench: &Bench, left: &Value) {
    bench.run(&["zero", "machine.toml"]).with_code(0);
    let id = left["id"].as_str().expect("it has a name");
    let (status, run) = ask(
        bench.folder(),
        &format!("POST /v1/runs/{id}/resume"),
        &json!({}),
    );
    assert_eq!(status, 200, "{run}");
    let wait = format!("GET /v1/runs/{id}?wait_s=300");
    let mut waits = (0..100).map(|_| ask(bench.folder(), &wait, &json!({})).1);
    let ended = waits.find(|it| it["state"] != "running");
    let ended = ended.expect("it comes to an end");
    assert_eq!(ended["state"], "done", "{ended}");
    assert_eq!(ended["result"]["journal"], left["journal"], "{ended}");
}

/// Somebody who came when the tool of three axes moved: while he is there and does not wait, no time passes.
fn watcher_in_motion(bench: &Bench) -> Watcher {
    let mut watcher = Watcher::of(bench);
    let mut before = watcher.true_tool_mm();
    let is_moving = |_: u32| {
        watcher.wait(Duration::from_millis(10));
        let now = watcher.true_tool_mm();
        let moves = now
            .iter()
            .zip(&before)
            .any(|(now, before)| (now - before).abs() > IN_MOTION_MM);
        before = now;
        moves
    };
    assert!((0..1000).any(is_moving), "it does not move");
    watcher
}

/// Which lines somebody was asked to set up.
fn asked(said: &str) -> Vec<u32> {
    let lines = said.lines().filter_map(|it| it.strip_prefix("> line "));
    let numbers = lines.map(|it| it.split(' ').next().and_then(|it| it.parse().ok()));
    numbers.map(|it| it.expect("a number")).collect()
}

/// The next service goes on behind the lines that were read cold, and whoever has it go on is told that the axes become warm
/// again, and why.
#[test]
fn three_axes_whose_service_is_killed_while_they_become_warm_become_warm_again_with_the_next() {
    for rig in live_rigs().filter(|rig| *rig == Rig::Pty) {
        let bench = Bench::of(rig, VOLUMETRIC, |text| text);
        bench.configure("machine.toml", |text| small(&text));
        let service = keep(&bench);
        let client = bench.start(&["calibrate", "machine.toml", "--warm-up-min", "0.5"]);
        let ended = client.end_heard(|_, said| {
            // The lines that are read cold are read: the axes go to and fro. At rest no drive would miss anything.
            if said.contains("may be packed up") {
                let _watcher = watcher_in_motion(&bench);
                service.signal(Signal::SIGKILL);
            }
        });
        assert_eq!(ended.code, Some(4), "{ended:?}");
        assert_eq!(service.end().code, None);
        let cold = asked(&ended.said);
        // The drives miss the heartbeat, and stand.
        Watcher::of(&bench).wait(Duration::from_secs(3));

        let service = keep(&bench);
        // They followed set-points, and have a fault since none comes.
        let refused = bench.run(&["zero", "machine.toml"]).with_code(4);
        check_error(&refused, &["enabling failed", "truestage reset"]);
        let reset = bench
            .run(&["reset", "machine.toml", "--axis", "x"])
            .with_code(0);
        assert_eq!(
            (&reset["axis"], &reset["after"]),
            (&"x".into(), &"Disabled".into()),
            "{reset}"
        );
        let client = bench.start(&["calibrate", "machine.toml", "--resume"]);
        let ended = client.end_heard(|client, said| {
            if said.starts_with("> line ") {
                client.signal(Signal::SIGINT);
            }
        });
        assert_eq!(ended.code, Some(130), "{ended:?}");
        let next = cold.last().map(|it| it + 1);
        assert_eq!(asked(&ended.said).first().copied(), next, "{ended:?}");
        let why = "no line was read warm before: the axes warm up for 0.5 min";
        assert_eq!(ended.said.matches(why).count(), 1, "{ended:?}");
        service.signal(Signal::SIGTERM);
        assert_eq!(service.end().code, Some(0));
    }
}
