//! What can go wrong, and when: injected from the configuration, the command line or a test.
//!
//! Every fault counts its deliveries, so that a test can prove that it really happened.
//! Probabilities are drawn from a stream of the fault's own: one fault never shifts another.

use core::time::Duration;
use serde::Deserialize;
use wire::can::{CanFrame, CanId};
use wire::canopen::emcy::{Emergency, EmergencyCode};
use wire::canopen::nmt::{NmtState, emit_heartbeat};
use wire::canopen::sdo::{Expedited, SdoRequest};
use wire::canopen::sync::emit_sync;
use wire::canopen::{Function, NodeId, Object};

use crate::plant::BeamPlace;

mod plan;

#[cfg(test)]
mod tests;

pub(crate) use plan::{Edge, Plan};

/// A fault, when it is there and how often it strikes.
///
/// # Example
///
/// ```
/// use mock_bus::fault::{Fault, FaultConfig};
/// use std::time::Duration;
///
/// let once = FaultConfig::times(Fault::BeamBlocked, 1);
/// assert_eq!((once.count_max, once.duration_s), (Some(1), None));
/// let for_a_while = FaultConfig::lasting(Fault::BeamBlocked, Duration::from_millis(250));
/// assert_eq!(for_a_while.duration_s, Some(0.25));
/// ```
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FaultConfig {
    /// From when on, in simulated seconds.
    #[serde(default)]
    pub from_s: f64,
    /// For how long; for ever when absent.
    #[serde(default)]
    pub duration_s: Option<f64>,
    /// The share of frames or messages that it strikes.
    #[serde(default = "certain")]
    pub probability: f64,
    /// It strikes no more than this often.
    #[serde(default)]
    pub count_max: Option<u64>,
    /// What goes wrong.
    pub fault: Fault,
}

const fn certain() -> f64 {
    1.0
}

impl FaultConfig {
    /// From now on, for ever, always.
    pub const fn permanent(fault: Fault) -> Self {
        Self {
            from_s: 0.0,
            duration_s: None,
            probability: 1.0,
            count_max: None,
            fault,
        }
    }

    /// Strikes `count` times.
    pub const fn times(fault: Fault, count: u64) -> Self {
        let mut config = Self::permanent(fault);
        config.count_max = Some(count);
        config
    }

    /// For `span`, from now on.
    pub const fn lasting(fault: Fault, span: Duration) -> Self {
        let mut config = Self::permanent(fault);
        config.duration_s = Some(span.as_secs_f64());
        config
    }
}

