//! Opening of a serial line.

use std::fs::File;
use std::os::unix::fs::OpenOptionsExt as _;

use nix::errno::Errno;
use nix::fcntl::{FcntlArg, Flock, FlockArg, OFlag, fcntl};
use tokio_serial::SerialPort as _;

use super::super::open_line::OpenLine;
use super::super::os;
use super::{Parity, SerialSettings, StopBits};

const IN_USE: &str = "another program has it open, or it is not a serial device";

/// Why a serial line could not be opened.
#[derive(Debug)]
pub(in crate::transport) struct SerialError {
    pub(in crate::transport) source: std::io::Error,
    pub(in crate::transport) help: &'static str,
}

/// Opens and sets up a serial line; reads and writes on it never wait.
pub(in crate::transport) fn open(
    path: &str,
    settings: &SerialSettings,
) -> Result<OpenLine, SerialError> {
    let data_bits = match settings.data_bits {
        5 => tokio_serial::DataBits::Five,
        6 => tokio_serial::DataBits::Six,
        7 => tokio_serial::DataBits::Seven,
        _ => tokio_serial::DataBits::Eight,
    };
    let parity = match settings.parity {
        Parity::None => tokio_serial::Parity::None,
        Parity::Even => tokio_serial::Parity::Even,
        Parity::Odd => tokio_serial::Parity::Odd,
    };
    let stop_bits = match settings.stop_bits {
        StopBits::One => tokio_serial::StopBits::One,
        StopBits::Two => tokio_serial::StopBits::Two,
    };
    let held = require_alone(path)?;
    let mut port = tokio_serial::new(path, settings.baud)
        .data_bits(data_bits)
        .parity(parity)
        .stop_bits(stop_bits)
        .open_native()
        .map_err(|error| explain(path, error))?;
    // Not before: the adapter would see a line that was dropped.
    drop(held);
    // A pty has no modem lines (ENOTTY), some adapters do not either.
    if let Some(level) = settings.dtr {
        let _ = port.write_data_terminal_ready(level);
    }
    if let Some(level) = settings.rts {
        let _ = port.write_request_to_send(level);
    }
    // What came before the settings did may be garbled.
    let _ = port.clear(tokio_serial::ClearBuffer::Input);
    let descriptor = OpenLine::new(os::take_descriptor(port));
    fcntl(&descriptor, FcntlArg::F_SETFL(OFlag::O_NONBLOCK)).map_err(|errno| SerialError {
        source: errno.into(),
        help: "this is not a serial line (terminal device)",
    })?;
    Ok(descriptor)
}

/// Opens the line at `path` where no other program has locked it.
///
/// The library gives up the exclusive use of a line (TIOCNXCL) also where it did not get its lock, and would take it
/// from the program that has it.
fn require_alone(path: &str) -> Result<File, SerialError> {
    let flags = OFlag::O_NOCTTY | OFlag::O_NONBLOCK;
    let opened = File::options()
        .read(true)
        .write(true)
        .custom_flags(flags.bits())
        .open(path);
    let file = opened.map_err(|source| SerialError {
        help: match source.raw_os_error().map(Errno::from_raw) {
            Some(Errno::EMFILE | Errno::ENFILE) => "allow more open files (`ulimit -n`)",
            _ => help_for(path),
        },
        source: plain(source),
    })?;
    let in_use = |errno: Errno| SerialError {
        source: errno.into(),
        help: IN_USE,
    };
    let locked = Flock::lock(file, FlockArg::LockExclusiveNonblock);
    let locked = locked.map_err(|(_, errno)| in_use(errno))?;
    locked.unlock().map_err(|(_, errno)| in_use(errno))
}

/// The same error without its number, which says nothing to an operator.
fn plain(error: std::io::Error) -> std::io::Error {
    match error.raw_os_error().map(Errno::from_raw) {
        Some(errno) => std::io::Error::new(error.kind(), errno.desc()),
        None => error,
    }
}

fn explain(path: &str, error: tokio_serial::Error) -> SerialError {
    SerialError {
        source: error.into(),
        help: help_for(path),
    }
}

/// What to do where a line cannot be opened. tokio-serial folds every cause into "no device": ask the file system.
fn help_for(path: &str) -> &'static str {
    let found = std::fs::metadata(path);
    if found.as_ref().is_err_and(is_denied)
        || File::open(path).is_err_and(|error| is_denied(&error))
    {
        "no permission; add the user to the group of the device (often `dialout`)"
    } else if found.is_err() {
        "`ls /dev/serial/by-id` lists what is plugged in"
    } else {
        IN_USE
    }
}

fn is_denied(error: &std::io::Error) -> bool {
    error.kind() == std::io::ErrorKind::PermissionDenied
}
