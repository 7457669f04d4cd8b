//! Whether a stored calibration belongs to a machine, as far as its configuration says who it is.

use machine::records::{RecordHead, Store, StoreError};

use crate::Failure;
use crate::config::Loaded;

/// The head of calibration `id`. Who the drive is shows only when the machine is connected.
///
/// # Errors
/// It cannot be read, or is of another stage or configuration.
pub(super) fn head_of(loaded: &Loaded, store: &Store, id: &str) -> Result<RecordHead, Failure> {
    let head = store.glance(id)?.head;
    belongs(loaded, &head, id).map_err(|error| match error {
        StoreError::Foreign {
            id,
            what,
            expected,
            seen,
            ..
        } => StoreError::Foreign {
            id,
            what,
            expected,
            seen,
            instead: newest_that_belongs(loaded, store, &head.axis).map(Into::into),
        },
        other => other,
    })?;
    Ok(head)
}

/// The newest stored calibration of `axis` that belongs to this machine.
fn newest_that_belongs(loaded: &Loaded, store: &Store, axis: &str) -> Option<String> {
    let all = store.list().ok()?.into_iter();
    let own = all.filter_map(|id| {
        let head = store.glance(&id).ok()?.head;
        let is_own = head.axis == axis && belongs(loaded, &head, &id).is_ok();
        is_own.then_some((head.created, id))
    });
    own.max().map(|it| it.1)
}

fn belongs(loaded: &Loaded, head: &RecordHead, id: &str) -> Result<(), StoreError> {
    let here = RecordHead {
        stage_serial: loaded.config.machine.stage_serial.clone(),
        config_hash: loaded.hash.as_str().to_owned(),
        ..head.clone()
    };
    head.belongs_to(id, &here, &loaded.hash)
}
