//! What is set about an amplifier.

use core::time::Duration;

use units::{Coordinate, Metres, MetresPerSecond, MetresPerSecondSquared, Scale};
use wire::copley::Address;

/// Everything the driver must know about one amplifier.
///
/// # Example
///
/// ```
/// use drivers::device::{Device, LineUse, copley::{CopleyAxis, CopleySettings}};
/// use units::{Metres, MetresPerSecond, MetresPerSecondSquared, Scale, Time};
/// use wire::{LineControl, Payload, copley::Address};
///
/// let scale = Scale::new(Metres(10e-9)).expect("a count is some length");
/// let (speed, acceleration) = (MetresPerSecond(0.1), MetresPerSecondSquared(5.0));
/// let settings = CopleySettings::new(Address::GATEWAY, scale, speed, acceleration);
/// let mut axis = CopleyAxis::new(settings);
/// axis.start(Time::ZERO);
/// assert!(matches!(axis.line_use(), LineUse::Wants { .. }), "it may share its line");
/// assert_eq!(axis.poll_transmit(), None, "not before it was told that time has passed");
/// axis.handle_timeout(Time::ZERO);
/// let rate = Payload::Control(LineControl::Baud(115_200));
/// assert_eq!(axis.poll_transmit(), Some(rate));
/// axis.handle_timeout(axis.poll_timeout());
/// assert_eq!(axis.poll_transmit(), Some(Payload::Bytes(b"g r0x90\r".to_vec())));
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct CopleySettings<Q: Coordinate = Metres> {
    /// Whom the lines are for.
    pub address: Address,
    /// The line's working rate in bits per second; after a reset amplifiers are at 9600.
    pub baud: u32,
    /// What it must call itself; `None`: anything.
    pub model: Option<String>,
    /// Its serial number; `None`: any.
    pub serial: Option<u32>,
    /// Metres (radians) per count; negative when the amplifier counts against the axis.
    pub scale: Scale<Q>,
    /// Lowest and highest position, as coordinates.
    pub soft_limits: Option<(Q, Q)>,
    /// How far the axis may lag behind its trajectory; `None` leaves the amplifier's own.
    pub following_error: Option<Q>,
    /// How near to its target the axis must be ...
    pub position_window: Q,
    /// ... and for how long, for the amplifier to call it settled.
    pub position_window_time: Duration,
    /// How far an enabled axis that nothing moves may be from where it stood; `None`: it is not judged.
    pub hold_limit: Option<Q>,
    /// Whether gravity pulls the axis: it is never let go.
    pub gravity: bool,
    /// Deceleration of aborts: quick stop and halt.
    pub quick_stop_deceleration: Q::Acceleration,
    /// What the axis can do at most: faster moves are refused, faster positions not believed.
    pub speed_max: Q::Speed,
    /// Likewise.
    pub acceleration_max: Q::Acceleration,
    /// How far a position may be from where `speed_max` could have taken it.
    pub jump_margin: Q,
    /// Acceleration while homing.
    pub homing_acceleration: Q::Acceleration,
    /// From one look at status and position to the next; slower if the line is.
    pub poll_period: Duration,
    /// Whether each look asks for the following error, too.
    pub read_following_error: bool,
    /// How long each thing is waited for.
    pub timeouts: CopleyTimeouts,
}

/// How long each thing is waited for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CopleyTimeouts {
    /// A reply, beyond the time that its bytes and the command's take.
    pub reply: Duration,
    /// After a reply that did not come: the line must be quiet for so long.
    pub quiet: Duration,
    /// Finding the amplifier at the cable, its boot included.
    pub find: Duration,
    /// What was sent to have left, before the rate is changed.
    pub drain: Duration,
    /// Without an answer for so long an alarm is raised.
    pub silence: Duration,
    /// Enabling and disabling.
    pub transition: Duration,
    /// Signs of motion after a move was begun.
    pub motion: Duration,
    /// Settling at the target, beyond half as much again as the profile takes.
    pub settling: Duration,
    /// Standing still after a stop.
    pub standing: Duration,
    /// Homing, once begun.
    pub homing: Duration,
}

impl Default for CopleyTimeouts {
    fn default() -> Self {
        Self {
            reply: Duration::from_millis(100),
            quiet: Duration::from_millis(50),
            find: Duration::from_secs(10),
            drain: Duration::from_millis(30),
            silence: Duration::from_millis(700),
            transition: Duration::from_secs(2),
            motion: Duration::from_millis(500),
            settling: Duration::from_secs(3),
            standing: Duration::from_secs(3),
            homing: Duration::from_secs(120),
        }
    }
}

impl CopleySettings {
    /// A linear axis at 115200 bit/s: windows of 1 µm for 10 ms, position jumps above 100 µm are
    /// not believed, aborts with the largest acceleration, a look every 20 ms.
    pub fn new(
        address: Address,
        scale: Scale,
        speed_max: MetresPerSecond,
        acceleration_max: MetresPerSecondSquared,
    ) -> Self {
        Self {
            address,
            baud: 115_200,
            model: None,
            serial: None,
            scale,
            soft_limits: None,
            following_error: None,
            position_window: Metres::from_um(1.0),
            position_window_time: Duration::from_millis(10),
            hold_limit: None,
            gravity: false,
            quick_stop_deceleration: acceleration_max,
            speed_max,
            acceleration_max,
            jump_margin: Metres::from_um(100.0),
            homing_acceleration: acceleration_max * 0.1,
            poll_period: Duration::from_millis(20),
            read_following_error: true,
            timeouts: CopleyTimeouts::default(),
        }
    }
}

impl<Q: Coordinate> CopleySettings<Q> {
    /// How far from its target a standing axis may be found: the window and its noise.
    pub(super) fn tolerance_counts(&self) -> i64 {
        let window = self.scale.to_counts(self.position_window).0;
        window.saturating_abs().saturating_mul(2).saturating_add(1)
    }
}