/// What goes wrong. Frames are chosen by `cob_id`; without one, every frame of the port.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
#[expect(
    missing_docs,
    reason = "ports and nodes by name; the other fields end in their unit"
)]
pub enum Fault {
    /// Frames vanish from the bus.
    Drop { port: String, cob_id: Option<u16> },
    /// Frames come twice.
    Duplicate { port: String, cob_id: Option<u16> },
    /// A frame changes places with the next one.
    Reorder { port: String, cob_id: Option<u16> },
    /// One byte of the payload has wrong bits.
    Corrupt { port: String, cob_id: Option<u16> },
    /// Frames reach the host late.
    Delay {
        port: String,
        cob_id: Option<u16>,
        delay_ms: f64,
    },
    /// Nothing that the device sends gets out.
    Mute { node: String },
    /// A CANopen device's heartbeat stops, its PDOs go on.
    StopHeartbeat { node: String },
    /// A CANopen device's PDOs stop, its heartbeat goes on.
    StopPdos { node: String },
    /// Somebody fills the bus with frames of this identifier: of 29 bits when 11 do not hold it.
    Babble { port: String, cob_id: u32 },
    /// A second master sends SYNC.
    ForeignSync { port: String, period_ms: f64 },
    /// Another client asks the SDO server of a node: how it reads its position, or, with `writes`,
    /// for another profile velocity.
    ForeignSdo {
        port: String,
        node_id: u8,
        #[serde(default)]
        writes: bool,
        period_ms: f64,
    },
    /// A second device with this node identifier boots.
    DuplicateBootUp { port: String, node_id: u8 },
    /// An emergency message goes out in the name of this node identifier.
    Emergency {
        port: String,
        node_id: u8,
        code: u16,
        register: u8,
    },
    /// A CANopen device repeats its last process data for ever.
    StaleData { node: String },
    /// The device loses its power, and boots when the fault ends.
    PowerLoss { node: String },
    /// The host's controller goes error-passive.
    ErrorPassive { port: String },
    /// The host's controller goes off the bus.
    BusOff { port: String },
    /// The host's interface is set down, and up when the fault ends.
    LinkDown { port: String },
    /// The host's adapter is pulled out, and put back when the fault ends.
    LinkGone { port: String },
    /// An axis is held fast.
    BlockedAxis {
        #[serde(default)]
        axis: usize,
    },
    /// The safe torque off circuit, which all axes are on, opens.
    SafeTorqueOff,
    /// A limit switch of an axis is stuck in a state.
    LimitSwitch {
        #[serde(default)]
        axis: usize,
        positive: bool,
        pressed: bool,
    },
    /// Nothing of the beam comes back.
    BeamBlocked,
    /// Too little of the beam comes back.
    BeamWeak,
    /// The reference beam along an axis is interrupted: before its slide both detectors are
    /// dark, behind it the one at the end.
    ReferenceBeamBlocked {
        axis: usize,
        #[serde(default)]
        behind_slide: bool,
    },
    /// The reference beam along an axis is twice as bright: its detectors saturate.
    ReferenceBeamBright { axis: usize },
    /// Somebody has knocked the source of a reference beam aside.
    ReferenceBeamKnocked { axis: usize, by_um: f64 },
    /// One of the detectors of a reference beam also sees a reflection of it, so far beside in both directions across,
    /// with this share of its light.
    ReferenceBeamReflected {
        axis: usize,
        at: BeamPlace,
        by_um: [f64; 2],
        share: f64,
    },
    /// The fringe counter slips.
    FringeJump { half_wavelengths: i64 },
    /// The cameras' marks are not there.
    TargetAbsent,
    /// The cameras' marks are partly covered.
    TargetCovered,
    /// A line of the table's plate cannot be seen.
    LineSmudged { line: u32 },
    /// A scratch beside a line of the table's plate gives a second edge.
    LineScratched { line: u32 },
    /// The line detector is bumped whenever this line passes, and sees it elsewhere.
    LineShifted { line: u32, shift_arcsec: f64 },
    /// The line detector sees nothing.
    DetectorDead,
    /// The machine shakes under its instruments (standard deviation).
    Vibration { amplitude_um: f64 },
    /// The instrument's temperature, pressure and humidity stand still.
    FrozenEnvironment,
    /// They show what cannot be.
    ImpossibleEnvironment,
    /// An analog input is tied to its rail.
    InputRail { channel: usize },
    /// An analog input's wire is open.
    InputOpen { channel: usize },
    /// An analog input is stuck at its last value.
    InputStuck { channel: usize },
    /// An analog input has the wrong polarity.
    InputInverted { channel: usize },
    /// An analog input shows so much more than it should: volts, or degrees of a thermometer.
    InputShifted { channel: usize, by: f64 },
    /// Analog inputs 0 and 1 are exchanged.
    InputsSwapped,
    /// Random bytes come before an answer.
    Garbage { port: String },
    /// An answer comes in two parts with a pause between.
    Split { port: String },
    /// An answer waits for the next one.
    Merge { port: String },
    /// An answer comes late.
    LateAnswer { port: String, delay_ms: f64 },
    /// The line sends back what the host says.
    Echo { port: String },
    /// Nothing comes back.
    Silence { port: String },
}

