//! What a configuration file says about emulated amplifiers.

use serde::Deserialize;

/// Amplifiers behind one serial line.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CopleyAmpsConfig {
    /// Each of them; that with address 0 is at the cable and hands lines on to the others.
    pub amps: Vec<CopleyAmpConfig>,
    /// From a command's end to its reply's start.
    pub reply_ms: f64,
    /// The reply varies by up to this much more.
    pub reply_jitter_ms: f64,
    /// So much later reply those that are not at the cable.
    pub forward_ms: f64,
    /// How long the one at the cable waits for another before it says so.
    pub forward_timeout_ms: f64,
    /// How badly the line behaves.
    pub quirks: LineQuirks,
}

impl Default for CopleyAmpsConfig {
    fn default() -> Self {
        Self {
            amps: vec![CopleyAmpConfig::default()],
            reply_ms: 0.6,
            reply_jitter_ms: 0.4,
            forward_ms: 0.5,
            forward_timeout_ms: 20.0,
            quirks: LineQuirks::default(),
        }
    }
}

/// One emulated amplifier; every key has a default.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CopleyAmpConfig {
    /// CAN node number; 0 is the amplifier at the cable.
    pub address: u8,
    /// Which axis of the plant it moves.
    pub axis: usize,
    /// Parameter 0x80.
    pub model: String,
    /// Parameter 0x81.
    pub serial_number: u32,
    /// From power-on until it listens.
    pub boot_ms: f64,
    /// From the command to enable until the motor is under control.
    pub enable_ms: f64,
    /// Length of one count.
    pub encoder_resolution_nm: f64,
    /// Parameter 0x24 in flash: what it does after power-on.
    pub state_at_power_on: i64,
    /// Parameter 0xba in flash.
    pub following_error_limit_um: f64,
    /// Parameter 0xbc in flash.
    pub tracking_window_um: f64,
    /// Parameter 0xbd in flash.
    pub tracking_window_time_ms: i64,
    /// Parameter 0xcb in flash.
    pub speed_mm_per_s: f64,
    /// Parameters 0xcc, 0xcd and 0xc5 in flash.
    pub acceleration_mm_per_s2: f64,
    /// Parameter 0xcf in flash.
    pub abort_deceleration_mm_per_s2: f64,
    /// How badly the amplifier behaves.
    pub quirks: AmpQuirks,
}

impl Default for CopleyAmpConfig {
    fn default() -> Self {
        Self {
            address: 0,
            axis: 0,
            model: "MOCK-055-18".to_owned(),
            serial_number: 4001,
            boot_ms: 800.0,
            enable_ms: 20.0,
            encoder_resolution_nm: 10.0,
            state_at_power_on: 0,
            following_error_limit_um: 500.0,
            tracking_window_um: 1.0,
            tracking_window_time_ms: 10,
            speed_mm_per_s: 20.0,
            acceleration_mm_per_s2: 200.0,
            abort_deceleration_mm_per_s2: 2000.0,
            quirks: AmpQuirks::default(),
        }
    }
}

impl CopleyAmpConfig {
    /// Micrometres to counts, at least one.
    pub(super) fn counts_of_um(&self, um: f64) -> i64 {
        ((um * 1e3 / self.encoder_resolution_nm).round() as i64).max(1)
    }
}

/// What lines and gateways do and polite ones would not. Each quota counts down as it is
/// delivered; the default is nothing.
#[derive(Clone, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LineQuirks {
    /// Replies that never come; what was asked is done.
    pub lose_replies: u32,
    /// Likewise, of `t` commands only.
    pub lose_trajectory_replies: u32,
    /// `t` commands that are lost: neither done nor answered.
    pub lose_trajectory_commands: u32,
    /// Replies that come late, ...
    pub delay_replies: u32,
    /// ... by this much.
    pub delay_ms: u32,
    /// Values that are another amplifier's.
    pub foreign_replies: u32,
    /// Values of which one digit is wrong: nothing on the line would show it.
    pub wrong_digits: u32,
}

/// What amplifiers do and polite ones would not; the default is nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct AmpQuirks {
    /// A move is taken (`ok`) and not begun.
    pub moves_not_begun: bool,
    /// It says that it is in motion for ever.
    pub never_settles: bool,
    /// Faults cannot be cleared.
    pub faults_stay: bool,
    /// It never gets enabled.
    pub enable_refused: bool,
}
