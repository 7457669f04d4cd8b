//! What every calibration says, whatever its kind: whose it is, where it comes from, what measured.

use drivers::device::{Environment, Identity};
use serde::{Deserialize, Serialize};

use super::failure::StoreError;
use super::hash::ConfigHash;
use super::name::short;
use super::sound::{
    self, CELSIUS, ERROR_U_M, HUMIDITY, Judged, PASCAL, RESOLUTION, number, optional,
};

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
                    expected: expected.into(),
                    seen: seen.into(),
                    instead: None,
                });
            }
        }
        Ok(())
    }

    /// Whether it can be so.
    pub(super) fn judge(&self) -> Judged {
        // The axis names the file that says what is in use.
        sound::file_name("axis", &self.axis)?;
        optional("resolution_m", self.resolution_m, &RESOLUTION)?;
        optional("resolution_rad", self.resolution_rad, &RESOLUTION)?;
        let u = self.instrument.standard_uncertainty_m;
        number("instrument.standard_uncertainty_m", u, &ERROR_U_M)?;
        self.environment.judge("environment")
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
    /// What its readings were not corrected for although they should have been.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub switched_off: Vec<String>,
    /// The certificates of what it measures by; none without, and of earlier programs.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub certificates: Vec<CertificateRecord>,
}

/// A certificate of calibration by which readings were corrected.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CertificateRecord {
    /// What of the instrument it is of.
    pub of: String,
    /// What its laboratory calls it.
    pub identifier: String,
    /// Who issued it.
    pub laboratory: String,
    /// Of what.
    pub serial_number: String,
    /// The last day of that calibration.
    pub calibrated: String,
    /// The last day that it holds.
    pub valid_until: String,
    /// BLAKE3 of its file.
    pub blake3: String,
}

impl CertificateRecord {
    /// For people.
    pub fn text(&self) -> String {
        format!(
            "{}: certificate {} of {}, serial number {}, of {}, until {}",
            self.of,
            self.identifier,
            self.laboratory,
            self.serial_number,
            self.calibrated,
            self.valid_until
        )
    }
}

impl InstrumentRecord {
    /// Without what follows from the rest, which earlier programs did not write.
    pub(super) fn corrections(&self) -> Self {
        Self {
            switched_off: Vec::new(),
            ..self.clone()
        }
    }

    /// That corrections were switched off, in capitals; `None` where none was.
    pub fn warning(&self) -> Option<String> {
        (!self.switched_off.is_empty())
            .then(|| format!("NOT CORRECTED for {}", self.switched_off.join(", ")))
    }
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

impl EnvironmentRecord {
    /// Whether sensors of the surroundings can say so; `place` is where it stands.
    ///
    /// # Errors
    /// Naming the first key that cannot be so.
    pub fn judge(&self, place: &str) -> Judged {
        let at = |key: &str| format!("{place}.{key}");
        let air = self.air_temperature_c;
        optional(&at("air_temperature_c"), air, &CELSIUS)?;
        let material = self.material_temperature_c;
        optional(&at("material_temperature_c"), material, &CELSIUS)?;
        optional(&at("pressure_pa"), self.pressure_pa, &PASCAL)?;
        optional(&at("relative_humidity"), self.relative_humidity, &HUMIDITY)
    }
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
