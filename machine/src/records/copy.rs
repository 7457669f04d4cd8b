//! The copy in memory of the records that a machine's procedures read.
//!
//! A machine's thread waits for no disk, so what it reads is there before: which calibrations are in use, those and
//! the ones before them, the notes of zeros, and the names of the run journals.

use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::path::{Path, PathBuf};

use super::files::Files;
use super::pointer::ActivePointer;

/// So many calibrations before the one in use are held: a harmful one is gone back from at once.
const EARLIER: usize = 4;

/// The copy.
#[derive(Debug, Default)]
pub(super) struct RecordsCopy {
    contents: BTreeMap<PathBuf, Vec<u8>>,
    folders: BTreeMap<PathBuf, BTreeSet<PathBuf>>,
    /// The journal that is read next. One at a time: they may be large.
    held: Option<(PathBuf, Vec<u8>)>,
}

impl RecordsCopy {
    /// Reads the records of the machine whose folder is `root`. What cannot be read is left out: a later
    /// question goes to the disk, and hears why.
    pub(super) fn read(files: &dyn Files, root: &Path) -> Self {
        let mut copy = Self::default();
        for folder in ["active", "zeros"] {
            for path in copy.list(files, &root.join(folder)) {
                copy.take(files, &path);
            }
        }
        copy.list(files, &root.join("calibrations"));
        copy.list(files, &root.join("runs"));
        for id in copy.calibrations_in_use(root) {
            let path = root.join("calibrations").join(format!("{id}.json"));
            copy.take(files, &path);
        }
        copy
    }

    fn list(&mut self, files: &dyn Files, folder: &Path) -> Vec<PathBuf> {
        let names = match files.list(folder) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => Vec::new(),
            Err(_) => return Vec::new(),
            Ok(names) => names,
        };
        let paths: BTreeSet<PathBuf> = names.iter().map(|name| folder.join(name)).collect();
        self.folders.insert(folder.to_owned(), paths.clone());
        paths.into_iter().collect()
    }

    fn take(&mut self, files: &dyn Files, path: &Path) {
        if let Ok(bytes) = files.read(path) {
            self.contents.insert(path.to_owned(), bytes);
        }
    }

    fn calibrations_in_use(&self, root: &Path) -> BTreeSet<String> {
        let active = root.join("active");
        let pointers = self
            .contents
            .iter()
            .filter(|file| file.0.starts_with(&active));
        let pointers = pointers.filter_map(|file| serde_json::from_slice(file.1).ok());
        pointers
            .flat_map(|pointer: ActivePointer| {
                let earlier = pointer.history.into_iter().rev().take(EARLIER);
                earlier.chain(pointer.current)
            })
            .collect()
    }

    /// The content of `path`; `None` where only the disk knows.
    pub(super) fn content(&self, path: &Path) -> Option<io::Result<Vec<u8>>> {
        if let Some((_, bytes)) = self.held.as_ref().filter(|held| held.0 == path) {
            return Some(Ok(bytes.clone()));
        }
        if let Some(bytes) = self.contents.get(path) {
            return Some(Ok(bytes.clone()));
        }
        let beside = self.folders.get(path.parent()?)?;
        (!beside.contains(path)).then(|| Err(io::ErrorKind::NotFound.into()))
    }

    /// Holds the content of `path` for who reads it next.
    pub(super) fn hold(&mut self, path: &Path, bytes: Vec<u8>) {
        self.held = Some((path.to_owned(), bytes));
    }

    /// The names in `folder`; `None` where only the disk knows.
    pub(super) fn names(&self, folder: &Path) -> Option<Vec<PathBuf>> {
        let paths = self.folders.get(folder)?.iter();
        Some(
            paths
                .filter_map(|path| Some(path.file_name()?.into()))
                .collect(),
        )
    }

    /// The file `path` was written. Of those that are not read again only the name is held.
    pub(super) fn set(&mut self, path: &Path, bytes: Option<Vec<u8>>) {
        if let Some(beside) = path
            .parent()
            .and_then(|folder| self.folders.get_mut(folder))
        {
            beside.insert(path.to_owned());
        }
        self.held.take_if(|held| held.0 == path);
        match bytes {
            Some(bytes) => drop(self.contents.insert(path.to_owned(), bytes)),
            None => drop(self.contents.remove(path)),
        }
    }

    /// The file `path` was removed.
    pub(super) fn remove(&mut self, path: &Path) {
        self.contents.remove(path);
        if let Some(beside) = path
            .parent()
            .and_then(|folder| self.folders.get_mut(folder))
        {
            beside.remove(path);
        }
    }
}
