//! Signs of life of the machine's thread among events.

use std::io::{BufRead, BufReader};

use serde_json::Value;

use crate::client::Client;
use crate::edge::on_a_stage;

/// A page counts on it, whatever else it asks for.
#[test]
fn a_stream_tells_that_the_machines_thread_lives() {
    on_a_stage(|stage, http| {
        let _passing = stage.gate.wait_for_an_end();
        let head = "GET /v1/events?kinds=calibration HTTP/1.1";
        let mut lines = BufReader::new(http.send(head, b"")).lines();
        let mut clocks = Vec::new();
        while clocks.len() < 3 {
            let line = lines.next().expect("it goes on").expect("a line in time");
            assert!(!line.starts_with("id:"), "{line}");
            if let Some(data) = line.strip_prefix("data: ") {
                let said: Value = serde_json::from_str(data).expect("JSON");
                clocks.push(said["clock_s"].as_f64().expect("seconds"));
            }
        }
        assert!(clocks.is_sorted_by(|a, b| a < b), "{clocks:?}");
        let events = http.events(0);
        assert!(events.iter().all(|event| event.kind != "alive"));
    });
}
