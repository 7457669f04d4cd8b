//! Writing run journals, through the door of a store.

use core::marker::PhantomData;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use serde::Serialize;

use super::difference::{Difference, first_difference};
use super::door::Door;
use super::files::Files;
use super::hash::ConfigHash;
use super::journal::{JournalHeader, Log, Mark, ReadJournal, journal_of, read_by};
use super::journal_file::JournalFile;
use super::line::sealed;
use super::run_name::RunName;
use super::{Store, StoreError, io_error};

/// A journal being written, with a log of kind `L`.
///
/// In the store of a machine's thread ([`Store::ordered`]) what is written is ordered, in order, and a failure is heard
/// at a later call. In any other store each call waits for the disk.
#[derive(Debug)]
pub struct Journal<L> {
    path: PathBuf,
    door: Door,
    /// Locked by the thread that writes it alone.
    file: Arc<Mutex<JournalFile>>,
    log: PhantomData<fn(L)>,
}

impl Store {
    /// Starts a journal in this store.
    ///
    /// # Errors
    /// When it cannot be created.
    pub fn create_journal<L: Log>(&self, header: &JournalHeader) -> Result<Journal<L>, StoreError> {
        Journal::create_by(&self.door, &self.runs(), header)
    }

    /// Continues the journal at `path` after its last whole line; `hash` is of the configuration
    /// that it is continued with.
    ///
    /// # Errors
    /// When it cannot be read or does not describe the same run as `header`.
    pub fn resume_journal<L: Log>(
        &self,
        path: &Path,
        header: &JournalHeader,
        hash: &ConfigHash,
    ) -> Result<(Journal<L>, ReadJournal<L>), StoreError> {
        Journal::resume_by(&self.door, path, header, hash)
    }

    /// [`read_journal`](super::read_journal) of this store.
    ///
    /// # Errors
    /// Those of [`read_journal`](super::read_journal).
    pub fn read_journal<L: Log>(&self, path: &Path) -> Result<ReadJournal<L>, StoreError> {
        read_by(&self.door, path)
    }
}

impl<L: Log> Journal<L> {
    /// Starts a journal in `folder`.
    ///
    /// # Errors
    /// When it cannot be created.
    pub fn create(folder: &Path, header: &JournalHeader) -> Result<Self, StoreError> {
        Self::create_by(&Door::of_system(), folder, header)
    }

    /// Continues the journal at `path`, as [`Store::resume_journal`].
    ///
    /// # Errors
    /// Those of [`Store::resume_journal`].
    pub fn resume(
        path: &Path,
        header: &JournalHeader,
        hash: &ConfigHash,
    ) -> Result<(Self, ReadJournal<L>), StoreError> {
        Self::resume_by(&Door::of_system(), path, header, hash)
    }

    fn create_by(door: &Door, folder: &Path, header: &JournalHeader) -> Result<Self, StoreError> {
        let path = folder.join(free_name(door, folder, header)?);
        let head = line_of(&Mark::Header(Box::new(header.clone())));
        let journal = Self::over(door, path);
        journal.order(move |file, files| file.create(files, &head))?;
        door.note(&journal.path, None);
        Ok(journal)
    }

    fn resume_by(
        door: &Door,
        path: &Path,
        header: &JournalHeader,
        hash: &ConfigHash,
    ) -> Result<(Self, ReadJournal<L>), StoreError> {
        let bytes = door.read(path).map_err(io_error("read", path))?;
        let mut read = journal_of::<L>(path, &*bytes, |_| {})?;
        same_run(path, &read.header, header, hash)?;
        if read.complete {
            return Err(StoreError::AlreadyComplete {
                path: path.to_owned(),
            });
        }
        let mut kept = bytes;
        kept.truncate(usize::try_from(read.valid_bytes).unwrap_or(usize::MAX));
        kept.extend(line_of(&Mark::Resumed {
            at: header.started.clone(),
        }));
        let journal = Self::over(door, path.to_owned());
        journal.order(move |file, files| file.go_on_from(files, &kept))?;
        door.note(path, None);
        read.failure = None;
        read.log.keep_whole(&read.header);
        Ok((journal, read))
    }

