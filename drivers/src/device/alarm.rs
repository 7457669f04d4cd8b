//! What a device says unasked when something is wrong.

use core::fmt;
use core::time::Duration;
use units::{AxisSpeed, Coordinate, Counts, LengthOrAngle, Quantity, Scale};
use wire::canopen::NodeId;
use wire::canopen::emcy::{Emergency, EmergencyCode};
use wire::canopen::nmt::NmtState;
use wire::cia402::PowerState;
use wire::copley::Faults;

use super::DeviceName;
use super::departure::{Asked, Departure};

/// Something that must stop the machine, or at least be reported.
///
/// # Example
///
/// ```
/// use drivers::device::Alarm;
/// use std::time::Duration;
/// use wire::canopen::NodeId;
///
/// let node = NodeId::new(5).expect("1 to 127");
/// let alarm = Alarm::HeartbeatLost { node, waited: Duration::from_millis(150) };
/// let text = "node 5: no heartbeat for 150ms; check its power and cable";
/// assert_eq!(alarm.to_string(), text);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[expect(
    missing_docs,
    reason = "fields are named by what they are: node, waited, state, limit"
)]
pub enum Alarm {
    /// No heartbeat for the consumer time.
    #[error("{node}: no heartbeat for {}; check its power and cable", units::ShortSpan(*waited))]
    HeartbeatLost { node: NodeId, waited: Duration },
    /// The node restarted unexpectedly: it was reset or lost power, and its zero is lost.
    #[error("{node}: restarted unexpectedly; it lost power or was reset: zero again")]
    UnexpectedBootUp { node: NodeId },
    /// A second device with this node identifier is on the bus.
    #[error(
        "{node}: a second device with this node number is on the bus; give one of them another \
         (LSS or its switches)"
    )]
    DuplicateNode { node: NodeId },
    /// The node left operational.
    #[error("{node}: left the state operational, is now {state}")]
    UnexpectedNmtState { node: NodeId, state: NmtState },
    /// An emergency message that reports an error.
    #[error("{node}: emergency {}, error register {:#04X}", emergency.code, emergency.register)]
    Emergency { node: NodeId, emergency: Emergency },
    /// The node's synchronous PDO did not come for `missed` SYNCs.
    #[error("{node}: process data missing for {missed} SYNC periods")]
    PdoLost { node: NodeId, missed: u32 },
    /// A PDO was shorter than its mapping.
    #[error("{node}: received process data of {seen} bytes, {expected} bytes are mapped")]
    PdoTooShort {
        node: NodeId,
        expected: usize,
        seen: usize,
    },
    /// The drive left the state it was told to keep.
    #[error("{node}: drive is in {seen}, should be in {expected}")]
    DriveState {
        node: NodeId,
        expected: PowerState,
        seen: PowerState,
    },
    /// The drive says its following error left the window.
    #[error("{node}: following error outside its window; is the axis blocked or overloaded?")]
    FollowingError { node: NodeId },
    /// In cyclic synchronous position: the drive is enabled and follows its set-points no more.
    #[error(
        "{node}: the drive no longer follows its set-points (0x6041 bit 12); was it halted, or \
         given another command?"
    )]
    NotFollowing { node: NodeId },
    /// In cyclic synchronous position: the drive limits what it was sent.
    #[error(
        "{node}: the drive limits its set-points (0x6041 bit 11); is it on a limit switch, or at \
         its own soft limit, speed limit or torque limit?"
    )]
    InternalLimit { node: NodeId },
    /// The axis moves against the direction that its drive demands.
    #[error(
        "{node}: the axis moves in the wrong direction: expected {wanted:+.3}, moved {moved:+.3}; \
         are the motor phases swapped, or is the encoder or the polarity reversed?"
    )]
    WrongDirection {
        node: NodeId,
        wanted: LengthOrAngle,
        moved: LengthOrAngle,
    },
    /// An implausible jump of a position.
    #[error("{node}: position jumped by {jump:.3}, at most {limit:.3} is possible")]
    PositionJump {
        node: NodeId,
        jump: LengthOrAngle,
        limit: LengthOrAngle,
    },
    /// The axis is where its request does not allow.
    #[error(
        "{device}: {} and is at {position:.3}, beyond {limit:.3}; look for {}",
        moved_unasked(*asked), causes_of_motion(*asked)
    )]
    OutsideEnvelope {
        device: DeviceName,
        asked: Asked,
        position: LengthOrAngle,
        limit: LengthOrAngle,
    },
    /// The axis is faster than its request allows.
    #[error(
        "{device}: moved at {seen:.3} while asked {asked} at {limit:.3} at most; the drive counts \
         speed in another unit (0x60A9, 0x608C, 0x6096), or its gear or encoder is set otherwise"
    )]
    TooFast {
        device: DeviceName,
        asked: Asked,
        seen: AxisSpeed,
        limit: AxisSpeed,
    },
    /// The drive is in another mode than it was given.
    #[error(
        "{node}: the drive is in mode {seen} (0x6061), was given mode {expected} (0x6060); does \
         another master or program set it, or does the drive take a mode only when enabled?"
    )]
    WrongMode {
        node: NodeId,
        expected: i8,
        seen: i8,
    },
    /// The drive is enabled without a command of this controller.
    #[error(
        "{device}: the drive is in operation enabled, and this controller did not enable it; look \
         for another master or program, or a drive that enables itself"
    )]
    EnabledUnasked { device: DeviceName },
    /// The drive no longer latches, although this controller did not switch that off.
    #[error("{node}: the touch probe was switched off; does another program write 0x60B8?")]
    LatchDisarmed { node: NodeId },
    /// The interferometer's measurement beam is blocked.
    #[error("interferometer: beam lost; clear and align it, set a new datum")]
    BeamLost,
    /// So many samples had no valid phase: there is light, but too little of it.
    #[error(
        "interferometer: beam too weak, {samples} samples without a valid phase; align it, clean \
         the optics"
    )]
    BeamWeak { samples: u64 },
    /// The interferometer's laser head gives no reference.
    #[error("interferometer: no reference from the laser head")]
    LaserLost,
    /// The stage moved faster than the interferometer can count.
    #[error("interferometer: too fast to count; slow down")]
    SlewError,
    /// Samples are missing from the interferometer's stream.
    #[error("interferometer: {lost} samples missing")]
    SamplesLost { lost: u64 },
    /// The interferometer's count started again: it was reset or lost power.
    #[error("interferometer: was reset; set a new datum")]
    CountRestarted,
    /// The stream ended.
    #[error("interferometer: no sample for {}; check its cable and power",
        units::ShortSpan(*waited))]
    StreamSilent { waited: Duration },
    /// Lines that are not understood came in a row: wrong baud rate?
    #[error("{lines} lines in a row could not be read; is the baud rate wrong?")]
    Garbage { lines: u64 },
    /// An alarm that only one family of devices has.
    #[error("{}: {}; {}", .0.device, .0.what, .0.remedy)]
    Own(&'static OwnAlarm),
    /// An analog channel's sample is too old.
    #[error("analog input: no sample for {}", units::ShortSpan(*waited))]
    StaleSample { waited: Duration },
    /// An amplifier on a serial line says that something is wrong.
    #[error("{device}: {trouble}")]
    Amplifier {
        device: DeviceName,
        trouble: AmplifierTrouble,
    },
    /// An amplifier has restarted.
    #[error("{device}: restarted unexpectedly; it lost power or was reset: zero again")]
    AmplifierRestarted { device: DeviceName },
    /// An amplifier does not answer.
    #[error("{device}: no answer for {}; check its power and cable: the axis may still be moving",
        units::ShortSpan(*waited))]
    AmplifierSilent {
        device: DeviceName,
        waited: Duration,
    },
    /// An implausible jump of a position that was asked for.
    #[error("{device}: position jumped by {jump:.3}, at most {limit:.3} is possible")]
    AmplifierJumped {
        device: DeviceName,
        jump: LengthOrAngle,
        limit: LengthOrAngle,
    },
}

