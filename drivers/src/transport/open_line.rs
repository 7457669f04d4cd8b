//! A serial line that is open for this program alone.

use std::os::fd::{AsFd, BorrowedFd, OwnedFd};

use super::os;

/// The line (TIOCEXCL), until it is given back. The terminal of an adapter forgets that with its last descriptor. A
/// pseudo-terminal remembers it as long as its other end is open, and would let nobody but root open it any more.
#[derive(Debug)]
pub(super) struct OpenLine(OwnedFd);

impl OpenLine {
    pub(super) const fn new(descriptor: OwnedFd) -> Self {
        Self(descriptor)
    }
}

impl AsFd for OpenLine {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.0.as_fd()
    }
}

impl Drop for OpenLine {
    fn drop(&mut self) {
        os::give_back(&self.0);
    }
}
