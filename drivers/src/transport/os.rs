//! The system calls that no safe library offers.

#![expect(
    unsafe_code,
    reason = "serialport gives its descriptor away only as a number, and nix has neither \
              sched_setscheduler, setpriority, TIOCSBRK nor TIOCNXCL"
)]

use nix::errno::Errno;
use std::os::fd::{AsFd, AsRawFd, FromRawFd, IntoRawFd, OwnedFd};

/// Takes over the descriptor of an open port.
pub(super) fn take_descriptor(port: impl IntoRawFd) -> OwnedFd {
    // SAFETY: `into_raw_fd` hands over an open descriptor that nobody else closes.
    unsafe { OwnedFd::from_raw_fd(port.into_raw_fd()) }
}

/// Whether the calling thread comes before all ordinary ones, whoever asked for that.
pub(super) fn is_real_time() -> bool {
    // SAFETY: 0 is the calling thread; nothing is passed by reference.
    let policy = unsafe { libc::sched_getscheduler(0) };
    matches!(
        policy & !libc::SCHED_RESET_ON_FORK,
        libc::SCHED_FIFO | libc::SCHED_RR
    )
}

/// Puts the calling thread under SCHED_FIFO.
///
/// # Errors
/// EPERM without CAP_SYS_NICE or a real-time limit (`ulimit -r`).
pub(super) fn schedule_fifo(priority: i32) -> Result<(), Errno> {
    let parameter = libc::sched_param {
        sched_priority: priority,
    };
    // SAFETY: the call reads one `sched_param`; 0 is the calling thread.
    let result = unsafe { libc::sched_setscheduler(0, libc::SCHED_FIFO, &raw const parameter) };
    Errno::result(result).map(drop)
}

/// Puts the calling thread back under the ordinary scheduler.
pub(super) fn schedule_ordinary() {
    let parameter = libc::sched_param { sched_priority: 0 };
    // SAFETY: as above. Giving up a priority is never refused.
    let _ = unsafe { libc::sched_setscheduler(0, libc::SCHED_OTHER, &raw const parameter) };
}

/// Lets the calling thread compute almost only where nobody else wants to (nice 19).
///
/// # Errors
/// When the system does not permit it.
pub(super) fn give_way() -> Result<(), Errno> {
    // Source: setpriority(2): on Linux the value belongs to a thread; 0 is the calling one.
    // SAFETY: nothing is passed by reference.
    let result = unsafe { libc::setpriority(libc::PRIO_PROCESS, 0, 19) };
    Errno::result(result).map(drop)
}

/// Holds a serial line low, or lets go of it. `tcsendbreak` would wait until the end.
///
/// # Errors
/// ENOTTY where there is no line.
pub(super) fn set_break(descriptor: &impl AsFd, on: bool) -> Result<(), Errno> {
    let request = if on { libc::TIOCSBRK } else { libc::TIOCCBRK };
    // SAFETY: the descriptor is open as long as it is borrowed; both requests take no argument.
    let result = unsafe { libc::ioctl(descriptor.as_fd().as_raw_fd(), request) };
    Errno::result(result).map(drop)
}

/// Lets others open a serial line that was opened for this program alone.
pub(super) fn give_back(descriptor: &impl AsFd) {
    // SAFETY: the descriptor is open as long as it is borrowed; the request takes no argument.
    // What is no terminal any more is nobody's.
    let _ = unsafe { libc::ioctl(descriptor.as_fd().as_raw_fd(), libc::TIOCNXCL) };
}
