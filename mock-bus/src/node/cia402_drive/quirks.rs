//! Quirks of a drive: one key for each way in which real ones differ.

use serde::{Deserialize, Serialize};

/// What real drives do and a polite one would not; the default is nothing. Each is counted as
/// delivered, under the name of its key, when it made a difference.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
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
    /// After a homing start, bits 10 and 12 of the homing before stay so long.
    pub stale_homing_ms: u64,
    /// They are there from power-on, as if a homing had been attained before.
    pub stale_homing_from_power_on: bool,
    /// A homing ends with "attained" (bit 12) and without "target reached" (bit 10).
    pub homing_ends_without_bit_10: bool,
    /// Bits 10 and 12 stay 1 in homing mode, whatever happens.
    pub homing_attained_stuck: bool,
    /// 0x6060 has no effect while the drive is not in operation enabled.
    pub mode_ignored_while_off: bool,
    /// 0x6061 shows this mode, whatever mode the drive is in.
    pub mode_display_stuck: Option<i8>,
    /// The mode at power-on. With 3, the drive knows profile velocity too.
    pub left_mode: Option<i8>,
    /// 0x60FF at power-on, in counts per second: an enabled drive in mode 3 runs at this speed.
    pub left_velocity: i32,
    /// The edge of a new set-point takes 0x607A as it was before the same frame.
    pub edge_before_target: bool,
    /// Objects take effect in the order of the mapping: an edge that is mapped before the target
    /// takes the target of before.
    pub edge_in_mapping_order: bool,
    /// From the command to operation enabled.
    pub enable_delay_ms: u64,
    /// 0x6060 has no effect while HALT is set.
    pub halt_blocks_mode: bool,
    /// A new set-point is neither acknowledged nor taken while HALT is set.
    pub halt_blocks_acknowledge: bool,
    /// The drive faults (0x8130) in every state when the watched heartbeat ends. The fault can be
    /// reset while a heartbeat is heard or none is watched.
    pub faults_on_lost_heartbeat: bool,
    /// The set-point acknowledge (bit 12 in profile position) is inverted.
    pub acknowledge_inverted: bool,
    /// The set-point acknowledge stays 1 until the drive is enabled anew.
    pub acknowledge_never_falls: bool,
    /// 0x1400:05 at power-on.
    pub rpdo_deadline_ms: u16,
    /// The drive's reaction, in operation enabled, to an RPDO that is late by 0x1400:05.
    pub rpdo_deadline: RpdoDeadline,
    /// Bits that are 1 in every statusword.
    pub statusword_bits: u16,
    /// 0x606B, 0x606C, 0x607F, 0x6081 and 0x6099 have 16 bits.
    pub speeds_of_16_bits: bool,
    /// Counts per second that one unit of 0x606B, 0x606C, 0x607F, 0x6081, 0x6099 and 0x60FF means.
    pub speed_unit: Option<f64>,
    /// Counts per second squared that one unit of 0x6083, 0x6084, 0x6085 and 0x609A means.
    pub acceleration_unit: Option<f64>,
    /// Homings are so many times as fast as 0x6099 says.
    pub homing_speed_factor: Option<f64>,
    /// What the drive says of its units.
    pub unit_objects: UnitObjects,
}

/// A drive's reaction to a late RPDO.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RpdoDeadline {
    /// An emergency and nothing else.
    #[default]
    Ignored,
    /// Quick stop.
    QuickStop,
    /// Fault 0x8250.
    Fault,
}

/// Objects that name the units of speed and acceleration; each is absent unless it has a value.
/// 0x60A9 and 0x60AA are there, in position units, while `speed_unit` and `acceleration_unit` are not given.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct UnitObjects {
    /// 0x60A9.
    pub si_velocity: Option<u32>,
    /// 0x60AA.
    pub si_acceleration: Option<u32>,
    /// 0x608B.
    pub velocity_notation: Option<i8>,
    /// 0x608C.
    pub velocity_dimension: Option<u8>,
    /// 0x608D.
    pub acceleration_notation: Option<i8>,
    /// 0x608E.
    pub acceleration_dimension: Option<u8>,
    /// 0x6096:01 and :02.
    pub velocity_factor: Option<[u32; 2]>,
}

impl DriveQuirks {
    /// Counts per second of one unit of speed.
    pub(super) fn counts_per_speed(&self) -> f64 {
        self.speed_unit.unwrap_or(1.0)
    }

    /// Counts per second squared of one unit of acceleration.
    pub(super) fn counts_per_acceleration(&self) -> f64 {
        self.acceleration_unit.unwrap_or(1.0)
    }
}
