//! Linear axes and their drives in the configuration file.

use drivers::device::Identity;
use schemars::JsonSchema;
use serde::Deserialize;

use super::drive::{HomeOffsetName, OptionCodesConfig};
use crate::hardware::node::IdentityConfig;
use crate::linear::{CalibrateConfig, CompensationConfig, VerifyConfig, ZeroConfig};

/// The servo drive of an axis, by what `device` calls it.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(tag = "device", rename_all = "lowercase")]
pub enum DriveConfig {
    /// A CiA 402 drive on CAN.
    Cia402(Cia402AxisConfig),
    /// A Copley Controls amplifier on a serial line (ASCII interface).
    Copley(CopleyAxisConfig),
}

/// What only an axis on CAN has.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
pub struct Cia402AxisConfig {
    /// The bus that the drive is on.
    #[schemars(extend("x-range" = "a `[can.NAME]`"))]
    pub bus: String,
    /// Its number there; no two nodes of a bus have the same.
    #[schemars(range(min = 1, max = 127))]
    pub node_id: u8,
    /// For how long the following error may be exceeded (0x6066).
    pub following_error_timeout_ms: u16,
    /// Period of the drive's heartbeat (0x1017).
    #[schemars(range(min = 5, max = 10000))]
    pub heartbeat_producer_ms: u16,
    /// Without a heartbeat for this long the drive counts as lost.
    #[schemars(extend("x-range" = "at least 2 × `heartbeat_producer_ms`"))]
    pub heartbeat_consumer_ms: u16,
    /// Without the controller's heartbeat for this long the drive stops by itself (0x1016).
    #[schemars(extend("x-range" = "at least 2 × `master_heartbeat_ms`"))]
    pub watch_master_ms: u16,
    /// Who the drive must be.
    pub identity: IdentityConfig,
    /// What the drive takes 0x607C for; CiA 402 says `zero_from_home`, many drives do
    /// `position_at_home`. A wrong one is noticed after homing, before anything moves by it.
    #[serde(default)]
    pub home_offset: HomeOffsetName,
    /// Written and read back at the start; what is absent stays as the drive has it.
    #[serde(default)]
    pub option_codes: OptionCodesConfig,
    /// The drive takes controlword and target over at SYNC (RPDO 1 with transmission type 1, read
    /// back), so that a group starts at the same SYNC; a quick stop is up to one SYNC later.
    #[serde(default)]
    pub synchronous_start: bool,
    /// The axis can follow cyclic set-points.
    pub cyclic: Option<CyclicConfig>,
}

/// What only an axis on a serial line has.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
pub struct CopleyAxisConfig {
    /// The line that the amplifier is on. Amplifiers are looked for at its rate and at 9600 bit/s,
    /// and brought to its rate.
    #[schemars(extend("x-range" = "a `[serial.NAME]` with 9600, 19200, 38400, 57600 or 115200 bit/s"))]
    pub line: String,
    /// 0: the amplifier at the cable; others: its node number on the CAN behind that one.
    #[schemars(range(min = 0, max = 127))]
    pub address: u8,
    /// From one look at status and position to the next. A look is three exchanges of some 3 ms at
    /// 115200 bit/s and 17 ms at 9600; what the line cannot carry comes later.
    #[schemars(range(min = 1.0, max = 300.0))]
    pub poll_period_ms: f64,
    /// Who the amplifier must be.
    pub amplifier: Option<AmplifierConfig>,
}

/// What an amplifier on a serial line must answer at the start.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AmplifierConfig {
    /// What it must call itself (parameter 0x80); any without it.
    pub model: Option<String>,
    /// The serial number that it must have (parameter 0x81); any without it.
    pub serial_number: Option<u32>,
}

/// An axis that follows a set-point at every SYNC, together with others.
///
/// It needs `synchronous_start = true`, and its set-points count in the bus load.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CyclicConfig {
    /// Greatest jerk of paths, moves and controlled stops; speed and acceleration are limited to
    /// `speed_max_mm_per_s` and `acceleration_mm_per_s2`.
    #[schemars(range(min = 1.0, max = 1000000000.0))]
    pub jerk_mm_per_s3: f64,
    /// This far outside its last set-points, twice running, the axis counts as blocked or astray.
    #[schemars(range(min = 0.01, max = 100000.0))]
    pub deviation_limit_um: f64,
    /// A correction is cut off beyond this.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 10000.0))]
    pub correction_limit_um: f64,
    /// A correction changes no faster; a path may be as fast as `speed_max_mm_per_s` less this and
    /// 2 %.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 1000000.0))]
    pub correction_rate_um_per_s: f64,
}

