//! Regular files of bounded size, in folders that others can write.
//!
//! A FIFO would hang its reader, a sparse file takes no disk and all of the memory, and a symbolic link leads
//! elsewhere.

use std::fs::{File, OpenOptions};
use std::io::{self, Read, Take};
use std::os::unix::fs::OpenOptionsExt as _;
use std::path::Path;

use nix::fcntl::OFlag;

/// So long a journal may be, in bytes: many times the longest that a run leaves.
pub const JOURNAL_MAX: u64 = 256 << 20;

/// Opens the file at `path`, to be read as far as it goes now, `most` bytes at most.
///
/// # Errors
/// When it cannot be opened, is no regular file, or is longer.
pub fn open_regular(path: &Path, most: u64) -> io::Result<Take<File>> {
    // Not to wait for the other end of a FIFO.
    let flags = OFlag::O_NOFOLLOW | OFlag::O_NONBLOCK;
    let opened = OpenOptions::new()
        .read(true)
        .custom_flags(flags.bits())
        .open(path);
    let file = opened.map_err(|error| match error.raw_os_error() {
        Some(code) if code == nix::errno::Errno::ELOOP as i32 => {
            refused("it is a symbolic link; name the file itself".into())
        }
        _ => error,
    })?;
    // What was opened, whatever has its name by now.
    let seen = file.metadata()?;
    if !seen.is_file() {
        return Err(refused("it is no regular file".into()));
    }
    if seen.len() > most {
        let length = seen.len();
        return Err(refused(format!(
            "it has {length} bytes; {most} are read at most"
        )));
    }
    // What is appended meanwhile is of the next look.
    Ok(file.take(seen.len()))
}

fn refused(what: String) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidInput, what)
}
