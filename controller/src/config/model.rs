//! The configuration file's structure, version 1. Each key's suffix is its unit.

use drivers::device::Identity;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::PathBuf;

use super::camera::CameraConfig;
use super::drive::{HomeOffsetName, IdentityConfig, OptionCodesConfig};
use crate::platform::config::PlatformConfig;
use crate::rotary::RotaryConfig;
use crate::volumetric::VolumetricConfig;

/// The whole file.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MachineConfig {
    /// Must be 1.
    pub schema_version: u32,
    /// Who the machine is.
    pub machine: MachineSection,
    /// CAN buses by name.
    #[serde(default)]
    pub can: BTreeMap<String, CanBus>,
    /// Serial lines by name.
    #[serde(default)]
    pub serial: BTreeMap<String, SerialLine>,
    /// Linear axes by name.
    #[serde(default)]
    pub axis: BTreeMap<String, AxisConfig>,
    /// Rotary axes by name.
    #[serde(default)]
    pub rotary: BTreeMap<String, RotaryConfig>,
    /// Analog modules by name.
    #[serde(default)]
    pub analog: BTreeMap<String, AnalogConfig>,
    /// Measuring instruments by name.
    #[serde(default)]
    pub instrument: BTreeMap<String, InstrumentConfig>,
    /// Image controllers by name.
    #[serde(default)]
    pub camera: BTreeMap<String, CameraConfig>,
    /// The alignment platform that the axes move, if they move one.
    pub platform: Option<PlatformConfig>,
    /// The three axes whose errors are corrected throughout the work volume, if there are.
    pub volumetric: Option<VolumetricConfig>,
}

/// Who the machine is, and where its records live.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MachineSection {
    /// A name for people and folders.
    pub name: String,
    /// The stage's serial number: calibrations belong to it.
    pub stage_serial: String,
    /// Folder of calibrations, runs and reports; relative to the configuration file's folder.
    pub data_dir: PathBuf,
}

/// How a CAN bus is reached.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum CanTransport {
    /// A network interface of the kernel.
    SocketCan,
    /// A serial adapter that speaks the Lawicel protocol.
    Slcan,
}

/// One CAN bus.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "configs/README.md documents each key")]
pub struct CanBus {
    pub transport: CanTransport,
    pub interface: Option<String>,
    pub path: Option<PathBuf>,
    pub bitrate_bit_per_s: u32,
    pub sync_period_ms: f64,
    pub master_node_id: u8,
    pub master_heartbeat_ms: u16,
}

/// One serial line.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "configs/README.md documents each key")]
pub struct SerialLine {
    pub path: PathBuf,
    pub baud_bit_per_s: u32,
}

/// The kinds of servo drive.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum AxisDevice {
    /// A CiA 402 drive on CAN.
    Cia402,
    /// A Copley Controls amplifier on a serial line.
    Copley,
}

/// What an amplifier on a serial line must answer at start.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "configs/README.md documents each key")]
pub struct AmplifierConfig {
    pub model: Option<String>,
    pub serial_number: Option<u32>,
}

/// One axis and what is done with it. Which of the optional keys its device needs, and which it
/// does not know, is checked when the file is read.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "configs/README.md documents each key")]
pub struct AxisConfig {
    pub device: AxisDevice,
    pub bus: Option<String>,
    pub node_id: Option<u8>,
    pub line: Option<String>,
    pub address: Option<u8>,
    pub resolution_nm: f64,
    pub soft_min_mm: f64,
    pub soft_max_mm: f64,
    pub speed_mm_per_s: f64,
    pub speed_max_mm_per_s: f64,
    pub acceleration_mm_per_s2: f64,
    pub quick_stop_deceleration_mm_per_s2: f64,
    pub following_error_limit_um: f64,
    pub following_error_timeout_ms: Option<u16>,
    pub position_window_um: f64,
    pub position_window_time_ms: u16,
    pub move_timeout_s: f64,
    pub heartbeat_producer_ms: Option<u16>,
    pub heartbeat_consumer_ms: Option<u16>,
    pub watch_master_ms: Option<u16>,
    pub home_offset: Option<HomeOffsetName>,
    pub option_codes: Option<OptionCodesConfig>,
    pub synchronous_start: Option<bool>,
    pub identity: Option<IdentityConfig>,
    pub poll_period_ms: Option<f64>,
    pub amplifier: Option<AmplifierConfig>,
    pub cyclic: Option<CyclicConfig>,
    pub zero: Option<ZeroConfig>,
    pub calibrate: Option<CalibrateConfig>,
    pub verify: Option<VerifyConfig>,
    pub compensation: Option<CompensationConfig>,
}

