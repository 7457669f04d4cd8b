//! What happened, in the system's own log (systemd-journald) beside what the service writes down itself: an entry for
//! each event, with its parts as fields, so that `journalctl` finds and sorts them.
//!
//! The protocol is that of <https://systemd.io/JOURNAL_NATIVE_PROTOCOL>: a datagram of lines `NAME=value`. Absent:
//! values of several lines, entries larger than a datagram, any other log.

use std::fs;
use std::io;
use std::os::unix::fs::MetadataExt;
use std::os::unix::net::UnixDatagram;
use std::path::Path;

use crate::desk::Desk;
use crate::manager::one_line;
use crate::view::Event;

const SOCKET: &str = "/run/systemd/journal/socket";
/// What is longer stands in the service's own journal alone.
const DATA_MAX: usize = 16 * 1024;

/// The journal of the system, as far as it was told.
pub(crate) struct SystemLog {
    socket: UnixDatagram,
    newest: u64,
}

impl SystemLog {
    /// Where standard error is the system's log; there may be none.
    pub(crate) fn of_environment() -> Option<Self> {
        let stream = std::env::var("JOURNAL_STREAM").ok()?;
        // Whatever a log's process starts inherits the variable, and may write elsewhere.
        let error = fs::metadata("/dev/stderr").ok()?;
        let is_log = stream == format!("{}:{}", error.dev(), error.ino());
        is_log.then(|| Self::at(Path::new(SOCKET)).ok())?
    }

    fn at(socket: &Path) -> io::Result<Self> {
        let log = UnixDatagram::unbound()?;
        log.connect(socket)?;
        // Nothing waits for a log.
        log.set_nonblocking(true)?;
        Ok(Self {
            socket: log,
            newest: 0,
        })
    }

    /// Tells what has happened since the last time.
    pub(crate) fn tell(&mut self, desk: &Desk) {
        for event in desk.events(self.newest) {
            self.newest = event.id;
            self.note(&event);
        }
    }

    /// What a log that is full or gone does not take is lost to it.
    fn note(&self, event: &Event) {
        let _ = self.socket.send(entry(event).as_bytes());
    }
}

fn entry(event: &Event) -> String {
    let mut data = event.data.to_string();
    if data.len() > DATA_MAX {
        data.clear();
    }
    let fields = [
        ("MESSAGE", message(event)),
        ("PRIORITY", priority(event).to_string()),
        ("SYSLOG_IDENTIFIER", "truestage".to_owned()),
        ("TRUESTAGE_EVENT", event.id.to_string()),
        ("TRUESTAGE_KIND", event.kind.clone()),
        ("TRUESTAGE_OF", event.of.clone()),
        ("TRUESTAGE_DATA", data),
    ];
    let lines = fields.map(|(name, value)| format!("{name}={}\n", one_line(&value)));
    lines.concat()
}

/// `motion m1-2: failed: node 1: …`.
fn message(event: &Event) -> String {
    let at = |place: &str| event.data.pointer(place).and_then(|it| it.as_str());
    let what = ["/text", "/state", "/mode", "/stage", "/name"];
    let what = what.into_iter().find_map(at);
    let who = at("/stopped/by").or_else(|| at("/by"));
    let parts = [
        Some(event.kind.clone()),
        (!event.of.is_empty()).then(|| format!(" {}", event.of)),
        what.map(|it| format!(": {it}")),
        who.map(|it| format!(" by {it}")),
        at("/cause/cause").map(|it| format!(": {it}")),
    ];
    parts.into_iter().flatten().collect()
}

/// As syslog(3) counts: 3 an error, 4 a warning, 5 worth a notice, 6 information, 7 for who looks closely.
fn priority(event: &Event) -> u8 {
    let state = event.data.get("state").and_then(|it| it.as_str());
    let has_cause = event.data.get("cause").is_some_and(|it| !it.is_null());
    match (event.kind.as_str(), state) {
        _ if has_cause => 3,
        (_, Some("error_stop" | "failed" | "timed_out")) => 3,
        ("warning", _) => 4,
        ("machine" | "stop" | "lease" | "calibration" | "question", _) => 5,
        ("motion" | "run", Some(_)) => 6,
        _ => 7,
    }
}

