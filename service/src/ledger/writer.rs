//! Writer of the ledger: all of its I/O, in one thread.

use core::sync::atomic::AtomicU64;
use core::time::Duration;
use std::fmt::Write as _;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Condvar, Mutex};
use std::thread;
use std::time::Instant;

use machine::records::files::Files;
use machine::records::replace_file;

use super::file::{BALLAST, LedgerFile, is_full};
use super::health::Health;
use super::lines::{Line, Reading};
use super::memory::Memory;
use super::{Item, ItemOf, Ledger, LedgerError, Note, State, storage};
use crate::problem::Problem;
use crate::random::draw_bytes;

/// How often a disk that cannot be written is tried again.
const RETRY_EVERY: Duration = Duration::from_secs(1);
/// How many letters tell lives of a store apart.
const LIFE_LETTERS: usize = 5;

/// The one who writes.
#[derive(Debug)]
pub(crate) struct Writer {
    ledger: Arc<Ledger>,
    files: Arc<dyn Files>,
    file: LedgerFile,
    /// What was found and is not kept yet: where it goes, and its bytes.
    damaged: Option<(PathBuf, Vec<u8>)>,
    /// Why the last write failed.
    cause: Option<String>,
    tried: Option<Instant>,
}

/// What was found at the start.
struct Found {
    bytes: Vec<u8>,
    reading: Reading,
    /// Whether it is a copy of the file that was written.
    is_copy: bool,
}

impl Ledger {
    /// The ledger in `folder`, which is made when it is not there, and the one who writes it. A disk that takes
    /// nothing lets no motion begin, and is tried again.
    ///
    /// # Errors
    /// When it cannot be read.
    pub(crate) fn open(
        files: Arc<dyn Files>,
        folder: &Path,
    ) -> Result<(Arc<Self>, Writer), LedgerError> {
        Self::open_with(files, folder, BALLAST)
    }

    /// [`Ledger::open`] with a ballast of so many bytes.
    pub(super) fn open_with(
        files: Arc<dyn Files>,
        folder: &Path,
        ballast: usize,
    ) -> Result<(Arc<Self>, Writer), LedgerError> {
        let path = folder.join("ledger.jsonl");
        let found = read(&*files, &path).map_err(|source| LedgerError {
            path: path.clone(),
            source,
        })?;
        let Reading {
            lines,
            torn,
            unreadable,
        } = found.reading;
        let mut boot = 0;
        let mut memory = Memory::default();
        for line in lines {
            if let Line::Boot(earlier) = line {
                boot = boot.max(earlier);
            }
            memory.take(line);
        }
        let mut warnings = Vec::new();
        let damaged = (unreadable > 0).then(|| {
            let copy = free_name(&*files, folder);
            memory.damaged = Some(name_of(&copy));
            (copy, found.bytes)
        });
        if let Some(name) = &memory.damaged {
            warnings.push(format!(
                "the ledger is damaged ({unreadable} lines): it is kept as {name}, and requests with a key are refused \
                 until a person accepts that (POST /v1/ledger/accept)"
            ));
        }
        if torn > 0 {
            warnings.push(format!(
                "the ledger had {torn} torn records, which were cut: no request had been taken by them"
            ));
        }
        if found.is_copy {
            warnings.push(
                "the machine's records were copied or restored: keys that were used after that copy was made are \
                 forgotten, and their requests would move again"
                    .to_owned(),
            );
        }
        let ledger = Arc::new(Self {
            state: Mutex::new(State {
                memory,
                ..State::default()
            }),
            news: Condvar::new(),
            health: Health::new(),
            boot: boot + 1,
            life: letters().map_err(|source| LedgerError {
                path: path.clone(),
                source,
            })?,
            names: AtomicU64::new(0),
            warnings,
        });
        let mut writer = Writer {
            ledger: Arc::clone(&ledger),
            file: LedgerFile::new(Arc::clone(&files), path, ballast),
            files,
            damaged,
            cause: None,
            tried: None,
        };
        writer.remove_leftovers(folder);
        writer.write();
        Ok((ledger, writer))
    }
}

