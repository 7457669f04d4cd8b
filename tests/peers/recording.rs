//! python-can reads our recordings.

use drivers::transport::Transport;
use drivers::transport::record::Recorder;
use drivers::transport::replay::Replay;
use serde_json::{Value, json};
use units::Time;
use wire::can::CanFrame;
use wire::{Payload, Port};

use crate::peer::Peer;

const BUS: Port = Port(0);

/// Standard, extended, remote, empty, an error frame, and a comment.
const HEARD: &str = "\
(0000000000.001000) can0 581#4300100092010200 R
(0000000001.001500) can0 12345678#DEADBEEF R
(0000000002.002000) can0 705#R1 R
(0000000002.002001) can0 080# R
# (0000000003.000000) can0 link down
(0000000004.000000) can0 20000080#0000000000000000 R
";

/// What a recorder writes when all that was heard and one frame was sent.
fn recording() -> String {
    let replay = Replay::parse(HEARD, &[]).expect("the text is a recording");
    let mut text = Vec::new();
    let mut recorder = Recorder::new(replay, &mut text, &[(BUS, "can0")]).expect("memory");
    while recorder.receive(Time(5_000_000_000)).is_some() {}
    let request = CanFrame::standard(0x601, &[0x40, 0, 0x10, 0, 0, 0, 0, 0]);
    recorder
        .send(BUS, &Payload::Frame(request))
        .expect("a replay takes everything");
    recorder.finish().expect("memory takes every line");
    String::from_utf8(text).expect("a recording is text")
}

fn message(at: f64, id: u32, data: &str) -> Value {
    json!({
        "at": at, "interface": "can0", "id": id, "extended": id > 0x7FF, "remote": false,
        "error": false, "received": true, "length": data.len() / 2, "data": data,
    })
}

#[test]
fn python_can_reads_the_can_lines_of_a_recording() {
    let text = recording();
    assert!(text.contains("link down"), "{text}");
    // can-utils skip what does not begin with a time stamp; python-can's reader does not.
    let lines: String = text
        .lines()
        .filter(|line| line.starts_with('('))
        .flat_map(|line| [line, "\n"])
        .collect();
    let mut reader = Peer::start("read_log.py", &[]);
    reader.feed(&lines);
    let read = reader.finish();
    let messages = read["messages"].as_array().expect("a list of messages");
    assert_eq!(messages.len(), 6, "{read}");
    assert_eq!(messages[0], message(0.001, 0x581, "4300100092010200"));
    assert_eq!(messages[1], message(1.0015, 0x1234_5678, "deadbeef"));
    assert_eq!(
        (&messages[2]["remote"], &messages[2]["length"]),
        (&json!(true), &json!(1))
    );
    assert_eq!(messages[3], message(2.002_001, 0x80, ""));
    assert_eq!(
        (&messages[4]["error"], &messages[4]["at"]),
        (&json!(true), &json!(4.0))
    );
    let mut sent = message(5.0, 0x601, "4000100000000000");
    sent["received"] = json!(false);
    assert_eq!(messages[5], sent);
}
