//! A servo drive by CiA 402 (IEC 61800-7-201) on CANopen.
//!
//! Start, power, profile position, homing, halt, quick stop and supervision of one axis, linear
//! or turning endlessly, and its touch probe.
//!
//! Process data: TPDO 1 carries statusword, position and mode, TPDO 2 (if wanted) the following
//! error, TPDO 3 (if wanted) the touch probe, all at every SYNC. RPDO 1 carries controlword **and**
//! target position in one frame, taken over at once (or, in a group that starts together, at the
//! next SYNC): no adapter that re-orders frames can separate a target from the edge that makes it
//! take effect, and a quick stop waits for no SDO. Velocity and accelerations change seldom; they
//! are written by SDO, read back, before the move that needs them.
//!
//! Nothing is concluded from a command having been sent: each step waits for the statusword, and a
//! controlword that seems to be without effect is sent again. All bits act by their level, except
//! for the edge of the fault reset: a repetition is harmless.
//!
//! Absent: cyclic synchronous velocity and torque, interpolated position, the second touch probe.

mod cautious;
mod commands;
mod convert;
mod course;
mod cyclic;
mod drive_units;
mod events;
mod halt;
mod homing;
mod homing_place;
mod image;
mod latch;
mod modulo;
mod motion;
mod power;
mod reference;
mod settings;
mod start;
mod supervision;
mod trial;
mod watch;

#[cfg(test)]
mod cyclic_tests;
#[cfg(test)]
mod rotary_tests;
#[cfg(test)]
mod tests;

use std::collections::VecDeque;

use units::{Coordinate, Metres, Quantity, Radians, Time};
use wire::Input;
use wire::Payload;
use wire::can::CanFrame;
use wire::canopen::Function;
use wire::cia402::{Controlword, NamedStatus, OperationMode, PowerState, Statusword};

pub use cyclic::{interpolation_period, period_from};
pub use settings::{
    Cia402Settings, Cia402Timeouts, Edge, HomeOffset, LatchSettings, OptionCodes, PositionRange,
    StatedUnits, Turn,
};

use super::canopen_node::CanopenNode;
use super::envelope::Envelope;
use super::plausible::Plausible;
use super::{Alarm, Axis, Device, DeviceError, DriveReference, Identity, RotaryAxis, Seen};
use cyclic::ModeChange;
use halt::Halt;
use homing::Homing;
use homing_place::HomingPlace;
use image::{Image, Sample};
use latch::{LatchChange, Probe};
use motion::Move;
use power::Power;
use reference::BeforeHome;

/// The profile number in 0x1000.
const PROFILE: u16 = 402;

/// What the drive is busy with.
#[derive(Debug)]
enum Activity {
    Idle,
    Starting,
    Power(Power),
    Move(Move),
    Halt(Halt),
    Homing(Homing),
    Latch(LatchChange),
    Mode(ModeChange),
    /// Its watch on our heartbeat is ended.
    Release,
    /// What shows its reference is read, after this mark was written.
    Reference {
        mark: Option<u32>,
    },
}

impl Activity {
    const fn name(&self) -> &'static str {
        match self {
            Self::Idle => "nothing",
            Self::Starting => "the start",
            Self::Power(_) => "the change of power state",
            Self::Move(_) => "the move",
            Self::Halt(_) => "the halt",
            Self::Homing(_) => "homing",
            Self::Latch(_) => "setting the touch probe",
            Self::Mode(_) => "the change of mode",
            Self::Release => "the end of its watch",
            Self::Reference { .. } => "reading its reference",
        }
    }
}