#[cfg(test)]
mod tests {
    use serde_json::{Value, json};

    use super::*;

    fn event(kind: &str, of: &str, data: Value) -> Event {
        Event {
            id: 7,
            at: "2026-11-27T07:39:56.037Z".into(),
            clock_s: 2.5,
            kind: kind.into(),
            of: of.into(),
            data,
        }
    }

    #[track_caller]
    fn check(event: &Event, priority_expected: u8, message_expected: &str) {
        assert_eq!(priority(event), priority_expected, "{event:?}");
        assert_eq!(message(event), message_expected);
    }

    #[test]
    fn an_entry_says_what_happened_by_whom_and_why() {
        let begun = json!({"state": "moving", "by": "anna", "stopped": null, "cause": null});
        check(
            &event("motion", "m1-2", begun),
            6,
            "motion m1-2: moving by anna",
        );
        let stopped = json!({"state": "stopped", "by": "anna", "stopped": {"by": "uid 0"}});
        let text = "motion m1-2: stopped by uid 0";
        check(&event("motion", "m1-2", stopped), 6, text);
        let cause =
            json!({"state": "failed", "cause": {"cause": "node 1: silent", "code": "silent"}});
        check(
            &event("run", "r1-1", cause),
            3,
            "run r1-1: failed: node 1: silent",
        );
        let stop = json!({"by": "a signal", "mode": "quick"});
        check(&event("stop", "", stop), 5, "stop: quick by a signal");
        let warning = json!({"text": "axis x did not confirm that it stopped"});
        let text = "warning: axis x did not confirm that it stopped";
        check(&event("warning", "", warning), 4, text);
        check(
            &event("axis", "x", json!({"state": "Standstill"})),
            7,
            "axis x: Standstill",
        );
        check(
            &event("machine", "", json!({"state": "error_stop"})),
            3,
            "machine: error_stop",
        );
    }

    /// A log of the system in a folder, and who tells it.
    fn journal() -> (tempfile::TempDir, UnixDatagram, SystemLog) {
        let folder = tempfile::tempdir().unwrap();
        let place = folder.path().join("socket");
        let journal = UnixDatagram::bind(&place).unwrap();
        let log = SystemLog::at(&place).unwrap();
        (folder, journal, log)
    }

    #[test]
    fn an_entry_is_a_datagram_with_a_line_for_each_field() {
        let (_folder, journal, log) = journal();
        // Whatever a device or a client says: it makes no field of its own.
        log.note(&event(
            "lease",
            "",
            json!({"name": "anna\nPRIORITY=0\u{1b}"}),
        ));
        let mut bytes = [0; 4096];
        let length = journal.recv(&mut bytes).unwrap();
        assert_eq!(
            String::from_utf8_lossy(&bytes[..length]),
            "MESSAGE=lease: anna PRIORITY=0 \nPRIORITY=5\nSYSLOG_IDENTIFIER=truestage\nTRUESTAGE_EVENT=7\n\
             TRUESTAGE_KIND=lease\nTRUESTAGE_OF=\nTRUESTAGE_DATA={\"name\":\"anna\\nPRIORITY=0\\u001b\"}\n"
        );
    }

    #[test]
    fn what_is_too_long_for_a_datagram_stands_elsewhere() {
        let long = json!({"state": "done", "told": "x".repeat(DATA_MAX)});
        let entry = entry(&event("run", "r1-1", long));
        assert!(entry.contains("MESSAGE=run r1-1: done\n"), "{entry}");
        assert!(entry.ends_with("TRUESTAGE_DATA=\n"), "{entry}");
    }

    /// A log that takes nothing holds nobody up.
    #[test]
    fn a_log_that_is_gone_is_no_reason_to_fail() {
        let (folder, journal, log) = journal();
        for _ in 0..10_000 {
            log.note(&event("axis", "x", json!({"state": "Standstill"})));
        }
        drop(journal);
        log.note(&event("axis", "x", json!({"state": "Standstill"})));
        let place = folder.path().join("socket");
        std::fs::remove_file(&place).unwrap();
        assert!(SystemLog::at(&place).is_err());
    }
}
