//! What a store says corrects an axis, judged as far as a configuration can: without a machine.

use machine::records::{RecordHead, Store};
use units::Metres;

use crate::config::{ConfigHash, MachineConfig};
use crate::failure::Failure;
use crate::linear::course::Course;
use crate::linear::{LinearContent, settings};

/// The calibration of `axis` that `store` says is in use on the machine of this configuration, and what it corrects; `None`
/// where there is none. Who the drive is shows only when the machine is connected.
///
/// # Errors
/// It belongs to another machine, or breaks a limit.
pub(crate) fn stored_course(
    (config, hash): (&MachineConfig, &ConfigHash),
    axis: &str,
    store: &Store,
) -> Result<Option<(String, Course)>, Failure> {
    let Some(id) = store.active(axis)?.current else {
        return Ok(None);
    };
    let record = store.load::<LinearContent>(&id)?;
    let here = here((config, hash), &record.head);
    record.head.belongs_to(&id, &here, hash)?;
    let table = record.content.table(&id)?;
    let course = Course {
        compensation: Some(settings::compensation(config, axis, table)?),
        budget: record.content.axis_budget(&id)?,
        approach: record.content.approach_m.map(Metres),
        arrives_over: None,
        overrun: None,
        zero: None,
    };
    Ok(Some((id, course)))
}

/// Who this machine is, as far as its configuration says it.
fn here((config, hash): (&MachineConfig, &ConfigHash), there: &RecordHead) -> RecordHead {
    let motion = config.axis.get(&there.axis).map(|it| &it.motion);
    RecordHead {
        stage_serial: config.machine.stage_serial.clone(),
        config_hash: hash.as_str().to_owned(),
        resolution_m: motion.map(|it| it.resolution_nm * 1e-9),
        ..there.clone()
    }
}