/// One CiA 402 drive, one axis: linear ([`Metres`]) or rotary.
///
/// # Example
///
/// ```
/// use drivers::device::canopen_node::NodeSettings;
/// use drivers::device::cia402::{Cia402Drive, Cia402Settings};
/// use drivers::device::{Axis, AxisCommand, Device};
/// use std::time::Duration;
/// use units::{Metres, MetresPerSecond, MetresPerSecondSquared, Scale, Time};
/// use wire::{Payload, canopen::NodeId};
///
/// let (node, master) = (NodeId::new(5).expect("1 to 127"), NodeId::new(127).expect("likewise"));
/// let common = NodeSettings::new(node, master, Duration::from_millis(2));
/// let scale = Scale::new(Metres(10e-9)).expect("a count is some length");
/// let (speed, acceleration) = (MetresPerSecond(0.1), MetresPerSecondSquared(1.0));
/// let mut drive = Cia402Drive::new(Cia402Settings::new(common, scale, speed, acceleration));
/// drive.start(Time::ZERO);
/// let Some(Payload::Frame(asked)) = drive.poll_transmit() else { unreachable!("it asks") };
/// assert_eq!(asked.to_string(), "605#4000100000000000", "who is it?");
/// assert_eq!(drive.reading(), None);
/// // A command before the start is done.
/// let target = Metres::from_mm(1.0);
/// drive.command(Time::ZERO, AxisCommand::MoveTo { target, speed, acceleration });
/// assert!(matches!(drive.poll_outcome(), Some(Err(_))));
/// ```
#[derive(Debug)]
pub struct Cia402Drive<Q: Coordinate = Metres> {
    settings: Cia402Settings<Q>,
    node: CanopenNode,
    image: Image,
    activity: Activity,
    /// What RPDO 1 said last.
    control: Controlword,
    target: i32,
    /// The target of the last frame that was sent, and since when it is on the bus.
    sent_target: Option<i32>,
    target_at: Time,
    repeat_at: Time,
    /// Since when the set-point bit is low.
    lowered_at: Time,
    /// The mode that was written last, as far as that is certain.
    commanded_mode: Option<OperationMode>,
    /// 0x6502, where the drive has it.
    supported_modes: Option<u32>,
    /// Velocity and acceleration that the drive confirmed.
    profile: Option<(u32, u32)>,
    /// Its units of speed and acceleration are stated, or its first motion agreed with them.
    units_proven: bool,
    /// Encoder increments of a turn.
    per_turn: Option<f64>,
    /// The homing to begin once the trial of its speed is over.
    homing_asked: Option<(Q, HomingPlace<Q::Speed>)>,
    /// The target that the axis reached last and was not moved from since.
    reached: Option<i64>,
    /// The drive was given a target that the axis has not reached, and that nothing has voided.
    open_target: bool,
    envelope: Envelope,
    /// A move that only has to be started.
    prepared: Option<Move>,
    started_at: Option<Time>,
    homed: bool,
    /// What showed its reference when it was read last.
    reference: Option<DriveReference>,
    before_home: Option<BeforeHome>,
    /// The newest process data of a start, not yet compared with the objects themselves.
    first: Option<Sample>,
    /// What the object was that is compared with them.
    compared: Option<u32>,
    /// The state the drive was brought to and must keep.
    kept: Option<PowerState>,
    /// Where the motion under way began.
    course: Option<course::Course>,
    probe: Probe,
    /// Alarms that were told and whose cause lasts.
    told_state: bool,
    told_following: bool,
    cyclic_watch: cyclic::CyclicWatch,
    told_short: bool,
    told_unasked: bool,
    /// So many samples in a row show another mode than the one that was written.
    other_mode: u8,
    outcome: Option<Result<(), DeviceError>>,
    alarms: VecDeque<Alarm>,
    short_pdos: u64,
    /// So often it was still enabled at a start.
    left_enabled: u64,
    /// Told to enable, or found enabled, since the start.
    was_enabled: bool,
    repeated_commands: u64,
}

impl Cia402Drive<Metres> {
    /// [`Cia402Drive::new`] as any axis: compiled with this package, not once more in each that drives one.
    pub fn linear(settings: Cia402Settings<Metres>) -> Box<dyn Axis> {
        Box::new(Self::new(settings))
    }
}

