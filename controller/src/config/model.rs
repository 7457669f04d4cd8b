//! The configuration file's structure, version 1. Each key's suffix is its unit.

use core::time::Duration;
use schemars::JsonSchema;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::PathBuf;

use super::analog::AnalogConfig;
use super::axis::AxisConfig;
use super::camera::CameraConfig;
use super::instrument::InstrumentConfig;
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
    pub stage_serial: String,
    /// Folder of calibrations, journals and reports, from this file's folder.
    pub data_dir: PathBuf,
}

/// How a CAN bus is reached.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum CanTransport {
    /// A network interface of the kernel.
    SocketCan,
    /// A serial adapter that speaks the Lawicel protocol.
    Slcan,
}

/// A CAN bus.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CanBus {
    /// A network interface of the kernel, or a serial adapter with the Lawicel protocol.
    pub transport: CanTransport,
    /// Interface name, such as `"can0"`.
    #[schemars(extend("x-range" = "with `socketcan`, only then"))]
    pub interface: Option<String>,
    /// The adapter's serial device; opened at 115200 baud.
    #[schemars(extend("x-range" = "with `slcan`, only then"))]
    pub path: Option<PathBuf>,
    /// Bit rate. An SLCAN adapter is set to it; a kernel interface is set by `ip link`, here it
    /// counts for the bus load only.
    #[schemars(extend("x-range" = "10000, 20000, 50000, 125000, 250000, 500000, 800000, 1000000"))]
    pub bitrate_bit_per_s: u32,
    /// Period of SYNC, and so of positions and voltages; refused when the bus cannot carry it
    /// (limit 80 % load), with a period that fits.
    #[schemars(range(min = 0.25, max = 1000.0))]
    pub sync_period_ms: f64,
    /// Node number of the controller's heartbeat.
    #[schemars(range(min = 1, max = 127))]
    pub master_node_id: u8,
    /// Period of the controller's heartbeat.
    #[schemars(range(min = 5, max = 10000))]
    pub master_heartbeat_ms: u16,
}

/// A serial line.
///
/// 8 data bits, no parity, 1 stop bit, no flow control.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SerialLine {
    /// The device; `/dev/serial/by-id/...` survives replugging.
    pub path: PathBuf,
    /// Baud rate.
    #[schemars(range(min = 50, max = 4000000))]
    pub baud_bit_per_s: u32,
}

impl CanBus {
    /// The SYNC period; nothing for one that is no span of time, which the judgement of the file tells.
    pub fn sync_period(&self) -> Duration {
        Duration::try_from_secs_f64(self.sync_period_ms * 1e-3).unwrap_or_default()
    }
}
