//! Which request is which motion or run, in a file: the same request never moves twice, not even after a restart.
//!
//! One JSON object a line. A line is written and synced before its order is given to the machine's thread; a
//! last line that a crash cut off is left out when the file is read, for its order was never given.

mod runs;

use std::collections::{BTreeMap, VecDeque};
use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::request::MoveRequest;
use crate::view::{MotionView, RunView};
pub(crate) use runs::AskedRun;
use runs::KnownRuns;

/// So many motions, and so many runs that were asked for with a key, are remembered over a restart.
const KEPT: usize = 4096;

/// The ledger cannot be read or written.
#[derive(Debug, thiserror::Error)]
#[error("{}: {source}; what was asked for before a restart is kept there", path.display())]
pub struct LedgerError {
    /// The file or folder.
    pub path: PathBuf,
    /// Why.
    pub source: io::Error,
}

/// A line of the file.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Line {
    /// The service began for this time.
    Boot(u64),
    /// A motion was asked for.
    Asked(Asked),
    /// A motion or run was refused: nothing moved.
    Refused(String),
    /// It ended.
    Ended(Box<MotionView>),
    /// A run was asked for with a key.
    AskedRun(AskedRun),
    /// It ended; once more where it went on.
    EndedRun(Box<RunView>),
}

/// A motion that was asked for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Asked {
    pub(crate) id: String,
    /// The Idempotency-Key, when there was one.
    pub(crate) key: Option<String>,
    pub(crate) by: String,
    pub(crate) at: String,
    pub(crate) request: MoveRequest,
}

/// The motions and runs that were asked for.
#[derive(Debug)]
pub(crate) struct Ledger {
    path: PathBuf,
    file: File,
    boot: u64,
    motions: u64,
    asked: VecDeque<Asked>,
    ended: BTreeMap<String, MotionView>,
    runs: KnownRuns,
}

