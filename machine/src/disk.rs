//! Waiting for the disk of the records while the machine lives on.

use core::time::Duration;
use std::path::PathBuf;

use crate::failure::Failure;
use crate::machine::{Machine, Supervision};
use crate::records::{Asked, Store, StoreError};

/// From one look at the disk to the next.
const LOOK_EVERY: Duration = Duration::from_millis(2);
/// Where the machine's clock stands meanwhile: how long a stop request may go unseen.
const LOOK_HELD: Duration = Duration::from_millis(20);

/// What `work` returns, which the thread of the records does after all that was ordered before; the machine lives on
/// meanwhile. In a store that orders nothing it is done at once.
///
/// # Errors
/// As [`Machine::tick`]; when the disk does not answer. `work` is done then all the same, if the disk ever does it.
pub fn ask_disk<R: Send + 'static>(
    machine: &mut Machine,
    store: &Store,
    work: impl FnOnce(&Store) -> R + Send + 'static,
) -> Result<R, Failure> {
    match store.ask(work)? {
        Asked::Done(answer) => Ok(answer),
        Asked::Under(mut answer) => loop {
            if let Some(answer) = answer.poll()? {
                return Ok(answer);
            }
            let next = machine.now() + LOOK_EVERY;
            machine.tick(next)?;
        },
        Asked::Held(mut answer) => loop {
            if let Some(answer) = answer.wait_for(LOOK_HELD)? {
                return Ok(answer);
            }
            let stop = machine.stop_request();
            if machine.supervision != Supervision::Stopping && stop.is_requested() {
                return Err(stop.failure());
            }
        },
    }
}

/// Waits until all that `store` was ordered to write is done.
///
/// # Errors
/// As [`ask_disk`]; the outer one. The inner one is the first that went wrong.
pub fn settle(machine: &mut Machine, store: &Store) -> Result<Result<(), StoreError>, Failure> {
    ask_disk(machine, store, |_| ())?;
    Ok(store.heard())
}

/// Lets `store` have the content of the journal `path` when it is read next.
///
/// # Errors
/// As [`ask_disk`]. That it cannot be read is heard by who reads it.
pub fn read_ahead(machine: &mut Machine, store: &Store, path: PathBuf) -> Result<(), Failure> {
    ask_disk(machine, store, move |store| store.hold(&path))
}
