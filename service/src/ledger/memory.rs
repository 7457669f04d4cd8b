//! Memory of the ledger: what was asked for and how it ended, found by name and by key.

use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

use jiff::{SignedDuration, Timestamp};

use super::asked::{Asked, AskedMotion, End};
use super::lines::Line;

/// So many motions without a key are remembered over a restart.
const KEYLESS_MAX: usize = 4096;
/// So many keys are remembered.
pub(super) const KEYS_MAX: usize = 100_000;
/// How long each key is remembered at least.
const KEY_AGE: SignedDuration = SignedDuration::from_hours(7 * 24);

/// A request, and what became of it.
#[derive(Clone, Debug)]
pub(super) struct Entry {
    pub(super) asked: Arc<Asked>,
    /// Whether its request is on the disk.
    pub(super) is_noted: bool,
    pub(super) end: Option<Arc<End>>,
    /// Whether its end is on the disk.
    pub(super) is_kept: bool,
    /// Where it stands in the order of requests.
    pub(super) number: u64,
}

/// What a request with a key is.
pub(super) enum Known<'m> {
    /// The first with its key, for which there is room.
    New,
    /// There is no room for another key.
    Full,
    /// Its key was used before.
    Before(&'m Entry),
}

/// All that was asked for.
#[derive(Debug, Default)]
pub(super) struct Memory {
    entries: HashMap<String, Entry>,
    /// The name of the request of each key.
    keys: HashMap<String, String>,
    /// Names by the order of requests.
    keyed: BTreeMap<u64, String>,
    keyless: BTreeMap<u64, String>,
    newest: u64,
    /// What could not be read of an earlier ledger, until a person accepts that.
    pub(super) damaged: Option<String>,
}

impl Memory {
    pub(super) fn keys(&self) -> usize {
        self.keys.len()
    }

    pub(super) fn entry(&self, id: &str) -> Option<&Entry> {
        self.entries.get(id)
    }

