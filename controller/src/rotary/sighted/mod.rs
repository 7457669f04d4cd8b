//! Placements whose lines a person reads: typed line by line, or imported from a file (step 2 of
//! system S2 without a detector).
//!
//! The passes are those of a detector; so are the journal's, the evaluation and the limits. Each value
//! stands in the journal as soon as it was typed, and may be typed again until its placement is closed.
//! Where nothing is driven the machine is not needed: neither its buses nor power.

pub(crate) mod alone;
mod answer;
mod dialog;
mod driven;
mod import;
mod person;
mod stand;
#[cfg(test)]
#[cfg(feature = "program")]
mod tests;

/// What whoever keeps a machine calls a question for the value of a line.
pub(crate) const READ_LINE: &str = "read_line";
/// The same for whether a placement shall be closed.
pub(crate) const CLOSE_PLACEMENT: &str = "close_placement";
/// The word that closes it; at a terminal it is Enter alone.
pub(crate) const CLOSE: &str = "close";

pub use person::{Asked, Person, Question};