/// An axis that follows cyclic set-points.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "configs/README.md documents each key")]
pub struct CyclicConfig {
    pub jerk_mm_per_s3: f64,
    pub deviation_limit_um: f64,
    #[serde(default)]
    pub correction_limit_um: f64,
    #[serde(default)]
    pub correction_rate_um_per_s: f64,
}

/// What only an axis on CAN has.
#[derive(Clone, Copy, Debug)]
#[expect(missing_docs, reason = "configs/README.md documents each key")]
pub struct CanAxis<'a> {
    pub bus: &'a str,
    pub node_id: u8,
    pub following_error_timeout_ms: u16,
    pub heartbeat_producer_ms: u16,
    pub heartbeat_consumer_ms: u16,
    pub watch_master_ms: u16,
    pub home_offset: HomeOffsetName,
    pub option_codes: OptionCodesConfig,
    pub synchronous_start: bool,
    pub identity: &'a IdentityConfig,
}

/// What only an axis on a serial line has.
#[derive(Clone, Copy, Debug)]
#[expect(missing_docs, reason = "configs/README.md documents each key")]
pub struct SerialAxis<'a> {
    pub line: &'a str,
    pub address: u8,
    pub poll_period_ms: f64,
    pub model: Option<&'a str>,
    pub serial_number: Option<u32>,
}

impl AxisConfig {
    /// The part of a CiA 402 drive; `None` for another device, or while a key is missing.
    pub fn can(&self) -> Option<CanAxis<'_>> {
        if self.device != AxisDevice::Cia402 {
            return None;
        }
        Some(CanAxis {
            bus: self.bus.as_deref()?,
            node_id: self.node_id?,
            following_error_timeout_ms: self.following_error_timeout_ms?,
            heartbeat_producer_ms: self.heartbeat_producer_ms?,
            heartbeat_consumer_ms: self.heartbeat_consumer_ms?,
            watch_master_ms: self.watch_master_ms?,
            home_offset: self.home_offset.unwrap_or_default(),
            option_codes: self.option_codes.unwrap_or_default(),
            synchronous_start: self.synchronous_start.unwrap_or(false),
            identity: self.identity.as_ref()?,
        })
    }

    /// Likewise of a Copley amplifier.
    pub fn serial(&self) -> Option<SerialAxis<'_>> {
        if self.device != AxisDevice::Copley {
            return None;
        }
        let amplifier = self.amplifier.as_ref();
        Some(SerialAxis {
            line: self.line.as_deref()?,
            address: self.address?,
            poll_period_ms: self.poll_period_ms?,
            model: amplifier.and_then(|it| it.model.as_deref()),
            serial_number: amplifier.and_then(|it| it.serial_number),
        })
    }

    /// The bus or line that it is on.
    pub fn port(&self) -> Option<&str> {
        let can = self.can().map(|it| it.bus);
        can.or_else(|| self.serial().map(|it| it.line))
    }

    /// Who its drive is, as far as the configuration says it.
    pub fn configured_identity(&self) -> Identity {
        let of_can = self.identity.as_ref().map(IdentityConfig::configured);
        let of_line = self.amplifier.as_ref().map(|it| Identity {
            serial: it.serial_number.unwrap_or(0),
            name: it.model.clone().unwrap_or_default(),
            ..Identity::default()
        });
        of_can.or(of_line).unwrap_or_default()
    }
}

/// The kinds of analog module.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum AnalogDevice {
    /// A CiA 401 module on CAN.
    Cia401,
    /// A CiA 404 measuring module on CAN.
    Cia404,
    /// An ADAM/DCON module on a serial line.
    Dcon,
}

