//! What was made from a run.

use std::path::Path;

use machine::records::{CalibrationRecord, Content, Store};

use crate::Failure;
use crate::stores::contents;

/// The calibrations of a kind that were made from the journal at `path`.
pub(crate) fn made_from<C: Content>(
    path: &Path,
) -> Result<Vec<(String, CalibrationRecord<C>)>, Failure> {
    Ok(match source(path) {
        Some((store, name)) => store.made_from(&name)?,
        None => Vec::new(),
    })
}

/// The store that the journal at `path` lies in, and what calibrations call the journal; `None` when it
/// lies elsewhere.
pub(crate) fn source(path: &Path) -> Option<(Store, String)> {
    let name = path.file_name()?.to_string_lossy().into_owned();
    Some((Store::of_journal(path, contents())?, name))
}
