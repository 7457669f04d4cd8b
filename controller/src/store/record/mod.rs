//! What one calibration says: a head that all kinds share, and the content of its kind.
//!
//! Each kind of content has a file of its own here. Another kind is: its file with its plain
//! struct (`deny_unknown_fields`, every key with its unit), a variant of [`Content`], its arms in
//! `kind` and `summary`, and a way from [`CalibrationRecord`] to it that ends in
//! [`CalibrationRecord::other_kind`]. In the file the keys of head and content stand side by side.

mod agreement;
mod linear;
mod rotary;
mod screw;
mod volumetric;
mod warmth;

use drivers::device::{Environment, Identity};
use serde::{Deserialize, Serialize};

use super::{StoreError, short};
use crate::config::ConfigHash;

pub use agreement::AgreementRecord;
pub use linear::{LinearContent, NodeRecord};
pub use rotary::{ReadingName, RotaryContent};
pub use screw::{HarmonicRecord, ScrewContent, ScrewMethodName, StrokeRecord};
pub use volumetric::{
    BeamRecord, BeamReferencesContent, FunctionRecord, FunctionShape, GeometryContent, MemoryName,
    MemoryRecord, StateMemoryContent,
};
pub use warmth::{BendRecord, ExpansionRecord, UnknownRecord};

pub(crate) use volumetric::error_name;
pub(crate) use warmth::AXES;

/// One calibration of one axis: a signed statement of what was measured, with what, when,
/// on which machine, and how well.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CalibrationRecord {
    /// Whose it is and where it comes from.
    #[serde(flatten)]
    pub head: RecordHead,
    /// What it says. It is read last: what the head does not know must be known here.
    #[serde(flatten)]
    pub content: Content,
}

/// What every calibration says, whatever its kind.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RecordHead {
    /// Of the record.
    pub schema_version: u32,
    /// The machine's name.
    pub machine: String,
    /// The stage's serial number.
    pub stage_serial: String,
    /// BLAKE3 of what a calibration depends on in the configuration.
    pub config_hash: String,
    /// Which axis.
    pub axis: String,
    /// Who the drive was.
    pub drive: IdentityRecord,
    /// One encoder count of a linear axis, metres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub resolution_m: Option<f64>,
    /// One encoder count of a rotary axis, radians.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub resolution_rad: Option<f64>,
    /// When, UTC, RFC 3339.
    pub created: String,
    /// The program that made it.
    pub program: String,
    /// The run journal or data file it was made from.
    pub source: String,
    /// What measured, and which corrections its readings got.
    pub instrument: InstrumentRecord,
    /// Means over the run, where known.
    pub environment: EnvironmentRecord,
}

/// The model a calibration holds; the key `kind` says which.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Content {
    /// Deviations of a linear axis at calibrated positions.
    LinearErrorTable(LinearContent),
    /// Errors of a rotary table at the lines of a plate.
    RotaryErrorTable(RotaryContent),
    /// Lead error, periodic error and lost motion of a ball screw.
    ScrewModel(ScrewContent),
    /// The 21 errors of three axes.
    VolumetricGeometry(GeometryContent),
    /// What the detectors of three axes read when their errors were measured.
    BeamReferences(BeamReferencesContent),
    /// Displacements of three axes that are to be kept.
    StateMemory(StateMemoryContent),
}

impl Content {
    /// Its name in files and messages.
    pub const fn kind(&self) -> &'static str {
        match self {
            Self::LinearErrorTable(_) => LinearContent::KIND,
            Self::RotaryErrorTable(_) => RotaryContent::KIND,
            Self::ScrewModel(_) => ScrewContent::KIND,
            Self::VolumetricGeometry(_) => GeometryContent::KIND,
            Self::BeamReferences(_) => BeamReferencesContent::KIND,
            Self::StateMemory(_) => StateMemoryContent::KIND,
        }
    }

    /// How much it holds, in a few words.
    pub fn summary(&self) -> String {
        match self {
            Self::LinearErrorTable(it) => format!("{} nodes", it.nodes.len()),
            Self::RotaryErrorTable(it) => it.summary(),
            Self::ScrewModel(it) => it.summary(),
            Self::VolumetricGeometry(it) => it.summary(),
            Self::BeamReferences(it) => it.summary(),
            Self::StateMemory(it) => it.summary(),
        }
    }
}

