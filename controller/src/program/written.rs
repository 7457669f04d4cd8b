//! Files that people asked for: whole, or not there.

use std::fs::{self, File};
use std::io::{self, Write as _};
use std::path::Path;

use machine::records::write_new_or_replace;

use crate::Failure;

/// A new file that is whole: half of one that could not be written is removed.
///
/// # Errors
/// When there is something of this name already, which is left as it is; when it cannot be written.
pub(crate) fn create(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let mut file = File::create_new(path)?;
    let written = file.write_all(bytes);
    if written.is_err() {
        // The failure itself is what the operator is told.
        let _ = fs::remove_file(path);
    }
    written
}

/// Writes to `path`, whatever there was before: that stays where the new cannot be written.
///
/// # Errors
/// When it cannot be written, or its folder is not there.
pub(crate) fn replace(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    let failed = |source| Failure::File {
        path: path.to_owned(),
        source,
    };
    match fs::canonicalize(path) {
        // A pipe, say, which is written to and not replaced.
        Ok(there) if !there.is_file() => fs::write(path, bytes).map_err(failed),
        // Where a link leads to.
        Ok(there) => Ok(write_new_or_replace(&there, bytes)?),
        Err(_) => {
            let folder = match path.parent() {
                Some(folder) if !folder.as_os_str().is_empty() => folder,
                _ => Path::new("."),
            };
            // A folder that is mistyped is not made.
            let folder = fs::canonicalize(folder).map_err(failed)?;
            let name = path.file_name().unwrap_or_default();
            Ok(write_new_or_replace(&folder.join(name), bytes)?)
        }
    }
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::symlink;

    use super::*;

    #[test]
    fn what_is_replaced_is_the_file_that_is_named_and_nothing_but_a_file() {
        let folder = tempfile::tempdir().unwrap();
        let (file, link) = (folder.path().join("a"), folder.path().join("b"));
        replace(&file, b"one").unwrap();
        symlink(&file, &link).unwrap();
        replace(&link, b"two").unwrap();
        assert_eq!(fs::read(&file).unwrap(), b"two");
        assert!(link.is_symlink());
        replace(Path::new("/dev/null"), b"three").unwrap();
        assert!(!Path::new("/dev/null").is_file());
        let nowhere = folder.path().join("nowhere/a");
        assert!(replace(&nowhere, b"four").is_err());
        assert!(!nowhere.parent().unwrap().exists());
    }
}
