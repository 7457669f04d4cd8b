//! Motions, stops and their acknowledgements on a disk that hangs, is full, or was damaged.

use core::time::Duration;
use std::fs::{self, OpenOptions};
use std::io::Write;
use std::path::Path;
use std::sync::Arc;
use std::thread;
use std::time::Instant;

use serde_json::{Value, json};
use service::{Caller, MotionState, RunKind, RunRequest, RunState, StopMode};
use tests::{Edit, LINEAR};

use crate::client::{Client, PATIENCE};
use crate::disk::Disk;
use crate::http::{Answer, Http};
use crate::stage::Stage;

/// So soon a stop is answered; half of some may be late on a computer with other work.
const STOP_WITHIN: Duration = Duration::from_millis(50);
/// A write that takes longer has failed.
const WRITE_LIMIT: Duration = Duration::from_secs(2);
/// What waits for no disk is answered sooner, whatever else the computer does.
const AT_ONCE: Duration = Duration::from_secs(1);

fn anna() -> Caller {
    Caller::named("anna")
}

fn stage_on(disk: &Disk, folder: &Path) -> Stage {
    Stage::on_disk(Arc::new(disk.files()), (LINEAR, 51), folder, |text| {
        text.edit("move_timeout_s = 10.0", "move_timeout_s = 10000.0")
    })
}

/// A linear stage that has its zero, on a disk of its own.
fn on_a_disk(body: impl FnOnce(&Stage, &Http, &Disk)) {
    let folder = tempfile::tempdir().unwrap();
    let disk = Disk::default();
    let stage = stage_on(&disk, folder.path());
    let http = Http::of(&stage);
    http.zero(&anna(), None);
    body(&stage, &http, &disk);
    drop(http);
    stage.end();
}

fn to(mm: f64) -> Value {
    json!({"targets": {"x": format!("{mm}mm")}, "uncompensated": true})
}

fn slowly(mm: f64) -> Value {
    json!({"targets": {"x": format!("{mm}mm")}, "speed": "0.1mm/s", "uncompensated": true})
}

fn begin(http: &Http, body: &Value, key: Option<&str>) -> Answer {
    let key = key.map_or(String::new(), |key| format!("\r\nidempotency-key: {key}"));
    http.post(&anna(), "/v1/motions", &key, body)
}

fn encoder_mm(http: &Http) -> f64 {
    let axis = http.axis("x").unwrap();
    axis.encoder.expect("it was read").value
}

fn health(http: &Http) -> Value {
    http.ask("GET /healthz HTTP/1.1", b"").json()["storage"].clone()
}

/// Returns once the ledger takes requests again.
fn await_health(http: &Http) {
    let begun = Instant::now();
    while health(http)["ok"] != true {
        assert!(begun.elapsed() < PATIENCE, "{}", health(http));
        thread::park_timeout(Duration::from_millis(20));
    }
}

/// What `ask` hears where a stop arrives while its request waits for the disk.
fn stopped_while_it_waits<T: Send>(http: &Http, disk: &Disk, ask: &(dyn Fn() -> T + Sync)) -> T {
    disk.hang();
    thread::scope(|scope| {
        let asking = scope.spawn(ask);
        disk.await_hanging();
        let stopped = http.stop(&Caller::named("bert"), StopMode::Controlled);
        disk.go_on();
        stopped.unwrap();
        asking.join().expect("it hears")
    })
}

#[test]
fn a_stop_voids_what_waits_for_the_disk() {
    on_a_disk(|stage, http, disk| {
        let motion = stopped_while_it_waits(http, disk, &|| begin(http, &to(10.0), Some("motion")));
        assert_eq!(motion.status, 201, "{motion:?}");
        let motion = motion.json();
        assert_eq!(motion["state"], "stopped", "{motion}");
        let by = motion["stopped"]["by"].as_str().unwrap();
        assert!(by.starts_with("bert"), "{motion}");
        let zero = RunRequest::of(RunKind::Zero, None);
        let run = stopped_while_it_waits(http, disk, &|| {
            http.plan_once(&anna(), &zero, Some("run")).unwrap()
        });
        let run = http.run(&run, PATIENCE).unwrap();
        assert_eq!((run.state, run.kept), (RunState::Stopped, Some(true)));
        assert_eq!(run.stopped.unwrap().by, "bert");
        // It ended so for good: the same request is the same motion.
        let again = begin(http, &to(10.0), Some("motion"));
        assert_eq!((again.status, &again.json()["id"]), (200, &motion["id"]));
        stage.gate.let_pass(Duration::from_secs(1));
        assert!(encoder_mm(http).abs() < 0.01, "it moved after the stop");
        let ended = http
            .motion(motion["id"].as_str().unwrap(), PATIENCE)
            .unwrap();
        assert_eq!(
            (ended.state, ended.kept),
            (MotionState::Stopped, Some(true))
        );
        let next = begin(http, &to(1.0), None).json();
        let ended = http.motion(next["id"].as_str().unwrap(), PATIENCE).unwrap();
        assert_eq!(
            ended.state,
            MotionState::Done,
            "what comes after the stop begins"
        );
    });
}

/// How long `ask` takes, which waits for no disk.
fn look(name: &str, ask: &dyn Fn()) -> Duration {
    let begun = Instant::now();
    ask();
    let taken = begun.elapsed();
    println!("{name}: {:.1} ms", taken.as_secs_f64() * 1e3);
    assert!(taken < AT_ONCE, "{name} took {taken:?}");
    taken
}

