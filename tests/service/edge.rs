//! What only HTTP has: units, problems, hosts, sizes, streams, its description.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::os::unix::fs::PermissionsExt;
use std::os::unix::net::UnixStream;
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use service::{Access, Caller, Edge, Listen, RunKind, RunRequest, RunState};
use tests::LINEAR;

use crate::client::{Client, PATIENCE};
use crate::http::Http;
use crate::stage::Stage;

pub(crate) fn on_a_stage(body: impl FnOnce(&Stage, &Http)) {
    let folder = tempfile::tempdir().unwrap();
    let rig = tests::rigs()[0];
    let stage = Stage::new(rig, (LINEAR, 51), folder.path(), |text| text);
    let http = Http::of(&stage);
    body(&stage, &http);
    drop(http);
    stage.end();
}

#[test]
fn a_quantity_without_a_unit_is_refused_with_what_to_write() {
    on_a_stage(|_, http| {
        for body in [
            r#"{"targets": {"x": 12.5}}"#,
            r#"{"targets": {"x": "12.5"}}"#,
            r#"{"targets": {"x": "1mm"}, "speed": 20}"#,
        ] {
            let answer = http.ask("POST /v1/motions HTTP/1.1", body.as_bytes());
            assert_eq!(answer.status, 400, "{answer:?}");
            let problem = answer.json();
            assert_eq!(problem["code"], "bad_quantity", "{problem}");
            let cause = problem["cause"].as_str().unwrap();
            assert!(cause.contains("mm"), "{problem}");
        }
    });
}

#[test]
fn a_problem_has_the_members_of_rfc_9457_and_ours() {
    on_a_stage(|_, http| {
        let body = br#"{"targets": {"x": {"value": 1, "unit": "mm"}}}"#;
        let answer = http.ask("POST /v1/motions HTTP/1.1", body);
        assert!(
            answer.head.contains("application/problem+json"),
            "{answer:?}"
        );
        let problem = answer.json();
        assert_eq!(answer.status, 409);
        assert_eq!(
            problem,
            json!({
                "type": "urn:truestage:problem:not_zeroed",
                "title": "not zeroed",
                "status": 409,
                "detail": "axis x: not zeroed since power-on; run `truestage zero` first",
                "code": "not_zeroed",
                "cause": "axis x: not zeroed since power-on; run `truestage zero` first",
                "help": "",
                "exit_code": 3,
            })
        );
    });
}

#[test]
fn whatever_is_sent_is_answered_with_a_problem() {
    on_a_stage(|_, http| {
        let large = vec![b' '; 100_000];
        let cases: [(&str, &[u8], u16); 8] = [
            ("GET /nowhere HTTP/1.1", b"", 404),
            ("DELETE /v1/machine HTTP/1.1", b"", 405),
            ("POST /v1/motions HTTP/1.1", b"{", 400),
            (
                "POST /v1/motions HTTP/1.1",
                b"{\"targets\": {}, \"more\": 1}",
                400,
            ),
            ("POST /v1/motions HTTP/1.1", &large, 413),
            ("GET /v1/motions/m0-0?wait_s=-1 HTTP/1.1", b"", 400),
            ("GET /v1/motions/m0-0?wait=1 HTTP/1.1", b"", 400),
            ("GET /v1/axes/%1b%5b31m HTTP/1.1", b"", 404),
        ];
        for (head, body, status) in cases {
            let answer = http.ask(head, body);
            assert_eq!(answer.status, status, "{head}: {answer:?}");
            let problem = answer.json();
            assert_eq!(problem["status"], status, "{head}: {problem}");
            assert!(!answer.body.contains(&0x1b), "{head}: {problem}");
        }
    });
}

