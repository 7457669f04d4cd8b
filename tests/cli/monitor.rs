//! `truestage monitor`: what a kept machine does, as it happens.

use core::time::Duration;
use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};

use nix::sys::signal::Signal;
use serde_json::{Value, json};
use tests::json_schema::check_output;

use crate::programs::{Bench, live_rigs, program};
use crate::serve::{ask, keep};

/// Its lines go to a pipe.
fn monitor(bench: &Bench, words: &[&str]) -> Child {
    let mut command = Command::new(program("truestage"));
    command.current_dir(bench.folder()).args(words);
    let piped = command.stdin(Stdio::null()).stdout(Stdio::piped());
    piped
        .stderr(Stdio::piped())
        .spawn()
        .expect("it can be started")
}

#[test]
fn every_event_is_a_line_from_the_first_one_on_until_the_service_ends() {
    for rig in live_rigs() {
        let bench = Bench::new(rig);
        let service = keep(&bench);
        let mut objects = monitor(&bench, &["--json", "monitor", "--all"]);
        let mut texts = monitor(&bench, &["monitor", "--all"]);
        // Meanwhile the streams say that the machine's thread ticks, which is no event.
        std::thread::park_timeout(Duration::from_millis(1200));
        let (status, _) = ask(bench.folder(), "POST /v1/stop", &json!({}));
        assert_eq!(status, 200);
        let mut heard = BufReader::new(objects.stdout.take().expect("it is piped")).lines();
        let mut ids = Vec::new();
        loop {
            let line = heard
                .next()
                .expect("a stop comes")
                .expect("a program prints text");
            let event: Value = serde_json::from_str(&line).expect("an object a line");
            check_output(&event);
            ids.push(event["id"].as_u64().expect("a number"));
            if event["kind"] == "stop" {
                assert_eq!(event["data"]["mode"], "controlled", "{event}");
                break;
            }
        }
        let all: Vec<u64> = (1..).take(ids.len()).collect();
        assert_eq!(ids, all, "none is left out");
        let mut lines = BufReader::new(texts.stdout.take().expect("it is piped")).lines();
        let is_stop = |line: std::io::Result<String>| {
            line.expect("a program prints text")
                .contains("stop controlled by")
        };
        assert!(lines.any(is_stop));
        service.signal(Signal::SIGTERM);
        assert_eq!(service.end().code, Some(0));
        // To their end: who cannot print what it hears leaves earlier.
        heard.for_each(drop);
        lines.for_each(drop);
        for child in [objects, texts] {
            let ended = child.wait_with_output();
            let ended = ended.expect("a child can be waited for");
            assert_eq!(ended.status.code(), Some(0), "{ended:?}");
            let said = String::from_utf8_lossy(&ended.stderr);
            assert!(said.contains("the service has ended"), "{said}");
        }
        let nobody = bench.run(&["monitor"]);
        assert_eq!(nobody.code, Some(2), "{nobody:?}");
        assert!(nobody.said.contains("truestage serve"), "{nobody:?}");
    }
}
