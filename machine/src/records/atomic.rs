//! Writing a file so that a crash at any moment leaves the old one or the new one.

use std::fs::{self, File, Permissions};
use std::io::{self, Write};
use std::os::unix::fs::PermissionsExt;
use std::path::Path;

use super::{StoreError, io_error};

/// What a file is created with that everybody may use; the umask takes its share off.
const ORDINARY_MODE: u32 = 0o666;

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
    let folder = path.parent().unwrap_or(Path::new("."));
    fs::create_dir_all(folder).map_err(io_error("create the folder", folder))?;
    let mut file = tempfile::Builder::new()
        .prefix(".new-")
        .permissions(Permissions::from_mode(ORDINARY_MODE))
        .tempfile_in(folder)
        .map_err(io_error("create a temporary file beside it", path))?;
    if let Ok(replaced) = fs::metadata(path) {
        file.as_file()
            .set_permissions(replaced.permissions())
            .map_err(io_error(
                "set the mode of the temporary file beside it",
                path,
            ))?;
    }
    file.write_all(bytes).map_err(io_error("write", path))?;
    file.as_file()
        .sync_all()
        .map_err(io_error("flush it to disk", path))?;
    file.persist(path)
        .map_err(|error| io_error("rename the temporary file to it", path)(error.error))?;
    sync_folder(folder)
}

/// Removes `path`, which need not be there, so that it does not come back after a crash.
///
/// # Errors
/// What the operating system says.
pub fn remove_durably(path: &Path) -> io::Result<()> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
        _ => {}
    }
    // Also where it is gone already: whoever removed it may have died before this.
    match File::open(path.parent().unwrap_or(Path::new("."))) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
        folder => folder?.sync_all(),
    }
}

/// A rename is durable only when its folder is.
fn sync_folder(folder: &Path) -> Result<(), StoreError> {
    File::open(folder)
        .and_then(|handle| handle.sync_all())
        .map_err(io_error("flush the folder to disk", folder))
}

#[cfg(test)]
mod tests {
    use super::*;

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
