//! What every CANopen device has in common: identity, heartbeat, start procedure.
//!
//! Source: CiA 301 (7.3.2 NMT, 7.2.8.3.2 heartbeat, 7.2.7 EMCY); the order of the start
//! procedure follows CiA 302-2: boot-up or answer, device type, identity, configuration,
//! error control, start.

mod error;
mod identity;
mod settings;
mod twins;
mod vigil;

use core::time::Duration;
use std::collections::VecDeque;
use units::Time;
use wire::Input;
use wire::Payload;
use wire::can::CanFrame;
use wire::canopen::emcy::Emergency;
use wire::canopen::nmt::{NmtCommand, NmtState, consumer_heartbeat_entry};
use wire::canopen::{Function, NodeId, Object};

pub(super) use settings::millis;
pub use settings::{ExpectedIdentity, NodeSettings, NodeTimeouts};

use super::{Alarm, DeviceError, DeviceName, Identity, Seen};
use crate::protocol::heartbeat::HeartbeatConsumer;
use crate::protocol::script::{Script, ScriptCause, ScriptFailure, Step};
use crate::protocol::sdo_client::{SdoClient, SdoFailure};

/// How often NMT start, which nobody confirms, is sent before the node counts as deaf.
const START_COMMANDS_MAX: u8 = 3;

/// What the common part tells the device's own part.
#[derive(Debug)]
pub(super) enum NodeEvent {
    /// The identity is right; the profile's own objects were read. Answer with
    /// [`CanopenNode::configure`].
    Described(Script),
    /// Configured and operational. Answer with [`CanopenNode::up`] when data came.
    Operational,
    /// A script of the device's own is done.
    ScriptDone(Script),
    /// The start or a script failed.
    Failed(DeviceError),
    /// Something is wrong.
    Alarm(Alarm),
    /// Process data: TPDO 1 to 4.
    Pdo { number: u8, frame: CanFrame },
    /// No process data for this long.
    PdoSilent { waited: Duration },
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    Off,
    /// Does it answer? Until the deadline.
    Probing {
        since: Time,
    },
    Describing,
    /// The device's own part checks what was read.
    Described,
    Configuring,
    Starting {
        since: Time,
        again: Time,
        sent: u8,
    },
    /// Operational, waiting for data.
    Operational {
        since: Time,
    },
    Up,
    /// It booted by itself; process data that come all the same are another device's.
    Rebooted {
        since: Time,
    },
}

/// The common part of a CANopen device.
#[derive(Debug)]
pub(super) struct CanopenNode {
    settings: NodeSettings,
    profile: u16,
    /// The TPDO that carries the sample that the device lives by.
    life_pdo: u8,
    client: SdoClient,
    twins: twins::Twins,
    consumer: HeartbeatConsumer,
    phase: Phase,
    description: Vec<Step>,
    script: Option<Script>,
    outbox: VecDeque<CanFrame>,
    events: VecDeque<NodeEvent>,
    identity: Option<Identity>,
    last_pdo: Time,
    pdo_silent: bool,
    watches_master: bool,
    lost_master: bool,
    emergencies: u64,
    heartbeats_lost: u64,
    boot_ups: u64,
}

impl CanopenNode {
    pub(super) fn new(settings: NodeSettings, profile: u16) -> Self {
        let sdo = settings.timeouts.sdo;
        Self {
            client: SdoClient::new(settings.node, sdo).with_retry(settings.retry),
            consumer: HeartbeatConsumer::new(settings.node, settings.consumer_time),
            twins: twins::Twins::new(settings.node),
            settings,
            profile,
            life_pdo: 1,
            phase: Phase::Off,
            description: Vec::new(),
            script: None,
            outbox: VecDeque::new(),
            events: VecDeque::new(),
            identity: None,
            last_pdo: Time::ZERO,
            pdo_silent: false,
            watches_master: false,
            lost_master: false,
            emergencies: 0,
            heartbeats_lost: 0,
            boot_ups: 0,
        }
    }

    /// The device lives by another TPDO than the first.
    #[must_use]
    pub(super) const fn living_by(mut self, number: u8) -> Self {
        self.life_pdo = number;
        self
    }

