//! A file of data measured elsewhere, and the head of a calibration made from it.

use core::f64::consts::TAU;
use std::collections::BTreeMap;
use std::path::Path;

use drivers::device::Identity;
use machine::records::{EnvironmentRecord, IdentityRecord, RecordHead, SCHEMA_VERSION};

use crate::made_by::made_by;
use crate::program::data_text::name_of;
use crate::run::{measured_elsewhere, utc_now};
use crate::volumetric::VolumetricFailure;
use crate::{Failure, config};

/// The head of a calibration of the linear `axis` made from the file `data`. The drive cannot be
/// asked here, so its identity is what the configuration expects; with a serial number there it is
/// checked like any other, without one any drive of that product will do.
pub(crate) fn head_of(
    loaded: &config::Loaded,
    axis: &str,
    data: &Path,
) -> Result<RecordHead, Failure> {
    let axes = &loaded.config.axis;
    let it = axes.get(axis).ok_or_else(|| no_such_axis(axis, axes))?;
    Ok(RecordHead {
        resolution_m: Some(it.motion.resolution_nm * 1e-9),
        ..head(loaded, axis, &it.configured_identity(), data)
    })
}

/// The same of the rotary `axis`.
pub(crate) fn rotary_head_of(
    loaded: &config::Loaded,
    axis: &str,
    data: &Path,
) -> Result<RecordHead, Failure> {
    let axes = &loaded.config.rotary;
    let it = axes.get(axis).ok_or_else(|| no_such_axis(axis, axes))?;
    Ok(RecordHead {
        resolution_rad: Some(TAU / f64::from(it.counts_per_turn)),
        ..head(loaded, axis, &it.node.identity.configured(), data)
    })
}

/// The same of three axes, whose record is called `pointer`.
pub(crate) fn volume_head_of(
    loaded: &config::Loaded,
    pointer: &str,
    data: &Path,
) -> Result<RecordHead, Failure> {
    let volumetric = loaded.config.volumetric.as_ref();
    let [first, ..] = &volumetric.ok_or(VolumetricFailure::None)?.axes;
    Ok(RecordHead {
        axis: pointer.to_owned(),
        ..head_of(loaded, first, data)?
    })
}

fn no_such_axis<T>(axis: &str, axes: &BTreeMap<String, T>) -> Failure {
    Failure::Machine(machine::Failure::NoSuchAxis {
        axis: axis.to_owned(),
        known: axes.keys().cloned().collect::<Vec<_>>().join(", "),
    })
}

fn head(loaded: &config::Loaded, axis: &str, drive: &Identity, data: &Path) -> RecordHead {
    let section = &loaded.config.machine;
    RecordHead {
        schema_version: SCHEMA_VERSION,
        machine: section.name.clone(),
        stage_serial: section.stage_serial.clone(),
        config_hash: loaded.hash.as_str().to_owned(),
        axis: axis.to_owned(),
        drive: IdentityRecord::from(drive),
        resolution_m: None,
        resolution_rad: None,
        created: utc_now(),
        program: made_by(),
        source: name_of(Path::new(data.file_name().unwrap_or_default())),
        instrument: measured_elsewhere(),
        environment: EnvironmentRecord::default(),
    }
}
