//! Files whose calls are held up or refused: for tests.

use core::fmt::Debug;
use std::io;
use std::path::{Path, PathBuf};

use super::{Files, OpenFile};

/// A call on files that reads or writes the disk.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[expect(missing_docs, reason = "the names are those of the calls")]
pub enum Call {
    Read,
    List,
    MakeFolder,
    Create,
    Open,
    Rename,
    Remove,
    SyncFolder,
}

/// A watch over the calls on files.
pub trait Watch: Debug + Send + Sync {
    /// Lets `call` go on, at once or later.
    ///
    /// # Errors
    /// When the call is refused.
    fn begin_call(&self, call: Call, path: &Path) -> io::Result<()>;

    /// Takes a file that was opened.
    fn take_file(&self, file: Box<dyn OpenFile>) -> Box<dyn OpenFile> {
        file
    }
}

/// Files under a watch.
#[derive(Clone, Debug, Default)]
pub struct WatchedFiles<F, W> {
    /// The files themselves.
    pub files: F,
    /// The watch over them.
    pub watch: W,
}

impl<F: Files, W: Watch> Files for WatchedFiles<F, W> {
    fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        self.watch.begin_call(Call::Read, path)?;
        self.files.read(path)
    }

    fn list(&self, folder: &Path) -> io::Result<Vec<PathBuf>> {
        self.watch.begin_call(Call::List, folder)?;
        self.files.list(folder)
    }

    fn make_folder(&self, folder: &Path) -> io::Result<()> {
        self.watch.begin_call(Call::MakeFolder, folder)?;
        self.files.make_folder(folder)
    }

    fn create(&self, path: &Path, mode: Option<u32>) -> io::Result<Box<dyn OpenFile>> {
        self.watch.begin_call(Call::Create, path)?;
        let file = self.files.create(path, mode)?;
        Ok(self.watch.take_file(file))
    }

    fn open(&self, path: &Path) -> io::Result<Box<dyn OpenFile>> {
        self.watch.begin_call(Call::Open, path)?;
        let file = self.files.open(path)?;
        Ok(self.watch.take_file(file))
    }

    fn mode(&self, path: &Path) -> io::Result<u32> {
        self.files.mode(path)
    }

    fn identity(&self, path: &Path) -> io::Result<Option<String>> {
        self.files.identity(path)
    }

    fn rename(&self, from: &Path, to: &Path) -> io::Result<()> {
        self.watch.begin_call(Call::Rename, to)?;
        self.files.rename(from, to)
    }

    fn remove(&self, path: &Path) -> io::Result<()> {
        self.watch.begin_call(Call::Remove, path)?;
        self.files.remove(path)
    }

    fn sync_folder(&self, folder: &Path) -> io::Result<()> {
        self.watch.begin_call(Call::SyncFolder, folder)?;
        self.files.sync_folder(folder)
    }
}
