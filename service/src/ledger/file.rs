//! File of the ledger, and the ballast beside it.
//!
//! A write that did not happen as a whole is cut off again. After a sync that failed nothing is known of the
//! file: it is replaced by a new one. The ballast takes room on the disk that ends can have when it is full.

use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use machine::records::files::{Files, OpenFile, write_all};
use machine::records::replace_file;

use super::lines::Line;

/// So large is the ballast, in bytes: thousands of ends.
pub(super) const BALLAST: usize = 1 << 20;

/// So many folders are made for a machine: `DATA/MACHINE/service`.
const FOLDERS_MADE: usize = 3;

/// The file that is written to.
#[derive(Debug)]
pub(super) struct LedgerFile {
    files: Arc<dyn Files>,
    path: PathBuf,
    /// Where it can be trusted.
    open: Option<Trusted>,
    /// So large is the ballast, in bytes.
    ballast: usize,
    has_ballast: bool,
}

/// A file whose content is known.
#[derive(Debug)]
struct Trusted {
    file: Box<dyn OpenFile>,
    /// So long it is by what was written as a whole.
    length: u64,
}

impl LedgerFile {
    pub(super) fn new(files: Arc<dyn Files>, path: PathBuf, ballast: usize) -> Self {
        Self {
            files,
            path,
            open: None,
            ballast,
            has_ballast: false,
        }
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    pub(super) const fn is_trusted(&self) -> bool {
        self.open.is_some()
    }

    pub(super) const fn has_ballast(&self) -> bool {
        self.has_ballast
    }

    /// Replaces the file by one with `lines`.
    pub(super) fn replace(&mut self, lines: &[u8]) -> io::Result<()> {
        self.open = None;
        let replaced = replace_file(&*self.files, &self.path, lines);
        replaced.map_err(|error| match error {
            machine::records::StoreError::Io { source, .. } => source,
            other => io::Error::other(other.to_string()),
        })?;
        self.sync_folders_above()?;
        let mut file = self.files.open(&self.path)?;
        if let Some(identity) = self.files.identity(&self.path)? {
            write_all(&mut *file, Line::File(identity).sealed().as_bytes())?;
            file.sync()?;
        }
        let length = file.length()?;
        self.open = Some(Trusted { file, length });
        Ok(())
    }

    /// Makes the folder durable that may have been made, also by a program that was ended before it did that.
    fn sync_folders_above(&self) -> io::Result<()> {
        let above = self.folder().ancestors().skip(1).take(FOLDERS_MADE);
        for folder in above {
            match self.files.sync_folder(folder) {
                // No folder was made there for this program.
                Err(error) if error.kind() == io::ErrorKind::PermissionDenied => {}
                synced => synced?,
            }
        }
        Ok(())
    }

    /// Writes `bytes` at the end. A crash of the program leaves them there, a power cut perhaps. After an error nothing
    /// of them is in the file, where that is still trusted.
    pub(super) fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        let Some(trusted) = &mut self.open else {
            return Err(io::ErrorKind::NotFound.into());
        };
        let Err(error) = write_all(&mut *trusted.file, bytes) else {
            trusted.length += bytes.len() as u64;
            return Ok(());
        };
        let cut = trusted.file.set_len(trusted.length);
        if cut.and_then(|()| trusted.file.sync()).is_err() {
            self.open = None;
        }
        Err(error)
    }

    /// Makes what was written durable.
    pub(super) fn sync(&mut self) -> io::Result<()> {
        let synced = self.open.as_mut().map(|trusted| trusted.file.sync());
        let synced = synced.unwrap_or_else(|| Err(io::ErrorKind::NotFound.into()));
        synced.inspect_err(|_| self.open = None)
    }

    /// Gives the room of the ballast away.
    pub(super) fn release_ballast(&mut self) {
        if core::mem::take(&mut self.has_ballast) {
            // Where it is gone already, its room is free as well.
            let _ = self.files.remove(&self.ballast_path());
            let _ = self.files.sync_folder(self.folder());
        }
    }

    /// Takes the room of the ballast, where it has none.
    pub(super) fn place_ballast(&mut self) -> io::Result<()> {
        let path = self.ballast_path();
        let length = self.files.open(&path).and_then(|file| file.length());
        if length.ok() == Some(self.ballast as u64) {
            self.has_ballast = true;
            return Ok(());
        }
        let placed = self.write_ballast(&path);
        self.has_ballast = placed.is_ok();
        if placed.is_err() {
            // It only takes the room that is missing.
            let _ = self.files.remove(&path);
        }
        placed
    }

    fn write_ballast(&self, path: &Path) -> io::Result<()> {
        match self.files.remove(path) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
            _ => {}
        }
        let mut file = self.files.create(path, None)?;
        write_all(&mut *file, &incompressible(self.ballast))?;
        file.sync()?;
        self.files.sync_folder(self.folder())
    }

    fn ballast_path(&self) -> PathBuf {
        self.path.with_extension("ballast")
    }

    fn folder(&self) -> &Path {
        self.path.parent().unwrap_or(Path::new("."))
    }
}

/// So many bytes that no file system makes fewer of.
fn incompressible(length: usize) -> Vec<u8> {
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    let words = core::iter::repeat_with(|| {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        state.to_le_bytes()
    });
    words.flatten().take(length).collect()
}

/// Whether an error says that there is no room.
pub(super) fn is_full(error: &io::Error) -> bool {
    use io::ErrorKind as Kind;
    [Kind::StorageFull, Kind::QuotaExceeded, Kind::FileTooLarge].contains(&error.kind())
}