impl Ledger {
    /// The ledger in `folder`, which is made when it is not there.
    pub(crate) fn open(folder: &Path) -> Result<Self, LedgerError> {
        let path = folder.join("ledger.jsonl");
        let failed = |path: &Path| {
            let path = path.to_owned();
            move |source| LedgerError { path, source }
        };
        fs::create_dir_all(folder).map_err(failed(folder))?;
        let text = match fs::read_to_string(&path) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => String::new(),
            read => read.map_err(failed(&path))?,
        };
        let mut before = Before::default();
        text.lines()
            .filter_map(|line| serde_json::from_str(line).ok())
            .for_each(|line| before.take(line));
        let boot = before.boot + 1;
        let lines = before.lines(boot);
        let temporary = folder.join("ledger.new");
        let mut file = File::create(&temporary).map_err(failed(&temporary))?;
        file.write_all(&lines)
            .and_then(|()| file.sync_all())
            .and_then(|()| fs::rename(&temporary, &path))
            .map_err(failed(&path))?;
        let appended = OpenOptions::new().append(true).open(&path);
        Ok(Self {
            file: appended.map_err(failed(&path))?,
            path,
            boot,
            motions: 0,
            asked: before.asked,
            ended: before.ended,
            runs: before.runs,
        })
    }

    /// A name that nothing has had, for what kind of thing.
    pub(crate) fn next_id(&mut self, kind: char) -> String {
        self.motions += 1;
        format!("{kind}{}-{}", self.boot, self.motions)
    }

    /// What numbers of events count from in this life of the service: none is used twice, so that whoever goes on with one
    /// of an earlier life hears that he has missed some.
    pub(crate) const fn events_from(&self) -> u64 {
        // Four thousand million events for each life, and two million lives before numbers of JavaScript end.
        (self.boot - 1) << 32
    }

    /// The motion that was asked for with `key`.
    pub(crate) fn of_key(&self, key: &str) -> Option<&Asked> {
        let mut asked = self.asked.iter().rev();
        asked.find(|it| it.key.as_deref() == Some(key))
    }

    /// The motion `id`.
    pub(crate) fn of_id(&self, id: &str) -> Option<&Asked> {
        self.asked.iter().rev().find(|it| it.id == id)
    }

    /// How the motion `id` ended, when that was written.
    pub(crate) fn end_of(&self, id: &str) -> Option<&MotionView> {
        self.ended.get(id)
    }

    /// Whether `asked` was asked for before the last restart.
    pub(crate) fn is_of_earlier_boot(&self, asked: &Asked) -> bool {
        !self.is_own(&asked.id)
    }

    /// Whether this service gave the name `id`.
    fn is_own(&self, id: &str) -> bool {
        let own = format!("{}-", self.boot);
        id.get(1..).is_some_and(|it| it.starts_with(&own))
    }

    /// The run that was asked for with `key`.
    pub(crate) fn run_of_key(&self, key: &str) -> Option<&AskedRun> {
        self.runs.of_key(key)
    }

    /// The run `id` that was asked for with a key, as far as it is known.
    pub(crate) fn run(&self, id: &str) -> Option<RunView> {
        self.runs.run(id, !self.is_own(id))
    }

    /// Notes a run that will be asked for; it is on the disk when this returns.
    pub(crate) fn ask_run(&mut self, asked: AskedRun) -> Result<(), LedgerError> {
        self.append(&Line::AskedRun(asked.clone()), true)?;
        self.runs.ask(asked);
        Ok(())
    }

    /// Notes how a run ended that was asked for with a key.
    pub(crate) fn end_run(&mut self, view: &RunView) -> Result<(), LedgerError> {
        match self.runs.end(view) {
            Some(ended) => self.append(&Line::EndedRun(Box::new(ended)), false),
            None => Ok(()),
        }
    }

    /// Notes a motion that will be asked for; with a key, it is on the disk when this returns.
    pub(crate) fn ask(&mut self, asked: Asked) -> Result<(), LedgerError> {
        // Without a key nobody asks for it a second time.
        let sync = asked.key.is_some();
        self.append(&Line::Asked(asked.clone()), sync)?;
        self.asked.push_back(asked);
        if self.asked.len() > KEPT
            && let Some(old) = self.asked.pop_front()
        {
            self.ended.remove(&old.id);
        }
        Ok(())
    }

    /// The motion or run `id` was refused: its key is free again.
    pub(crate) fn refuse(&mut self, id: &str) -> Result<(), LedgerError> {
        self.asked.retain(|it| it.id != id);
        self.runs.forget(id);
        self.append(&Line::Refused(id.to_owned()), false)
    }

    /// Notes how a motion ended, once.
    pub(crate) fn end(&mut self, view: &MotionView) -> Result<(), LedgerError> {
        if self.ended.contains_key(&view.id) {
            return Ok(());
        }
        self.ended.insert(view.id.clone(), view.clone());
        self.append(&Line::Ended(Box::new(view.clone())), false)
    }

    fn append(&mut self, line: &Line, sync: bool) -> Result<(), LedgerError> {
        let mut bytes = serde_json::to_vec(line).map_err(|it| self.failed(it.into()))?;
        bytes.push(b'\n');
        let written = self.file.write_all(&bytes);
        let synced = written.and_then(|()| match sync {
            true => self.file.sync_data(),
            false => Ok(()),
        });
        synced.map_err(|source| self.failed(source))
    }

    fn failed(&self, source: io::Error) -> LedgerError {
        let path = self.path.clone();
        LedgerError { path, source }
    }
}

/// What a file says that was there.
#[derive(Default)]
struct Before {
    boot: u64,
    asked: VecDeque<Asked>,
    ended: BTreeMap<String, MotionView>,
    runs: KnownRuns,
}

