//! What is set about a drive.

use core::time::Duration;

use units::{
    Coordinate, Metres, MetresPerSecond, MetresPerSecondSquared, Quantity, Radians,
    RadiansPerSecond, RadiansPerSecondSquared, Scale,
};

use crate::device::ReferenceProof;
use crate::device::canopen_node::NodeSettings;
use crate::device::envelope::{Figures, hold_limit};

/// Everything the driver must know about one drive. [`Cia402Settings::new`] leaves to the
/// drive what is `None`: it is then neither written nor checked.
#[derive(Clone, Debug, PartialEq)]
pub struct Cia402Settings<Q: Coordinate = Metres> {
    /// Node, master, identity, heartbeats, SYNC period, start time-outs.
    pub common: NodeSettings,
    /// Metres (radians) per position unit of 0x6064; negative when the drive counts against the
    /// axis.
    pub scale: Scale<Q>,
    /// Metres (radians) per encoder increment, to check the factor objects (0x608F, 0x6091, 0x6092)
    /// against; `None`: not checked.
    pub increment: Option<Q>,
    /// How an axis that turns endlessly is counted; `None` for one that has ends.
    pub turn: Option<Turn>,
    /// How positions are latched; `None`: not at all.
    pub latch: Option<LatchSettings>,
    /// Lowest and highest position (0x607D), drive coordinates.
    pub soft_limits: Option<(Q, Q)>,
    /// How far the axis may lag behind the drive's demand (0x6065), and for how long (0x6066).
    pub following_error: Option<(Q, Duration)>,
    /// How far an axis that holds its place may leave that; `None`: a tenth of the following
    /// error, at least the position window.
    pub hold_limit: Option<Q>,
    /// Whether gravity pulls the axis: it is never let go.
    pub gravity: bool,
    /// How near to its target the axis must be (0x6067) ...
    pub position_window: Q,
    /// ... and for how long (0x6068), for the drive to call it reached.
    pub position_window_time: Duration,
    /// Deceleration of a quick stop (0x6085).
    pub quick_stop_deceleration: Option<Q::Acceleration>,
    /// What the drive does of itself.
    pub options: OptionCodes,
    /// What the axis can do at most: faster moves are refused, faster positions not believed.
    pub speed_max: Q::Speed,
    /// Likewise.
    pub acceleration_max: Q::Acceleration,
    /// How far a position may be from where `speed_max` could have taken it.
    pub jump_margin: Q,
    /// How much later than it came a sample may be stamped on a host that is held up. None on
    /// a real machine: its transports stamp what queued up with the time of its arrival.
    pub stall_max: Duration,
    /// Acceleration while homing (0x609A).
    pub homing_acceleration: Q::Acceleration,
    /// What 0x607C means to this drive.
    pub home_offset: HomeOffset,
    /// How the drive proves that it has kept its reference; `None`: it cannot.
    pub reference_proof: Option<ReferenceProof>,
    /// What its owner states of its units.
    pub stated_units: StatedUnits,
    /// Whether TPDO 2 carries the following error (0x60F4).
    pub map_following_error: bool,
    /// Whether RPDO 1 takes effect at the next SYNC (transmission type 1) instead of at once, so
    /// that axes which are started together start at the same one. Every controlword then takes
    /// up to one SYNC period longer, a quick stop too; and none without SYNC.
    pub synchronous_start: bool,
    /// How long each thing is waited for.
    pub timeouts: Cia402Timeouts,
}

/// The option codes of CiA 402 (8.4.6 and 8.4.7); `None` leaves the drive's own.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct OptionCodes {
    /// 0x605A: 1, 2 stop and disable; 5, 6 stop and stay in quick stop active.
    pub quick_stop: Option<i16>,
    /// 0x605B: on shutdown.
    pub shutdown: Option<i16>,
    /// 0x605C: on disable operation.
    pub disable: Option<i16>,
    /// 0x605D: on halt.
    pub halt: Option<i16>,
    /// 0x605E: on a fault.
    pub fault_reaction: Option<i16>,
    /// 0x6007: when our heartbeat is lost; 3 is a quick stop.
    pub abort_connection: Option<i16>,
}

