//! CAN buses and serial lines in the configuration file.

use core::time::Duration;
use std::collections::BTreeMap;
use std::path::PathBuf;

use schemars::JsonSchema;
use serde::Deserialize;

/// The buses and lines of a machine, by name.
#[derive(Clone, Copy, Debug)]
pub struct Wiring<'a> {
    /// CAN buses.
    pub can: &'a BTreeMap<String, CanBus>,
    /// Serial lines.
    pub serial: &'a BTreeMap<String, SerialLine>,
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
    #[schemars(extend("x-own" = true))]
    pub interface: Option<String>,
    /// The adapter's serial device; opened at 115200 baud.
    #[schemars(extend("x-range" = "with `slcan`, only then"))]
    #[schemars(extend("x-own" = true))]
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
    #[schemars(extend("x-range" = "not empty"))]
    #[schemars(extend("x-own" = true))]
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