    pub(super) const fn id(&self) -> NodeId {
        self.settings.node
    }

    pub(super) const fn name(&self) -> DeviceName {
        DeviceName::Node(self.settings.node)
    }

    pub(super) const fn is_up(&self) -> bool {
        matches!(self.phase, Phase::Up)
    }

    /// Whether NMT start was obeyed.
    pub(super) const fn is_operational(&self) -> bool {
        matches!(self.phase, Phase::Operational { .. } | Phase::Up)
    }

    /// Whether what its process data says is about now: operational, alive, PDOs coming.
    pub(super) fn is_in_service(&self) -> bool {
        self.is_up() && !self.pdo_silent && self.consumer.state() == Some(NmtState::Operational)
    }

    pub(super) const fn identity(&self) -> Option<&Identity> {
        self.identity.as_ref()
    }

    pub(super) fn counters(&self) -> Vec<(&'static str, u64)> {
        let sdo = self.client.counters();
        vec![
            ("sdo stale", sdo.stale),
            ("sdo mismatched", sdo.mismatched),
            ("sdo short", sdo.short),
            ("sdo unexpected", sdo.unexpected),
            ("sdo duplicated", sdo.duplicated),
            ("sdo late", sdo.late),
            ("sdo aborts sent", sdo.aborts_sent),
            ("sdo retries", sdo.retries),
            ("emergencies", self.emergencies),
            ("heartbeats lost", self.heartbeats_lost),
            ("boot-ups", self.boot_ups),
        ]
    }

    /// Begins the start; `description` are the profile's own reads.
    pub(super) fn start(&mut self, now: Time, description: Vec<Step>) {
        self.drop_script(now);
        self.events.clear();
        self.identity = None;
        self.pdo_silent = false;
        (self.watches_master, self.lost_master) = (false, false);
        self.consumer.rest();
        self.twins.forget();
        self.description = description;
        self.phase = Phase::Probing { since: now };
        self.probe(now);
    }

    /// Goes on with the start: configuration, error control, NMT start.
    pub(super) fn configure(&mut self, now: Time, mut steps: Vec<Step>) {
        let settings = &self.settings;
        let watch = if settings.master_consumer_time.is_zero() {
            0
        } else {
            consumer_heartbeat_entry(settings.master, millis(settings.master_consumer_time))
        };
        steps.push(Step::check(
            Object::new(0x1017, 0),
            millis(settings.heartbeat_period),
            "setting the node's heartbeat",
        ));
        steps.push(Step::check(
            vigil::WATCH,
            watch,
            "making the node watch our heartbeat",
        ));
        self.phase = Phase::Configuring;
        self.run_script(now, Script::new(steps));
    }

    /// The start is over: from now on everything unexpected is an alarm.
    pub(super) const fn up(&mut self, now: Time) {
        self.phase = Phase::Up;
        self.last_pdo = now;
    }

    /// The start failed in the device's own part.
    pub(super) fn give_up(&mut self, now: Time) {
        self.drop_script(now);
        self.phase = Phase::Off;
    }

    /// Runs steps of the device's own; an unfinished script is given up.
    pub(super) fn run(&mut self, now: Time, steps: Vec<Step>) {
        self.drop_script(now);
        self.run_script(now, Script::new(steps));
    }

    pub(super) fn drop_script(&mut self, now: Time) {
        self.script = None;
        self.client.cancel(now);
    }

    fn run_script(&mut self, now: Time, script: Script) {
        self.script = Some(script);
        self.poll_script(now);
    }

    pub(super) fn send(&mut self, frame: CanFrame) {
        self.outbox.push_back(frame);
    }

    pub(super) fn poll_transmit(&mut self) -> Option<CanFrame> {
        self.outbox
            .pop_front()
            .or_else(|| self.client.poll_transmit())
    }

    pub(super) fn poll_event(&mut self) -> Option<NodeEvent> {
        self.events.pop_front()
    }

