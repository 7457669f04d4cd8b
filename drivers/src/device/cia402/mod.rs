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

mod commands;
mod convert;
mod course;
mod cyclic;
mod homing;
mod image;
mod latch;
mod modulo;
mod motion;
mod power;
mod reference;
mod settings;
mod start;
mod supervision;

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
use wire::cia402::{Controlword, OperationMode, PowerState, Statusword};

pub use cyclic::{interpolation_period, period_from};
pub use settings::{
    Cia402Settings, Cia402Timeouts, Edge, HomeOffset, LatchSettings, OptionCodes, PositionRange,
    Turn,
};

use super::canopen_node::{CanopenNode, NodeEvent};
use super::plausible::Plausible;
use super::{Alarm, Axis, Device, DeviceError, DriveReference, Identity, RotaryAxis, Seen};
use crate::protocol::script::Script;
use cyclic::ModeChange;
use homing::Homing;
use image::{Image, Sample};
use latch::{LatchChange, Probe};
use motion::{Halt, Move};
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
    repeat_at: Time,
    /// Since when the set-point bit is low.
    lowered_at: Time,
    /// The mode that was written last, as far as that is certain.
    commanded_mode: Option<OperationMode>,
    /// 0x6502, where the drive has it.
    supported_modes: Option<u32>,
    /// Velocity and acceleration that the drive confirmed.
    profile: Option<(u32, u32)>,
    /// The target that the axis reached last and was not moved from since.
    reached: Option<i64>,
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
    outcome: Option<Result<(), DeviceError>>,
    alarms: VecDeque<Alarm>,
    short_pdos: u64,
    /// So often it was still enabled at a start.
    left_enabled: u64,
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
            settings,
            activity: Activity::Idle,
            control: Controlword::empty(),
            target: 0,
            repeat_at: Time::NEVER,
            lowered_at: Time::ZERO,
            commanded_mode: None,
            supported_modes: None,
            profile: None,
            reached: None,
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
            outcome: None,
            alarms: VecDeque::new(),
            short_pdos: 0,
            left_enabled: 0,
            repeated_commands: 0,
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
        self.statusword()
            .map_or(Seen::Nothing, |word| Seen::Statusword(word.bits()))
    }

    fn refuse(&mut self, step: &'static str, needs: &'static str) {
        let device = self.node.name();
        self.finish(Err(DeviceError::NotPossible {
            device,
            step,
            needs,
        }));
    }

    fn alarm(&mut self, alarm: Alarm) {
        self.alarms.push_back(alarm);
        self.prepared = None;
        let ends_it = match (&self.activity, alarm) {
            (Activity::Idle | Activity::Starting, _) => false,
            // Stopping and resetting go on: they are the answer to alarms. A drive that booted
            // has nothing left to stop.
            (Activity::Power(_) | Activity::Halt(_), Alarm::UnexpectedBootUp { .. }) => true,
            (Activity::Power(_) | Activity::Halt(_), _) => false,
            (
                Activity::Move(_)
                | Activity::Homing(_)
                | Activity::Latch(_)
                | Activity::Mode(_)
                | Activity::Reference { .. },
                _,
            ) => true,
        };
        if ends_it {
            let step = self.activity.name();
            let device = self.node.name();
            self.finish(Err(DeviceError::Alarmed {
                device,
                step,
                alarm,
            }));
        }
    }

    fn pump(&mut self, now: Time) {
        while let Some(event) = self.node.poll_event() {
            match event {
                NodeEvent::Described(script) => self.take_description(now, &script),
                NodeEvent::Operational => {}
                NodeEvent::ScriptDone(script) => self.script_done(now, &script),
                NodeEvent::Failed(error) => self.script_failed(now, error),
                NodeEvent::Alarm(alarm) => self.take_alarm(alarm),
                NodeEvent::Pdo { number, frame } => self.take_pdo(now, number, &frame),
                NodeEvent::PdoSilent { waited } => {
                    let node = self.node.id();
                    let period = self.settings.common.sync_period.as_nanos().max(1);
                    let missed = u32::try_from(waited.as_nanos() / period).unwrap_or(u32::MAX);
                    self.alarm(Alarm::PdoLost { node, missed });
                }
            }
        }
    }

    fn take_description(&mut self, now: Time, script: &Script) {
        self.probe.counts_edges = latch::counts_edges(&self.settings, script);
        self.supported_modes = start::supported_modes(script);
        let steps = start::check_description(&self.settings, script)
            .and_then(|()| start::configuration(&self.settings, self.probe.counts_edges));
        match steps {
            Ok(steps) => self.node.configure(now, steps),
            Err(error) => {
                self.node.give_up(now);
                self.finish(Err(error));
            }
        }
    }

    fn script_done(&mut self, now: Time, script: &Script) {
        match &self.activity {
            Activity::Starting => self.end_start(now, script),
            Activity::Move(_) => self.move_prepared(now),
            Activity::Homing(_) => {
                self.note_before_home(script);
                self.homing_prepared(now);
            }
            Activity::Latch(_) => self.latch_written(now),
            Activity::Mode(_) => self.mode_written(now),
            Activity::Reference { .. } => self.reference_read(script),
            Activity::Idle | Activity::Power(_) | Activity::Halt(_) => {}
        }
    }

    fn script_failed(&mut self, now: Time, error: DeviceError) {
        match &self.activity {
            Activity::Homing(_) => self.homing_failed(now, error),
            Activity::Starting | Activity::Move(_) => {
                self.profile = None;
                self.finish(Err(error));
            }
            Activity::Latch(_) | Activity::Mode(_) | Activity::Reference { .. } => {
                self.finish(Err(error));
            }
            Activity::Idle | Activity::Power(_) | Activity::Halt(_) => {}
        }
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
            Activity::Idle | Activity::Starting | Activity::Reference { .. } => {}
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
            Activity::Idle | Activity::Starting | Activity::Reference { .. } => Time::NEVER,
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
        self.kept = None;
        (self.first, self.compared) = (None, None);
        self.probe.disarm();
        self.activity = Activity::Starting;
        self.node.start(now, start::description(&self.settings));
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