    /// What a request with `key` is `now`. The oldest keys go when there is no other room.
    pub(super) fn known(&mut self, key: &str, now: Timestamp) -> Known<'_> {
        if !self.keys.contains_key(key) {
            return match self.make_room(now) {
                true => Known::New,
                false => Known::Full,
            };
        }
        let id = &self.keys[key];
        self.entries.get(id).map_or(Known::New, Known::Before)
    }

    fn make_room(&mut self, now: Timestamp) -> bool {
        if self.keys.len() < KEYS_MAX {
            return true;
        }
        let oldest = self.keyed.values().next().cloned();
        let old = oldest.filter(|id| {
            let at = self.entries.get(id).map(|entry| entry.asked.at());
            // One whose time cannot be read is as old as any.
            let at = at.and_then(|at| at.parse::<Timestamp>().ok());
            at.is_none_or(|at| now.duration_since(at) > KEY_AGE)
        });
        old.inspect(|id| self.forget(id)).is_some()
    }

    /// Takes a request; `is_noted`: it is on the disk.
    pub(super) fn ask(&mut self, asked: Arc<Asked>, is_noted: bool) {
        let id = asked.id().to_owned();
        self.forget(&id);
        self.newest += 1;
        let number = self.newest;
        match asked.key() {
            Some(key) => {
                self.keys.insert(key.to_owned(), id.clone());
                self.keyed.insert(number, id.clone());
            }
            None => {
                self.keyless.insert(number, id.clone());
            }
        }
        let entry = Entry {
            asked,
            is_noted,
            end: None,
            is_kept: false,
            number,
        };
        self.entries.insert(id, entry);
        if self.keyless.len() > KEYLESS_MAX
            && let Some((_, oldest)) = self.keyless.pop_first()
        {
            self.entries.remove(&oldest);
        }
    }

    /// Forgets the request `id`: its key is free.
    pub(super) fn forget(&mut self, id: &str) {
        let Some(entry) = self.entries.remove(id) else {
            return;
        };
        self.keyed.remove(&entry.number);
        self.keyless.remove(&entry.number);
        if let Some(key) = entry.asked.key()
            && self.keys.get(key).is_some_and(|holder| holder == id)
        {
            self.keys.remove(key);
        }
    }

    /// The request `id` is on the disk.
    pub(super) fn note(&mut self, id: &str) {
        if let Some(entry) = self.entries.get_mut(id) {
            entry.is_noted = true;
        }
    }

    /// Takes an end; `None` where it was known, or is not asked for after a restart.
    pub(super) fn end(&mut self, end: Arc<End>) -> Option<Arc<End>> {
        let entry = self.entries.get_mut(end.id())?;
        if entry.end.as_ref().is_some_and(|known| known.is_same(&end)) {
            return None;
        }
        entry.is_kept = false;
        entry.end = Some(Arc::clone(&end));
        Some(end)
    }

    /// `end` is on the disk.
    pub(super) fn keep(&mut self, end: &Arc<End>) {
        if let Some(entry) = self.entries.get_mut(end.id())
            && entry
                .end
                .as_ref()
                .is_some_and(|known| Arc::ptr_eq(known, end))
        {
            entry.is_kept = true;
        }
    }

    /// Takes a line of a file.
    pub(super) fn take(&mut self, line: Line) {
        match line {
            // Of the file itself.
            Line::Boot(_) | Line::File(_) => {}
            Line::Asked(motion) => self.ask(Arc::new(Asked::Motion(motion)), true),
            Line::AskedRun(run) => self.ask(Arc::new(Asked::Run(run)), true),
            Line::Refused(id) => self.forget(&id),
            Line::Ended(view) => self.take_end(End::Motion(Arc::new(*view))),
            Line::EndedRun(view) => self.take_end(End::Run(Arc::new(*view))),
            Line::Damaged(name) => self.damaged = Some(name),
            Line::Accepted(_) => self.damaged = None,
        }
    }

    fn take_end(&mut self, end: End) {
        let end = Arc::new(end);
        if self.end(Arc::clone(&end)).is_some() {
            self.keep(&end);
        }
    }

    /// All that a new file has to say, in no order.
    pub(super) fn entries(&self) -> Vec<Entry> {
        self.entries.values().cloned().collect()
    }

    /// The motion `id`, when it was asked for.
    pub(super) fn motion(&self, id: &str) -> Option<(&AskedMotion, &Entry)> {
        let entry = self.entries.get(id)?;
        match &*entry.asked {
            Asked::Motion(motion) => Some((motion, entry)),
            Asked::Run(_) => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use units::Metres;

    use super::*;
    use crate::request::MoveRequest;

    fn ask(memory: &mut Memory, number: usize, key: Option<&str>, at: &str) {
        let request = MoveRequest::of("x", Metres::from_mm(1.0));
        let motion = AskedMotion {
            at: at.to_owned(),
            ..AskedMotion::now(format!("m1-{number}"), key, "a test", &request)
        };
        memory.ask(Arc::new(Asked::Motion(motion)), true);
    }

    #[test]
    fn motions_without_a_key_displace_no_key() {
        let mut memory = Memory::default();
        let (at, now) = ("2026-01-01T00:00:00.000Z", Timestamp::now());
        ask(&mut memory, 0, Some("first"), at);
        for number in 1..=2 * KEYLESS_MAX {
            ask(&mut memory, number, None, at);
        }
        assert!(
            matches!(memory.known("first", now), Known::Before(entry) if entry.asked.id() == "m1-0")
        );
        assert_eq!(memory.entries().len(), KEYLESS_MAX + 1);
    }

    #[test]
    fn a_full_ledger_refuses_new_keys_for_a_week() {
        let mut memory = Memory::default();
        let at = "2026-01-01T00:00:00.000Z";
        let begin: Timestamp = at.parse().expect("a time");
        for number in 0..KEYS_MAX {
            ask(&mut memory, number, Some(&number.to_string()), at);
        }
        let seven_days = begin + KEY_AGE;
        assert!(matches!(memory.known("new", seven_days), Known::Full));
        assert!(matches!(memory.known("0", seven_days), Known::Before(_)));
        let later = seven_days + SignedDuration::from_millis(1);
        assert!(matches!(memory.known("new", later), Known::New));
        assert!(matches!(memory.known("1", later), Known::Before(_)));
        assert_eq!(memory.keys(), KEYS_MAX - 1, "only the oldest has gone");
    }
}
