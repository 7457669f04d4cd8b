//! What is on record of a zero that was found earlier.

use machine::{ask_disk, kept_zero};
use units::Metres;

use crate::config::AxisConfig;
use crate::failure::Failure;
use crate::handle::Core;
use crate::linear::LinearLog;
use crate::linear::memory::AxisMemory;
use crate::memories::Memories;
use crate::store::Store;

/// What the newest zero of an axis or a gantry has on record. A trend is worth having but never worth failing for:
/// a journal that cannot be read is no reason not to zero.
///
/// # Errors
/// Whatever stops the machine meanwhile.
pub(super) fn newest_zero(
    core: &mut Core<'_>,
    store: &Store,
    name: &str,
) -> Result<Option<LinearLog>, Failure> {
    let name = name.to_owned();
    Ok(ask_disk(core, store, move |store| {
        let path = store.newest_run("zero", &name).ok().flatten()?;
        Some(store.read_journal::<LinearLog>(&path).ok()?.log)
    })?)
}

/// Standard uncertainty of the zero that `axis` has kept over a start of this program, which remembers none.
///
/// # Errors
/// When its zero cannot be taken from it. It is, where nothing on record says how uncertain it is: a position that has a
/// zero but no uncertainty would be told with one that is too small.
pub(super) fn kept_since(
    core: &mut Core<'_>,
    memories: &Memories,
    axis: &str,
    config: &AxisConfig,
) -> Result<Option<Metres>, Failure> {
    let remembered = memories
        .get::<AxisMemory>(axis)
        .and_then(|it| it.course.zero);
    let asks = remembered.is_none() && config.zero.is_some();
    if !asks || !kept_zero::is_proved(core, axis) || !core.is_zeroed(axis) {
        return Ok(remembered);
    }
    let Some(store) = kept_zero::store_of(core) else {
        return Ok(remembered);
    };
    let log = newest_zero(core, &store, axis)?;
    let zero = log.and_then(|mut log| log.zeros.pop());
    if zero.is_none() {
        core.observer().warning(&format!(
            "axis {axis}: it must be zeroed again: its drive kept the zero, but the journal that says how uncertain it is \
             is gone"
        ));
        core.set_zeroed(axis, false)?;
    }
    Ok(zero.map(|it| Metres(it.standard_uncertainty_m)))
}
