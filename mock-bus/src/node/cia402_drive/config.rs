//! What a configuration file says about an emulated drive.

use drivers::wire::canopen::NodeId;
use serde::{Deserialize, Deserializer, Serialize, de::Error};

use crate::node::canopen_server::{Identity, Manners};

/// An emulated CiA 402 drive; every key has a default.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Cia402DriveConfig {
    /// CANopen node identifier, 1 to 127.
    #[serde(deserialize_with = "checked_node_id")]
    pub node_id: u8,
    /// Which axis of the plant it moves.
    pub axis: usize,
    /// 0x1018.
    pub identity: Identity,
    /// 0x1008.
    pub device_name: String,
    /// 0x1009.
    pub hardware_version: String,
    /// 0x100A.
    pub software_version: String,
    /// From power-on to the boot-up message.
    pub boot_delay_ms: u64,
    /// 0x1017 at power-on; 0, as most drives have it, means no heartbeat.
    pub heartbeat_ms: u16,
    /// Length of one count; the defaults below are turned into counts with it, and 0x60A8
    /// names it when it is a power of ten.
    pub encoder_resolution_nm: f64,
    /// How often the demand is updated while something moves.
    pub servo_period_us: u64,
    /// How often the drive looks after itself while nothing moves.
    pub supervision_period_ms: u64,
    /// How long each transition of the power state machine takes.
    pub power_transition_ms: u64,
    /// How long 0x6061 lags behind 0x6060.
    pub mode_lag_ms: u64,
    /// 0x6065 at power-on.
    pub following_error_window_um: f64,
    /// 0x6066 at power-on.
    pub following_error_timeout_ms: u16,
    /// 0x6067 at power-on.
    pub position_window_um: f64,
    /// 0x6068 at power-on.
    pub position_window_time_ms: u16,
    /// 0x607F at power-on.
    pub max_profile_velocity_mm_per_s: f64,
    /// 0x6081 at power-on.
    pub profile_velocity_mm_per_s: f64,
    /// 0x6083 and 0x6084 at power-on.
    pub profile_acceleration_mm_per_s2: f64,
    /// 0x6085 at power-on.
    pub quick_stop_deceleration_mm_per_s2: f64,
    /// 0x6099:01 at power-on.
    pub homing_switch_speed_mm_per_s: f64,
    /// 0x6099:02 at power-on.
    pub homing_zero_speed_mm_per_s: f64,
    /// 0x609A at power-on.
    pub homing_acceleration_mm_per_s2: f64,
    /// Homing fails when no switch is found over this travel.
    pub homing_search_limit_mm: f64,
    /// Whether the encoder's index is wired: homing methods 1, 2, 33 and 34.
    pub has_index: bool,
    /// 0x605A at power-on: 6 as in EPOS4 (stay in quick stop active), 2 as in most others.
    pub quick_stop_option: i16,
    /// 0x6007 at power-on: 0 nothing, 1 fault, 2 disable voltage, 3 quick stop.
    pub abort_connection_option: i16,
    /// How badly its communication behaves.
    pub manners: Manners,
    /// How badly the drive itself behaves.
    pub quirks: DriveQuirks,
}

/// What real drives do and a polite one would not; the default is nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DriveQuirks {
    /// The statusword keeps the value it has, whatever the drive does.
    pub statusword_stuck: bool,
    /// The drive never gets from switched on to operation enabled.
    pub enable_refused: bool,
    /// A new set-point equal to the last one is not acknowledged.
    pub identical_target_ignored: bool,
    /// Target reached (bit 10) never comes.
    pub target_never_reached: bool,
    /// Fault resets have no effect.
    pub fault_reset_ignored: bool,
    /// The motor is wired the wrong way round: the demand is mirrored about where it stood
    /// when it was enabled.
    pub direction_reversed: bool,
}

impl Default for Cia402DriveConfig {
    fn default() -> Self {
        Self {
            node_id: 1,
            axis: 0,
            identity: Identity::default(),
            device_name: "truestage mock servo drive".into(),
            hardware_version: "mock-bus 1".into(),
            software_version: concat!("mock-bus ", env!("CARGO_PKG_VERSION")).into(),
            boot_delay_ms: 100,
            heartbeat_ms: 0,
            encoder_resolution_nm: 10.0,
            servo_period_us: 1000,
            supervision_period_ms: 10,
            power_transition_ms: 1,
            mode_lag_ms: 3,
            following_error_window_um: 500.0,
            following_error_timeout_ms: 10,
            position_window_um: 1.0,
            position_window_time_ms: 10,
            max_profile_velocity_mm_per_s: 500.0,
            profile_velocity_mm_per_s: 20.0,
            profile_acceleration_mm_per_s2: 200.0,
            quick_stop_deceleration_mm_per_s2: 2000.0,
            homing_switch_speed_mm_per_s: 10.0,
            homing_zero_speed_mm_per_s: 0.5,
            homing_acceleration_mm_per_s2: 200.0,
            homing_search_limit_mm: 500.0,
            has_index: false,
            quick_stop_option: 6,
            abort_connection_option: 3,
            manners: Manners::default(),
            quirks: DriveQuirks::default(),
        }
    }
}

impl Cia402DriveConfig {
    /// Micrometres to counts, at least one.
    pub(super) fn counts_of_um(&self, um: f64) -> i64 {
        ((um * 1e3 / self.encoder_resolution_nm).round() as i64).max(1)
    }

    /// Millimetres (per second, per second squared) to counts.
    pub(super) fn counts_of_mm(&self, mm: f64) -> i64 {
        self.counts_of_um(mm * 1e3)
    }
}

/// Refuses node identifiers outside 1 to 127 where the file is read.
pub(in crate::node) fn checked_node_id<'de, D>(deserializer: D) -> Result<u8, D::Error>
where
    D: Deserializer<'de>,
{
    let raw = u8::deserialize(deserializer)?;
    let node = NodeId::new(raw);
    node.map(NodeId::raw).ok_or_else(|| {
        D::Error::custom(format_args!(
            "node_id {raw} is no CANopen node, these are 1 to 127"
        ))
    })
}