    pub(super) fn poll_timeout(&self) -> Time {
        let phase = match self.phase {
            Phase::Probing { since } => since + self.settings.timeouts.boot,
            Phase::Starting { since, again, .. } => {
                again.min(since + self.settings.timeouts.operational)
            }
            Phase::Operational { since } => since + self.settings.timeouts.operational,
            Phase::Up if !self.pdo_silent => self.pdo_deadline(),
            Phase::Rebooted { since } => self.reboot_deadline(since),
            Phase::Up | Phase::Off | Phase::Describing | Phase::Described | Phase::Configuring => {
                Time::NEVER
            }
        };
        phase
            .min(self.client.poll_timeout())
            .min(self.consumer.poll_timeout())
    }

    /// Half a period of grace: process data has its own place within the period.
    fn pdo_deadline(&self) -> Time {
        let settings = &self.settings;
        self.last_pdo + settings.sync_period * settings.missed_pdos_max + settings.sync_period / 2
    }

    /// When process data of a twin must have come: after the next SYNC.
    fn reboot_deadline(&self, since: Time) -> Time {
        since + self.settings.sync_period * 3 / 2
    }

    pub(super) fn handle(&mut self, now: Time, input: &Input) {
        let Input::Payload(Payload::Frame(frame)) = input else {
            return;
        };
        if self.twins.contradicts(frame) {
            let node = self.settings.node;
            self.end_by(now, Alarm::DuplicateNode { node });
        }
        if let Some(event) = self.consumer.handle_frame(now, frame) {
            self.take_heartbeat(now, event);
        } else if self.client.handle_frame(now, frame) {
            self.poll_script(now);
        } else if let Ok((node, emergency)) = Emergency::parse(frame) {
            if node == self.settings.node {
                self.take_emergency(emergency);
            }
        } else if let Some(number) = self.pdo_number(frame) {
            if number == self.life_pdo {
                self.last_pdo = now;
                self.pdo_silent = false;
                self.take_pdo_of_twin();
            }
            let frame = *frame;
            self.events.push_back(NodeEvent::Pdo { number, frame });
        }
    }

    fn pdo_number(&self, frame: &CanFrame) -> Option<u8> {
        let (function, node) = Function::of(frame.standard_id()?)?;
        if node != self.settings.node || frame.is_remote() {
            return None;
        }
        match function {
            Function::Tpdo1 => Some(1),
            Function::Tpdo2 => Some(2),
            Function::Tpdo3 => Some(3),
            Function::Tpdo4 => Some(4),
            Function::Emergency
            | Function::Rpdo1
            | Function::Rpdo2
            | Function::Rpdo3
            | Function::Rpdo4
            | Function::SdoResponse
            | Function::SdoRequest
            | Function::ErrorControl => None,
        }
    }

    pub(super) fn handle_timeout(&mut self, now: Time) {
        self.client.handle_timeout(now);
        self.poll_script(now);
        if let Some(event) = self.consumer.handle_timeout(now) {
            self.take_heartbeat(now, event);
        }
        let timeouts = self.settings.timeouts;
        match self.phase {
            Phase::Probing { since } if now >= since + timeouts.boot => {
                self.fail_waiting(now, since, "boot-up or an answer to SDO");
            }
            Phase::Starting { since, .. } if now >= since + timeouts.operational => {
                self.fail_waiting(now, since, "operational after NMT start");
            }
            Phase::Starting { since, again, sent } if now >= again => {
                self.command_start(now, since, sent);
            }
            Phase::Operational { since } if now >= since + timeouts.operational => {
                self.fail_waiting(now, since, "the first process data; does SYNC run?");
            }
            Phase::Up if !self.pdo_silent && now >= self.pdo_deadline() => {
                self.pdo_silent = true;
                let waited = now.since(self.last_pdo);
                self.events.push_back(NodeEvent::PdoSilent { waited });
            }
            Phase::Rebooted { since } if now >= self.reboot_deadline(since) => {
                self.phase = Phase::Off;
                let node = self.settings.node;
                self.alarm(Alarm::UnexpectedBootUp { node });
            }
            Phase::Off
            | Phase::Probing { .. }
            | Phase::Describing
            | Phase::Described
            | Phase::Configuring
            | Phase::Starting { .. }
            | Phase::Operational { .. }
            | Phase::Rebooted { .. }
            | Phase::Up => {}
        }
    }

