//! Several axes of an emulated machine on a desk: their drivers, one transport, and no machine.

use core::time::Duration;

use drivers::device::{Alarm, Axis, AxisCommand, AxisReading, DeviceError, LineUse};
use drivers::protocol::heartbeat::HeartbeatProducer;
use drivers::transport::Transport;
use truestage::for_tests::port_numbers;
use units::{Metres, MetresPerSecond, MetresPerSecondSquared, Time};
use wire::canopen::NodeId;
use wire::{Payload, Port};

use crate::emulator::Emulator;

/// One axis of a group.
struct Member {
    axis: Box<dyn Axis>,
    port: Port,
}

/// The axes of a machine, in the order of their names, with nothing above them.
pub struct Group {
    /// The machine that they are part of.
    pub emulator: Emulator,
    /// Every alarm so far, with the axis that raised it.
    pub alarms: Vec<(usize, Alarm)>,
    members: Vec<Member>,
    transport: Box<dyn Transport>,
    heartbeats: Vec<(Port, HeartbeatProducer)>,
    sync_period: Option<Duration>,
    /// Every run of bytes that was sent on a serial line, and when.
    pub said: Vec<(Time, String)>,
    /// Every run of bytes that came on one.
    pub heard: Vec<(Time, String)>,
}

/// How far from each other the axes of a group started.
#[derive(Clone, Debug)]
pub struct Start {
    /// When each was seen to start.
    pub at: Vec<Time>,
    /// From the first to the last.
    pub skew: Duration,
}

impl Group {
    /// The axes of `emulator`'s machine, not started.
    ///
    /// # Panics
    /// When the machine's buses cannot be used.
    pub fn new(emulator: Emulator) -> Self {
        let config = &emulator.loaded.config;
        let ports = port_numbers(config);
        let patience = emulator.loaded.patience;
        let mut transport = emulator.transport();
        let members = config.axis.values().map(|axis| {
            let device = axis.driver(config.wiring(), patience);
            let name = axis.port();
            Member {
                axis: device,
                port: ports[name],
            }
        });
        let members = members.collect();
        let mut sync_period = None;
        let heartbeats = config.can.iter().map(|(name, bus)| {
            let period = bus.sync_period();
            sync_period = Some(period);
            let started = transport.set_sync(ports[name], Some(period));
            started.unwrap_or_else(|error| panic!("{error}"));
            let node = NodeId::new(bus.master_node_id).expect("the configuration was checked");
            let period = Duration::from_millis(bus.master_heartbeat_ms.into());
            (ports[name], HeartbeatProducer::new(node, period))
        });
        let heartbeats = heartbeats.collect();
        Self {
            members,
            transport,
            heartbeats,
            sync_period,
            alarms: Vec::new(),
            said: Vec::new(),
            heard: Vec::new(),
            emulator,
        }
    }

    /// The clock.
    pub fn now(&self) -> Time {
        self.transport.now()
    }

    /// How many axes there are.
    pub fn len(&self) -> usize {
        self.members.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.members.is_empty()
    }

    /// Axis number `at`.
    pub fn axis(&mut self, at: usize) -> &mut dyn Axis {
        &mut *self.members[at].axis
    }

    /// The newest sample of axis number `at`.
    ///
    /// # Panics
    /// Before the first.
    pub fn reading(&self, at: usize) -> AxisReading {
        let reading = self.members[at].axis.reading();
        reading.expect("the axis was started")
    }

    fn may_speak(&self, at: usize) -> bool {
        let own = &self.members[at];
        let others = self.members.iter().enumerate();
        let others = others.filter(|(other, it)| *other != at && it.port == own.port);
        let uses: Vec<(LineUse, bool)> = others
            .map(|(other, it)| (it.axis.line_use(), other < at))
            .collect();
        own.axis.line_use().may_speak(uses)
    }

    fn send(&mut self, port: Port, payload: &Payload) {
        if let Payload::Bytes(bytes) = payload {
            let text = String::from_utf8_lossy(bytes).trim_end().to_owned();
            self.said.push((self.transport.now(), text));
        }
        let sent = self.transport.send(port, payload);
        sent.unwrap_or_else(|error| panic!("{error}"));
    }

    fn send_pending(&mut self) {
        let now = self.now();
        for at in 0..self.heartbeats.len() {
            let (port, heartbeat) = &mut self.heartbeats[at];
            heartbeat.handle_timeout(now);
            if let Some(frame) = heartbeat.poll_transmit() {
                let port = *port;
                self.send(port, &Payload::Frame(frame));
            }
        }
        for at in 0..self.members.len() {
            while self.may_speak(at) {
                let member = &mut self.members[at];
                let port = member.port;
                let Some(payload) = member.axis.poll_transmit() else {
                    break;
                };
                self.send(port, &payload);
            }
        }
    }

