//! A machine is used by one program at a time.

use std::fs::{self, File, OpenOptions};
use std::io::{Read, Seek, Write};

use nix::fcntl::{Flock, FlockArg};

use super::{Store, StoreError, io_error};

/// The right to use a machine; given back when dropped, or by the kernel when the process dies.
///
/// # Example
///
/// ```
/// use machine::records::{Lease, Store, StoreError};
///
/// let folder = tempfile::tempdir()?;
/// let store = Store::new(folder.path(), "stage", &[]);
/// let lease = Lease::take(&store, "calibrate")?;
/// let second = Lease::take(&store, "move");
/// assert!(matches!(second, Err(StoreError::Leased { owner }) if owner.contains("calibrate")));
/// drop(lease);
/// Lease::take(&store, "move")?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct Lease {
    _lock: Flock<File>,
}

impl Lease {
    /// Takes the lease of the machine whose store this is, for `verb`.
    ///
    /// # Errors
    /// When another program has it (its name is told), or the lock file cannot be made.
    pub fn take(store: &Store, verb: &str) -> Result<Self, StoreError> {
        let path = store.root().join("lease");
        fs::create_dir_all(store.root()).map_err(io_error("create the folder", store.root()))?;
        let file = OpenOptions::new()
            .read(true)
            .write(true)
            .create(true)
            .truncate(false)
            .open(&path)
            .map_err(io_error("open", &path))?;
        match Flock::lock(file, FlockArg::LockExclusiveNonblock) {
            Ok(mut lock) => {
                let owner = format!("truestage {verb}, process {}\n", std::process::id());
                lock.set_len(0).map_err(io_error("write", &path))?;
                lock.write_all(owner.as_bytes())
                    .map_err(io_error("write", &path))?;
                Ok(Self { _lock: lock })
            }
            Err((mut file, _)) => {
                let mut owner = String::new();
                // Who holds it is a courtesy; that it is held is the fact.
                let _ = file.rewind().and_then(|()| file.read_to_string(&mut owner));
                Err(StoreError::Leased {
                    owner: owner.trim().to_owned(),
                })
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whoever is refused must be able to read who has the machine.
    #[test]
    fn the_lease_can_be_read_by_whom_any_other_new_file_can_be() {
        use std::os::unix::fs::MetadataExt;
        let folder = tempfile::tempdir().unwrap();
        let store = Store::new(folder.path(), "m", &[]);
        let _lease = Lease::take(&store, "calibrate").unwrap();
        let ordinary = store.root().join("ordinary");
        fs::write(&ordinary, b"x").unwrap();
        let mode = |path| fs::metadata(path).unwrap().mode();
        assert_eq!(mode(store.root().join("lease")), mode(ordinary));
    }

    #[test]
    fn a_second_program_is_told_who_has_the_machine() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::new(folder.path(), "m", &[]);
        let first = Lease::take(&store, "calibrate").unwrap();
        let error = Lease::take(&store, "move").unwrap_err().to_string();
        assert!(error.contains("truestage calibrate, process"), "{error}");
        drop(first);
        Lease::take(&store, "move").unwrap();
    }
}
