//! Whether a stored calibration belongs to a machine, as far as its configuration says who it is.

use machine::records::{RecordHead, Store};

use crate::Failure;
use crate::config::Loaded;

/// The head of calibration `id`. Who the drive is shows only when the machine is connected.
///
/// # Errors
/// It cannot be read, or is of another stage or configuration.
pub(super) fn head_of(loaded: &Loaded, store: &Store, id: &str) -> Result<RecordHead, Failure> {
    let head = store.glance(id)?.head;
    let here = RecordHead {
        stage_serial: loaded.config.machine.stage_serial.clone(),
        config_hash: loaded.hash.as_str().to_owned(),
        ..head.clone()
    };
    head.belongs_to(id, &here, &loaded.hash)?;
    Ok(head)
}