impl Before {
    fn take(&mut self, line: Line) {
        match line {
            Line::Boot(boot) => self.boot = self.boot.max(boot),
            Line::Asked(asked) => self.asked.push_back(asked),
            Line::Refused(id) => {
                self.asked.retain(|it| it.id != id);
                self.runs.forget(&id);
            }
            Line::AskedRun(asked) => self.runs.ask(asked),
            Line::EndedRun(view) => self.runs.take_end(*view),
            Line::Ended(view) => {
                self.ended.insert(view.id.clone(), *view);
            }
        }
    }

    /// The file for the service that begins: as much as is remembered, and the boot.
    fn lines(&mut self, boot: u64) -> Vec<u8> {
        let old = self.asked.len().saturating_sub(KEPT);
        self.asked.drain(..old);
        let asked = &self.asked;
        self.ended
            .retain(|id, _| asked.iter().any(|it| it.id == *id));
        let asked = self.asked.iter().cloned().map(Line::Asked);
        let ended = self.ended.values().cloned();
        let ended = ended.map(|it| Line::Ended(Box::new(it)));
        let runs = self.runs.all().flat_map(|(asked, ended)| {
            let ended = ended.map(|it| Line::EndedRun(Box::new(it)));
            [Line::AskedRun(asked)].into_iter().chain(ended)
        });
        let lines = [Line::Boot(boot)].into_iter().chain(asked).chain(ended);
        let lines = lines.chain(runs);
        lines
            .filter_map(|line| serde_json::to_string(&line).ok())
            .flat_map(|line| format!("{line}\n").into_bytes())
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use units::Metres;

    use super::*;

    fn asked(ledger: &mut Ledger, key: &str) -> Asked {
        Asked {
            id: ledger.next_id('m'),
            key: Some(key.to_owned()),
            by: "a test".into(),
            at: "2026-01-01T00:00:00.000Z".into(),
            request: MoveRequest::of("x", Metres::from_mm(1.0)),
        }
    }

    #[test]
    fn what_was_asked_for_is_known_after_a_restart_and_names_are_never_given_twice() {
        let folder = tempfile::tempdir().unwrap();
        let mut first = Ledger::open(folder.path()).unwrap();
        let one = asked(&mut first, "one");
        first.ask(one.clone()).unwrap();
        drop(first);
        let mut second = Ledger::open(folder.path()).unwrap();
        assert_eq!(second.of_key("one"), Some(&one));
        assert!(second.is_of_earlier_boot(&one));
        let two = asked(&mut second, "two");
        assert_ne!(two.id, one.id);
        assert!(!second.is_of_earlier_boot(&two));
    }

    #[test]
    fn a_refused_request_may_be_made_again() {
        let folder = tempfile::tempdir().unwrap();
        let mut ledger = Ledger::open(folder.path()).unwrap();
        let one = asked(&mut ledger, "one");
        ledger.ask(one.clone()).unwrap();
        ledger.refuse(&one.id).unwrap();
        assert_eq!(ledger.of_key("one"), None);
        drop(ledger);
        assert_eq!(Ledger::open(folder.path()).unwrap().of_key("one"), None);
    }

    #[test]
    fn a_file_cut_at_any_byte_loses_at_most_its_last_line() {
        let folder = tempfile::tempdir().unwrap();
        let mut ledger = Ledger::open(folder.path()).unwrap();
        for key in ["one", "two"] {
            let asked = asked(&mut ledger, key);
            ledger.ask(asked).unwrap();
        }
        let path = folder.path().join("ledger.jsonl");
        let whole = fs::read(&path).unwrap();
        let ends: Vec<_> = (0..whole.len()).filter(|at| whole[*at] == b'\n').collect();
        for length in ends[1]..whole.len() {
            fs::write(&path, &whole[..length]).unwrap();
            let ledger = Ledger::open(folder.path()).unwrap();
            assert!(ledger.of_key("one").is_some(), "{length}");
            assert_eq!(
                ledger.of_key("two").is_some(),
                length == ends[2],
                "{length}"
            );
        }
    }
}