    fn tick(&mut self, until: Time) {
        self.send_pending();
        let beats = self.heartbeats.iter().map(|(_, it)| it.poll_timeout());
        let axes = self.members.iter().map(|it| it.axis.poll_timeout());
        let deadline = beats.chain(axes).fold(until, Time::min);
        let arrival = self.transport.receive(deadline);
        let now = arrival.as_ref().map_or_else(|| self.now(), |it| it.at);
        if let Some(arrival) = arrival {
            use wire::Input;
            if let Input::Payload(Payload::Bytes(bytes)) = &arrival.input {
                let text = String::from_utf8_lossy(bytes).into_owned();
                self.heard.push((arrival.at, text));
            }
            let concerned = self.members.iter_mut().filter(|it| it.port == arrival.port);
            for member in concerned {
                member.axis.handle(now, &arrival.input);
            }
        }
        for member in &mut self.members {
            if member.axis.poll_timeout() <= now {
                member.axis.handle_timeout(now);
            }
        }
        self.send_pending();
        for at in 0..self.members.len() {
            while let Some(alarm) = self.members[at].axis.poll_alarm() {
                self.alarms.push((at, alarm));
            }
        }
    }

    /// Lets everything live for `span`.
    pub fn live(&mut self, span: Duration) {
        let until = self.now() + span;
        while self.now() < until {
            self.tick(until);
        }
    }

    /// Lets everything live until `reached`.
    ///
    /// # Panics
    /// When that does not come in a minute of the machine's life.
    pub fn live_until(&mut self, reached: impl Fn(&Self) -> bool) {
        let until = self.now() + Duration::from_secs(60);
        while !reached(self) {
            assert!(self.now() < until, "not reached; alarms: {:?}", self.alarms);
            self.tick(until);
        }
    }

    /// How the command of axis number `at` ends.
    ///
    /// # Errors
    /// What the driver says.
    ///
    /// # Panics
    /// When it does not end in two minutes of the machine's life: every driver has time-outs.
    pub fn outcome(&mut self, at: usize) -> Result<(), DeviceError> {
        let until = self.now() + Duration::from_secs(120);
        loop {
            if let Some(outcome) = self.members[at].axis.poll_outcome() {
                return outcome;
            }
            assert!(self.now() < until, "no outcome; alarms: {:?}", self.alarms);
            self.tick(until);
        }
    }

    fn outcomes(&mut self) -> Result<(), DeviceError> {
        let mut result = Ok(());
        for at in 0..self.len() {
            result = result.and(self.outcome(at));
        }
        result
    }

    /// Starts all axes at once, as a machine does.
    ///
    /// # Errors
    /// The first that failed.
    pub fn start(&mut self) -> Result<(), DeviceError> {
        let now = self.now();
        for member in &mut self.members {
            member.axis.start(now);
        }
        self.outcomes()
    }

    /// Gives a command to one axis and does not wait.
    pub fn begin(&mut self, at: usize, command: impl Into<AxisCommand>) {
        let now = self.now();
        self.members[at].axis.command(now, command.into());
    }

    /// Gives a command to one axis and waits for its end.
    ///
    /// # Errors
    /// What the driver says.
    pub fn command(
        &mut self,
        at: usize,
        command: impl Into<AxisCommand>,
    ) -> Result<(), DeviceError> {
        self.begin(at, command);
        self.outcome(at)
    }

    /// Gives a command to all axes at once and waits for the end of each.
    ///
    /// # Errors
    /// The first that failed.
    pub fn all(&mut self, command: impl Into<AxisCommand>) -> Result<(), DeviceError> {
        let command = command.into();
        for at in 0..self.len() {
            self.begin(at, command);
        }
        self.outcomes()
    }

    /// Prepares a move of every axis.
    ///
    /// # Errors
    /// The first that failed.
    pub fn prepare(&mut self, targets: &[Metres]) -> Result<(), DeviceError> {
        for (at, target) in targets.iter().enumerate() {
            let prepare = AxisCommand::Prepare {
                target: *target,
                speed: MetresPerSecond(0.005),
                acceleration: MetresPerSecondSquared(0.05),
            };
            self.begin(at, prepare);
        }
        self.outcomes()
    }

    /// Starts what was prepared, behind a SYNC where there is one; waits for the end of all.
    ///
    /// # Errors
    /// The first that failed.
    ///
    /// # Panics
    /// When an axis moved and does not say when it started.
    pub fn start_together(&mut self) -> Result<Start, DeviceError> {
        if let Some(period) = self.sync_period {
            let before = self.reading(0).at;
            self.live_until(|group| {
                let sample = group.reading(0).at;
                sample != before && group.now().since(sample) * 2 <= period
            });
        }
        for at in 0..self.len() {
            self.begin(at, AxisCommand::Start);
        }
        self.send_pending();
        self.outcomes()?;
        let at: Vec<Time> = self
            .members
            .iter()
            .map(|it| it.axis.started_at().expect("it has moved"))
            .collect();
        let first = at.iter().copied().fold(Time::NEVER, Time::min);
        let last = at.iter().copied().fold(Time::ZERO, Time::max);
        let skew = last.since(first);
        Ok(Start { at, skew })
    }
}