impl Cia402Drive<Radians> {
    /// As [`Cia402Drive::linear`].
    pub fn rotary(settings: Cia402Settings<Radians>) -> Box<dyn RotaryAxis> {
        Box::new(Self::new(settings))
    }
}

impl<Q: Coordinate> Cia402Drive<Q> {
    /// A drive that is not started.
    pub fn new(settings: Cia402Settings<Q>) -> Self {
        let counts = |si: f64| si / settings.scale.resolution().abs().value();
        let plausible = Plausible::new(
            counts(settings.speed_max.value()),
            counts(settings.jump_margin.value()) as i64,
            settings.tolerance_counts(),
        );
        let (modulo, period) = (settings.modulo(), settings.common.sync_period);
        let image = Image::new(modulo, plausible, period, settings.stall_max);
        Self {
            node: CanopenNode::new(settings.common, PROFILE),
            image,
            activity: Activity::Idle,
            control: Controlword::empty(),
            target: 0,
            sent_target: None,
            target_at: Time::ZERO,
            repeat_at: Time::NEVER,
            lowered_at: Time::ZERO,
            commanded_mode: None,
            supported_modes: None,
            profile: None,
            units_proven: false,
            per_turn: None,
            homing_asked: None,
            reached: None,
            open_target: false,
            envelope: Envelope::new(settings.figures()),
            prepared: None,
            started_at: None,
            homed: false,
            reference: None,
            before_home: None,
            first: None,
            compared: None,
            kept: None,
            course: None,
            probe: Probe::default(),
            told_state: false,
            told_following: false,
            cyclic_watch: cyclic::CyclicWatch::default(),
            told_short: false,
            told_unasked: false,
            other_mode: 0,
            outcome: None,
            alarms: VecDeque::new(),
            short_pdos: 0,
            left_enabled: 0,
            was_enabled: false,
            repeated_commands: 0,
            settings,
        }
    }

    /// What was set.
    pub const fn settings(&self) -> &Cia402Settings<Q> {
        &self.settings
    }

    /// The newest statusword, for a person who looks for trouble.
    pub fn statusword(&self) -> Option<Statusword> {
        self.image.sample().map(|sample| sample.status)
    }

    /// The newest mode display (0x6061).
    pub fn mode(&self) -> Option<OperationMode> {
        self.image.sample().map(|sample| sample.mode)
    }

    fn state(&self) -> Option<PowerState> {
        self.image.sample().map(Sample::state)
    }

    /// Sends RPDO 1: controlword and target in one frame.
    fn send_control(&mut self, now: Time, control: Controlword) {
        if (self.control - control).contains(Controlword::MODE_4) {
            self.lowered_at = now;
        }
        self.control = control;
        self.repeat_at = now + self.settings.timeouts.repeat;
        self.keep_target_at_axis();
        if self.sent_target != Some(self.target) {
            (self.sent_target, self.target_at) = (Some(self.target), now);
        }
        let [a, b] = control.bits().to_le_bytes();
        let [c, d, e, f] = self.target.to_le_bytes();
        let cob_id = self.node.id().cob_id(Function::Rpdo1);
        self.node
            .send(CanFrame::standard(cob_id, &[a, b, c, d, e, f]));
    }

    fn finish(&mut self, result: Result<(), DeviceError>) {
        self.activity = Activity::Idle;
        self.repeat_at = Time::NEVER;
        self.image.plausible.allow_jumps(false);
        self.course = None;
        self.outcome = Some(result);
    }

    fn time_out(&mut self, now: Time, since: Time, awaited: &'static str, seen: Seen) {
        let error = DeviceError::Timeout {
            device: self.node.name(),
            awaited,
            waited: now.since(since),
            seen,
        };
        self.finish(Err(error));
    }

    fn seen_status(&self) -> Seen {
        self.image.sample().map_or(Seen::Nothing, |sample| {
            Seen::Statusword(NamedStatus::new(sample.status, Some(sample.mode)))
        })
    }

