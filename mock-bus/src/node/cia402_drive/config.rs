//! What a configuration file says about an emulated drive.

use serde::{Deserialize, Deserializer, Serialize, de::Error};
use wire::canopen::NodeId;

use super::quirks::DriveQuirks;
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
    /// A drive that follows set-points faults after so many periods without SYNC.
    pub sync_lost_after_periods: f64,
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
    /// The drive holds its axis so long while its brake falls in; 0 without a brake.
    pub brake_engage_ms: u64,
    /// 0x6007 at power-on: 0 nothing, 1 fault, 2 disable voltage, 3 quick stop.
    pub abort_connection_option: i16,
    /// The encoder is absolute and the drive stores its origin: both are there again after a power cycle.
    pub absolute_encoder: bool,
    /// 0x6063 counts with the position, also when that is homed, as in some drives.
    pub increments_are_homed: bool,
    /// Bit of the statusword (8, 14 or 15, which CiA 402 leaves to the manufacturer) that is 1 while the drive is homed.
    pub homed_bit: Option<u8>,
    /// It moves a rotary axis: this takes the place of all lengths above.
    pub rotary: Option<RotaryDriveConfig>,
    /// It has a touch probe.
    pub touch_probe: Option<TouchProbeConfig>,
    /// How badly its communication behaves.
    pub manners: Manners,
    /// How badly the drive itself behaves.
    pub quirks: DriveQuirks,
}

/// What a drive of a rotary axis has at power-on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[expect(missing_docs, reason = "as the drive's own keys, in angles")]
pub struct RotaryDriveConfig {
    pub counts_per_turn: u32,
    /// Whether the upper limit in 0x607B is still a position of its own.
    pub upper_limit_is_a_position: bool,
    pub following_error_window_arcsec: f64,
    pub position_window_arcsec: f64,
    pub max_profile_velocity_deg_per_s: f64,
    pub profile_velocity_deg_per_s: f64,
    pub profile_acceleration_deg_per_s2: f64,
    pub quick_stop_deceleration_deg_per_s2: f64,
    pub homing_switch_speed_deg_per_s: f64,
    pub homing_zero_speed_deg_per_s: f64,
    pub homing_acceleration_deg_per_s2: f64,
    pub homing_search_limit_deg: f64,
}

impl Default for RotaryDriveConfig {
    fn default() -> Self {
        Self {
            counts_per_turn: 129_600_000,
            upper_limit_is_a_position: true,
            following_error_window_arcsec: 600.0,
            position_window_arcsec: 1.0,
            max_profile_velocity_deg_per_s: 360.0,
            profile_velocity_deg_per_s: 10.0,
            profile_acceleration_deg_per_s2: 100.0,
            quick_stop_deceleration_deg_per_s2: 1000.0,
            homing_switch_speed_deg_per_s: 10.0,
            homing_zero_speed_deg_per_s: 2.0,
            homing_acceleration_deg_per_s2: 100.0,
            homing_search_limit_deg: 400.0,
        }
    }
}

/// What a touch probe can do.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TouchProbeConfig {
    /// The drive counts edges (0x60D5 and 0x60D6).
    pub edge_counters: bool,
    /// Bits 6 and 7 of 0x60B9 toggle with each position latched.
    pub status_toggles: bool,
}

impl Default for TouchProbeConfig {
    fn default() -> Self {
        Self {
            edge_counters: true,
            status_toggles: false,
        }
    }
}

/// What objects have at power-on, in counts and seconds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct PowerOn {
    pub(super) following_error_window: i64,
    pub(super) position_window: i64,
    pub(super) max_velocity: i64,
    pub(super) velocity: i64,
    pub(super) acceleration: i64,
    pub(super) quick_stop_deceleration: i64,
    pub(super) homing_switch_speed: i64,
    pub(super) homing_zero_speed: i64,
    pub(super) homing_acceleration: i64,
    pub(super) homing_search_limit: i64,
    /// A search may begin so near to the opposite switch.
    pub(super) homing_may_begin_within: i64,
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
            sync_lost_after_periods: 2.5,
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
            brake_engage_ms: 0,
            abort_connection_option: 3,
            absolute_encoder: false,
            increments_are_homed: false,
            homed_bit: None,
            rotary: None,
            touch_probe: None,
            manners: Manners::default(),
            quirks: DriveQuirks::default(),
        }
    }
}

impl Cia402DriveConfig {
    pub(super) fn power_on(&self) -> PowerOn {
        const MAY_BEGIN_WITHIN_MM: f64 = 10.0;
        if let Some(rotary) = &self.rotary {
            return rotary.power_on();
        }
        let um = |um: f64| ((um * 1e3 / self.encoder_resolution_nm).round() as i64).max(1);
        let mm = |mm: f64| um(mm * 1e3);
        PowerOn {
            following_error_window: um(self.following_error_window_um),
            position_window: um(self.position_window_um),
            max_velocity: mm(self.max_profile_velocity_mm_per_s),
            velocity: mm(self.profile_velocity_mm_per_s),
            acceleration: mm(self.profile_acceleration_mm_per_s2),
            quick_stop_deceleration: mm(self.quick_stop_deceleration_mm_per_s2),
            homing_switch_speed: mm(self.homing_switch_speed_mm_per_s),
            homing_zero_speed: mm(self.homing_zero_speed_mm_per_s),
            homing_acceleration: mm(self.homing_acceleration_mm_per_s2),
            homing_search_limit: mm(self.homing_search_limit_mm),
            homing_may_begin_within: mm(MAY_BEGIN_WITHIN_MM),
        }
    }
}

impl RotaryDriveConfig {
    fn power_on(&self) -> PowerOn {
        const MAY_BEGIN_WITHIN_DEG: f64 = 10.0;
        let turn = f64::from(self.counts_per_turn);
        let deg = |deg: f64| ((deg * turn / 360.0).round() as i64).max(1);
        let arcsec = |arcsec: f64| deg(arcsec / 3600.0);
        PowerOn {
            following_error_window: arcsec(self.following_error_window_arcsec),
            position_window: arcsec(self.position_window_arcsec),
            max_velocity: deg(self.max_profile_velocity_deg_per_s),
            velocity: deg(self.profile_velocity_deg_per_s),
            acceleration: deg(self.profile_acceleration_deg_per_s2),
            quick_stop_deceleration: deg(self.quick_stop_deceleration_deg_per_s2),
            homing_switch_speed: deg(self.homing_switch_speed_deg_per_s),
            homing_zero_speed: deg(self.homing_zero_speed_deg_per_s),
            homing_acceleration: deg(self.homing_acceleration_deg_per_s2),
            homing_search_limit: deg(self.homing_search_limit_deg),
            homing_may_begin_within: deg(MAY_BEGIN_WITHIN_DEG),
        }
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
            "node_id {raw} is not a CANopen node; nodes are 1 to 127"
        ))
    })
}
