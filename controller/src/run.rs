//! What the runs of all kinds of machine have in common: who the machine is and who measures, the
//! time of day, and a note of what ended a run.

use core::f64::consts::TAU;
use std::path::PathBuf;

use crate::certificate;
use crate::config::{ConfigHash, MachineConfig};
use crate::failure::Failure;
use crate::made_by::made_by;
use crate::store::{
    EnvironmentRecord, IdentityRecord, InstrumentRecord, Journal, Log, RecordHead, SCHEMA_VERSION,
    Store, StoreError,
};
use crate::time_of_day::time_of_day;

/// How a calibration is made.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct CalibrateOptions {
    /// Continue this journal instead of starting a new one.
    pub resume: Option<PathBuf>,
    /// Save although the closure error is above its limit.
    pub accept_drift: bool,
    /// Store what is found, and go on using what was used before.
    pub aside: bool,
}

/// The time of day for records, UTC, RFC 3339, to the second. Control never reads it.
pub(crate) fn utc_now() -> String {
    time_of_day().strftime("%Y-%m-%dT%H:%M:%SZ").to_string()
}

/// Whether the certificates of `config` whose keys begin with `of` hold today.
///
/// # Errors
/// Of the first that does not: nothing is measured with what it certifies.
pub(crate) fn require_certified(config: &MachineConfig, of: &str) -> Result<(), Failure> {
    let today = certificate::today();
    let own = config.certificates().into_iter();
    for (key, _, it) in own.filter(|it| it.0.starts_with(of)) {
        let Some(certified) = &it.certified else {
            continue;
        };
        let standing = certified.standing(today, it.remind_days);
        if standing.is_refused() {
            return Err(Failure::NotCertified {
                key,
                file: it.file.clone(),
                standing: standing.to_string(),
                help: standing.help(),
            });
        }
    }
    Ok(())
}

/// The failure of a verb whose section of the configuration is missing.
pub(crate) fn missing(axis: &str, section: &'static str) -> Failure {
    Failure::NotConfigured {
        axis: axis.to_owned(),
        section,
    }
}

pub(crate) fn note_failure<L: Log>(journal: &mut Journal<L>, failure: &Failure) {
    // The failure itself is on its way to the operator; a journal that cannot take the note
    // as well changes nothing about it.
    let _ = journal.fail(failure.to_string());
}

/// Waits until all that `store` was ordered to write is on the disk.
///
/// # Errors
/// Of the first that is not; whatever stops `machine` meanwhile.
pub(crate) fn settle(machine: &mut machine::Machine, store: &Store) -> Result<(), Failure> {
    Ok(machine::settle(machine, store)??)
}

/// Whether what `stored` a calibration has put it into use.
pub(crate) fn is_used_by(stored: &Result<(), Failure>) -> bool {
    matches!(
        stored,
        Ok(()) | Err(Failure::Store(StoreError::UseUnsynced { .. }))
    )
}

/// The head of a record without measurements, which says who `machine` is.
pub(crate) fn this_machine(
    machine: &machine::Machine,
    (config, hash): (&MachineConfig, &ConfigHash),
    axis: &str,
) -> RecordHead {
    let linear = config.axis.get(axis);
    let rotary = config.rotary.get(axis);
    RecordHead {
        schema_version: SCHEMA_VERSION,
        machine: config.machine.name.clone(),
        stage_serial: config.machine.stage_serial.clone(),
        config_hash: hash.as_str().to_owned(),
        axis: axis.to_owned(),
        drive: drive_record(machine, axis),
        resolution_m: linear.map(|axis| axis.motion.resolution_nm * 1e-9),
        resolution_rad: rotary.map(|it| TAU / f64::from(it.counts_per_turn)),
        created: String::new(),
        program: made_by(),
        source: String::new(),
        instrument: InstrumentRecord::default(),
        environment: EnvironmentRecord::default(),
    }
}

/// What no instrument of the machine has measured.
pub(crate) fn measured_elsewhere() -> InstrumentRecord {
    InstrumentRecord {
        name: "measured elsewhere".into(),
        ..InstrumentRecord::default()
    }
}

pub(crate) fn drive_record(machine: &machine::Machine, axis: &str) -> IdentityRecord {
    let identity = machine.devices().identity(axis);
    identity
        .as_ref()
        .map(IdentityRecord::from)
        .unwrap_or_default()
}