/// A key that is written wrongly must not keep a machine going.
#[test]
fn a_stop_stops_whatever_its_body_says_and_tells_what_was_not_understood() {
    on_a_stage(|_, http| {
        let who = Caller::named("anna");
        http.zero(&who, None);
        let large = vec![b'x'; 70_000];
        let cases: [&[u8]; 7] = [
            br#"{"mode": "QUICK"}"#,
            br#"{"mode": null}"#,
            br#"{"now": true}"#,
            b"[]",
            b"\xff\x00 not JSON",
            b"{",
            &large,
        ];
        for body in cases {
            let run = RunRequest::of(RunKind::Zero, None);
            let id = http.plan(&who, &run).unwrap();
            let answer = http.ask("POST /v1/stop HTTP/1.1", body);
            let said = answer.json();
            assert_eq!(
                (answer.status, &said["done"]),
                (200, &json!(true)),
                "{said}"
            );
            let warning = said["warning"].as_str().expect("it was not understood");
            assert!(warning.contains("stopped (controlled)"), "{warning}");
            let run = http.run(&id, PATIENCE).unwrap();
            assert_eq!(run.state, RunState::Stopped, "{run:?}");
        }
        let plain = http.ask("POST /v1/stop HTTP/1.1", br#"{"mode": "controlled"}"#);
        assert_eq!(plain.json(), json!({"done": true}));
        // What is understood of it counts.
        http.zero(&who, None);
        let more = br#"{"mode": "quick", "more": 1}"#;
        let said = http.ask("POST /v1/stop HTTP/1.1", more).json();
        let warning = said["warning"].as_str().expect("there is more");
        assert!(warning.contains("stopped (quick)"), "{warning}");
    });
}

/// Whoever promises a body and sends none of it wants a stop all the same.
#[test]
fn a_stop_does_not_wait_for_a_body_that_does_not_come() {
    on_a_stage(|stage, http| {
        let id = http
            .plan(&Caller::named("anna"), &RunRequest::of(RunKind::Zero, None))
            .unwrap();
        let mut stream = UnixStream::connect(http.socket()).unwrap();
        let head =
            "POST /v1/stop HTTP/1.1\r\nhost: x\r\ncontent-length: 20\r\nconnection: close\r\n\r\n{";
        stream.write_all(head.as_bytes()).unwrap();
        let mut said = String::new();
        {
            let _passing = stage.gate.pass();
            stream.read_to_string(&mut said).unwrap();
        }
        assert!(said.starts_with("HTTP/1.1 200 "), "{said}");
        assert!(said.contains("had not come as a whole"), "{said}");
        let run = http.run(&id, PATIENCE).unwrap();
        assert_eq!(run.state, RunState::Stopped, "{run:?}");
    });
}

/// A controller of another kind sends its order and closes its end.
#[test]
fn a_stop_of_whoever_closes_his_end_at_once_is_carried_out() {
    on_a_stage(|_, http| {
        for _ in 0..5 {
            let id = http
                .plan(&Caller::named("anna"), &RunRequest::of(RunKind::Zero, None))
                .unwrap();
            let mut stream = UnixStream::connect(http.socket()).unwrap();
            stream
                .write_all(b"POST /v1/stop HTTP/1.1\r\nhost: x\r\n\r\n")
                .unwrap();
            drop(stream);
            let run = http.run(&id, PATIENCE).unwrap();
            assert_eq!(run.state, RunState::Stopped, "{run:?}");
        }
    });
}

#[test]
fn a_page_from_elsewhere_cannot_move_a_stage() {
    on_a_stage(|stage, _| {
        let any = "tcp:127.0.0.1:0".parse::<Listen>().unwrap();
        let edge = Edge::open(stage.desk.clone(), &[any], &Access::default()).unwrap();
        let Listen::Tcp(address) = edge.places()[0] else {
            panic!("it is TCP")
        };
        let ask = |headers: &str| {
            let _passing = stage.gate.pass();
            let mut stream = TcpStream::connect(address).unwrap();
            let request = format!(
                "POST /v1/stop HTTP/1.1\r\n{headers}\r\nconnection: close\r\ncontent-length: 2\r\n\r\n{{}}"
            );
            stream.write_all(request.as_bytes()).unwrap();
            let mut said = String::new();
            stream.read_to_string(&mut said).unwrap();
            said.split(' ').nth(1).unwrap().parse::<u16>().unwrap()
        };
        assert_eq!(ask(&format!("host: {address}")), 200);
        assert_eq!(
            ask(&format!("host: {address}\r\norigin: http://{address}")),
            200
        );
        assert_eq!(
            ask(&format!("host: {address}\r\norigin: http://evil.example")),
            403
        );
        assert_eq!(ask("host: evil.example"), 403);
        // Whichever of two comes first: nobody judges the other one.
        let own = format!("host: {address}");
        let page = format!("{own}\r\norigin: http://{address}");
        assert_eq!(ask(&format!("{own}\r\nhost: evil.example")), 400);
        assert_eq!(ask(&format!("host: evil.example\r\n{own}")), 400);
        assert_eq!(ask(&format!("{page}\r\norigin: http://evil.example")), 400);
    });
}

/// Whoever can open the socket may call himself what he likes.
#[test]
fn a_name_on_the_socket_is_followed_by_the_user_wherever_it_is_shown() {
    on_a_stage(|stage, http| {
        let user = crate::http::user();
        let anna = format!("anna{user}");
        let ask = |head: &str, body: Value| {
            let head = format!("{head} HTTP/1.1\r\ntruestage-client: anna (uid 0)");
            http.ask(&head, body.to_string().as_bytes()).json()
        };
        let leased = ask("POST /v1/lease", json!({"name": "anna"}));
        assert_eq!(stage.desk.machine().lease.unwrap().name, anna);
        let token = leased["token"].as_str().unwrap();
        let release = format!("DELETE /v1/lease HTTP/1.1\r\ntruestage-lease: {token}");
        assert_eq!(http.ask(&release, b"").status, 200);
        let forger = format!("anna uid 0{user}");
        let run = ask("POST /v1/runs", json!({"kind": "zero", "start": true}));
        assert_eq!(run["by"], forger, "{run}");
        ask("POST /v1/stop", json!({}));
        let id = run["id"].as_str().unwrap();
        http.run(id, PATIENCE).unwrap();
        let stopped = stage.desk.run(id).unwrap().stopped.unwrap();
        assert_eq!(stopped.by, forger);
        let events = stage.desk.events(0);
        let by = |kind: &str, name: &str| {
            let event = events.iter().find(|it| it.kind == kind).unwrap();
            event.data[name].clone()
        };
        assert_eq!(
            (by("lease", "name"), by("stop", "by")),
            (json!(anna), json!(forger))
        );
    });
}

#[test]
fn only_the_owner_and_the_group_may_use_the_socket() {
    on_a_stage(|_, http| {
        let mode = std::fs::metadata(http.socket())
            .unwrap()
            .permissions()
            .mode();
        assert_eq!(mode & 0o777, 0o660);
    });
}

#[test]
fn a_stream_of_events_goes_on_where_it_was_broken_off() {
    on_a_stage(|_, http| {
        let who = Caller::named("anna");
        http.power(&who, "x", true).unwrap();
        http.power(&who, "x", false).unwrap();
        let newest = http.machine().newest_event;
        let whole = http.stream("GET /v1/events?after=0 HTTP/1.1", newest);
        let broken = whole[1].id;
        let rest = http.stream(
            &format!("GET /v1/events HTTP/1.1\r\nlast-event-id: {broken}"),
            newest,
        );
        assert_eq!(rest, whole[2..]);
        // A service that was started again counts from 1.
        let of_before = "GET /v1/events HTTP/1.1\r\nlast-event-id: 1000000";
        assert_eq!(http.stream(of_before, newest), whole);
        let axes = http.stream("GET /v1/events?after=0&kinds=axis HTTP/1.1", {
            let last = whole.iter().rfind(|it| it.kind == "axis");
            last.unwrap().id
        });
        assert!(
            axes.len() >= 2 && axes.iter().all(|it| it.kind == "axis"),
            "{axes:?}"
        );
    });
}

/// That a service ends is the last that whoever follows it hears: not that the connection was lost.
#[test]
fn a_stream_says_that_the_service_ends_before_it_is_closed() {
    let folder = tempfile::tempdir().unwrap();
    let stage = Stage::new(tests::rigs()[0], (LINEAR, 51), folder.path(), |text| text);
    let http = Http::of(&stage);
    let stream = http.send("GET /v1/events?after=0 HTTP/1.1", b"");
    let mut lines = BufReader::new(stream).lines();
    // It is open: what happened before is on its way.
    let first = lines.find(|it| it.as_ref().is_ok_and(|it| it.starts_with("data: ")));
    assert!(first.is_some());
    stage.end();
    drop(http);
    let rest: Vec<String> = lines.map(|it| it.expect("it ends in order")).collect();
    let is_last_word = |it: &String| it.starts_with("data: ") && it.contains(r#""state":"ending""#);
    assert!(rest.iter().any(is_last_word), "{rest:?}");
    assert_eq!(
        rest.last().map(String::as_str),
        Some(""),
        "its last chunk is there"
    );
}

/// Whoever hears nothing for ten seconds takes the service for lost.
#[test]
fn a_stream_in_which_nothing_happens_says_that_it_is_alive() {
    on_a_stage(|_, http| {
        let mut stream = UnixStream::connect(http.socket()).unwrap();
        stream
            .set_read_timeout(Some(Duration::from_secs(60)))
            .unwrap();
        stream
            .write_all(b"GET /v1/events HTTP/1.0\r\nhost: x\r\n\r\n")
            .unwrap();
        let begun = Instant::now();
        let mut lines = BufReader::new(stream)
            .lines()
            .map(|line| line.expect("it is not silent"));
        assert!(lines.any(|line| line == ":"), "a comment");
        assert!(begun.elapsed() < Duration::from_secs(10));
    });
}

#[test]
fn the_page_comes_with_a_policy_that_lets_nothing_in_from_elsewhere() {
    on_a_stage(|_, http| {
        for (path, kind) in [
            ("/", "text/html"),
            ("/page.css", "text/css"),
            ("/page.js", "text/javascript"),
            ("/feed.js", "text/javascript"),
            ("/link.js", "text/javascript"),
            ("/stop.js", "text/javascript"),
            ("/stream.js", "text/javascript"),
        ] {
            let answer = http.ask(&format!("GET {path} HTTP/1.1"), b"");
            assert_eq!(answer.status, 200, "{path}");
            let policy = "content-security-policy: default-src 'self'";
            assert!(answer.head.contains(policy), "{answer:?}");
            assert!(answer.head.contains(kind), "{answer:?}");
        }
    });
}

#[test]
fn what_there_is_is_described_and_counted() {
    on_a_stage(|stage, http| {
        let description = http.ask("GET /openapi.json HTTP/1.1", b"").json();
        assert_eq!(description["openapi"], "3.1.0");
        assert!(description["paths"]["/v1/motions"]["post"].is_object());
        let health: Value = http.ask("GET /healthz HTTP/1.1", b"").json();
        let storage = json!({"ok": true, "cause": null, "damaged": null});
        assert_eq!(health, json!({"state": "running", "storage": storage}));
        let metrics = http.ask("GET /metrics HTTP/1.1", b"");
        let text = String::from_utf8(metrics.body).unwrap();
        assert!(text.contains("truestage_running 1\n"), "{text}");
        assert!(
            text.contains("truestage_axis_homed{axis=\"x\"} 0\n"),
            "{text}"
        );
        for figure in ["load_ratio", "frames_total", "errors_total"] {
            let line = format!("\ntruestage_bus_{figure}{{bus=\"can0\"}} ");
            assert!(text.contains(&line), "{text}");
        }
        assert!(
            !text.contains("sync_lateness"),
            "no thread sends SYNCs in simulated time: {text}"
        );
        // Figures are taken once a second of the machine's time.
        let _passing = stage.gate.wait_for_an_end();
        let frames = "truestage_bus_frames_total{bus=\"can0\"} ";
        let is_counted = |_| {
            let text = String::from_utf8(http.ask("GET /metrics HTTP/1.1", b"").body).unwrap();
            let count = text.lines().find_map(|it| it.strip_prefix(frames));
            count.is_some_and(|it| it.parse::<u64>().unwrap() > 100)
        };
        assert!((0..100_000).any(is_counted), "nothing is counted");
    });
}

/// Somebody who begins requests and never ends them has all places, until somebody comes who says one.
#[test]
fn half_a_request_keeps_nobody_out() {
    /// So many are served at once.
    const PLACES: usize = 64;
    /// After so long they would have been closed anyway.
    const SAYING_MAX: Duration = Duration::from_secs(10);
    on_a_stage(|stage, _| {
        let any = "tcp:127.0.0.1:0".parse().unwrap();
        let edge = Edge::open(stage.desk.clone(), &[any], &Access::default()).unwrap();
        let Listen::Tcp(address) = edge.places()[0] else {
            panic!("it is TCP")
        };
        let say = |text: &str| {
            let mut stream = TcpStream::connect(address).unwrap();
            stream.write_all(text.as_bytes()).unwrap();
            stream
        };
        let head = "POST /v1/stop HTTP/1.1\r\nhost: 127.0.0.1\r\n";
        let body = format!("{head}content-length: 2\r\n\r\n{{");
        let whole = format!("{head}connection: close\r\ncontent-length: 2\r\n\r\n{{}}");
        let wait = "GET /v1/motions/m0-0?wait_s=300 HTTP/1.1\r\nhost: 127.0.0.1\r\n\r\n";
        let begun = Instant::now();
        // Nothing, half a head, half a body, and whoever waits for an end: three times as many as there are places.
        let kinds = ["", head, &body, wait];
        let kinds = kinds.iter().cycle().take(3 * PLACES);
        let silent: Vec<_> = kinds.map(|it| say(it)).collect();
        let _passing = stage.gate.pass();
        let mut said = String::new();
        say(&whole).read_to_string(&mut said).unwrap();
        assert!(said.starts_with("HTTP/1.1 200 "), "{said}");
        if begun.elapsed() > SAYING_MAX {
            let why = "it took so long that all of them were closed anyway";
            tests::not_run("half_a_request_keeps_nobody_out", why);
        }
        drop(silent);
    });
}
