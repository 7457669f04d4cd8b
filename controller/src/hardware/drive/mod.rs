//! Drives of linear axes: `[axis.NAME]`.

pub(crate) mod cia402;
pub(crate) mod copley;

use core::time::Duration;

use drivers::device::{Axis, Identity};
use machine::Patience;
use machine::engine::{AxisLimits, CorrectionLimits};
use schemars::JsonSchema;
use serde::Deserialize;
use units::{Metres, MetresPerSecond, MetresPerSecondCubed, MetresPerSecondSquared};

use super::bus::Wiring;
use super::kept_zero::KeptZeroConfig;
use super::node::NodeConfig;
use crate::config::judge::Judge;
pub(crate) use cia402::Cia402AxisConfig;
pub(crate) use copley::CopleyAxisConfig;

/// The servo drive of an axis, by what `device` calls it.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(tag = "device", rename_all = "lowercase")]
pub enum DriveConfig {
    /// A CiA 402 drive on CAN.
    Cia402(Cia402AxisConfig),
    /// A Copley Controls amplifier on a serial line (ASCII interface).
    Copley(CopleyAxisConfig),
}

/// What a family of drives is to a machine.
pub(crate) trait Family {
    /// The bus or line that it is on.
    fn port(&self) -> &str;

    /// Where it is on CAN, if it is.
    fn node(&self) -> Option<&NodeConfig> {
        None
    }

    /// Its address on a serial line that it shares with others of its family.
    fn address(&self) -> Option<u8> {
        None
    }

    /// How it follows cyclic set-points, if it does.
    fn cyclic(&self) -> Option<&CyclicConfig> {
        None
    }

    /// Who it is, as far as the configuration says it.
    fn identity(&self) -> Identity;

    /// In how many counts its registers hold speeds (counts/s) and accelerations (counts/s²).
    fn register_units(&self) -> [f64; 2];

    /// Judges what its keys must keep to together.
    fn check(&self, judge: &mut Judge<'_>, wiring: Wiring<'_>);

    /// Its driver; the configuration has been checked.
    fn driver(&self, task: Task<'_>, wiring: Wiring<'_>, patience: Patience) -> Box<dyn Axis>;
}

/// What a drive is for.
#[derive(Clone, Copy, Debug)]
pub struct Task<'a> {
    /// How its axis counts and moves.
    pub motion: &'a MotionConfig,
    /// How long it may look for its limit switch, where it does.
    pub homing: Option<Duration>,
}

impl DriveConfig {
    /// How it proves at a start that it kept its zero.
    pub(crate) const fn kept_zero(&self) -> Option<&KeptZeroConfig> {
        match self {
            Self::Cia402(family) => family.kept_zero.as_ref(),
            Self::Copley(_) => None,
        }
    }

    pub(crate) fn family(&self) -> &dyn Family {
        match self {
            Self::Cia402(family) => family,
            Self::Copley(family) => family,
        }
    }
}

/// How an axis counts and moves.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
pub struct MotionConfig {
    /// One encoder count; negative when the drive counts against the axis. The soft limits must fit
    /// 31 bits of counts.
    #[schemars(extend("x-magnitude" = [0.01, 1e6]))]
    #[schemars(extend("x-own" = true))]
    pub resolution_nm: f64,
    /// Soft limit; also written to the drive (0x607D), to an amplifier after homing (0xb8).
    #[schemars(extend("x-range" = "below `soft_max_mm`"))]
    #[schemars(extend("x-own" = true))]
    pub soft_min_mm: f64,
    /// Likewise (0xb9).
    #[schemars(extend("x-own" = true))]
    pub soft_max_mm: f64,
    /// Greatest speed of every motion that is no path and has no speed of its own in this file.
    #[schemars(range(min = 0.001), extend("x-range" = "at most `speed_max_mm_per_s`"))]
    #[schemars(extend("x-own" = true))]
    pub speed_mm_per_s: f64,
    /// Fastest possible: faster moves are refused, faster changes of position not believed.
    #[schemars(range(min = 0.001, max = 100000.0))]
    #[schemars(extend("x-own" = true))]
    pub speed_max_mm_per_s: f64,
    /// Acceleration and deceleration of moves.
    #[schemars(range(min = 0.01, max = 1000000.0))]
    #[schemars(extend("x-own" = true))]
    pub acceleration_mm_per_s2: f64,
    /// Written to the drive (0x6085; 0xcf).
    #[schemars(range(min = 0.01, max = 10000000.0))]
    #[schemars(extend("x-own" = true))]
    pub quick_stop_deceleration_mm_per_s2: f64,
    /// Following error window (0x6065; 0xba).
    #[schemars(range(min = 0.001, max = 100000.0), extend("x-range" = "at least one count"))]
    pub following_error_limit_um: f64,
    /// How far an axis that is on, and that nothing moves, may be from where it stood before it is stopped; a tenth of
    /// `following_error_limit_um` when left out, and `position_window_um` at least.
    #[schemars(range(min = 0.0001, max = 100000.0), extend("x-range" = "at least `position_window_um`"))]
    pub hold_limit_um: Option<f64>,
    /// Gravity pulls the axis: it is never let go. Its drive stays in quick stop active (`option_codes`, `quick_stop` 5 to
    /// 8), or holds it by a brake of its own (`drive_brake`).
    #[serde(default)]
    pub gravity: bool,
    /// The drive closes a holding brake by itself before it switches its power off.
    #[serde(default)]
    pub drive_brake: bool,
    /// How near its target the axis must be (0x6067; 0xbc).
    #[schemars(range(min = 0.0001, max = 10000.0))]
    pub position_window_um: f64,
    /// For how long it must be there (0x6068; 0xbd).
    pub position_window_time_ms: u16,
    /// Longest time of one move.
    #[schemars(range(min = 0.01, max = 100000.0))]
    pub move_timeout_s: f64,
}

