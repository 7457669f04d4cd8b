//! The zero of an axis over a restart, where its drive proves that it has kept its reference.
//!
//! When an axis has its zero, what its drive shows of it is noted beside the machine's records; before it loses it, the
//! note goes. A start compares the two ([`drivers::device::ReferenceProof`]), and an axis without a note, or with one
//! that does not fit, has no zero. The order makes any moment safe to die in: the note is never older than the zero.

use core::time::Duration;
use std::io;
use std::time::{SystemTime, UNIX_EPOCH};

use drivers::device::{DriveCommand, ReferenceLost, ServoDrive};

use crate::disk::ask_disk;
use crate::failure::Failure;
use crate::machine::Machine;
use crate::records::{IdentityRecord, Store};
use crate::zero_notes::{KeptZeros, Note, VERSION};

/// Notes in `store` what the drives of `machine` show of their reference, of those that prove it, and believes at a start
/// what was noted of a machine of the same `configuration` (its hash).
pub fn keep(machine: &mut Machine, store: Store, configuration: String) {
    machine.kept_zeros = Some(KeptZeros {
        store,
        configuration,
    });
}

/// The store in which zeros are noted; `None` where they are not.
pub fn store_of(machine: &Machine) -> Option<Store> {
    machine.kept_zeros.as_ref().map(|kept| kept.store.clone())
}

/// Whether the drive of `axis` can prove that it kept its zero over a restart.
pub fn is_proved(machine: &Machine, axis: &str) -> bool {
    let at = machine.devices.drive_index(axis);
    at.is_ok_and(|at| machine.devices.drive(at).proves_reference())
}

impl Machine {
    /// Says that `axis` has its zero, until its drive loses power or the machine is started anew;
    /// or that it has none.
    ///
    /// # Errors
    /// When there is no such axis; when what was noted of an earlier zero cannot be removed
    /// ([`keep`]).
    pub fn set_zeroed(&mut self, axis: &str, zeroed: bool) -> Result<(), Failure> {
        let at = self.devices.drive_index(axis)?;
        self.zeroed[at] = false;
        forget(self, at)?;
        if zeroed {
            note_zero(self, at)?;
            self.zeroed[at] = true;
        }
        Ok(())
    }
}

/// The axis has its zero: its drive is marked, and what it shows noted. That the drive refuses takes the zero from nobody;
/// a restart will only know nothing of it.
fn note_zero(machine: &mut Machine, at: usize) -> Result<(), Failure> {
    if machine.kept_zeros.is_none() || !machine.devices.drive(at).proves_reference() {
        return Ok(());
    }
    if let Err(why) = mark_and_note(machine, at)? {
        let axis = machine.devices.name(at);
        machine.notices.warn(format!(
            "axis {axis}: its zero will not outlast a restart: {why}"
        ));
    }
    Ok(())
}

/// Has the drive show its reference, after it was marked; why it cannot. What stops the machine stops it here, too.
fn read(
    machine: &mut Machine,
    at: usize,
    mark: Option<u32>,
) -> Result<Result<(), String>, Failure> {
    let command = DriveCommand::ReadReference { mark };
    match machine.control(at, command, "reading its reference", LIMIT) {
        Ok(()) => Ok(Ok(())),
        Err(refused @ (Failure::Device { .. } | Failure::Overdue { .. })) => {
            Ok(Err(refused.to_string()))
        }
        Err(failure) => Err(failure),
    }
}

