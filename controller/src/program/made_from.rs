//! What was made from a run.

use std::path::Path;

use truestage::store::{CalibrationRecord, Content};
use truestage::{Failure, store_of_journal};

/// The calibrations of a kind that were made from the journal at `path`.
pub(crate) fn made_from<C: Content>(
    path: &Path,
) -> Result<Vec<(String, CalibrationRecord<C>)>, Failure> {
    Ok(match (store_of_journal(path), path.file_name()) {
        (Some(store), Some(name)) => store.made_from(&name.to_string_lossy())?,
        _ => Vec::new(),
    })
}
