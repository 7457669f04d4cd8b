//! A servo amplifier by Copley Controls on its ASCII interface over a serial line.
//!
//! Source: Copley Controls, ASCII Programmer's Guide, 16-01196 rev. 01; the lines are
//! [`wire::copley`]'s. Start, power, profile position, homing, halt, quick stop and
//! supervision of one axis.
//!
//! Up to some four amplifiers share a line. Each has a driver of its own, which takes its turn
//! ([`LineUse`]) for one exchange at a time: command and reply, and what has to be done when the
//! reply is missing (`link`). Urgency decides whose turn it is: stops, then starts, then steps of
//! commands, then readings of the amplifier's state.
//!
//! The protocol has no checksum: what a move needs is read back before it can begin, and an
//! impossible position is rejected. `ok` says only that a command was understood: motion is what
//! the trajectory status says. A lost reply to `t 1` is never answered by another `t 1` before that
//! status and the commanded position have shown that nothing has begun.
//!
//! The amplifier's own coordinates stay as its homing made them, 0 at home; which coordinate that
//! is, this driver remembers. The home offset (0xc6) is kept 0, since amplifiers move by it.
//!
//! There is no watchdog on this interface: an amplifier whose host dies finishes its move.
//! Absent: S-curves, velocity moves, dual feedback beyond reading the load's position, the
//! simultaneous start of several axes of one amplifier.

mod convert;
mod finding;
mod homing;
mod image;
mod link;
mod motion;
mod power;
mod script;
mod settings;
mod start;
mod steps;
mod supervision;
#[cfg(test)]
mod tests;
mod watch;

use std::collections::VecDeque;

use units::{Coordinate, Counts, Metres, Quantity, Time};
use wire::cia402::PowerState;
use wire::copley::{BAUD_AT_RESET, EventStatus, Parameter};
use wire::{Input, LinkState, Payload};

pub use settings::{CopleySettings, CopleyTimeouts};

use super::envelope::Envelope;
use super::plausible::Plausible;
use super::{
    Alarm, Axis, AxisCommand, AxisReading, Device, DeviceError, DeviceName, DriveCommand, Identity,
    LineUse, Place, Seen, ServoDrive,
};
use homing::{Homing, HomingPlace};
use image::{Image, Look};
use link::Link;
use motion::{Halt, Motion, Plan};
use power::Power;
use script::Script;
use start::Starting;

/// What the amplifier is busy with.
#[derive(Debug)]
enum Activity {
    Idle,
    Starting(Starting),
    Power(Power),
    Motion(Motion),
    Halt(Halt),
    Homing(Homing),
}

impl Activity {
    const fn name(&self) -> &'static str {
        match self {
            Self::Idle => "nothing",
            Self::Starting(_) => "the start",
            Self::Power(_) => "the change of power state",
            Self::Motion(_) => "the move",
            Self::Halt(_) => "the halt",
            Self::Homing(_) => "homing",
        }
    }
}

/// What the exchange under way is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Purpose {
    /// Nobody waits for it any more.
    Nothing,
    /// The first step of the script.
    Step,
    /// A look.
    Look(Parameter),
}

/// One amplifier, one axis: linear ([`Metres`]) or rotary.
#[derive(Debug)]
pub struct CopleyAxis<Q: Coordinate = Metres> {
    settings: CopleySettings<Q>,
    link: Link,
    purpose: Purpose,
    script: Script,
    look: Look,
    image: Image,
    envelope: Envelope,
    activity: Activity,
    identity: Option<Identity>,
    /// The start ends with the identity.
    asks_only: bool,
    /// The coordinate of the amplifier's 0, in counts.
    origin: Counts,
    homed: bool,
    /// Speed and acceleration that the amplifier confirmed.
    profile: Option<(i64, i64)>,
    /// A move that only has to be started.
    prepared: Option<Plan>,
    started_at: Option<Time>,
    /// It was enabled and must stay so.
    kept: bool,
    was_enabled: bool,
    /// The stop under way was asked for by nobody: it has no outcome.
    stops_by_itself: bool,
    /// Alarms that were told and whose cause lasts.
    told: EventStatus,
    told_silence: bool,
    outcome: Option<Result<(), DeviceError>>,
    alarms: VecDeque<Alarm>,
}

