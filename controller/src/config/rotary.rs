//! The part of a configuration that is about rotary axes. Each key's suffix is its unit.

use serde::Deserialize;

use super::model::{HomeOffsetName, IdentityConfig, OptionCodesConfig};

/// The kinds of drive of a rotary axis: those with a touch probe.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum RotaryDevice {
    /// A CiA 402 drive on CAN.
    Cia402,
}

/// Where the position of a rotary axis's drive starts again (0x607B).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PositionRangeName {
    /// Not until 32 bits are full.
    CountsOn,
    /// After the last count of a turn, which is the upper limit.
    ToLastCount,
    /// At the upper limit, which is the counts of a turn.
    ToFirstCount,
}

/// A direction of travel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum DirectionName {
    /// Coordinates increase.
    Forward,
    /// Coordinates decrease.
    Reverse,
}

/// An edge of an input.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum EdgeName {
    /// From low to high.
    #[default]
    Positive,
    /// From high to low.
    Negative,
}

/// One rotary axis that turns endlessly.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "configs/README.md documents each key")]
pub struct RotaryConfig {
    pub device: RotaryDevice,
    pub bus: String,
    pub node_id: u8,
    pub counts_per_turn: u32,
    #[serde(default)]
    pub reverse: bool,
    pub position_range: PositionRangeName,
    pub speed_deg_per_s: f64,
    pub speed_max_deg_per_s: f64,
    pub acceleration_deg_per_s2: f64,
    pub quick_stop_deceleration_deg_per_s2: f64,
    pub following_error_limit_arcsec: f64,
    pub following_error_timeout_ms: u16,
    pub position_window_arcsec: f64,
    pub position_window_time_ms: u16,
    pub move_timeout_s: f64,
    pub heartbeat_producer_ms: u16,
    pub heartbeat_consumer_ms: u16,
    pub watch_master_ms: u16,
    #[serde(default)]
    pub home_offset: HomeOffsetName,
    #[serde(default)]
    pub option_codes: OptionCodesConfig,
    pub identity: IdentityConfig,
    pub zero: Option<RotaryZeroConfig>,
    pub line_detector: Option<LineDetectorConfig>,
}

/// The zero: the encoder's index mark.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "configs/README.md documents each key")]
pub struct RotaryZeroConfig {
    pub index_direction: DirectionName,
    pub index_speed_deg_per_s: f64,
    pub index_deg: f64,
}

/// What sees the lines of a plate pass, wired to the drive's touch probe.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "configs/README.md documents each key")]
pub struct LineDetectorConfig {
    #[serde(default)]
    pub edge: EdgeName,
    pub input: Option<i16>,
}
