//! `truestage serve` as a user runs it: one process keeps the machine, any client asks it.

use std::fs;
use std::io::{Read, Write};
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::process::Command;

use nix::sys::signal::Signal;
use serde_json::{Value, json};
use tests::Edit;

use crate::held::{Brake, Steps};
use crate::programs::{Bench, Process, SOCKET, live_rigs, number, program};

pub(crate) fn ask(folder: &Path, request: &str, body: &Value) -> (u16, Value) {
    let (status, said) = fetch(folder, request, body);
    let json = serde_json::from_str(&said).unwrap_or_else(|error| panic!("{error}: {said}"));
    (status, json)
}

/// The status of an answer, and its body as it is.
pub(crate) fn fetch(folder: &Path, request: &str, body: &Value) -> (u16, String) {
    fetch_with(folder, request, "", body)
}

/// The same with more `headers`, each with the end of its line.
pub(crate) fn fetch_with(
    folder: &Path,
    request: &str,
    headers: &str,
    body: &Value,
) -> (u16, String) {
    let mut stream = UnixStream::connect(folder.join(SOCKET)).expect("it listens");
    let body = body.to_string();
    let length = body.len();
    let head = format!(
        "{request} HTTP/1.1\r\n{headers}host: x\r\nconnection: close\r\ncontent-length: {length}"
    );
    stream
        .write_all(format!("{head}\r\n\r\n{body}").as_bytes())
        .expect("it hears");
    let mut said = String::new();
    stream.read_to_string(&mut said).expect("it answers");
    let status = said.split(' ').nth(1).and_then(|it| it.parse().ok());
    let body = said.split_once("\r\n\r\n").map_or("", |it| it.1);
    (status.expect("a status"), body.to_owned())
}

pub(crate) fn keep(bench: &Bench) -> Process {
    let mut service = bench.start(&["serve", "machine.toml", "--listen", "unix:truestage.sock"]);
    // The last that it does before it only listens: other programs find it by this.
    let lease = bench.records().join("lease");
    // One that was killed before may have left its own.
    let own = format!("process {}\n", service.id());
    let says_where = || {
        let said = std::fs::read_to_string(&lease);
        said.is_ok_and(|it| it.contains(&own) && it.contains("listening at"))
    };
    service.wait_until(says_where);
    service
}

#[test]
fn a_machine_is_kept_zeroed_over_many_requests_and_given_back_at_the_end() {
    for rig in live_rigs() {
        let bench = Bench::new(rig);
        // A slow motion has all the time that it wants: the clock here is as fast as the computer.
        bench.configure("machine.toml", |text| {
            text.edit("move_timeout_s = 10.0", "move_timeout_s = 100000.0")
        });
        let service = keep(&bench);
        let folder = bench.folder();
        let (status, run) = ask(
            folder,
            "POST /v1/runs",
            &json!({"kind": "zero", "start": true}),
        );
        assert_eq!(status, 201, "{run}");
        let id = run["id"].as_str().expect("it has a name");
        let (_, run) = ask(folder, &format!("GET /v1/runs/{id}?wait_s=120"), &json!({}));
        assert_eq!(run["state"], "done", "{run}");
        for mm in [12.5, -1.0] {
            let body =
                json!({"targets": {"x": {"value": mm, "unit": "mm"}}, "uncompensated": true});
            let (status, motion) = ask(folder, "POST /v1/motions", &body);
            assert_eq!(status, 201, "{motion}");
            let id = motion["id"].as_str().expect("it has a name");
            let (_, motion) = ask(
                folder,
                &format!("GET /v1/motions/{id}?wait_s=60"),
                &json!({}),
            );
            assert_eq!(motion["state"], "done", "{motion}");
            let stands = number(&motion["axes"]["x"]["encoder"]["value"]);
            assert!((stands - mm).abs() < 0.001, "{motion}");
        }
        let status = bench.run(&["status"]).with_code(0);
        assert_eq!(status["machine"]["state"], "running", "{status}");
        assert_eq!(status["axes"][0]["homed"], true, "{status}");
        // Wherever it listens, the machine's records say so.
        let named = bench.run(&["status", "machine.toml"]).with_code(0);
        assert_eq!(named["machine"]["name"], status["machine"]["name"]);
        // Slowly: it would take minutes.
        let body = json!({"targets": {"x": "60mm"}, "speed": "0.1mm/s", "uncompensated": true});
        let (status, motion) = ask(folder, "POST /v1/motions", &body);
        assert_eq!(status, 201, "{motion}");
        bench.run(&["stop"]).with_code(0);
        let id = motion["id"].as_str().expect("it has a name");
        let (_, motion) = ask(
            folder,
            &format!("GET /v1/motions/{id}?wait_s=60"),
            &json!({}),
        );
        assert_eq!(motion["state"], "stopped", "{motion}");
        assert!(
            motion["stopped"]["by"].to_string().contains("uid"),
            "{motion}"
        );
        service.signal(Signal::SIGTERM);
        let ended = service.end();
        assert_eq!(ended.code, Some(0), "{ended:?}");
        assert!(!folder.join(SOCKET).exists());
        // The machine is free again.
        bench.run(&["zero", "machine.toml"]).with_code(0);
    }
}