impl Writer {
    /// Waits for something that can be written, at most for so long.
    pub(crate) fn await_news(&self, limit: Duration) {
        match self.is_well() {
            true => self.ledger.await_news(limit),
            // What waits may wait for long.
            false => thread::park_timeout(limit),
        }
    }

    const fn is_well(&self) -> bool {
        self.file.is_trusted() && self.file.has_ballast() && self.cause.is_none()
    }

    /// Writes what waits. Where the disk took nothing it is tried again, once a second.
    pub(crate) fn write(&mut self) {
        let is_due = self.tried.is_none_or(|at| at.elapsed() >= RETRY_EVERY);
        let has_work = !self.ledger.state().pending.is_empty();
        let is_well = self.is_well();
        if is_well && !has_work || !is_well && !is_due {
            return;
        }
        self.ledger.health.begin_write();
        if !is_well {
            self.tried = Some(Instant::now());
            self.repair();
        }
        self.write_pending();
        self.ledger.health.end_write(self.cause.clone());
    }

    /// Makes the next [`Writer::write`] try what failed.
    pub(crate) const fn retry_now(&mut self) {
        self.tried = None;
    }

    /// A trusted file, and the ballast.
    fn repair(&mut self) {
        self.cause = None;
        if !self.file.is_trusted() {
            let renewed = self.renew().or_else(|error| match is_full(&error) {
                true => {
                    self.file.release_ballast();
                    self.renew()
                }
                false => Err(error),
            });
            if let Err(error) = renewed {
                return self.failed(&error);
            }
        }
        if let Err(error) = self.file.place_ballast() {
            self.failed(&error);
        }
    }

    fn failed(&mut self, error: &io::Error) {
        let path = self.file.path().display();
        self.cause = Some(format!("{path}: {error}"));
    }

    /// Replaces the file by all that is known.
    fn renew(&mut self) -> io::Result<()> {
        if let Some((path, bytes)) = &self.damaged {
            replace_file(&*self.files, path, bytes).map_err(|error| match error {
                machine::records::StoreError::Io { source, .. } => source,
                other => io::Error::other(other.to_string()),
            })?;
            self.damaged = None;
        }
        let (mut entries, damaged) = {
            let mut state = self.ledger.state();
            let left: Vec<_> = state.pending.drain(..).collect();
            let cause = self
                .cause
                .as_deref()
                .unwrap_or("the ledger is written anew");
            refuse_notes(&mut state, left, cause);
            (state.memory.entries(), state.memory.damaged.clone())
        };
        entries.sort_unstable_by_key(|entry| entry.number);
        let mut text = Line::Boot(self.ledger.boot).sealed();
        let mut add = |line: &Line| {
            // To write into a text cannot fail.
            let _ = text.write_str(&line.sealed());
        };
        damaged
            .into_iter()
            .for_each(|name| add(&Line::Damaged(name)));
        for entry in &entries {
            add(&Line::of_asked(&entry.asked));
            entry.end.iter().for_each(|end| add(&Line::of_end(end)));
        }
        self.file.replace(text.as_bytes())?;
        let mut state = self.ledger.state();
        for entry in &entries {
            entry.end.iter().for_each(|end| state.memory.keep(end));
        }
        Ok(())
    }

    fn write_pending(&mut self) {
        let items: Vec<_> = self.ledger.state().pending.drain(..).collect();
        if items.is_empty() {
            return;
        }
        let items = match self.is_well() {
            true => items,
            false => self.refuse_waiting(items),
        };
        if !self.file.is_trusted() {
            // A new file will have all that is known.
            return;
        }
        let (items, error) = match self.append(items) {
            Ok(()) => return,
            Err(failed) => failed,
        };
        self.failed(&error);
        let rest = self.refuse_waiting(items);
        if is_full(&error) {
            self.file.release_ballast();
        }
        if self.file.is_trusted()
            && let Err((rest, error)) = self.append(rest)
        {
            self.failed(&error);
            if self.file.is_trusted() {
                self.put_back(rest);
            }
        }
    }