/// What is stated to count in position units and seconds. Where both are, the first motion is not
/// measured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StatedUnits {
    /// Speed.
    pub speed: bool,
    /// Acceleration.
    pub acceleration: bool,
}

impl StatedUnits {
    /// Whether nothing is left open with what `other` states.
    pub(super) const fn are_all_with(self, other: Self) -> bool {
        (self.speed || other.speed) && (self.acceleration || other.acceleration)
    }
}

/// CiA 402 says that zero is the home position plus the offset; many drives take the offset
/// for the position at home instead.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum HomeOffset {
    /// 0x6064 becomes 0x607C at home.
    IsPositionAtHome,
    /// 0x6064 becomes -0x607C at home.
    IsZeroFromHome,
}

/// How an axis that turns endlessly is counted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Turn {
    /// Position units of one turn: a whole number, or every turn would add to an error.
    pub counts: u32,
    /// Where the drive's position starts again.
    pub range: PositionRange,
}

/// Where the drive's position starts again (0x607B, CiA 402: position range limit).
///
/// The standard says that a position that reaches or exceeds a limit wraps to the other one;
/// drives differ in whether the upper limit is still a position of its own.
///
/// A drive that wraps must also take the shortest way (0x60F2, bits 6 and 7): only so is a
/// target beyond the seam told apart from one on this side. Longer ways are made of several.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum PositionRange {
    /// It does not until 32 bits are full; 0x607B is 0 or absent.
    CountsOn,
    /// At 0, after the last count of the turn, which is the upper limit.
    ToLastCount,
    /// At 0, which is also what the upper limit, the counts of the turn, stands for.
    ToFirstCount,
}

/// How positions are latched: touch probe 1 (CiA 402, 0x60B8 to 0x60BB).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct LatchSettings {
    /// Which edge of the input.
    pub edge: Edge,
    /// 0x60D0:01, where the drive has a choice of inputs; `None`: its first one.
    pub source: Option<i16>,
}

/// An edge of an input.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Edge {
    /// From low to high (0x60BA).
    Positive,
    /// From high to low (0x60BB).
    Negative,
}

/// How long each thing is waited for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cia402Timeouts {
    /// One transition of the power state machine.
    pub transition: Duration,
    /// The mode display following the mode (0x6061 after 0x6060).
    pub mode: Duration,
    /// Each half of the set-point handshake.
    pub set_point: Duration,
    /// Settling at the target, beyond half as much again as the profile takes.
    pub settling: Duration,
    /// Standing still after halt or quick stop.
    pub standing: Duration,
    /// Homing, once started.
    pub homing: Duration,
    /// The new position after homing.
    pub new_position: Duration,
    /// The latch saying that it is armed.
    pub latch: Duration,
    /// After how long a controlword without effect is sent again.
    pub repeat: Duration,
}

impl Default for Cia402Timeouts {
    fn default() -> Self {
        Self {
            transition: Duration::from_secs(2),
            mode: Duration::from_secs(1),
            set_point: Duration::from_millis(500),
            settling: Duration::from_secs(3),
            standing: Duration::from_secs(3),
            homing: Duration::from_secs(120),
            new_position: Duration::from_secs(1),
            latch: Duration::from_secs(1),
            repeat: Duration::from_millis(50),
        }
    }
}

impl Cia402Settings {
    /// A linear axis whose position unit is one encoder increment; windows of 100 nm for
    /// 10 ms, position jumps above 100 µm are not believed, a lost heartbeat is a quick stop.
    pub fn new(
        common: NodeSettings,
        scale: Scale,
        speed_max: MetresPerSecond,
        acceleration_max: MetresPerSecondSquared,
    ) -> Self {
        let (window, jump) = (Metres::from_um(0.1), Metres::from_um(100.0));
        Self::with_windows(common, scale, (speed_max, acceleration_max), window, jump)
    }
}