/// A linear axis and its drive.
///
/// Node numbers on one bus must differ, the master's included; so must the addresses of amplifiers
/// on one line, which carries nothing else. Which of the optional keys a device needs, and which it
/// does not know, is checked when the file is read.
///
/// A `copley` axis has no section `zero`: the Hall search needs positions and voltages of one SYNC.
/// What stops it when the controller dies stands in docs/safety.md: read it.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[schemars(extend("unevaluatedProperties" = false))]
pub struct AxisConfig {
    /// Its drive.
    #[serde(flatten)]
    pub drive: DriveConfig,
    /// One encoder count; negative when the drive counts against the axis. The soft limits must fit
    /// 31 bits of counts.
    #[schemars(extend("x-magnitude" = [0.01, 1e6]))]
    pub resolution_nm: f64,
    /// Soft limit; also written to the drive (0x607D), to an amplifier after homing (0xb8).
    #[schemars(extend("x-range" = "below `soft_max_mm`"))]
    pub soft_min_mm: f64,
    /// Likewise (0xb9).
    pub soft_max_mm: f64,
    /// Speed of ordinary moves.
    #[schemars(range(min = 0.001), extend("x-range" = "at most `speed_max_mm_per_s`"))]
    pub speed_mm_per_s: f64,
    /// Fastest possible: faster moves are refused, faster changes of position not believed.
    #[schemars(range(min = 0.001, max = 100000.0))]
    pub speed_max_mm_per_s: f64,
    /// Acceleration and deceleration of moves.
    #[schemars(range(min = 0.01, max = 1000000.0))]
    pub acceleration_mm_per_s2: f64,
    /// Written to the drive (0x6085; 0xcf).
    #[schemars(range(min = 0.01, max = 10000000.0))]
    pub quick_stop_deceleration_mm_per_s2: f64,
    /// Following error window (0x6065; 0xba).
    #[schemars(range(min = 0.001, max = 100000.0))]
    pub following_error_limit_um: f64,
    /// How near its target the axis must be (0x6067; 0xbc).
    #[schemars(range(min = 0.0001, max = 10000.0))]
    pub position_window_um: f64,
    /// For how long it must be there (0x6068; 0xbd).
    pub position_window_time_ms: u16,
    /// Longest time of one move.
    #[schemars(range(min = 0.01, max = 100000.0))]
    pub move_timeout_s: f64,
    /// How it gets its origin: the drift-free Hall search.
    pub zero: Option<ZeroConfig>,
    /// How it is calibrated.
    pub calibrate: Option<CalibrateConfig>,
    /// How it is verified (ISO 230-2 asks for 5 runs and 5 targets).
    pub verify: Option<VerifyConfig>,
    /// How a calibration is applied, and its limits; needed to calibrate or to use one.
    pub compensation: Option<CompensationConfig>,
}

impl AxisConfig {
    /// Its drive, where that is on CAN.
    pub const fn can(&self) -> Option<&Cia402AxisConfig> {
        match &self.drive {
            DriveConfig::Cia402(drive) => Some(drive),
            DriveConfig::Copley(_) => None,
        }
    }

    /// Its amplifier, where that is on a serial line.
    pub const fn serial(&self) -> Option<&CopleyAxisConfig> {
        match &self.drive {
            DriveConfig::Copley(amplifier) => Some(amplifier),
            DriveConfig::Cia402(_) => None,
        }
    }

    /// How it follows cyclic set-points, if it does.
    pub fn cyclic(&self) -> Option<&CyclicConfig> {
        self.can()?.cyclic.as_ref()
    }

    /// What `device` calls its drive.
    pub const fn device(&self) -> &'static str {
        match &self.drive {
            DriveConfig::Cia402(_) => "cia402",
            DriveConfig::Copley(_) => "copley",
        }
    }

    /// The bus or line that it is on.
    pub fn port(&self) -> &str {
        match &self.drive {
            DriveConfig::Cia402(drive) => &drive.bus,
            DriveConfig::Copley(amplifier) => &amplifier.line,
        }
    }

    /// Who its drive is, as far as the configuration says it.
    pub fn configured_identity(&self) -> Identity {
        match &self.drive {
            DriveConfig::Cia402(drive) => drive.identity.configured(),
            DriveConfig::Copley(drive) => {
                let amplifier = drive.amplifier.clone().unwrap_or_default();
                Identity {
                    serial: amplifier.serial_number.unwrap_or(0),
                    name: amplifier.model.unwrap_or_default(),
                    ..Identity::default()
                }
            }
        }
    }
}