/// What an axis did that left its envelope.
const fn moved_unasked(asked: Asked) -> &'static str {
    match asked {
        Asked::Hold => "the axis moves although it was asked to hold its place,",
        Asked::Motion => "the axis left the way to its set-point",
        Asked::Homing => "the search of its home met nothing",
        Asked::Stop => "the axis does not stop",
        Asked::Follow => "the axis left its set-points",
    }
}

/// Where the cause of such a motion is looked for.
const fn causes_of_motion(asked: Asked) -> &'static str {
    match asked {
        Asked::Homing => {
            "a limit switch or index mark that is not connected, a search in the wrong direction, \
             or a wrong gear or resolution of the drive"
        }
        Asked::Hold | Asked::Motion | Asked::Stop | Asked::Follow => {
            "another master or program, a wrong gear or unit of the drive, or a force on the axis"
        }
    }
}

impl Alarm {
    /// Whether a search of its home went farther than an axis can.
    pub const fn is_endless_search(&self) -> bool {
        matches!(
            self,
            Self::OutsideEnvelope {
                asked: Asked::Homing,
                ..
            }
        )
    }

    /// Whether a drive says that its axis is farther from the demand than its limit permits.
    pub fn is_following_error(&self) -> bool {
        match self {
            Self::FollowingError { .. } => true,
            Self::Emergency { emergency, .. } => emergency.code == EmergencyCode::FOLLOWING_ERROR,
            Self::Amplifier { trouble, .. } => match trouble {
                AmplifierTrouble::TrackingError => true,
                AmplifierTrouble::Faults(faults) => faults.contains(Faults::FOLLOWING_ERROR),
                _ => false,
            },
            _ => false,
        }
    }
}