/// An axis that follows a set-point at every SYNC, together with others.
///
/// It needs `synchronous_start = true`, and its set-points count in the bus load.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CyclicConfig {
    /// Greatest jerk of paths, moves and controlled stops. A path is limited to `speed_max_mm_per_s`, a move and the way
    /// to the first point of a path to `speed_mm_per_s`, all of them to `acceleration_mm_per_s2`.
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

impl MotionConfig {
    /// How far it may be from where it stood while nothing moves it.
    pub(crate) fn hold_limit(&self) -> Metres {
        let usual_um = HOLD_SHARE * self.following_error_limit_um;
        let limit_um = self.hold_limit_um.unwrap_or(usual_um);
        Metres::from_um(limit_um.max(self.position_window_um))
    }

    /// Whether the soft limits leave any travel: where they are swapped, that is told and nothing else by them.
    pub(crate) fn has_travel(&self) -> bool {
        self.soft_min_mm < self.soft_max_mm
    }
}

/// An axis that stands may be this share of its following error limit from where it stood.
pub(crate) const HOLD_SHARE: f64 = 0.1;

/// The share of a drive's speed that is left to catch up what a SYNC that came early left short.
const CATCHING_UP: f64 = 0.02;
/// A correction never takes more than this share.
const CORRECTING_MAX: f64 = 0.5;

/// How fast a path may be: the drive itself goes no faster than its 0x607F, and what is added to
/// the path and what jitter leaves short must fit below that too, or they pile up as following
/// error.
fn path_speed(axis: &MotionConfig, cyclic: &CyclicConfig) -> MetresPerSecond {
    let own_mm_per_s = axis.speed_max_mm_per_s;
    let correcting = cyclic.correction_rate_um_per_s * 1e-3;
    let correcting = correcting.min(own_mm_per_s * CORRECTING_MAX);
    MetresPerSecond((own_mm_per_s * (1.0 - CATCHING_UP) - correcting) * 1e-3)
}

/// The limits of an axis and of what is added to its set-points.
pub(crate) fn cyclic_settings(
    axis: &MotionConfig,
    cyclic: &CyclicConfig,
) -> (AxisLimits, CorrectionLimits) {
    let limits = AxisLimits {
        min: Metres::from_mm(axis.soft_min_mm),
        max: Metres::from_mm(axis.soft_max_mm),
        speed: path_speed(axis, cyclic),
        move_speed: MetresPerSecond(axis.speed_mm_per_s * 1e-3).min(path_speed(axis, cyclic)),
        acceleration: MetresPerSecondSquared(axis.acceleration_mm_per_s2 * 1e-3),
        jerk: MetresPerSecondCubed(cyclic.jerk_mm_per_s3 * 1e-3),
        deviation: Metres::from_um(cyclic.deviation_limit_um),
    };
    let correction = CorrectionLimits {
        size: Metres::from_um(cyclic.correction_limit_um),
        rate: MetresPerSecond(cyclic.correction_rate_um_per_s * 1e-6),
    };
    (limits, correction)
}
