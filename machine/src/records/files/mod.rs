//! Files of records, behind one door.
//!
//! Records go through [`Files`], so that a test can let each call fail and cut the power between any two:
//! [`OsFiles`] is the operating system, [`SimulatedFiles`] a disk in memory.

mod os;
mod simulated;
mod watched;

use core::fmt::Debug;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

pub use os::OsFiles;
pub use simulated::{Fault, SimulatedFiles};
pub use watched::{Call, Watch, WatchedFiles};

/// The files that records are kept in. Each call is one of the operating system's, apart from
/// [`Files::make_folder`].
pub trait Files: Debug + Send + Sync {
    /// The whole content of `path`.
    ///
    /// # Errors
    /// Those of the operating system; what `path` is when a regular file is expected.
    fn read(&self, path: &Path) -> io::Result<Vec<u8>>;

    /// The names in `folder`, in no order.
    ///
    /// # Errors
    /// Those of the operating system.
    fn list(&self, folder: &Path) -> io::Result<Vec<PathBuf>>;

    /// Makes `folder` and those above where they are missing. Each is durable when this returns.
    ///
    /// # Errors
    /// Those of the operating system.
    fn make_folder(&self, folder: &Path) -> io::Result<()>;

    /// Creates `path`, to write at its end. `mode` are its permissions where they are not the ordinary ones.
    ///
    /// # Errors
    /// Those of the operating system; `AlreadyExists` where something has that name.
    fn create(&self, path: &Path, mode: Option<u32>) -> io::Result<Box<dyn OpenFile>>;

    /// Opens `path`, to write at its end.
    ///
    /// # Errors
    /// Those of the operating system.
    fn open(&self, path: &Path) -> io::Result<Box<dyn OpenFile>>;

    /// The permissions of `path`.
    ///
    /// # Errors
    /// Those of the operating system.
    fn mode(&self, path: &Path) -> io::Result<u32>;

    /// What tells `path` from a copy of it, where the system knows that. A new name changes nothing.
    ///
    /// # Errors
    /// Those of the operating system.
    fn identity(&self, path: &Path) -> io::Result<Option<String>>;

    /// Gives `from` the name `to`; what had that name is gone.
    ///
    /// # Errors
    /// Those of the operating system.
    fn rename(&self, from: &Path, to: &Path) -> io::Result<()>;

    /// Removes the file `path`.
    ///
    /// # Errors
    /// Those of the operating system.
    fn remove(&self, path: &Path) -> io::Result<()>;

    /// Makes the names in `folder` durable.
    ///
    /// # Errors
    /// Those of the operating system.
    fn sync_folder(&self, folder: &Path) -> io::Result<()>;
}

/// A file that is written at its end.
pub trait OpenFile: Debug + Send {
    /// Writes the beginning of `bytes`, and says how many. A full disk takes fewer than all.
    ///
    /// # Errors
    /// Those of the operating system.
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize>;

    /// Makes the content durable. After an error nothing is known about what was written before, and a
    /// second call would report success over lost pages.
    ///
    /// # Errors
    /// Those of the operating system.
    fn sync(&mut self) -> io::Result<()>;

    /// Cuts the file, or lengthens it by zeros.
    ///
    /// # Errors
    /// Those of the operating system.
    fn set_len(&mut self, length: u64) -> io::Result<()>;

    /// How long the file is.
    ///
    /// # Errors
    /// Those of the operating system.
    fn length(&self) -> io::Result<u64>;
}

/// Writes all of `bytes`.
///
/// # Errors
/// Those of the operating system; part of `bytes` may stand in the file.
pub fn write_all(file: &mut dyn OpenFile, mut bytes: &[u8]) -> io::Result<()> {
    while !bytes.is_empty() {
        match file.write(bytes) {
            Ok(0) => return Err(io::ErrorKind::WriteZero.into()),
            Ok(count) => bytes = &bytes[count..],
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
    Ok(())
}

/// The files of the operating system.
pub fn os_files() -> Arc<dyn Files> {
    Arc::new(OsFiles)
}