impl<Q: Coordinate> CopleyAxis<Q> {
    /// An amplifier that is not started.
    pub fn new(settings: CopleySettings<Q>) -> Self {
        let count = settings.scale.resolution().abs().value();
        let image = Image::new(Plausible::new(
            settings.speed_max.value() / count,
            (settings.jump_margin.value() / count) as i64,
            settings.tolerance_counts(),
        ));
        Self {
            link: Link::new(settings.address, settings.baud, settings.timeouts),
            purpose: Purpose::Nothing,
            script: Script::nothing(),
            look: Look::new(),
            image,
            envelope: Envelope::new(settings.figures()),
            activity: Activity::Idle,
            identity: None,
            asks_only: false,
            origin: Counts(0),
            homed: false,
            profile: None,
            prepared: None,
            started_at: None,
            kept: false,
            was_enabled: false,
            stops_by_itself: false,
            told: EventStatus::empty(),
            told_silence: false,
            outcome: None,
            alarms: VecDeque::new(),
            settings,
        }
    }

    /// What was set.
    pub const fn settings(&self) -> &CopleySettings<Q> {
        &self.settings
    }

    /// The newest event status, for a person who looks for trouble.
    pub const fn events(&self) -> EventStatus {
        self.image.events
    }

    const fn name(&self) -> DeviceName {
        DeviceName::Amplifier(self.settings.address)
    }

    fn finish(&mut self, result: Result<(), DeviceError>) {
        self.activity = Activity::Idle;
        if let (Err(_), Some(here)) = (&result, self.here()) {
            self.envelope.begin_stop(here);
        }
        self.image.plausible.allow_jumps(false);
        self.script = Script::nothing();
        if self.purpose == Purpose::Step {
            self.purpose = Purpose::Nothing;
            self.link.cancel();
        }
        if !core::mem::take(&mut self.stops_by_itself) {
            self.outcome = Some(result);
        }
    }

    fn time_out(&mut self, now: Time, since: Time, awaited: &'static str, seen: Seen) {
        let error = DeviceError::Timeout {
            device: self.name(),
            awaited,
            waited: now.since(since),
            seen,
        };
        self.finish(Err(error));
    }

    const fn seen_events(&self) -> Seen {
        Seen::Events(self.image.events)
    }

    fn seen_position(&self) -> Seen {
        self.image
            .position()
            .map_or(Seen::Nothing, |(_, position)| {
                let counts = position + self.origin;
                Seen::Position(self.settings.scale.to_coordinate(counts).into())
            })
    }

    fn refuse(&mut self, step: &'static str, needs: &'static str) {
        let device = self.name();
        self.finish(Err(DeviceError::NotPossible {
            device,
            step,
            needs,
        }));
    }

    fn refuse_out_of_service(&mut self) {
        self.refuse(
            "a command",
            "a started amplifier that answers; start it (again)",
        );
    }

    /// Whether it was started and is being looked at.
    const fn is_in_service(&self) -> bool {
        self.look.active
    }

    /// Ends whatever runs, without an outcome.
    fn supersede(&mut self) {
        self.outcome = None;
        self.stops_by_itself = false;
        self.prepared = None;
        self.script = Script::nothing();
        if self.purpose == Purpose::Step {
            self.purpose = Purpose::Nothing;
            self.link.cancel();
        }
        if matches!(self.activity, Activity::Starting(_)) {
            self.link.close();
            self.look.active = false;
        }
        self.image.plausible.allow_jumps(false);
        self.activity = Activity::Idle;
    }

