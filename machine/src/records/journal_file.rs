//! The file of a journal that is being written.

use std::io;
use std::path::{Path, PathBuf};

use super::files::{Files, OpenFile, write_all};
use super::{StoreError, io_error, replace_file};

/// The file, and how much of it is whole lines.
#[derive(Debug)]
pub(super) struct JournalFile {
    path: PathBuf,
    file: Option<Box<dyn OpenFile>>,
    whole: u64,
}

impl JournalFile {
    /// One that is not there yet.
    pub(super) fn new(path: &Path) -> Self {
        Self {
            path: path.to_owned(),
            file: None,
            whole: 0,
        }
    }

    /// Creates it with its first line, durably: what cannot be written then is heard before anything moves.
    pub(super) fn create(&mut self, files: &dyn Files, head: &[u8]) -> Result<(), StoreError> {
        let folder = self.path.parent().unwrap_or(Path::new(".")).to_owned();
        let made = files.make_folder(&folder);
        made.map_err(io_error("create the folder", &folder))?;
        let created = files.create(&self.path, None);
        self.file = Some(created.map_err(io_error("create", &self.path))?);
        let begun = self.write_head(files, &folder, head);
        if begun.is_err() {
            self.file = None;
            // One without a whole header is no journal; the cause is the first error.
            let _ = files.remove(&self.path);
        }
        begun
    }

    fn write_head(
        &mut self,
        files: &dyn Files,
        folder: &Path,
        head: &[u8],
    ) -> Result<(), StoreError> {
        self.append(head)?;
        self.sync()?;
        let synced = files.sync_folder(folder);
        synced.map_err(io_error("flush its folder to disk", &self.path))
    }

    /// Goes on from `kept`, its whole lines. They are written anew: of what a disk failed to keep nothing says so later.
    pub(super) fn go_on_from(&mut self, files: &dyn Files, kept: &[u8]) -> Result<(), StoreError> {
        replace_file(files, &self.path, kept)?;
        let opened = files.open(&self.path);
        self.file = Some(opened.map_err(io_error("open", &self.path))?);
        self.whole = kept.len() as u64;
        Ok(())
    }

    /// Appends a line. Where it cannot be written whole, nothing of it is left, or nothing is written behind it.
    pub(super) fn append(&mut self, line: &[u8]) -> Result<(), StoreError> {
        let written = write_all(&mut **self.open()?, line);
        if let Err(error) = written {
            let whole = self.whole;
            let is_cut = self.open()?.set_len(whole).is_ok();
            if !is_cut {
                self.file = None;
            }
            return Err(io_error("append to it", &self.path)(error));
        }
        self.whole += line.len() as u64;
        Ok(())
    }

    /// Forces it to the disk. After an error nothing more is written to it: a second call would report success over
    /// what is lost.
    pub(super) fn sync(&mut self) -> Result<(), StoreError> {
        if let Err(error) = self.open()?.sync() {
            self.file = None;
            return Err(io_error("flush it to disk", &self.path)(error));
        }
        Ok(())
    }

    fn open(&mut self) -> Result<&mut Box<dyn OpenFile>, StoreError> {
        let given_up = || {
            let before = io::Error::other("it could not be written before");
            io_error("append to it", &self.path)(before)
        };
        match self.file.as_mut() {
            Some(file) => Ok(file),
            None => Err(given_up()),
        }
    }
}