impl CalibrationRecord {
    /// The error for who wanted a calibration of kind `expected` and got this one, named `id`.
    pub fn other_kind(&self, id: &str, expected: &'static str) -> StoreError {
        StoreError::OtherKind {
            id: short(id),
            axis: self.head.axis.clone(),
            expected,
            seen: self.content.kind(),
        }
    }

    pub(super) fn bytes(&self) -> Vec<u8> {
        let mut bytes = serde_json::to_vec_pretty(self).expect("plain data always serialises");
        bytes.push(b'\n');
        bytes
    }
}

impl RecordHead {
    /// Whether the calibration `id` with this head belongs to `here`, a machine whose configuration
    /// has `hash`.
    ///
    /// # Errors
    /// Naming the first thing that differs.
    pub fn belongs_to(&self, id: &str, here: &Self, hash: &ConfigHash) -> Result<(), StoreError> {
        // A table measured elsewhere may not know the drive's serial number (0 in 0x1018:04).
        let serial_known = self.drive.serial != 0;
        let drive = |head: &Self| {
            let it = &head.drive;
            let product = format!("{:#X}:{:#X}", it.vendor, it.product);
            if serial_known {
                format!("{product} serial {}", it.serial)
            } else {
                product
            }
        };
        let comparisons = [
            (
                "the stage's serial number",
                self.stage_serial.clone(),
                here.stage_serial.clone(),
            ),
            ("the axis", self.axis.clone(), here.axis.clone()),
            ("the drive", drive(self), drive(here)),
            ("one encoder count", self.resolution(), here.resolution()),
            (
                "the configuration's hash",
                self.config_hash.clone(),
                hash.beside(&self.config_hash).to_owned(),
            ),
        ];
        for (what, expected, seen) in comparisons {
            if expected != seen {
                return Err(StoreError::Foreign {
                    id: short(id),
                    what,
                    expected,
                    seen,
                });
            }
        }
        Ok(())
    }

    fn resolution(&self) -> String {
        match (self.resolution_m, self.resolution_rad) {
            (Some(metres), _) => format!("{} nm", units::Short(metres * 1e9)),
            (None, Some(radians)) => {
                format!("{} arcsec", units::Short(units::Radians(radians).arcsec()))
            }
            (None, None) => "unknown".into(),
        }
    }
}

/// The identity of a device.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(
    missing_docs,
    reason = "the fields of objects 0x1000, 0x1018 and 0x1008"
)]
pub struct IdentityRecord {
    pub device_type: u32,
    pub vendor: u32,
    pub product: u32,
    pub revision: u32,
    pub serial: u32,
    pub name: String,
}

impl From<&Identity> for IdentityRecord {
    fn from(identity: &Identity) -> Self {
        Self {
            device_type: identity.device_type,
            vendor: identity.vendor,
            product: identity.product,
            revision: identity.revision,
            serial: identity.serial,
            name: identity.name.clone(),
        }
    }
}

/// What measured, and how its readings were corrected.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "the names say which correction was on")]
pub struct InstrumentRecord {
    pub name: String,
    pub identity: String,
    pub air_corrected: bool,
    pub material_corrected: bool,
    pub dead_path_corrected: bool,
    pub cosine_corrected: bool,
    pub standard_uncertainty_m: f64,
}

/// The environment, SI (temperatures in °C); `None` where no sensor said.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "the names carry the units")]
pub struct EnvironmentRecord {
    pub air_temperature_c: Option<f64>,
    pub material_temperature_c: Option<f64>,
    pub pressure_pa: Option<f64>,
    pub relative_humidity: Option<f64>,
}

impl From<&Environment> for EnvironmentRecord {
    fn from(environment: &Environment) -> Self {
        Self {
            air_temperature_c: environment.air_temperature.map(|it| it.value()),
            material_temperature_c: environment.material_temperature.map(|it| it.value()),
            pressure_pa: environment.pressure.map(|it| it.value()),
            relative_humidity: environment.humidity.map(|it| it.value()),
        }
    }
}

#[cfg(test)]
pub(in crate::store) mod tests;
