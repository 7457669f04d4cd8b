//! What a thread that must not be late asks of the system: SCHED_FIFO and memory that stays.
//!
//! Both may be refused (`ulimit -r`, `ulimit -l`, CAP_SYS_NICE, CAP_IPC_LOCK); the thread runs
//! all the same, and whoever reads the figures must know.

use core::fmt;
use core::marker::PhantomData;

use nix::errno::Errno;
use nix::sys::mman::{MlockAllFlags, mlockall, munlockall};

use super::os;
use super::sync_thread::Scheduling;

/// What the system granted; given back when it is dropped.
#[derive(Debug)]
pub struct RealTime {
    scheduling: Scheduling,
    /// A thread that was real time before keeps its own priority, now and afterwards.
    was_before: bool,
    locked: Result<(), Errno>,
    /// It belongs to the thread that asked.
    here: PhantomData<*const ()>,
}

impl RealTime {
    /// Asks for both, for the calling thread (its priority) and the process (its memory).
    pub fn ask() -> Self {
        let was_before = os::is_real_time();
        let scheduling = if was_before {
            Scheduling::RealTime
        } else {
            Scheduling::ask()
        };
        Self {
            scheduling,
            was_before,
            locked: mlockall(MlockAllFlags::MCL_CURRENT | MlockAllFlags::MCL_FUTURE),
            here: PhantomData,
        }
    }

    /// How the thread is scheduled.
    pub const fn scheduling(&self) -> Scheduling {
        self.scheduling
    }

    /// Whether no page of the process can be swapped out.
    pub const fn is_locked(&self) -> bool {
        self.locked.is_ok()
    }
}

impl fmt::Display for RealTime {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.scheduling {
            Scheduling::RealTime => f.write_str("SCHED_FIFO")?,
            Scheduling::Starting => f.write_str("ordinary scheduling")?,
            Scheduling::Ordinary { errno } => {
                let errno = Errno::from_raw(errno);
                write!(f, "ordinary scheduling ({errno}; see `ulimit -r`)")?;
            }
        }
        match self.locked {
            Ok(()) => f.write_str(", memory locked"),
            Err(errno) => write!(f, ", memory not locked ({errno}; see `ulimit -l`)"),
        }
    }
}

impl Drop for RealTime {
    fn drop(&mut self) {
        if self.scheduling == Scheduling::RealTime && !self.was_before {
            os::schedule_ordinary();
        }
        if self.locked.is_ok() {
            let _ = munlockall();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What a program asked for its own thread is not taken from it by what it calls.
    #[test]
    fn a_thread_that_was_real_time_before_still_is_afterwards() {
        let before = os::is_real_time();
        let outer = RealTime::ask();
        drop(RealTime::ask());
        let granted = outer.scheduling() == Scheduling::RealTime;
        assert_eq!(os::is_real_time(), granted);
        drop(outer);
        assert_eq!(os::is_real_time(), before);
    }

    #[test]
    fn what_was_granted_is_said() {
        let granted = RealTime::ask();
        let text = granted.to_string();
        assert_eq!(
            granted.is_locked(),
            text.contains("memory locked"),
            "{text}"
        );
        assert_eq!(
            granted.scheduling() == Scheduling::RealTime,
            text.starts_with("SCHED_FIFO"),
            "{text}"
        );
    }
}