/// Why a drive proves nothing now.
#[derive(Debug, thiserror::Error)]
enum Unproved {
    /// It could not be asked.
    #[error("{0}")]
    Unread(String),
    #[error(transparent)]
    Lost(#[from] ReferenceLost),
}

/// The longest that some dozen SDO transfers may take.
const LIMIT: Duration = Duration::from_secs(2);

/// An axis that is homed on its way stops somewhere behind: it is read again, so many times and so long after.
const READINGS: u32 = 40;
const SETTLING: Duration = Duration::from_millis(50);

/// `read` until the axis stood meanwhile; what `judge` says of that then.
fn read_at_rest<R>(
    machine: &mut Machine,
    at: usize,
    mark: Option<u32>,
    judge: impl Fn(&mut dyn ServoDrive) -> Result<R, ReferenceLost>,
) -> Result<Result<R, Unproved>, Failure> {
    let mut readings = READINGS;
    loop {
        if let Err(why) = read(machine, at, mark)? {
            return Ok(Err(Unproved::Unread(why)));
        }
        readings -= 1;
        match judge(machine.devices.drive_mut(at)) {
            Err(ReferenceLost::Moving { .. }) if readings > 0 => {
                let until = machine.now() + SETTLING;
                machine.run_until(until)?;
            }
            judged => return Ok(judged.map_err(Unproved::from)),
        }
    }
}

fn mark_and_note(machine: &mut Machine, at: usize) -> Result<Result<(), String>, Failure> {
    let axis = machine.devices.name(at);
    let mark = Some(unlike_any_other(&axis));
    let shown = match read_at_rest(machine, at, mark, |drive| drive.reference())? {
        Ok(shown) => shown,
        Err(why) => return Ok(Err(why.to_string())),
    };
    let Some(kept) = &machine.kept_zeros else {
        return Ok(Ok(()));
    };
    let (store, configuration) = (kept.store.clone(), kept.configuration.clone());
    let note = Note {
        schema_version: VERSION,
        configuration,
        drive: drive_record(machine, at),
        mark: shown.mark,
        homed: shown.homed,
        homing_method: shown.method,
        home_offset: shown.home_offset,
        polarity: shown.polarity,
        position_counts: shown.position,
        encoder_increments: shown.increments,
        moved_increments: shown.moved,
        error_code: shown.error_code,
        axis,
    };
    let (axis, text) = (note.axis.clone(), note.text());
    let noted = ask_disk(machine, &store, move |store| {
        store.write_zero_note(&axis, text)
    })?;
    Ok(noted.map_err(|error| error.to_string()))
}

/// The axis has no zero any more, or is about to be moved somewhere else by a search for it. Also of a drive that proves
/// nothing by this configuration: another one of the same machine may ask it to.
pub(crate) fn forget(machine: &mut Machine, at: usize) -> Result<(), Failure> {
    let Some(store) = store_of(machine) else {
        return Ok(());
    };
    let axis = machine.devices.name(at);
    let path = store.hide_zero_note(&axis);
    let removed = ask_disk(machine, &store, move |store| store.remove_zero_note(&axis))?;
    removed.map_err(|source| Failure::ZeroNoted { path, source })
}

/// How long a stop that is over waits for the disk: its answer is for the operator alone.
const AFTER_A_STOP: Duration = Duration::from_millis(100);

/// Forgets what an alarm has made doubtful, now that there is time for files.
pub(crate) fn forget_doubted(machine: &mut Machine) {
    let Some(store) = store_of(machine) else {
        return machine.doubted.fill(false);
    };
    for at in 0..machine.doubted.len() {
        if !std::mem::take(&mut machine.doubted[at]) {
            continue;
        }
        let axis = machine.devices.name(at);
        let path = store.hide_zero_note(&axis);
        let asked = store.ask(move |store| store.remove_zero_note(&axis));
        let removed = asked.and_then(|asked| asked.within(AFTER_A_STOP));
        let failure = match removed {
            Ok(Some(Ok(()))) => continue,
            Ok(Some(Err(source))) => Failure::ZeroNoted { path, source },
            Ok(None) => Failure::ZeroNoted {
                path,
                source: io::ErrorKind::TimedOut.into(),
            },
            Err(failure) => failure.into(),
        };
        machine.notices.warn(failure.to_string());
    }
}

/// At a start, everything stands: gives their zeros back to the axes whose drives have kept their reference.
///
/// # Errors
/// Whatever stops the machine. That a drive does not prove it is none: its axis has no zero then.
pub(crate) fn take_up(machine: &mut Machine) -> Result<(), Failure> {
    forget_doubted(machine);
    for at in 0..machine.devices.drive_count() {
        if !machine.devices.drive(at).proves_reference() {
            continue;
        }
        let axis = machine.devices.name(at);
        let Some(note) = machine.kept_zeros.as_ref().and_then(|it| it.read(&axis)) else {
            continue;
        };
        let lost = match still_holds(machine, at, &note)? {
            Holds::Yes => {
                machine.zeroed[at] = true;
                continue;
            }
            Holds::Unread(why) => why,
            Holds::No(why) => {
                forget(machine, at)?;
                why
            }
            Holds::Refuted(why) => {
                forget(machine, at)?;
                // A note of the same mark may lie elsewhere.
                let _ = read(machine, at, Some(0))?;
                why
            }
        };
        machine.notices.warn(format!(
            "axis {axis}: it must be zeroed again, its zero was not kept: {lost}"
        ));
    }
    Ok(())
}

enum Holds {
    Yes,
    /// It could not be asked, or moves.
    Unread(String),
    /// The note is of something else.
    No(String),
    /// The drive speaks against it. What was found wrong once is not believed when it looks right later: a fault that was
    /// reset leaves no trace.
    Refuted(String),
}

fn still_holds(machine: &mut Machine, at: usize, note: &Note) -> Result<Holds, Failure> {
    if let Some(other) = is_of_another(machine, at, note) {
        return Ok(Holds::No(other.into()));
    }
    let then = note.reference();
    let judged = read_at_rest(machine, at, None, |drive| drive.take_up_reference(&then))?;
    let Err(why) = judged else {
        return Ok(Holds::Yes);
    };
    let said = why.to_string();
    Ok(match why {
        Unproved::Unread(_)
        | Unproved::Lost(ReferenceLost::Moving { .. } | ReferenceLost::NoEncoder) => {
            Holds::Unread(said)
        }
        // The object holds what another has written.
        Unproved::Lost(ReferenceLost::Mark { .. }) => Holds::No(said),
        Unproved::Lost(_) => Holds::Refuted(said),
    })
}

/// Why a note says nothing of this axis, whatever its drive shows.
fn is_of_another(machine: &Machine, at: usize, note: &Note) -> Option<&'static str> {
    let configuration = machine
        .kept_zeros
        .as_ref()
        .map(|it| it.configuration.as_str());
    if note.schema_version != VERSION {
        Some("another version of this program has noted it")
    } else if note.axis != machine.devices.name(at)
        || Some(note.configuration.as_str()) != configuration
    {
        Some("the configuration was changed since")
    } else if note.drive != drive_record(machine, at) {
        Some("it is another drive")
    } else {
        None
    }
}

fn drive_record(machine: &Machine, at: usize) -> IdentityRecord {
    let identity = machine.devices.drive(at).identity();
    identity
        .as_ref()
        .map(IdentityRecord::from)
        .unwrap_or_default()
}

/// A mark that no earlier zero has left: of the axis and the time. Never 0, which is what nobody wrote.
fn unlike_any_other(axis: &str) -> u32 {
    let now = SystemTime::now().duration_since(UNIX_EPOCH);
    let nanos = now.map_or(0, |it| it.as_nanos());
    let hash = blake3::hash(format!("{axis} {nanos} {}", std::process::id()).as_bytes());
    let [a, b, c, d, ..] = *hash.as_bytes();
    u32::from_le_bytes([a, b, c, d]).max(1)
}