/// What goes on while the disk hangs, and what is refused at once; `known` is a motion that has ended.
fn check_on_hanging_disk(stage: &Stage, http: &Http, known: &str) {
    look("motion", &|| {
        drop(http.motion(known, Duration::ZERO).unwrap())
    });
    look("status", &|| drop(http.machine()));
    look("jog", &|| {
        let jog = json!({"axis": "x", "speed": "1mm/s"});
        let jog = http.post(&anna(), "/v1/jog", "", &jog);
        assert_eq!(jog.status, 200, "{jog:?}");
    });
    http.stop(&anna(), StopMode::Quick).unwrap();
    // The axis is in use until it stands.
    stage.gate.let_pass(Duration::from_secs(1));
    look("disable", &|| http.power(&anna(), "x", false).unwrap());
    look("lease", &|| {
        let lease = http.post(
            &anna(),
            "/v1/lease",
            "",
            &json!({"name": "anna", "seconds": 9}),
        );
        assert_eq!(lease.status, 200, "{lease:?}");
        let token = lease.json()["token"].as_str().map(str::to_owned);
        let holder = Caller {
            lease: token,
            ..anna()
        };
        http.release(&holder).unwrap();
    });
    for (path, body) in [
        ("/v1/motions", to(2.0)),
        ("/v1/runs", json!({"kind": "zero"})),
    ] {
        look(path, &|| {
            let refused = http.post(&anna(), path, "", &body);
            assert_eq!(refused.status, 503, "{refused:?}");
            assert!(refused.json()["cause"].as_str().unwrap().contains("hangs"));
        });
    }
}

#[test]
fn a_disk_that_hangs_keeps_motions_waiting_and_nothing_else() {
    on_a_disk(|stage, http, disk| {
        let known = begin(http, &to(1.0), Some("known")).json();
        let known = known["id"].as_str().unwrap().to_owned();
        http.motion(&known, PATIENCE).unwrap();
        disk.hang();
        let begun = Instant::now();
        let refused = begin(http, &to(10.0), Some("key"));
        assert!(begun.elapsed() >= WRITE_LIMIT && begun.elapsed() < 2 * WRITE_LIMIT);
        assert_eq!(
            (refused.status, &refused.json()["code"]),
            (503, &json!("storage"))
        );
        let mut stops: Vec<_> = (0..9)
            .map(|_| {
                look("stop", &|| {
                    http.stop(&anna(), StopMode::Controlled).unwrap()
                })
            })
            .collect();
        stops.sort();
        assert!(stops[4] <= STOP_WITHIN, "{stops:?}");
        check_on_hanging_disk(stage, http, &known);
        assert_eq!(health(http)["ok"], false);
        let metrics = http.ask("GET /metrics HTTP/1.1", b"");
        let metrics = String::from_utf8(metrics.body).unwrap();
        assert!(metrics.contains("\ntruestage_storage_ok 0\n"), "{metrics}");
        disk.go_on();
        await_health(http);
        http.power(&anna(), "x", true).unwrap();
        let again = begin(http, &to(2.0), Some("key"));
        assert_eq!(
            again.status, 201,
            "nothing was begun, and its key is free: {again:?}"
        );
    });
}

#[test]
fn a_motion_ends_on_a_full_disk_and_none_begins() {
    on_a_disk(|stage, http, disk| {
        let motion = begin(http, &slowly(30.0), Some("key")).json();
        let id = motion["id"].as_str().unwrap();
        stage.gate.let_pass(Duration::from_secs(1));
        disk.fill();
        http.stop(&anna(), StopMode::Controlled).unwrap();
        let ended = http.motion(id, PATIENCE).unwrap();
        assert_eq!(
            (ended.state, ended.kept),
            (MotionState::Stopped, Some(true))
        );
        let refused = begin(http, &to(1.0), None);
        assert_eq!(
            (refused.status, &refused.json()["code"]),
            (503, &json!("storage"))
        );
        disk.free();
        await_health(http);
        let next = begin(http, &to(1.0), None);
        assert_eq!(next.status, 201, "{next:?}");
    });
}

#[test]
fn a_damaged_ledger_takes_keys_once_a_person_accepts_it() {
    let folder = tempfile::tempdir().unwrap();
    let disk = Disk::default();
    stage_on(&disk, folder.path()).end();
    let service = folder.path().join("linear/service");
    let path = service.join("ledger.jsonl");
    let mut file = OpenOptions::new().append(true).open(&path).unwrap();
    file.write_all(b"{\"asked\":{\"id\":\"m1-1\",\"key\":\"ke\0\"}}\n")
        .unwrap();
    let damaged = fs::read(&path).unwrap();
    let stage = stage_on(&disk, folder.path());
    let http = Http::of(&stage);
    http.zero(&anna(), None);
    assert_eq!(fs::read(service.join("ledger.damaged-1")).unwrap(), damaged);
    assert_eq!(health(&http)["damaged"], "ledger.damaged-1");
    let refused = begin(&http, &to(1.0), Some("key"));
    assert_eq!(
        (refused.status, &refused.json()["code"]),
        (503, &json!("storage"))
    );
    let told = http.events(0);
    let told = told.iter().filter(|event| event.kind == "warning");
    let told: Vec<_> = told.map(|event| event.data["text"].to_string()).collect();
    assert!(
        told.iter().any(|text| text.contains("ledger.damaged-1")),
        "{told:?}"
    );
    let accepted = http.post(&anna(), "/v1/ledger/accept", "", &json!({}));
    assert_eq!(accepted.status, 200, "{accepted:?}");
    let taken = begin(&http, &to(1.0), Some("key"));
    assert_eq!(taken.status, 201, "{taken:?}");
    drop(http);
    stage.end();
}
