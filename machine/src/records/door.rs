//! The way of records to their files: at once, or through the thread of a machine's disk.

use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::disk::{Answer, Disk, Shared};
use super::files::{Files, os_files};
use super::{StoreError, remove_file, replace_file};

/// The way to the files of a store.
#[derive(Clone, Debug)]
pub(super) enum Door {
    /// Each call waits for the disk.
    Direct(Arc<dyn Files>),
    /// What is read is there already, and what is written is ordered.
    Ordered(Disk),
    /// From the disk's own thread.
    Within(Arc<Shared>),
}

impl Door {
    pub(super) fn of_system() -> Self {
        Self::Direct(os_files())
    }

    pub(super) fn files(&self) -> &Arc<dyn Files> {
        match self {
            Self::Direct(files) => files,
            Self::Ordered(disk) => &disk.shared().files,
            Self::Within(shared) => &shared.files,
        }
    }

    /// The content of `path`. What no copy was made of is waited for.
    pub(super) fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        let Self::Ordered(disk) = self else {
            return self.files().read(path);
        };
        if let Some(content) = disk.shared().copy().content(path) {
            return content;
        }
        let path = path.to_owned();
        ask_files(disk, move |files| files.read(&path))
    }

    /// The names in `folder`.
    pub(super) fn list(&self, folder: &Path) -> io::Result<Vec<PathBuf>> {
        let Self::Ordered(disk) = self else {
            return self.files().list(folder);
        };
        if let Some(names) = disk.shared().copy().names(folder) {
            return Ok(names);
        }
        let folder = folder.to_owned();
        ask_files(disk, move |files| files.list(&folder))
    }

    /// Does `change`, or orders it: then its failure is heard later.
    pub(super) fn change(
        &self,
        change: impl FnOnce(&dyn Files) -> Result<(), StoreError> + Send + 'static,
    ) -> Result<(), StoreError> {
        match self {
            Self::Ordered(disk) => disk.change(Box::new(change)),
            Self::Direct(_) | Self::Within(_) => change(&**self.files()),
        }
    }

    fn shared(&self) -> Option<&Shared> {
        match self {
            Self::Direct(_) => None,
            Self::Ordered(disk) => Some(disk.shared()),
            Self::Within(shared) => Some(shared),
        }
    }

    /// Notes what `path` holds from now on; the name alone of what is not read again.
    pub(super) fn note(&self, path: &Path, bytes: Option<&[u8]>) {
        if let Some(shared) = self.shared() {
            shared.copy().set(path, bytes.map(<[u8]>::to_vec));
        }
    }

    /// [`replace_file`], of a file that is read again.
    pub(super) fn replace(&self, path: &Path, bytes: Vec<u8>) -> Result<(), StoreError> {
        self.replace_or(path, bytes, |failure| failure)
    }

    /// The same of what says which calibration is in use.
    pub(super) fn replace_pointer(&self, path: &Path, bytes: Vec<u8>) -> Result<(), StoreError> {
        self.replace_or(path, bytes, |failure| match failure {
            StoreError::Unsynced { path, source } => StoreError::UseUnsynced { path, source },
            failure => failure,
        })
    }

    fn replace_or(
        &self,
        path: &Path,
        bytes: Vec<u8>,
        explain: fn(StoreError) -> StoreError,
    ) -> Result<(), StoreError> {
        let (to, written) = (path.to_owned(), bytes.clone());
        let changed = self.change(move |files| replace_file(files, &to, &written).map_err(explain));
        let is_there = matches!(
            changed,
            Ok(()) | Err(StoreError::Unsynced { .. } | StoreError::UseUnsynced { .. })
        );
        if is_there {
            self.note(path, Some(&bytes));
        }
        changed
    }

    /// [`remove_file`].
    pub(super) fn remove(&self, path: &Path) -> io::Result<()> {
        let removed = remove_file(&**self.files(), path);
        if let (Ok(()), Some(shared)) = (&removed, self.shared()) {
            shared.copy().remove(path);
        }
        removed
    }
}

/// Waits for what the disk's thread finds.
fn ask_files<R: Send + 'static>(
    disk: &Disk,
    look: impl FnOnce(&dyn Files) -> io::Result<R> + Send + 'static,
) -> io::Result<R> {
    let files = Arc::clone(&disk.shared().files);
    let asked = disk.ask(move || look(&*files));
    asked.and_then(Answer::wait).map_err(io::Error::other)?
}
