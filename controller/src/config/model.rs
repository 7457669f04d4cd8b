//! The configuration file's structure, version 1. Each key's suffix is its unit.

use core::time::Duration;
use schemars::JsonSchema;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::PathBuf;

use super::axis::AxisConfig;
use super::file::ConfigFile;
use crate::certificate::{CertificateConfig, Measurand, Named};
use crate::hardware::analog::AnalogConfig;
use crate::hardware::bus::{CanBus, SerialLine, Wiring};
use crate::hardware::camera::CameraConfig;
use crate::hardware::instrument::InstrumentConfig;
use crate::linear::GantryConfig;
use crate::platform::config::PlatformConfig;
use crate::rotary::RotaryConfig;
use crate::volumetric::VolumetricConfig;

/// The whole file.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MachineConfig {
    /// Version of this format.
    #[schemars(extend("x-range" = "1"))]
    pub schema_version: u32,
    /// Who the machine is.
    pub machine: MachineSection,
    /// CAN buses by name.
    #[serde(default)]
    pub can: BTreeMap<String, CanBus>,
    /// Serial lines by name.
    #[serde(default)]
    pub serial: BTreeMap<String, SerialLine>,
    /// Linear axes by name. At least one axis, linear or rotary, is required.
    #[serde(default)]
    pub axis: BTreeMap<String, AxisConfig>,
    /// Pairs of linear axes that move one stage side by side, by name; no axis may have the same one.
    #[serde(default)]
    pub gantry: BTreeMap<String, GantryConfig>,
    /// Rotary axes by name; no linear axis may have the same one.
    #[serde(default)]
    pub rotary: BTreeMap<String, RotaryConfig>,
    /// Analog modules by name.
    #[serde(default)]
    pub analog: BTreeMap<String, AnalogConfig>,
    /// Displacement instruments by name.
    #[serde(default)]
    pub instrument: BTreeMap<String, InstrumentConfig>,
    /// Image controllers by name.
    #[serde(default)]
    pub camera: BTreeMap<String, CameraConfig>,
    /// The alignment platform that the axes move.
    pub platform: Option<PlatformConfig>,
    /// The three axes that are corrected throughout their volume.
    pub volumetric: Option<VolumetricConfig>,
    /// The file that it was read from, where it was one.
    #[serde(skip)]
    pub(crate) file: Option<ConfigFile>,
}

/// Who the machine is, and where its records lie.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MachineSection {
    /// For people; names the machine's folder below `data_dir`.
    #[schemars(extend("x-range" = "letters, digits, `-`, `_`"))]
    pub name: String,
    /// Serial number of the stage; calibrations belong to it.
    #[schemars(extend("x-range" = "not empty"))]
    #[schemars(extend("x-own" = true))]
    pub stage_serial: String,
    /// Folder of calibrations, journals and reports, from this file's folder.
    pub data_dir: PathBuf,
}

impl MachineConfig {
    /// Says that its file has another text by now than the one in use. Reads the disk.
    pub fn change_of_file(&self) -> Option<String> {
        self.file.as_ref().and_then(ConfigFile::change)
    }

    /// Its buses and lines.
    pub const fn wiring(&self) -> Wiring<'_> {
        Wiring {
            can: &self.can,
            serial: &self.serial,
        }
    }

    /// From one sample of an analog module to the next, in seconds; nothing where it is not known.
    pub(crate) fn sample_period_s(&self, module: &str) -> f64 {
        let period = self.analog.get(module).and_then(|it| {
            let bus = self.can.get(&it.node()?.bus)?;
            Some(bus.sync_period().as_secs_f64() * f64::from(it.every_syncs()?))
        });
        period.unwrap_or(0.0)
    }

    /// Its certificates, to be read.
    pub(crate) fn certificates_mut(&mut self) -> Vec<Named<'_>> {
        let instruments = self.instrument.iter_mut();
        let instruments = instruments.flat_map(|(name, it)| it.certificates_mut(name));
        let volumetric = self.volumetric.iter_mut();
        let thermometers = volumetric.flat_map(VolumetricConfig::certificates_mut);
        instruments.chain(thermometers).collect()
    }

    /// Its certificates by their keys, once they have been read.
    pub(crate) fn certificates(&self) -> Vec<(String, Measurand, &CertificateConfig)> {
        let instruments = self.instrument.iter().flat_map(|(name, it)| {
            let own = it.certificates().into_iter();
            own.map(move |(of, measurand, it)| {
                (format!("instrument.{name}.certificate.{of}"), measurand, it)
            })
        });
        let volumetric = self.volumetric.iter();
        let thermometers = volumetric.flat_map(VolumetricConfig::certificates);
        instruments.chain(thermometers).collect()
    }

    /// How long a picture of the slowest camera that sees a beam may take; nothing without one.
    pub(crate) fn longest_picture(&self) -> Duration {
        let detectors = self.camera.iter();
        let detectors = detectors.filter(|(name, _)| self.is_detector(name));
        let pictures = detectors.map(|(_, camera)| camera.inspection_timeout());
        pictures.max().unwrap_or_default()
    }

    /// Whether the camera `name` sees the spot of a beam, all the time.
    pub(crate) fn is_detector(&self, name: &str) -> bool {
        let of_volume = self.volumetric.iter().flat_map(VolumetricConfig::cameras);
        of_volume.map(|it| &it.camera).any(|it| it == name)
    }
}