    fn script_done(&mut self, now: Time) {
        match &self.activity {
            Activity::Idle => {}
            Activity::Starting(_) => self.start_step_done(now),
            Activity::Power(_) => self.power_step_done(now),
            Activity::Motion(_) => self.motion_step_done(now),
            Activity::Halt(_) => self.halt_sent(now),
            Activity::Homing(_) => self.homing_step_done(now),
        }
    }
}

impl<Q: Coordinate> Device for CopleyAxis<Q> {
    fn handle(&mut self, now: Time, input: &Input) {
        match input {
            Input::Payload(Payload::Bytes(bytes)) => self.link.handle(now, bytes),
            // Another amplifier may have been plugged in, at another rate.
            Input::Link(LinkState::Up) if self.look.active => {
                self.link.open(now);
                if core::mem::replace(&mut self.purpose, Purpose::Nothing) == Purpose::Step {
                    self.step_lost(now);
                }
            }
            Input::Link(_)
            | Input::Lost(_)
            | Input::BusError(_)
            | Input::Payload(Payload::Frame(_) | Payload::Control(_)) => {}
        }
        self.pump(now);
    }

    fn handle_timeout(&mut self, now: Time) {
        self.link.handle_timeout(now);
        self.pump(now);
        self.watch_silence(now);
        match &self.activity {
            Activity::Idle | Activity::Starting(_) => {}
            Activity::Power(_) => self.power_timeout(now),
            Activity::Motion(_) => self.motion_timeout(now),
            Activity::Halt(_) => self.halt_timeout(now),
            Activity::Homing(_) => self.homing_timeout(now),
        }
        self.pump(now);
    }

    fn poll_timeout(&self) -> Time {
        let activity = match &self.activity {
            Activity::Idle | Activity::Starting(_) => Time::NEVER,
            Activity::Power(power) => power.deadline(),
            Activity::Motion(motion) => motion.deadline(),
            Activity::Halt(halt) => halt.deadline(),
            Activity::Homing(homing) => homing.deadline(),
        };
        let look = if self.look.active && self.link.is_free() {
            self.look.due
        } else {
            Time::NEVER
        };
        activity
            .min(look)
            .min(self.link.poll_timeout())
            .min(self.silence_deadline())
    }

    fn poll_transmit(&mut self) -> Option<Payload> {
        self.link.poll_transmit()
    }

    fn line_use(&self) -> LineUse {
        self.link.line_use()
    }

    fn poll_alarm(&mut self) -> Option<Alarm> {
        self.alarms.pop_front()
    }

    fn start(&mut self, now: Time) {
        self.begin_start(now);
        self.asks_only = false;
    }

    /// An amplifier that holds something stays enabled.
    fn identify(&mut self, now: Time) {
        self.begin_start(now);
        self.asks_only = true;
    }

    fn looks_for(&self) -> Option<String> {
        let (baud, at_reset) = (self.settings.baud, BAUD_AT_RESET);
        self.link.is_searching().then(|| {
            format!(
                "the amplifier with address 0, at {baud} bit/s and, after a BREAK, {at_reset} bit/s"
            )
        })
    }

    fn poll_outcome(&mut self) -> Option<Result<(), DeviceError>> {
        self.outcome.take()
    }

    fn identity(&self) -> Option<Identity> {
        self.identity.clone()
    }

    fn counters(&self) -> Vec<(&'static str, u64)> {
        let counts = &self.link.counts;
        vec![
            ("exchanges", counts.exchanges),
            ("replies lost", counts.lost),
            ("late lines dropped", counts.late),
            ("replies of another kind dropped", counts.mismatched),
            ("damaged lines", counts.damaged),
            ("commands sent again", counts.resent),
            ("searches for the amplifier", counts.searches),
            ("positions not believed", self.image.plausible.rejected()),
        ]
    }
}