impl Fault {
    /// The port it names, and whether that must be CAN (or serial, or either).
    pub(crate) fn port(&self) -> Option<(&str, Option<bool>)> {
        match self {
            Self::Drop { port, .. }
            | Self::Duplicate { port, .. }
            | Self::Reorder { port, .. }
            | Self::Corrupt { port, .. }
            | Self::Delay { port, .. }
            | Self::Babble { port, .. }
            | Self::ForeignSync { port, .. }
            | Self::ForeignSdo { port, .. }
            | Self::DuplicateBootUp { port, .. }
            | Self::Emergency { port, .. }
            | Self::ErrorPassive { port }
            | Self::BusOff { port } => Some((port, Some(true))),
            Self::Garbage { port }
            | Self::Split { port }
            | Self::Merge { port }
            | Self::LateAnswer { port, .. }
            | Self::Echo { port }
            | Self::Silence { port } => Some((port, Some(false))),
            Self::LinkDown { port } | Self::LinkGone { port } => Some((port, None)),
            _ => None,
        }
    }

    /// The node it names.
    pub(crate) fn node(&self) -> Option<&str> {
        match self {
            Self::Mute { node }
            | Self::StopHeartbeat { node }
            | Self::StopPdos { node }
            | Self::StaleData { node }
            | Self::PowerLoss { node } => Some(node),
            _ => None,
        }
    }

    /// What a stranger sends, and how often (once when `None`).
    fn strangers_frame(&self) -> Option<(CanFrame, Option<Duration>)> {
        // Shorter than the shortest frame at 1 Mbit/s: the next one always waits.
        const FULL_LOAD: Duration = Duration::from_micros(50);
        let every = |period_ms: f64| Some(Duration::from_secs_f64(period_ms.max(0.1) * 1e-3));
        match self {
            Self::Babble { cob_id, .. } => {
                Some((CanFrame::new(id_of(*cob_id), &[0xBA; 8])?, Some(FULL_LOAD)))
            }
            Self::ForeignSync { period_ms, .. } => Some((emit_sync(None), every(*period_ms))),
            Self::ForeignSdo {
                node_id,
                writes,
                period_ms,
                ..
            } => {
                let cob_id = NodeId::new(*node_id)?.cob_id(Function::SdoRequest);
                let frame = CanFrame::standard(cob_id, &foreign_request(*writes)?.emit());
                Some((frame, every(*period_ms)))
            }
            Self::DuplicateBootUp { node_id, .. } => {
                let node = NodeId::new(*node_id)?;
                Some((emit_heartbeat(node, NmtState::BootUp), None))
            }
            Self::Emergency {
                node_id,
                code,
                register,
                ..
            } => {
                let emergency = Emergency {
                    code: EmergencyCode(*code),
                    register: *register,
                    detail: [0; 5],
                };
                Some((emergency.emit(NodeId::new(*node_id)?), None))
            }
            _ => None,
        }
    }

    /// Whether it changes the machine's state as long as it lasts.
    const fn is_level(&self) -> bool {
        !matches!(
            self,
            Self::Drop { .. }
                | Self::Duplicate { .. }
                | Self::Reorder { .. }
                | Self::Corrupt { .. }
                | Self::Delay { .. }
                | Self::Mute { .. }
                | Self::StaleData { .. }
                | Self::StopHeartbeat { .. }
                | Self::StopPdos { .. }
                | Self::Garbage { .. }
                | Self::Split { .. }
                | Self::Merge { .. }
                | Self::LateAnswer { .. }
                | Self::Echo { .. }
                | Self::Silence { .. }
        )
    }
}

/// An identifier of 11 bits where they hold it, else of 29.
fn id_of(raw: u32) -> CanId {
    let standard = u16::try_from(raw).ok().and_then(CanId::standard);
    standard.unwrap_or(CanId::Extended(raw & CanId::EXTENDED_MAX))
}

/// What somebody else asks of a drive (CiA 402: 0x6064 position, 0x6081 profile velocity).
fn foreign_request(writes: bool) -> Option<SdoRequest> {
    let object = Object::new(if writes { 0x6081 } else { 0x6064 }, 0);
    if !writes {
        return Some(SdoRequest::UploadInitiate { object });
    }
    let data = Expedited::new(&1000_u32.to_le_bytes())?;
    Some(SdoRequest::DownloadExpedited { object, data })
}

/// A fault that was injected, by its place in the plan.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct FaultId(pub usize);
