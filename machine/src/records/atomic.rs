//! Writing a file so that a crash at any moment leaves the old one or the new one.

use core::sync::atomic::{AtomicU32, Ordering};
use std::io;
use std::path::{Path, PathBuf};

use super::files::{Files, OpenFile, OsFiles, write_all};
use super::{StoreError, io_error};

/// Writes `bytes` to `path`: temporary file in the same folder, fsync, rename, fsync of the
/// folder. Whatever happens, `path` holds the old content or the whole new one. A file that is
/// replaced keeps its mode; a new one has the ordinary one, because a calibration is for everybody
/// who uses the machine, while a temporary file is for its maker only.
///
/// # Errors
/// When the folder cannot be made or written to, or the disk is full; what was done, and where.
///
/// # Example
///
/// ```
/// use machine::records::write_new_or_replace;
///
/// let folder = tempfile::tempdir()?;
/// let path = folder.path().join("active/x.json");
/// write_new_or_replace(&path, b"one")?;
/// write_new_or_replace(&path, b"two")?;
/// assert_eq!(std::fs::read(&path)?, b"two");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn write_new_or_replace(path: &Path, bytes: &[u8]) -> Result<(), StoreError> {
    replace_file(&OsFiles, path, bytes)
}

/// [`write_new_or_replace`] with these `files`.
///
/// # Errors
/// Those of [`write_new_or_replace`].
pub fn replace_file(files: &dyn Files, path: &Path, bytes: &[u8]) -> Result<(), StoreError> {
    let folder = path.parent().unwrap_or(Path::new("."));
    let made = files.make_folder(folder);
    made.map_err(io_error("create the folder", folder))?;
    let mode = files.mode(path).ok();
    let temporary = create_beside(files, path, mode)?;
    let replaced = write_temporary(files, temporary, path, bytes);
    replaced?;
    files
        .sync_folder(folder)
        .map_err(|source| StoreError::Unsynced {
            path: path.to_owned(),
            source,
        })
}

/// Creates a temporary file in the folder of `path`.
fn create_beside(
    files: &dyn Files,
    path: &Path,
    mode: Option<u32>,
) -> Result<(PathBuf, Box<dyn OpenFile>), StoreError> {
    /// Programs of one process number, on several hosts, may share a folder.
    const ATTEMPTS: u32 = 1000;
    static MADE: AtomicU32 = AtomicU32::new(0);
    let mut attempts = 0;
    loop {
        let number = MADE.fetch_add(1, Ordering::Relaxed);
        let temporary = path.with_file_name(format!(".new-{}-{number}", std::process::id()));
        attempts += 1;
        match files.create(&temporary, mode) {
            Ok(file) => return Ok((temporary, file)),
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists && attempts < ATTEMPTS => {}
            Err(error) => {
                return Err(io_error("create a temporary file beside it", path)(error));
            }
        }
    }
}

/// Writes and syncs a temporary file, and gives it the name `path`. What fails leaves none behind.
fn write_temporary(
    files: &dyn Files,
    (temporary, mut file): (PathBuf, Box<dyn OpenFile>),
    path: &Path,
    bytes: &[u8],
) -> Result<(), StoreError> {
    let written = write_all(&mut *file, bytes).map_err(io_error("write", path));
    let synced = written.and_then(|()| file.sync().map_err(io_error("flush it to disk", path)));
    let renamed = synced.and_then(|()| {
        let renamed = files.rename(&temporary, path);
        renamed.map_err(io_error("rename the temporary file to it", path))
    });
    if renamed.is_err() {
        // It only takes place; the cause is the first error.
        let _ = files.remove(&temporary);
    }
    renamed
}

/// Removes `path`, which need not be there, so that it does not come back after a crash.
///
/// # Errors
/// What the operating system says.
pub fn remove_durably(path: &Path) -> io::Result<()> {
    remove_file(&OsFiles, path)
}

/// [`remove_durably`] with these `files`.
///
/// # Errors
/// Those of [`remove_durably`].
pub fn remove_file(files: &dyn Files, path: &Path) -> io::Result<()> {
    match files.remove(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
        _ => {}
    }
    // Also where it is gone already: whoever removed it may have died before this.
    match files.sync_folder(path.parent().unwrap_or(Path::new("."))) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
        synced => synced,
    }
}

#[cfg(test)]
mod tests {
    use std::fs::{self, Permissions};
    use std::os::unix::fs::PermissionsExt;

    use super::*;
    use crate::records::files::{Fault, SimulatedFiles};

    /// Each call of a replacement fails in each way, then the power is cut at random.
    #[test]
    fn a_replacement_leaves_the_old_or_the_new_file() {
        let path = Path::new("/store/active/x.json");
        let count = |files: &SimulatedFiles| {
            replace_file(files, path, b"the old content").unwrap();
            files.calls()
        };
        let old = count(&SimulatedFiles::new());
        let twice = SimulatedFiles::new();
        count(&twice);
        replace_file(&twice, path, b"the new one").unwrap();
        let mut tried = 0;
        for call in old..twice.calls() {
            for fault in [Fault::Error(28), Fault::Partly(28), Fault::End] {
                for seed in 0..64_u32 {
                    let files = SimulatedFiles::new();
                    count(&files);
                    files.fail(call, fault);
                    let replaced = replace_file(&files, path, b"the new one");
                    let mut dice = seed;
                    files.cut_power(|| {
                        dice = dice.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
                        f64::from(dice >> 24) / 128.0 - 0.5
                    });
                    let kept = files.read(path).unwrap();
                    let is_new = kept == b"the new one";
                    assert!(
                        is_new || kept == b"the old content",
                        "{call} {fault:?} {kept:?}"
                    );
                    assert!(is_new || replaced.is_err(), "{call} {fault:?} {seed}");
                    tried += 1;
                }
            }
        }
        assert!(tried > 500, "{tried}");
    }

    #[test]
    fn a_replaced_file_has_the_new_content_and_leaves_no_temporary() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a/b.json");
        write_new_or_replace(&path, b"one").unwrap();
        write_new_or_replace(&path, b"two").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"two");
        assert_eq!(fs::read_dir(path.parent().unwrap()).unwrap().count(), 1);
    }

    fn mode(path: &Path) -> u32 {
        fs::metadata(path).unwrap().permissions().mode() & 0o7777
    }

    #[test]
    fn a_new_file_is_for_whom_any_other_new_file_is() {
        let folder = tempfile::tempdir().unwrap();
        let (path, ordinary) = (folder.path().join("a.json"), folder.path().join("ordinary"));
        fs::write(&ordinary, b"x").unwrap();
        write_new_or_replace(&path, b"one").unwrap();
        assert_eq!(mode(&path), mode(&ordinary));
    }

    #[test]
    fn a_replaced_file_keeps_its_mode() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.json");
        for wanted in [0o600, 0o640, 0o664] {
            fs::write(&path, b"one").unwrap();
            fs::set_permissions(&path, Permissions::from_mode(wanted)).unwrap();
            write_new_or_replace(&path, b"two").unwrap();
            assert_eq!(
                (fs::read(&path).unwrap(), mode(&path)),
                (b"two".to_vec(), wanted)
            );
        }
    }

    #[test]
    fn a_folder_that_cannot_be_made_is_an_error_that_names_it() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("plain");
        fs::write(&file, b"x").unwrap();
        let error = write_new_or_replace(&file.join("b.json"), b"one").unwrap_err();
        assert!(error.to_string().contains("plain"), "{error}");
        assert_eq!(fs::read(&file).unwrap(), b"x");
    }
}