    fn over(door: &Door, path: PathBuf) -> Self {
        Self {
            file: Arc::new(Mutex::new(JournalFile::new(&path))),
            door: door.clone(),
            path,
            log: PhantomData,
        }
    }

    fn order(
        &self,
        change: impl FnOnce(&mut JournalFile, &dyn Files) -> Result<(), StoreError> + Send + 'static,
    ) -> Result<(), StoreError> {
        let file = Arc::clone(&self.file);
        self.door.change(move |files| {
            change(
                &mut file.lock().unwrap_or_else(PoisonError::into_inner),
                files,
            )
        })
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Appends one entry. Once it was done, killing the process loses nothing of it.
    ///
    /// # Errors
    /// When it, or anything before it, cannot be written: the run must stop, its points would be lost.
    pub fn write(&mut self, entry: &L::Entry) -> Result<(), StoreError> {
        self.append(entry)
    }

    /// Says why the run failed.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn fail(&mut self, cause: String) -> Result<(), StoreError> {
        self.append(&Mark::Failed { cause })
    }

    /// Says that the run is complete, and forces everything to the disk. What is made of it is stored before: a run
    /// whose calibration is not stored can go on.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn complete(&mut self) -> Result<(), StoreError> {
        self.flush_to_disk()?;
        self.append(&Mark::Complete)?;
        self.flush_to_disk()
    }

    fn append(&self, line: &impl Serialize) -> Result<(), StoreError> {
        let line = line_of(line);
        self.order(move |file, _| file.append(&line))
    }

    /// Forces everything to the disk; called where the axis stands and time does not matter.
    ///
    /// # Errors
    /// When the disk refuses.
    pub fn flush_to_disk(&mut self) -> Result<(), StoreError> {
        self.order(|file, _| file.sync())
    }
}

/// As it stands in the file.
fn line_of(line: &impl Serialize) -> Vec<u8> {
    let json = serde_json::to_string(line).expect("plain data always serialises");
    sealed(&json).into_bytes()
}

/// A name in `folder` that no journal has.
fn free_name(door: &Door, folder: &Path, header: &JournalHeader) -> Result<String, StoreError> {
    let names = match door.list(folder) {
        Ok(names) => names,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Vec::new(),
        Err(error) => return Err(io_error("list", folder)(error)),
    };
    let names = names.iter().map(|name| name.to_string_lossy().into_owned());
    let names: Vec<String> = names.collect();
    let stamp = header.started.replace([':', '-'], "");
    let (verb, axis) = (header.verb.as_str(), header.axis.as_str());
    Ok(RunName::next(&names, &stamp, verb, axis).text(verb, axis))
}

fn same_run(
    path: &Path,
    old: &JournalHeader,
    new: &JournalHeader,
    hash: &ConfigHash,
) -> Result<(), StoreError> {
    let text = |a: &str, b: &str| first_difference(a, b);
    let config_hash = hash.beside(&old.config_hash);
    let comparisons = [
        ("verb", text(&old.verb, &new.verb)),
        ("stage serial", text(&old.stage_serial, &new.stage_serial)),
        ("configuration hash", text(&old.config_hash, config_hash)),
        ("axis", text(&old.axis, &new.axis)),
        ("drive", first_difference(&old.drive, &new.drive)),
        (
            "calibration",
            first_difference(&old.calibration, &new.calibration),
        ),
        (
            "instrument and its corrections",
            first_difference(&old.instrument.corrections(), &new.instrument.corrections()),
        ),
        ("number of runs", first_difference(&old.runs, &new.runs)),
        ("targets", first_difference(&old.targets_m, &new.targets_m)),
        (
            "length of approach",
            first_difference(&old.approach_m, &new.approach_m),
        ),
    ];
    let different = comparisons
        .into_iter()
        .find_map(|(what, it)| Some((what, it?)));
    different.map_or(Ok(()), |(what, it)| Err(not_resumable(path, what, it)))
}

/// The error for a journal whose run was another one than would be continued, with where they differ.
pub fn not_resumable(path: &Path, what: &str, it: Difference) -> StoreError {
    StoreError::NotResumable {
        path: path.to_owned(),
        what: it.in_what(what),
        expected: it.expected,
        seen: it.seen,
    }
}

#[cfg(test)]
mod tests;
