//! What happened, numbered.

use std::collections::VecDeque;
use std::sync::Arc;
use std::time::SystemTime;

use jiff::Timestamp;
use serde_json::Value;
use units::Time;

use crate::view::Event;

/// So many are kept in the snapshot; older ones are in the journal.
const KEPT: usize = 1024;

/// The newest events.
#[derive(Debug, Default)]
pub(super) struct Events {
    newest: u64,
    now: Time,
    kept: VecDeque<Arc<Event>>,
    published: Option<Arc<Vec<Arc<Event>>>>,
}

impl Events {
    /// What happens from now on happens at `now` by the machine's clock.
    pub(super) const fn set_now(&mut self, now: Time) {
        self.now = now;
    }

    /// `kind` is one of [`Event::KINDS`].
    pub(super) fn push(&mut self, kind: &str, of: &str, data: Value) {
        debug_assert!(Event::KINDS.contains(&kind), "{kind}");
        self.newest += 1;
        self.kept.push_back(Arc::new(Event {
            id: self.newest,
            at: utc_now(),
            clock_s: self.now.seconds(),
            kind: kind.to_owned(),
            of: of.to_owned(),
            data,
        }));
        if self.kept.len() > KEPT {
            self.kept.pop_front();
        }
        self.published = None;
    }

    /// The list for a snapshot; the same one until something happens.
    pub(super) fn list(&mut self) -> Arc<Vec<Arc<Event>>> {
        let kept = &self.kept;
        let list = self
            .published
            .get_or_insert_with(|| Arc::new(kept.iter().cloned().collect()));
        Arc::clone(list)
    }
}

/// The time of day for records, UTC, RFC 3339, to the millisecond. Nothing is decided by it.
pub(crate) fn utc_now() -> String {
    // A clock that is set beyond all calendars is at their end.
    let now = Timestamp::try_from(SystemTime::now()).unwrap_or(Timestamp::MAX);
    now.strftime("%Y-%m-%dT%H:%M:%S.%3fZ").to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn events_are_numbered_without_a_gap_and_the_oldest_go() {
        let mut events = Events::default();
        for _ in 0..KEPT + 10 {
            events.push("axis", "x", Value::Null);
        }
        let list = events.list();
        assert_eq!(list.len(), KEPT);
        assert_eq!(list[0].id, 11);
        assert!(list.windows(2).all(|it| it[1].id == it[0].id + 1));
        assert!(Arc::ptr_eq(&list, &events.list()), "nothing happened");
    }
}
