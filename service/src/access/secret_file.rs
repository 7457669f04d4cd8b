//! Files that others must not read: what is wrong with their mode, and with what to put it right.

use std::fs::{self, Metadata};
use std::io;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};

/// Others may do nothing with it, and the group may not write it: members of the service's group ask it, and no more.
const TOO_MUCH: u32 = 0o027;

/// A file that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum SecretError {
    /// The system.
    #[error("{}: {source}", path.display())]
    Io {
        /// Which file.
        path: PathBuf,
        /// What it said.
        source: io::Error,
    },
    /// Its mode lets others in.
    #[error(
        "{}: its mode is {mode:o}, which lets others read or change it; run `chmod 640 {}` (or 600)",
        path.display(),
        path.display()
    )]
    Open {
        /// Which file.
        path: PathBuf,
        /// Its mode.
        mode: u32,
    },
}

/// What `path` says.
///
/// # Errors
/// When others may read or write it, or it cannot be read.
pub(super) fn read(path: &Path) -> Result<String, SecretError> {
    check(path)?;
    fs::read_to_string(path).map_err(|source| io_of(path, source))
}

/// # Errors
/// When others may read or write `path`, or it is not there.
pub(super) fn check(path: &Path) -> Result<Metadata, SecretError> {
    let seen = fs::metadata(path).map_err(|source| io_of(path, source))?;
    let mode = seen.permissions().mode() & 0o777;
    if mode & TOO_MUCH == 0 {
        return Ok(seen);
    }
    Err(SecretError::Open {
        path: path.to_owned(),
        mode,
    })
}

pub(super) fn io_of(path: &Path, source: io::Error) -> SecretError {
    SecretError::Io {
        path: path.to_owned(),
        source,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_others_can_read_is_refused_with_the_command_that_closes_it() {
        let file = tempfile::NamedTempFile::new().unwrap();
        let path = file.path();
        for (mode, is_good) in [
            (0o600, true),
            (0o640, true),
            (0o400, true),
            (0o644, false),
            (0o660, false),
            (0o601, false),
        ] {
            fs::set_permissions(path, fs::Permissions::from_mode(mode)).unwrap();
            assert_eq!(read(path).is_ok(), is_good, "{mode:o}");
        }
        let said = read(path).unwrap_err().to_string();
        assert!(
            said.contains(&format!("chmod 640 {}", path.display())),
            "{said}"
        );
    }
}
