//! Failures of one kind of machine, which [`crate::Failure`] carries without knowing the kind.

use core::any::Any;
use core::error::Error;
use core::fmt;

/// Why a machine of one kind did not do what it was asked.
pub trait KindFailure: Error + Any + Send + Sync {
    /// As [`crate::Failure::exit_code`].
    fn exit_code(&self) -> u8;

    /// As [`machine::Layered::depends_on_time`].
    fn depends_on_time(&self) -> bool {
        false
    }

    /// Whether it says that a calibration makes the machine worse.
    fn tells_worse(&self) -> bool {
        false
    }
}

/// The failure of some kind; it says what that one says.
#[derive(Debug)]
pub struct OfKind(Box<dyn KindFailure>);

impl OfKind {
    pub(super) fn exit_code(&self) -> u8 {
        self.0.exit_code()
    }

    pub(super) fn depends_on_time(&self) -> bool {
        self.0.depends_on_time()
    }

    pub(super) fn tells_worse(&self) -> bool {
        self.0.tells_worse()
    }

    pub(super) fn downcast_ref<K: KindFailure>(&self) -> Option<&K> {
        let any: &dyn Any = &*self.0;
        any.downcast_ref()
    }
}

impl<K: KindFailure> From<K> for OfKind {
    fn from(failure: K) -> Self {
        Self(Box::new(failure))
    }
}

impl fmt::Display for OfKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

impl Error for OfKind {
    fn source(&self) -> Option<&(dyn Error + 'static)> {
        self.0.source()
    }
}