    fn probe(&mut self, now: Time) {
        let step = Step::read(identity::DEVICE_TYPE, "reading its identity");
        self.run_script(now, Script::new([step]));
    }

    fn poll_script(&mut self, now: Time) {
        let Some(script) = &mut self.script else {
            return;
        };
        let Some(result) = script.poll(now, &mut self.client) else {
            return;
        };
        let Some(script) = self.script.take() else {
            return;
        };
        match result {
            Ok(()) => self.script_done(now, script),
            Err(failure) => self.script_failed(now, failure),
        }
    }

    fn script_done(&mut self, now: Time, script: Script) {
        match self.phase {
            Phase::Probing { .. } => {
                let node = self.settings.node;
                self.outbox
                    .push_back(NmtCommand::EnterPreOperational.emit(Some(node)));
                self.phase = Phase::Describing;
                let mut steps = identity::steps();
                steps.extend(self.description.iter().copied());
                self.run_script(now, Script::new(steps));
            }
            Phase::Describing => {
                let seen = identity::from_script(&script);
                let checked = identity::check(&self.settings, self.profile, &seen);
                self.identity = Some(seen);
                match checked {
                    Ok(()) => {
                        self.phase = Phase::Described;
                        self.events.push_back(NodeEvent::Described(script));
                    }
                    Err(error) => self.fail(now, error),
                }
            }
            Phase::Configuring => {
                self.watches_master = !self.settings.master_consumer_time.is_zero();
                // What was reported before NMT start says nothing about what follows it.
                self.consumer.forget();
                self.consumer.expect(now);
                self.command_start(now, now, 0);
            }
            Phase::Off
            | Phase::Described
            | Phase::Starting { .. }
            | Phase::Operational { .. }
            | Phase::Rebooted { .. }
            | Phase::Up => self.events.push_back(NodeEvent::ScriptDone(script)),
        }
    }

    fn script_failed(&mut self, now: Time, failure: ScriptFailure) {
        let silent = matches!(
            failure.cause,
            ScriptCause::Sdo(SdoFailure::TimedOut { .. } | SdoFailure::Protocol { .. })
        );
        if silent && let Phase::Probing { since } = self.phase {
            // It may still be booting: asked again until the boot time-out.
            if now < since + self.settings.timeouts.boot {
                self.probe(now);
                return;
            }
        }
        let error = error::device_error(self.settings.node, failure);
        if self.is_up() {
            self.events.push_back(NodeEvent::Failed(error));
        } else {
            self.fail(now, error);
        }
    }

    fn command_start(&mut self, now: Time, since: Time, sent: u8) {
        if sent < START_COMMANDS_MAX {
            let node = self.settings.node;
            self.outbox.push_back(NmtCommand::Start.emit(Some(node)));
        }
        let pause = self.settings.timeouts.operational / u32::from(START_COMMANDS_MAX);
        self.phase = Phase::Starting {
            since,
            again: if sent < START_COMMANDS_MAX {
                now + pause
            } else {
                Time::NEVER
            },
            sent: sent.saturating_add(1),
        };
    }

    fn note_operational(&mut self, now: Time) {
        if let Phase::Starting { .. } = self.phase
            && self.consumer.state() == Some(NmtState::Operational)
        {
            self.phase = Phase::Operational { since: now };
            self.events.push_back(NodeEvent::Operational);
        }
    }

    fn fail_waiting(&mut self, now: Time, since: Time, awaited: &'static str) {
        let error = DeviceError::Timeout {
            device: self.name(),
            awaited,
            waited: now.since(since),
            seen: self.consumer.state().map_or(Seen::Nothing, Seen::Nmt),
        };
        self.fail(now, error);
    }

    fn fail(&mut self, now: Time, error: DeviceError) {
        self.give_up(now);
        self.consumer.rest();
        self.events.push_back(NodeEvent::Failed(error));
    }
}
