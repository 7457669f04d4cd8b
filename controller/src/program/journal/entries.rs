//! The entries of a journal, each with its line and the time of day at which it was written, as far as that is known.

use std::path::Path;

use jiff::Timestamp;
use machine::records::{StoreError, read_entries};

use super::node::Node;

/// What a line of a journal says.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Entry {
    /// Its line, from 1.
    pub(super) line: i64,
    /// What kind of entry it is: `point`, `zero`, `header`.
    pub(super) kind: String,
    /// When it was written, microseconds since 1970 (UTC).
    pub(super) time_us: i64,
    /// The rest of it.
    pub(super) members: Vec<(String, Node)>,
}

/// All whole lines of a journal.
pub(super) struct Entries {
    pub(super) all: Vec<Entry>,
    /// Whether a torn line followed them.
    pub(super) is_torn: bool,
}

/// Reads the journal at `path`, of whatever kind.
///
/// # Errors
/// When it cannot be read, or a line that is not its last one is damaged.
pub(super) fn entries_of(path: &Path) -> Result<Entries, StoreError> {
    let (read, lines) = read_entries(path)?;
    let mut clock = Clock::default();
    let each = lines.iter().zip(1..);
    let all = each.map(|(text, line)| {
        let node: Node = serde_json::from_str(text).expect("a line that was read is JSON");
        let kind = node.get("entry").and_then(Node::text).unwrap_or_default();
        let (kind, time_us) = (kind.to_owned(), clock.time_of(kind, &node));
        let members = match node {
            Node::Object(members) => members.into_iter().filter(|it| it.0 != "entry").collect(),
            _ => Vec::new(),
        };
        Entry {
            line,
            kind,
            time_us,
            members,
        }
    });
    Ok(Entries {
        all: all.collect(),
        is_torn: read.torn,
    })
}

/// The time of day of each entry: that of the run's beginning, or of its continuation, and from the first entry on
/// that says when it was by the machine's clock (`at_s`) what that clock has gone on.
#[derive(Default)]
struct Clock {
    begun_us: i64,
    first_s: Option<f64>,
    last_us: i64,
}

impl Clock {
    fn time_of(&mut self, kind: &str, entry: &Node) -> i64 {
        let at = |key| entry.get(key).and_then(Node::text).and_then(micros);
        let begins = match kind {
            "header" => at("started"),
            "resumed" => at("at"),
            _ => None,
        };
        if let Some(begun_us) = begins {
            (self.begun_us, self.last_us) = (begun_us, begun_us);
            self.first_s = None;
        } else if let Some(at_s) = entry.get("at_s").and_then(Node::number) {
            let first_s = *self.first_s.get_or_insert(at_s);
            let gone_us = ((at_s - first_s) * 1e6).round() as i64;
            // A clock that has gone on beyond all calendars says nothing.
            let at_us = self.begun_us.checked_add(gone_us);
            let at_us = at_us.filter(|it| Timestamp::from_microsecond(*it).is_ok());
            self.last_us = at_us.unwrap_or(self.last_us);
        } else if let Some(at_us) = at("at") {
            self.last_us = at_us;
        }
        self.last_us
    }
}

fn micros(text: &str) -> Option<i64> {
    let at: Timestamp = text.parse().ok()?;
    Some(at.as_microsecond())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(clock: &mut Clock, entry: &str, expected_s: f64) {
        let node: Node = serde_json::from_str(entry).unwrap();
        let kind = node.get("entry").and_then(Node::text).unwrap();
        let begun = micros("2026-01-01T00:00:00Z").unwrap();
        let seen = clock.time_of(kind, &node) - begun;
        assert_eq!(seen, (expected_s * 1e6) as i64, "{entry}");
    }

    /// The clock of a journal that begins with 2026.
    fn begun() -> Clock {
        let mut clock = Clock::default();
        let header = r#"{"entry":"header","started":"2026-01-01T00:00:00Z"}"#;
        check(&mut clock, header, 0.0);
        clock
    }

    #[test]
    fn time_goes_on_with_the_machines_clock_and_begins_again_when_a_run_is_continued() {
        let it = &mut begun();
        check(it, r#"{"entry":"job"}"#, 0.0);
        check(it, r#"{"entry":"point","at_s":45.5}"#, 0.0);
        check(it, r#"{"entry":"point","at_s":46.0}"#, 0.5);
        check(it, r#"{"entry":"failed","cause":"x"}"#, 0.5);
        check(
            it,
            r#"{"entry":"resumed","at":"2026-01-01T01:00:00Z"}"#,
            3600.0,
        );
        check(it, r#"{"entry":"point","at_s":7.0}"#, 3600.0);
        check(it, r#"{"entry":"point","at_s":7.25}"#, 3600.25);
        check(
            it,
            r#"{"entry":"sighted","at":"2026-01-01T02:00:00Z"}"#,
            7200.0,
        );
    }

    #[test]
    fn a_clock_that_is_beyond_all_calendars_is_not_believed() {
        let it = &mut begun();
        check(it, r#"{"entry":"point","at_s":1.0}"#, 0.0);
        for far in ["1e12", "-1e12", "1e300", "-1e300"] {
            let entry = format!(r#"{{"entry":"point","at_s":{far}}}"#);
            check(it, &entry, 0.0);
        }
        check(it, r#"{"entry":"point","at_s":2.5}"#, 1.5);
    }
}