impl<Q: Coordinate> ServoDrive for CopleyAxis<Q> {
    fn control(&mut self, now: Time, command: DriveCommand) {
        let was_moving = self.is_moving();
        self.supersede();
        match command {
            _ if !self.is_in_service() => self.refuse_out_of_service(),
            DriveCommand::QuickStop => self.begin_quick_stop(now),
            DriveCommand::Enable => self.begin_enable(now, was_moving),
            DriveCommand::Disable => self.begin_disable(now),
            DriveCommand::ResetFault => self.begin_reset(now),
            // An amplifier that is not enabled does not move: nothing is left to do.
            DriveCommand::Halt if !self.is_enabled() => self.finish(Ok(())),
            DriveCommand::Halt => self.begin_halt(now),
            DriveCommand::EnterCyclic { .. } | DriveCommand::LeaveCyclic => {
                self.refuse("following cyclic set-points", "a drive on CAN");
            }
            DriveCommand::ReadReference { .. } => {
                self.refuse("reading its reference", "a drive on CAN");
            }
        }
        self.pump(now);
    }

    fn power_state(&self) -> Option<PowerState> {
        self.is_in_service().then(|| self.state())
    }

    fn is_homed(&self) -> bool {
        self.homed
    }

    fn place(&self) -> Option<Place> {
        let stands = self.image.plausible.stands();
        self.reading().map(|reading| reading.place(stands))
    }

    fn was_enabled(&self) -> bool {
        self.was_enabled
    }

    fn started_at(&self) -> Option<Time> {
        self.started_at
    }
}

impl<Q: Coordinate> Axis<Q> for CopleyAxis<Q> {
    fn command(&mut self, now: Time, command: AxisCommand<Q>) {
        if let AxisCommand::Drive(command) = command {
            self.control(now, command);
            return;
        }
        let prepared = self.prepared.take();
        self.supersede();
        match command {
            AxisCommand::Drive(_) => {}
            _ if !self.is_in_service() => self.refuse_out_of_service(),
            _ if !self.is_enabled() => self.refuse("moving", "an enabled drive"),
            AxisCommand::MoveTo {
                target,
                speed,
                acceleration,
            } => self.begin_move(now, (target, speed, acceleration), true),
            AxisCommand::Prepare {
                target,
                speed,
                acceleration,
            } => self.begin_move(now, (target, speed, acceleration), false),
            AxisCommand::Start => match prepared {
                Some(plan) => self.begin_prepared(now, plan),
                None => self.refuse("starting", "a move that was prepared immediately before"),
            },
            AxisCommand::HomeNegativeLimit { position, speed } => {
                self.begin_homing(now, position, HomingPlace::NegativeLimit(speed));
            }
            AxisCommand::HomeNextIndex { .. } => {
                self.refuse(
                    "homing on the next index mark",
                    "a drive that searches for the mark by itself",
                );
            }
            AxisCommand::HomeIndex { position, speed } => {
                self.begin_homing(now, position, HomingPlace::Index(speed));
            }
            AxisCommand::HomeHere { position } => {
                self.begin_homing(now, position, HomingPlace::Here);
            }
        }
        self.pump(now);
    }

    fn follow(&mut self, _now: Time, _set_point: Q) -> Result<(), DeviceError> {
        Err(DeviceError::NotPossible {
            device: self.name(),
            step: "following cyclic set-points",
            needs: "a drive on CAN",
        })
    }

    fn held(&self) -> Option<Q> {
        None
    }

    fn reading(&self) -> Option<AxisReading<Q>> {
        let (at, position) = self.image.position()?;
        let scale = self.settings.scale;
        let counts = position + self.origin;
        let in_place = self.envelope.is_in_place(position.0);
        let moving = self.image.events.contains(EventStatus::IN_MOTION)
            || matches!(self.activity, Activity::Motion(_) | Activity::Homing(_));
        Some(AxisReading {
            at,
            counts,
            position: scale.to_coordinate(counts),
            following_error: self
                .image
                .following_error
                .map(|counts| scale.to_coordinate(counts)),
            standing: !moving && in_place,
            at_rest: in_place && self.image.plausible.stands(),
        })
    }
}