/// What a verb prints for people.
fn say(bench: &Bench, words: &[&str]) -> String {
    say_with_lease(bench, words, "")
}

fn say_with_lease(bench: &Bench, words: &[&str], token: &str) -> String {
    let mut command = Command::new(program("truestage"));
    command.current_dir(bench.folder()).args(words);
    let output = command.env("TRUESTAGE_LEASE", token).output();
    let output = output.expect("it can be started");
    assert!(output.status.success(), "{output:?}");
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// The names of what an object says.
fn names(value: &Value) -> Vec<String> {
    let members = value.as_object().expect("an object");
    let mut names: Vec<_> = members.keys().cloned().collect();
    names.sort();
    names
}

/// The same verbs, with and without a service that keeps the machine, say the same.
#[test]
fn the_verbs_of_the_cycle_go_through_a_service_that_keeps_the_machine() {
    let verbs: [&[&str]; 5] = [
        &["zero", "machine.toml"],
        &["verify", "machine.toml", "--uncompensated"],
        &["calibrate", "machine.toml"],
        &["verify", "machine.toml"],
        &["move", "machine.toml", "x=12.5mm"],
    ];
    for rig in live_rigs() {
        let bench = Bench::new(rig);
        let here: Vec<_> = verbs.map(|verb| bench.run(verb).with_code(0)).into();
        let service = keep(&bench);
        for (verb, here) in verbs.iter().zip(&here) {
            let there = bench.run(verb).with_code(0);
            assert_eq!(names(&there), names(here), "{verb:?}: {there}");
        }
        let moved = bench.run(&["move", "machine.toml", "x=20mm"]).with_code(0);
        let moved = &moved["moves"][0];
        assert_eq!(names(moved), names(&here[4]["moves"][0]), "{moved}");
        assert!((number(&moved["place_mm"]) - 20.0).abs() < 0.001, "{moved}");
        assert_eq!(moved["corrected"], "yes");
        let texts = [
            &["zero", "machine.toml"][..],
            &["move", "machine.toml", "x=1mm"],
        ];
        for (verb, said) in texts.iter().zip(["zero found", "the point stands at"]) {
            let told = say(&bench, verb);
            assert!(told.contains(said), "{told}");
        }
        // What it refuses ends as it would end here, and nothing moves.
        let beyond = bench.run(&["move", "machine.toml", "x=999mm"]).with_code(3);
        assert!(
            beyond["error"].to_string().contains("soft limit"),
            "{beyond}"
        );
        for option in ["--no-activate", "--verify", "--accept-drift"] {
            let words = ["calibrate", "machine.toml", option, "--resume"];
            let refused = bench.run(&words).with_code(2);
            let said = refused["error"].to_string();
            assert!(said.contains(&format!("{option} with --resume")), "{said}");
        }
        let resumed = bench.run(&["calibrate", "machine.toml", "--resume"]);
        let resumed = resumed.with_code(2);
        assert!(
            resumed["error"].to_string().contains("was interrupted"),
            "{resumed}"
        );
        // Whoever has the lease commands; nobody else does.
        let body = json!({"name": "anna", "seconds": 3600});
        let (_, lease) = ask(bench.folder(), "POST /v1/lease", &body);
        let refused = bench.run(&["move", "machine.toml", "x=2mm"]).with_code(3);
        assert!(refused["error"].to_string().contains("anna"), "{refused}");
        let token = lease["token"].as_str().expect("a token");
        let moved = say_with_lease(&bench, &["move", "machine.toml", "x=2mm"], token);
        assert!(moved.contains("the point stands at"), "{moved}");
        service.signal(Signal::SIGTERM);
        assert_eq!(service.end().code, Some(0));
    }
}

/// What runs measured can be asked for, and looked at.
#[test]
fn a_service_shows_the_journals_of_runs_and_their_pages() {
    for rig in live_rigs() {
        let bench = Bench::new(rig);
        bench.run(&["calibrate", "machine.toml"]).with_code(0);
        let service = keep(&bench);
        let folder = bench.folder();
        let get = |path: &str| fetch(folder, &format!("GET /v1/{path}"), &json!({}));
        let (_, journals) = ask(folder, "GET /v1/journals", &json!({}));
        // Here both are of the same second.
        let of = |verb: &str| {
            let all = journals.as_array().expect("a list");
            let found = all.iter().find(|it| it["verb"] == verb);
            found.unwrap_or_else(|| panic!("no {verb}: {journals}"))
        };
        let (calibration, zero) = (of("calibrate"), of("zero"));
        assert_eq!(zero["complete"], true, "{zero}");
        assert_eq!(
            (&calibration["axis"], &calibration["complete"]),
            (&json!("x"), &json!(true))
        );
        let name = calibration["name"].as_str().expect("a name");
        let (status, journal) = get(&format!("journals/{name}"));
        let stored = std::fs::read_to_string(bench.records().join(format!("runs/{name}.jsonl")));
        assert_eq!((status, journal), (200, stored.expect("it is there")));
        let (status, page) = get(&format!("reports/{name}"));
        assert_eq!(status, 200, "{page}");
        assert!(
            page.starts_with("<!doctype html>") && page.contains("</svg>"),
            "{page}"
        );
        // A file is called so, too, and a run of this service by its own name.
        assert_eq!(get(&format!("reports/{name}.jsonl")), (200, page));
        bench.run(&["zero", "machine.toml"]).with_code(0);
        let (_, runs) = ask(folder, "GET /v1/runs", &json!({}));
        let run = runs.as_array().and_then(|it| it.last()).expect("a zero");
        assert_eq!(run["journal"], run["result"]["journal"], "{run}");
        let id = run["id"].as_str().expect("a name");
        let (status, journal) = get(&format!("journals/{id}"));
        let stored = run["journal"].as_str().expect("where it is");
        let stored = std::fs::read_to_string(bench.folder().join(stored));
        assert_eq!((status, journal), (200, stored.expect("it is there")));
        let (status, said) = get(&format!("reports/{id}"));
        assert_eq!(status, 200, "{said}");
        let (_, axis) = ask(folder, "GET /v1/axes/x", &json!({}));
        assert!(axis["calibration_created"].is_string(), "{axis}");
        let (_, metrics) = fetch(folder, "GET /metrics", &json!({}));
        let age = "truestage_calibration_created_timestamp_seconds{axis=\"x\"} ";
        assert!(metrics.contains(age), "{metrics}");
        // Nothing but journals has a name.
        for other in [
            "journals/nobody",
            "journals/..%2Flease",
            "reports/..%2F..%2Fmachine",
            "reports/nobody",
        ] {
            let (status, said) = get(other);
            assert_eq!(status, 404, "{other}: {said}");
        }
        service.signal(Signal::SIGTERM);
        assert_eq!(service.end().code, Some(0));
    }
}

/// Whether a calibration has written down a point.
fn has_measured(bench: &Bench) -> bool {
    let Ok(runs) = fs::read_dir(bench.records().join("runs")) else {
        return false;
    };
    let paths = runs.map(|entry| entry.expect("a folder can be read").path());
    paths
        .filter(|path| path.to_string_lossy().contains("-calibrate-"))
        .any(|path| fs::read_to_string(path).is_ok_and(|text| text.contains("\"point\"")))
}

/// A client whose calibration goes on, slowly until the second is dropped.
fn calibrating(bench: &Bench) -> (Process, Brake) {
    bench.run(&["zero", "machine.toml"]).with_code(0);
    let mut client = bench.start(&["calibrate", "machine.toml"]);
    let mut time = Steps::of(bench);
    time.until(&mut client, || {
        let (_, axis) = ask(bench.folder(), "GET /v1/axes/x", &json!({}));
        axis["used_by"].is_string() && has_measured(bench)
    });
    (client, time.slowly())
}

/// A service that is killed is no mistake of whoever waits for it.
#[test]
fn a_service_that_is_killed_in_a_run_is_told_as_gone() {
    for rig in live_rigs() {
        let bench = Bench::new(rig);
        let service = keep(&bench);
        let (client, brake) = calibrating(&bench);
        service.signal(Signal::SIGKILL);
        drop(brake);
        let ended = client.end();
        assert_eq!(ended.code, Some(4), "{ended:?}");
        assert_eq!(service.end().code, None);
    }
}

/// Ctrl-C ends what was asked for, not the service.
#[test]
fn a_signal_to_the_client_stops_its_run_and_leaves_the_machine_kept() {
    for rig in live_rigs() {
        let bench = Bench::new(rig);
        let service = keep(&bench);
        let (client, brake) = calibrating(&bench);
        client.signal(Signal::SIGINT);
        let ended = client.end();
        drop(brake);
        assert_eq!(ended.code, Some(130), "{ended:?}");
        let status = bench.run(&["status"]).with_code(0);
        assert_eq!(status["machine"]["state"], "running", "{status}");
        assert_eq!(status["axes"][0]["state"], "Standstill", "{status}");
        assert!(ended.said.contains("--resume"), "{ended:?}");
        let made = bench.run(&["calibrate", "machine.toml", "--resume"]);
        assert!(made.with_code(0)["calibration"].is_string());
        service.signal(Signal::SIGTERM);
        assert_eq!(service.end().code, Some(0));
    }
}

/// Only who has the lease may pause or abort a run, and anybody may stop it: a Ctrl-C is never lost.
#[test]
fn a_signal_to_the_client_stops_everything_where_somebody_else_has_the_lease() {
    for rig in live_rigs() {
        let bench = Bench::new(rig);
        let service = keep(&bench);
        let (client, brake) = calibrating(&bench);
        let body = json!({"name": "anna", "seconds": 3600});
        let (status, lease) = ask(bench.folder(), "POST /v1/lease", &body);
        assert_eq!(status, 200, "{lease}");
        client.signal(Signal::SIGINT);
        let ended = client.end();
        drop(brake);
        assert_eq!(ended.code, Some(130), "{ended:?}");
        for said in [
            "anna (uid ",
            " has the lease",
            "everything is stopped instead",
        ] {
            assert!(ended.said.contains(said), "{ended:?}");
        }
        let status = bench.run(&["status"]).with_code(0);
        assert_eq!(status["axes"][0]["state"], "Standstill", "{status}");
        // What ended it does not matter: it goes on, as without a service.
        let token = lease["token"].as_str().expect("a token");
        let words = ["calibrate", "machine.toml", "--resume"];
        say_with_lease(&bench, &words, token);
        let (_, runs) = ask(bench.folder(), "GET /v1/runs", &json!({}));
        let last = runs.as_array().and_then(|it| it.last()).expect("a run");
        let told = (&last["kind"], &last["state"], &last["begun"]);
        assert_eq!(told, (&json!("calibrate"), &json!("done"), &json!(2)));
        service.signal(Signal::SIGTERM);
        assert_eq!(service.end().code, Some(0));
    }
}