impl Cia402Settings<Radians> {
    /// A rotary axis that turns endlessly and whose position unit is one encoder increment;
    /// windows of 1 arcsec for 10 ms, position jumps above 60 arcsec are not believed, a lost
    /// heartbeat is a quick stop.
    ///
    /// `None` when a turn has no counts, or more than the drive's 32 bits.
    ///
    /// # Example
    ///
    /// ```
    /// use drivers::device::canopen_node::NodeSettings;
    /// use drivers::device::cia402::{Cia402Settings, PositionRange, Turn};
    /// use std::time::Duration;
    /// use units::{RadiansPerSecond, RadiansPerSecondSquared};
    /// use wire::canopen::NodeId;
    ///
    /// let (node, master) = (NodeId::new(5).expect("1 to 127"), NodeId::new(127).expect("likewise"));
    /// let common = NodeSettings::new(node, master, Duration::from_millis(2));
    /// let turn = Turn { counts: 1_296_000, range: PositionRange::CountsOn };
    /// let (speed, acceleration) = (RadiansPerSecond(0.5), RadiansPerSecondSquared(1.0));
    /// let settings = Cia402Settings::rotary(common, turn, speed, acceleration).expect("32 bits");
    /// assert!((settings.scale.resolution().arcsec() - 1.0).abs() < 1e-9);
    /// let no_counts = Turn { counts: 0, ..turn };
    /// assert!(Cia402Settings::rotary(common, no_counts, speed, acceleration).is_none());
    /// ```
    pub fn rotary(
        common: NodeSettings,
        turn: Turn,
        speed_max: RadiansPerSecond,
        acceleration_max: RadiansPerSecondSquared,
    ) -> Option<Self> {
        i32::try_from(turn.counts).ok()?;
        let scale = Scale::new(Radians::TURN / f64::from(turn.counts))?;
        let (window, jump) = (Radians::from_arcsec(1.0), Radians::from_arcsec(60.0));
        let limits = (speed_max, acceleration_max);
        let axis = Self::with_windows(common, scale, limits, window, jump);
        Some(Self {
            turn: Some(turn),
            ..axis
        })
    }
}

impl<Q: Coordinate> Cia402Settings<Q> {
    fn with_windows(
        common: NodeSettings,
        scale: Scale<Q>,
        (speed_max, acceleration_max): (Q::Speed, Q::Acceleration),
        position_window: Q,
        jump_margin: Q,
    ) -> Self {
        Self {
            common,
            scale,
            increment: Some(scale.resolution().abs()),
            turn: None,
            latch: None,
            soft_limits: None,
            following_error: None,
            hold_limit: None,
            gravity: false,
            position_window,
            position_window_time: Duration::from_millis(10),
            quick_stop_deceleration: None,
            options: OptionCodes {
                abort_connection: Some(3),
                ..OptionCodes::default()
            },
            speed_max,
            acceleration_max,
            jump_margin,
            stall_max: Duration::ZERO,
            homing_acceleration: acceleration_max * 0.1,
            home_offset: HomeOffset::IsPositionAtHome,
            reference_proof: None,
            stated_units: StatedUnits::default(),
            map_following_error: true,
            synchronous_start: false,
            timeouts: Cia402Timeouts::default(),
        }
    }

    /// How far the axis may be from its demand.
    fn lag_counts(&self) -> i64 {
        let lag = self
            .following_error
            .map_or(self.jump_margin, |error| error.0);
        self.scale.to_counts(lag).0.saturating_abs()
    }

    /// From one end of the axis to the other, or one turn; endless where neither is known.
    pub(super) fn travel_counts(&self) -> f64 {
        let limits = self.soft_limits;
        let travel = limits.map(|(low, high)| self.scale.to_counts(high - low).0.abs() as f64);
        let turn = self.turn.map(|turn| f64::from(turn.counts));
        turn.or(travel).unwrap_or(f64::INFINITY)
    }

    /// What its motion is judged by.
    pub(super) fn figures(&self) -> Figures {
        let (lag, window) = (self.lag_counts(), self.tolerance_counts());
        Figures {
            period: self.common.sync_period,
            stall_max: self.stall_max,
            lag: lag.max(window),
            hold_limit: hold_limit(self.scale, self.hold_limit, lag, window),
            window,
            speed_max: self.speed_max.value() / self.scale.resolution().abs().value(),
        }
    }

    /// How far from its target a standing axis may be found: the window and its noise.
    pub(super) fn tolerance_counts(&self) -> i64 {
        let window = self.scale.to_counts(self.position_window).0;
        window.saturating_abs().saturating_mul(2).saturating_add(1)
    }
}