    fn refuse(&mut self, step: &'static str, needs: &'static str) {
        let device = self.node.name();
        self.finish(Err(DeviceError::NotPossible {
            device,
            step,
            needs,
        }));
    }

    /// Ends whatever runs, without an outcome.
    fn supersede(&mut self, now: Time) {
        self.outcome = None;
        self.prepared = None;
        self.repeat_at = Time::NEVER;
        self.image.plausible.allow_jumps(false);
        self.course = None;
        if matches!(self.activity, Activity::Starting) {
            self.node.give_up(now);
        } else {
            self.node.drop_script(now);
        }
        self.activity = Activity::Idle;
    }

    fn repeat_control(&mut self, now: Time) {
        if now >= self.repeat_at {
            self.repeated_commands += 1;
            self.send_control(now, self.control);
        }
    }
}

impl<Q: Coordinate> Device for Cia402Drive<Q> {
    fn handle(&mut self, now: Time, input: &Input) {
        self.node.handle(now, input);
        self.pump(now);
    }

    fn handle_timeout(&mut self, now: Time) {
        self.node.handle_timeout(now);
        self.pump(now);
        match &self.activity {
            Activity::Idle
            | Activity::Starting
            | Activity::Release
            | Activity::Reference { .. } => {}
            Activity::Power(_) => self.power_timeout(now),
            Activity::Move(_) => self.move_timeout(now),
            Activity::Halt(_) => self.halt_timeout(now),
            Activity::Homing(_) => self.homing_timeout(now),
            Activity::Latch(_) => self.latch_timeout(now),
            Activity::Mode(_) => self.mode_timeout(now),
        }
        self.repeat_control(now);
    }

    fn poll_timeout(&self) -> Time {
        let activity = match &self.activity {
            Activity::Idle
            | Activity::Starting
            | Activity::Release
            | Activity::Reference { .. } => Time::NEVER,
            Activity::Power(power) => power.poll_timeout(),
            Activity::Move(moving) => moving.deadline(),
            Activity::Halt(halt) => halt.deadline(),
            Activity::Homing(homing) => homing.deadline(),
            Activity::Latch(change) => change.deadline(),
            Activity::Mode(change) => change.deadline(),
        };
        activity.min(self.repeat_at).min(self.node.poll_timeout())
    }

    fn poll_transmit(&mut self) -> Option<Payload> {
        self.node.poll_transmit().map(Payload::Frame)
    }

    fn poll_alarm(&mut self) -> Option<Alarm> {
        self.alarms.pop_front()
    }

    fn start(&mut self, now: Time) {
        self.supersede(now);
        self.image.clear();
        self.alarms.clear();
        self.profile = None;
        self.commanded_mode = None;
        self.reached = None;
        self.open_target = false;
        self.sent_target = None;
        self.envelope.release();
        self.kept = None;
        self.was_enabled = false;
        (self.first, self.compared) = (None, None);
        self.probe.disarm();
        self.activity = Activity::Starting;
        self.node.start(now, start::description(&self.settings));
    }

    fn release_watch(&mut self, now: Time) -> bool {
        self.supersede(now);
        let begins = self.node.release_watch(now);
        if begins {
            self.activity = Activity::Release;
        }
        begins
    }

    fn poll_outcome(&mut self) -> Option<Result<(), DeviceError>> {
        self.outcome.take()
    }

    fn identity(&self) -> Option<Identity> {
        self.node.identity().cloned()
    }

    fn counters(&self) -> Vec<(&'static str, u64)> {
        let mut counters = self.node.counters();
        counters.push(("pdos too short", self.short_pdos));
        counters.push(("found enabled, and stopped", self.left_enabled));
        counters.push(("positions not believed", self.image.plausible.rejected()));
        counters.push(("commands repeated", self.repeated_commands));
        if self.settings.latch.is_some() {
            counters.push(("edges latched", self.probe.latched));
            counters.push(("edges missed", self.probe.missed));
        }
        counters
    }
}