/// One analog module.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "configs/README.md documents each key")]
pub struct AnalogConfig {
    pub device: AnalogDevice,
    #[serde(default)]
    pub channels: Vec<u8>,
    pub bus: Option<String>,
    pub node_id: Option<u8>,
    #[serde(default)]
    pub full_scale_v: Vec<f64>,
    #[serde(default)]
    pub temperature_channels: Vec<u8>,
    pub every_syncs: Option<u8>,
    pub heartbeat_producer_ms: Option<u16>,
    pub heartbeat_consumer_ms: Option<u16>,
    pub watch_master_ms: Option<u16>,
    pub identity: Option<IdentityConfig>,
    pub line: Option<String>,
    pub address: Option<u8>,
    #[serde(default)]
    pub checksum: bool,
    pub poll_period_ms: Option<f64>,
}

/// The kinds of displacement instrument.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum InstrumentDevice {
    /// A µMD1 or µMD2 interferometer interface.
    Umd2,
}

/// One displacement instrument, and which corrections its readings get.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "configs/README.md documents each key")]
pub struct InstrumentConfig {
    pub device: InstrumentDevice,
    pub line: String,
    pub optics_factor: u8,
    pub sample_rate_hz: f64,
    pub reverse: bool,
    pub correct_air: bool,
    pub correct_material: bool,
    pub expansion_per_kelvin: f64,
    pub correct_dead_path: bool,
    pub dead_path_mm: f64,
    pub correct_cosine: bool,
    pub misalignment_mrad: f64,
    pub instrument_standard_uncertainty_nm: f64,
    #[serde(default = "half_an_hour")]
    pub environment_frozen_s: f64,
    #[serde(default)]
    pub optics: OpticsConfig,
}

/// What an instrument can be set up with besides linear optics.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "configs/README.md documents each key")]
pub struct OpticsConfig {
    pub straightness_factor: Option<f64>,
    pub angular_separation_mm: Option<f64>,
}

/// The last digit of a good sensor moves with the air of a good hall.
const fn half_an_hour() -> f64 {
    1800.0
}

/// The drift-free zero (system S5).
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "configs/README.md documents each key")]
pub struct ZeroConfig {
    pub analog: String,
    pub negative_limit_mm: f64,
    pub reference_speed_mm_per_s: f64,
    pub search_speed_mm_per_s: f64,
    pub search_limit_mm: f64,
    pub time_limit_s: f64,
    pub samples: usize,
    pub level_below_peak_v: f64,
    pub turn_below_peak_v: f64,
    pub delta1_mv: f64,
    pub delta2_mv: f64,
    pub delta3_mv: f64,
    pub delta4_mv: f64,
    pub rail_low_v: f64,
    pub rail_high_v: f64,
    pub noise_mv: f64,
    pub standard_uncertainty_limit_um: f64,
}

/// The calibration run (system S3).
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "configs/README.md documents each key")]
pub struct CalibrateConfig {
    pub instrument: String,
    pub start_mm: f64,
    pub end_mm: f64,
    pub step_mm: f64,
    pub runs: u32,
    pub overrun_mm: f64,
    pub settle_ms: u32,
    pub average_samples: u32,
    pub closure_limit_um: f64,
    pub scale_limit_ppm: f64,
}

/// The verification run (ISO 230-2).
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "configs/README.md documents each key")]
pub struct VerifyConfig {
    pub instrument: String,
    pub start_mm: f64,
    pub end_mm: f64,
    pub targets: u32,
    pub runs: u32,
    pub overrun_mm: f64,
    pub settle_ms: u32,
    pub average_samples: u32,
    pub accuracy_tolerance_um: f64,
}

/// How the curve between calibrated positions is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum InterpolationName {
    /// The patent's.
    PiecewiseConstant,
    /// Straight lines.
    Linear,
    /// Cubic without overshoot.
    MonotoneCubic,
}

/// What holds outside the calibrated range.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum EndPolicyName {
    /// A target outside is refused.
    Refuse,
    /// The end's value holds on.
    Hold,
    /// The end's value fades to zero over `fade_out_mm`.
    FadeOut,
}

/// How a calibration is applied, and its limits.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "configs/README.md documents each key")]
pub struct CompensationConfig {
    pub interpolation: InterpolationName,
    pub end_policy: EndPolicyName,
    pub fade_out_mm: Option<f64>,
    pub size_limit_um: f64,
    pub slope_limit: f64,
    pub rate_limit_um_per_s: f64,
    pub jump_limit_um: Option<f64>,
}
