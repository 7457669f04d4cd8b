//! The person beside a job.

use crate::failure::Failure;
use crate::linear::job::Reached;

/// Whoever says that the next point is wanted.
pub trait JobOperator {
    /// Asks for what `text` says; the axis holds its place under power meanwhile, and moves as soon as
    /// [`Self::is_done`] says so.
    ///
    /// # Errors
    /// When nobody is there.
    fn ask(&mut self, text: &str) -> Result<(), Failure>;

    /// Whether it was done; asked again and again.
    ///
    /// # Errors
    /// When nobody is there any more.
    fn is_done(&mut self) -> Result<bool, Failure>;

    /// A point was reached and is in the journal.
    fn reached(&mut self, _: &Reached) {}
}
