//! `truestage serve` as a user runs it: one process keeps the machine, any client asks it.

use std::io::{Read, Write};
use std::os::unix::net::UnixStream;
use std::path::Path;

use nix::sys::signal::Signal;
use serde_json::{Value, json};
use tests::Edit;

use crate::programs::{Bench, Process, live_rigs, number};

/// Below the machine's folder.
const SOCKET: &str = "truestage.sock";

fn ask(folder: &Path, request: &str, body: &Value) -> (u16, Value) {
    let mut stream = UnixStream::connect(folder.join(SOCKET)).expect("it listens");
    let body = body.to_string();
    let length = body.len();
    let head =
        format!("{request} HTTP/1.1\r\nhost: x\r\nconnection: close\r\ncontent-length: {length}");
    stream
        .write_all(format!("{head}\r\n\r\n{body}").as_bytes())
        .expect("it hears");
    let mut said = String::new();
    stream.read_to_string(&mut said).expect("it answers");
    let status = said.split(' ').nth(1).and_then(|it| it.parse().ok());
    let body = said.split_once("\r\n\r\n").map_or("", |it| it.1);
    let json = serde_json::from_str(body).unwrap_or_else(|error| panic!("{error}: {said}"));
    (status.expect("a status"), json)
}

fn keep(bench: &Bench) -> Process {
    let mut service = bench.start(&["serve", "machine.toml", "--listen", "unix:truestage.sock"]);
    let socket = bench.folder().join(SOCKET);
    service.wait_until(|| UnixStream::connect(&socket).is_ok());
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
        let refused = bench.run(&["move", "machine.toml", "x=1mm"]);
        let refused = refused.with_code(3);
        assert!(
            refused["error"].to_string().contains("truestage serve"),
            "{refused}"
        );
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
            let body = json!({"targets": {"x": {"value": mm, "unit": "mm"}}});
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
        // Slowly: it would take minutes.
        let body = json!({"targets": {"x": "60mm"}, "speed": "0.1mm/s"});
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