impl Departure {
    /// What `device` reports of that; its counts are of `scale` and begin at `origin`.
    pub(super) fn to_alarm<Q: Coordinate>(
        self,
        device: DeviceName,
        scale: Scale<Q>,
        origin: Counts,
    ) -> Alarm {
        let shown = |counts| scale.to_coordinate(Counts(counts) + origin).into();
        let count = scale.resolution().abs().value();
        let speed = |counts: f64| Q::Speed::from_value(counts * count).into();
        match self {
            Self::Place {
                asked,
                position,
                limit,
            } => Alarm::OutsideEnvelope {
                device,
                asked,
                position: shown(position),
                limit: shown(limit),
            },
            Self::Speed { asked, limit, seen } => Alarm::TooFast {
                device,
                asked,
                seen: speed(seen),
                limit: speed(limit),
            },
        }
    }
}

/// What only one family of devices can say; its file has them as constants.
///
/// # Example
///
/// ```
/// use drivers::device::{Alarm, DeviceName, OwnAlarm};
///
/// static FLAT: OwnAlarm = OwnAlarm {
///     device: DeviceName::Serial("caliper"),
///     what: "its battery is nearly flat",
///     remedy: "change it",
/// };
/// assert_eq!(Alarm::Own(&FLAT).to_string(), "caliper: its battery is nearly flat; change it");
/// ```
#[derive(Debug, PartialEq, Eq)]
pub struct OwnAlarm {
    /// Who says it.
    pub device: DeviceName,
    /// What is wrong.
    pub what: &'static str,
    /// What to do.
    pub remedy: &'static str,
}

/// What an amplifier on a serial line can say of itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[expect(missing_docs, reason = "the names say it")]
pub enum AmplifierTrouble {
    ShortCircuit,
    AmplifierHot,
    MotorHot,
    OverVoltage,
    UnderVoltage,
    EncoderError,
    PhasingError,
    CommandFault,
    TrackingError,
    PositiveLimitSwitch,
    NegativeLimitSwitch,
    PositiveSoftLimit,
    NegativeSoftLimit,
    /// Its enable input, or its safe torque off, took the power away.
    EnableInputOff,
    /// It was enabled and is not any more.
    Disabled,
    /// Faults that have latched.
    Faults(Faults),
}

impl fmt::Display for AmplifierTrouble {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::ShortCircuit => "short circuit in the motor or its cable",
            Self::AmplifierHot => "amplifier too hot",
            Self::MotorHot => "motor too hot",
            Self::OverVoltage => "supply voltage too high",
            Self::UnderVoltage => "supply voltage too low",
            Self::EncoderError => "error of the encoder or its cable",
            Self::PhasingError => "motor phasing error",
            Self::CommandFault => "command signal missing",
            Self::TrackingError => {
                "following error outside its limit; is the axis blocked or overloaded?"
            }
            Self::PositiveLimitSwitch => "on its positive limit switch",
            Self::NegativeLimitSwitch => "on its negative limit switch",
            Self::PositiveSoftLimit => "beyond its positive software limit",
            Self::NegativeSoftLimit => "beyond its negative software limit",
            Self::EnableInputOff => "its enable input is not active (safe torque off?)",
            Self::Disabled => "is disabled, should be enabled",
            Self::Faults(faults) => return write!(f, "fault: {faults}"),
        })
    }
}
