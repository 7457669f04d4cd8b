//! One device of an emulated machine on a desk: a driver, its transport, and no machine.

use core::time::Duration;

use drivers::device::cia402::Cia402Settings;
use drivers::device::{
    Alarm, Axis, AxisCommand, AxisReading, Device, DeviceError, LatchCommand, PositionLatch,
};
use drivers::protocol::heartbeat::HeartbeatProducer;
use drivers::transport::Transport;
use truestage::config::Loaded;
use truestage::for_tests::DriveConfig;
use truestage::for_tests::port_numbers;
use units::{Coordinate, Time};
use wire::canopen::NodeId;
use wire::{Payload, Port};

use crate::emulator::Emulator;

/// A driver that talks to its device.
pub struct Desk<D> {
    /// The driver.
    pub device: D,
    /// The machine that the device is part of.
    pub emulator: Emulator,
    /// Every alarm so far.
    pub alarms: Vec<Alarm>,
    transport: Box<dyn Transport>,
    port: Port,
    heartbeat: Option<HeartbeatProducer>,
}

impl<D: Device> Desk<D> {
    /// `device` on the bus or line `name`; on a bus with SYNC and the master's heartbeat.
    ///
    /// # Panics
    /// When the configuration has no such bus or line.
    pub fn new(emulator: Emulator, name: &str, device: D) -> Self {
        let config = &emulator.loaded.config;
        let port = port_numbers(config)[name];
        let mut transport = emulator.transport();
        let heartbeat = config.can.get(name).map(|bus| {
            let sync = bus.sync_period();
            let started = transport.set_sync(port, Some(sync));
            started.unwrap_or_else(|error| panic!("{error}"));
            let node = NodeId::new(bus.master_node_id).expect("the configuration was checked");
            let period = Duration::from_millis(bus.master_heartbeat_ms.into());
            HeartbeatProducer::new(node, period)
        });
        Self {
            device,
            emulator,
            alarms: Vec::new(),
            transport,
            port,
            heartbeat,
        }
    }

    /// The clock.
    pub fn now(&self) -> Time {
        self.transport.now()
    }

    /// The master falls silent, as when its process was killed.
    pub fn stop_heartbeat(&mut self) {
        self.heartbeat = None;
    }

    fn send(&mut self, payload: &Payload) {
        let sent = self.transport.send(self.port, payload);
        sent.unwrap_or_else(|error| panic!("{error}"));
    }

    fn send_pending(&mut self) {
        let now = self.now();
        if let Some(heartbeat) = &mut self.heartbeat {
            heartbeat.handle_timeout(now);
            if let Some(frame) = heartbeat.poll_transmit() {
                self.send(&Payload::Frame(frame));
            }
        }
        while let Some(payload) = self.device.poll_transmit() {
            self.send(&payload);
        }
    }

    fn tick(&mut self, until: Time) {
        self.send_pending();
        let beat = self.heartbeat.as_ref().map(HeartbeatProducer::poll_timeout);
        let deadline = until
            .min(beat.unwrap_or(Time::NEVER))
            .min(self.device.poll_timeout());
        let arrival = self.transport.receive(deadline);
        let now = arrival.as_ref().map_or_else(|| self.now(), |it| it.at);
        if let Some(arrival) = arrival.filter(|arrival| arrival.port == self.port) {
            self.device.handle(now, &arrival.input);
        }
        if self.device.poll_timeout() <= now {
            self.device.handle_timeout(now);
        }
        self.send_pending();
        while let Some(alarm) = self.device.poll_alarm() {
            self.alarms.push(alarm);
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
    pub fn live_until(&mut self, reached: impl Fn(&D) -> bool) {
        let until = self.now() + Duration::from_secs(60);
        while !reached(&self.device) {
            assert!(self.now() < until, "not reached; alarms: {:?}", self.alarms);
            self.tick(until);
        }
    }

    /// How the command that runs ends.
    ///
    /// # Errors
    /// What the device says.
    ///
    /// # Panics
    /// When it does not end in a minute of the machine's life: every driver has timeouts.
    pub fn outcome(&mut self) -> Result<(), DeviceError> {
        let until = self.now() + Duration::from_secs(60);
        loop {
            if let Some(outcome) = self.device.poll_outcome() {
                return outcome;
            }
            assert!(self.now() < until, "no outcome; alarms: {:?}", self.alarms);
            self.tick(until);
        }
    }

    /// Starts the device.
    ///
    /// # Errors
    /// What the device says.
    pub fn start(&mut self) -> Result<(), DeviceError> {
        let now = self.now();
        self.device.start(now);
        self.outcome()
    }
}

impl<D: Device> Desk<D> {
    /// Gives a command and does not wait.
    pub fn begin<Q: Coordinate>(&mut self, command: impl Into<AxisCommand<Q>>)
    where
        D: Axis<Q>,
    {
        let now = self.now();
        self.device.command(now, command.into());
    }

    /// Gives a command and waits for its end.
    ///
    /// # Errors
    /// What the device says.
    pub fn command<Q: Coordinate>(
        &mut self,
        command: impl Into<AxisCommand<Q>>,
    ) -> Result<(), DeviceError>
    where
        D: Axis<Q>,
    {
        self.begin(command);
        self.outcome()
    }

    /// Tells the drive's latch something and waits for its end.
    ///
    /// # Errors
    /// What the device says.
    pub fn latch<Q: Coordinate>(&mut self, command: LatchCommand<Q>) -> Result<(), DeviceError>
    where
        D: PositionLatch<Q>,
    {
        let now = self.now();
        self.device.latch(now, command);
        self.outcome()
    }

    /// The newest sample.
    ///
    /// # Panics
    /// Before the first.
    pub fn reading<Q: Coordinate>(&self) -> AxisReading<Q>
    where
        D: Axis<Q>,
    {
        self.device.reading().expect("the drive was started")
    }
}

/// What the driver of `axis`, a drive of CiA 402, is told.
///
/// # Panics
/// When it is no such drive.
pub fn cia402_settings(loaded: &Loaded, axis: &str) -> Cia402Settings {
    let axis = &loaded.config.axis[axis];
    let DriveConfig::Cia402(drive) = &axis.drive else {
        panic!("{:?}", axis.drive)
    };
    drive.settings(axis.task(), loaded.config.wiring(), loaded.patience)
}