    /// Writes `items` and answers who waits for them; gives back those of which nothing is in the file, or all where
    /// that is not known.
    fn append(&mut self, items: Vec<Item>) -> Result<(), (Vec<Item>, io::Error)> {
        if items.is_empty() {
            return Ok(());
        }
        let bytes: String = items.iter().map(|item| item.text.as_str()).collect();
        if let Err(error) = self.file.write(bytes.as_bytes()) {
            return Err((items, error));
        }
        self.settle(&items, |note| !note.needs_sync);
        match self.file.sync() {
            Err(error) => {
                let mut unsettled = items;
                unsettled
                    .retain(|item| !matches!(&item.of, ItemOf::Note(note) if !note.needs_sync));
                Err((unsettled, error))
            }
            Ok(()) => {
                self.settle(&items, |note| note.needs_sync);
                let mut state = self.ledger.state();
                for item in &items {
                    if let ItemOf::End(end) = &item.of {
                        state.memory.keep(end);
                    }
                }
                Ok(())
            }
        }
    }

    /// Answers the requests that `are_due`.
    fn settle(&self, items: &[Item], are_due: impl Fn(&Note) -> bool) {
        let mut state = self.ledger.state();
        for item in items {
            if let ItemOf::Note(note) = &item.of
                && are_due(note)
            {
                state.memory.note(&note.id);
                // A request that waited too long has gone.
                let _ = note.answer.try_send(Ok(()));
            }
        }
    }

    fn refuse_waiting(&self, items: Vec<Item>) -> Vec<Item> {
        let cause = self.cause.as_deref().unwrap_or("the disk takes nothing");
        refuse_notes(&mut self.ledger.state(), items, cause)
    }

    /// These come first once the disk takes something.
    fn put_back(&self, items: Vec<Item>) {
        let mut state = self.ledger.state();
        items
            .into_iter()
            .rev()
            .for_each(|item| state.pending.push_front(item));
    }

    /// What writes of earlier programs left behind.
    fn remove_leftovers(&self, folder: &Path) {
        let names = self.files.list(folder).unwrap_or_default();
        for name in names {
            let is_left = |text: &str| text.starts_with(".new-") || text == "ledger.new";
            if name.to_str().is_some_and(is_left) {
                // It only takes room.
                let _ = self.files.remove(&folder.join(name));
            }
        }
    }
}

/// Refuses the requests among `items`, and gives the others back.
fn refuse_notes(state: &mut State, items: Vec<Item>, cause: &str) -> Vec<Item> {
    let problem: Problem = storage(cause);
    let (notes, rest): (Vec<_>, Vec<_>) = items
        .into_iter()
        .partition(|item| matches!(item.of, ItemOf::Note(_)));
    for item in notes {
        if let ItemOf::Note(note) = item.of {
            state.memory.forget(&note.id);
            // A request that waited too long has gone.
            let _ = note.answer.try_send(Err(problem.clone()));
        }
    }
    rest
}

fn read(files: &dyn Files, path: &Path) -> io::Result<Found> {
    let bytes = match files.read(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Vec::new(),
        read => read?,
    };
    let reading = Reading::parse(&bytes);
    let written = reading.lines.iter().rev().find_map(|line| match line {
        Line::File(identity) => Some(identity.clone()),
        _ => None,
    });
    let seen = match written {
        Some(_) => files.identity(path)?,
        None => None,
    };
    let is_copy = written.is_some_and(|written| seen.is_some_and(|seen| seen != written));
    Ok(Found {
        bytes,
        reading,
        is_copy,
    })
}

/// The first name of a damaged ledger that is free.
fn free_name(files: &dyn Files, folder: &Path) -> PathBuf {
    let names = (1_u32..).map(|number| folder.join(format!("ledger.damaged-{number}")));
    let mut free = names.filter(|path| files.mode(path).is_err());
    free.next().expect("some number is free")
}

fn name_of(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default();
    name.to_string_lossy().into_owned()
}

/// Random letters.
fn letters() -> io::Result<String> {
    let mut number = u64::from_le_bytes(draw_bytes()?);
    let letter = core::iter::repeat_with(|| {
        let letter = b'a' + (number % 26) as u8;
        number /= 26;
        char::from(letter)
    });
    Ok(letter.take(LIFE_LETTERS).collect())
}
