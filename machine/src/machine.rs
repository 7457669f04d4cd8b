//! One machine: its devices, its transport, and what its drives remember.

mod attendant;

use core::time::Duration;
use std::collections::BTreeSet;

use compensator::apply::ApproachTracker;
use drivers::device::{AxisCommand, AxisReading, DriveCommand};
use drivers::protocol::heartbeat::HeartbeatProducer;
use drivers::transport::Transport;
use units::{Metres, Time};
use wire::Port;
use wire::cia402::PowerState;

use crate::bus_account::BusAccount;
use crate::bus_watch::BusWatch;
use crate::devices::Devices;
use crate::diagnosis::Diagnosis;
use crate::failure::Failure;
use crate::host_watch::HostWatch;
use crate::lookout::Lookout;
use crate::notices::Notices;
use crate::observer::Observer;
use crate::outbox::Outbox;
use crate::parts::{AxisSettings, Bus, Parts};
use crate::patience::Patience;
use crate::ports::Ports;
use crate::stop_request::StopRequest;
use crate::sync_account::SyncAccount;
use crate::zero_notes::KeptZeros;

pub(crate) use attendant::call as call_attendant;
pub use attendant::{Attendant, attend};

/// How alarms are taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Supervision {
    /// Not started, or shut down: alarms are dropped.
    Off,
    /// An alarm ends whatever runs.
    On,
    /// A stop is under way: alarms must not keep it from finishing.
    Stopping,
}

/// A machine that is connected.
///
/// # Example
///
/// A machine without devices, over a recording in which nothing happens: time passes in ticks, and a stop request ends
/// whatever runs.
///
/// ```
/// use drivers::transport::replay::Replay;
/// use machine::{Failure, Machine, Parts, Patience};
/// use units::Time;
///
/// let parts = Parts {
///     buses: vec![],
///     lines: Default::default(),
///     axes: vec![],
///     rotaries: vec![],
///     analogs: vec![],
///     instruments: vec![],
///     cameras: vec![],
///     patience: Patience::NONE,
/// };
/// let mut machine = Machine::new(parts, Box::new(Replay::parse("", &[])?));
/// machine.run_until(Time::from_seconds(2.0))?;
/// assert_eq!(machine.now(), Time::from_seconds(2.0));
/// machine.stop_request().stop();
/// let stopped = machine.run_until(Time::from_seconds(3.0));
/// assert!(matches!(stopped, Err(Failure::Interrupted)));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Machine {
    pub(crate) patience: Patience,
    pub(crate) transport: Box<dyn Transport>,
    pub(crate) outbox: Outbox,
    pub(crate) ports: Ports,
    pub(crate) devices: Devices,
    /// By the numbers of the linear axes.
    pub(crate) settings: Vec<AxisSettings>,
    /// By the numbers of the linear axes: the direction of the last motion.
    pub(crate) approach: Vec<ApproachTracker>,
    /// By the numbers of the drives: zeroed since it was last powered.
    pub(crate) zeroed: Vec<bool>,
    /// What is noted of them for the next start.
    pub(crate) kept_zeros: Option<KeptZeros>,
    /// By the numbers of the drives: what is noted must go as soon as there is time for files.
    pub(crate) doubted: Vec<bool>,
    pub(crate) heartbeats: Vec<(Port, HeartbeatProducer)>,
    pub(crate) supervision: Supervision,
    pub(crate) bus_watch: BusWatch,
    pub(crate) diagnosis: Diagnosis,
    pub(crate) bus_account: BusAccount,
    pub(crate) host_watch: HostWatch,
    /// The instruments and cameras that were started, by name.
    pub(crate) started_instruments: BTreeSet<String>,
    /// The instrument or camera whose readings a procedure needs now: only its alarms count.
    pub(crate) instrument_in_use: Option<String>,
    pub(crate) notices: Notices,
    pub(crate) stop: StopRequest,
    /// Who looks after it at the end of every tick.
    pub(crate) attendant: Option<Box<dyn Attendant>>,
    /// The cyclic loop has axes in its hands.
    pub(crate) follows: bool,
    /// Whether its cyclic loops ask for SCHED_FIFO and locked memory.
    pub(crate) real_time: bool,
}

impl Machine {
    /// A machine of `parts` over `transport`, which must number its ports as they do. Nothing is
    /// sent yet.
    pub fn new(parts: Parts, transport: Box<dyn Transport>) -> Self {
        let (axes, settings): (Vec<_>, Vec<_>) = parts
            .axes
            .into_iter()
            .map(|it| (it.unit, it.settings))
            .unzip();
        let syncs = SyncAccount::new(&parts.buses);
        let heartbeat = |bus: &Bus| (bus.port, HeartbeatProducer::new(bus.master, bus.heartbeat));
        Self {
            heartbeats: parts.buses.iter().map(heartbeat).collect(),
            bus_watch: BusWatch::new(&parts.buses),
            diagnosis: Diagnosis::new(&parts.buses),
            bus_account: BusAccount::new(&parts.buses),
            host_watch: HostWatch::default(),
            approach: vec![ApproachTracker::new(); axes.len()],
            zeroed: vec![false; axes.len() + parts.rotaries.len()],
            kept_zeros: None,
            doubted: vec![false; axes.len() + parts.rotaries.len()],
            devices: Devices {
                axes,
                rotaries: parts.rotaries,
                analogs: parts.analogs,
                instruments: parts.instruments,
                lookouts: vec![Lookout::default(); parts.cameras.len()],
                cameras: parts.cameras,
            },
            settings,
            ports: Ports {
                buses: parts.buses,
                lines: parts.lines,
                is_synchronous: false,
                syncs,
            },
            patience: parts.patience,
            transport,
            outbox: Outbox::default(),
            supervision: Supervision::Off,
            started_instruments: BTreeSet::new(),
            instrument_in_use: None,
            notices: Notices::default(),
            stop: StopRequest::default(),
            attendant: None,
            follows: false,
            real_time: false,
        }
    }

    /// Lets all that is moved cyclically ask for SCHED_FIFO and locked memory
    /// ([`Engine::in_real_time`](crate::engine::Engine::in_real_time)). Not for simulated time, which
    /// passes as fast as the computer goes.
    pub const fn in_real_time(&mut self) {
        self.real_time = true;
    }

    /// Who is told about progress.
    pub fn observe(&mut self, observer: Box<dyn Observer>) {
        self.notices.observer = observer;
    }

    /// The observer that is told about progress.
    pub fn observer(&mut self) -> &mut dyn Observer {
        &mut *self.notices.observer
    }

    /// How much longer than usual things are waited for.
    pub const fn patience(&self) -> Patience {
        self.patience
    }

    /// The flag that stops this machine.
    pub fn stop_request(&self) -> StopRequest {
        self.stop.clone()
    }

    /// Lets another machine's flag stop this one too.
    pub fn share_stop_request(&mut self, stop: &StopRequest) {
        self.stop = stop.clone();
    }

    /// The machine's clock.
    pub fn now(&self) -> Time {
        self.transport.now()
    }

    /// Its devices: who they are, and what they have said.
    pub const fn devices(&self) -> &Devices {
        &self.devices
    }

    /// Within which `axis` is moved.
    ///
    /// # Errors
    /// When there is no such linear axis.
    pub fn axis_settings(&self, axis: &str) -> Result<&AxisSettings, Failure> {
        Ok(&self.settings[self.devices.axis_index(axis)?])
    }

    /// Whether the (linear or rotary) `axis` was zeroed since its drive was last powered.
    pub fn is_zeroed(&self, axis: &str) -> bool {
        self.devices
            .drive_index(axis)
            .is_ok_and(|at| self.zeroed[at] && self.devices.drive(at).is_homed())
    }

    /// Coordinates mean something only after the zero.
    ///
    /// # Errors
    /// When there is no such axis, or it was not zeroed.
    pub fn require_zeroed(&self, axis: &str) -> Result<(), Failure> {
        self.devices.drive_index(axis)?;
        if self.is_zeroed(axis) {
            return Ok(());
        }
        Err(Failure::NotZeroed {
            axis: axis.to_owned(),
        })
    }

    /// The newest sample of `axis`.
    ///
    /// # Errors
    /// When there is no such axis.
    pub fn reading(&self, axis: &str) -> Result<Option<AxisReading>, Failure> {
        let at = self.devices.axis_index(axis)?;
        Ok(self.devices.axes[at].device.reading())
    }

    /// The newest power state of the (linear or rotary) `axis`, `None` before its drive has
    /// said one.
    ///
    /// # Errors
    /// When there is no such axis.
    pub fn power_state(&self, axis: &str) -> Result<Option<PowerState>, Failure> {
        Ok(self
            .devices
            .drive(self.devices.drive_index(axis)?)
            .power_state())
    }

    /// Starts device number `at`, an instrument or a camera called `name`, unless it runs already,
    /// and counts its alarms from now on.
    pub(crate) fn use_device(&mut self, at: usize, name: &str) -> Result<(), Failure> {
        if !self.started_instruments.contains(name) {
            let now = self.now();
            self.devices.unit_mut(at).device.start(now);
            self.await_start(at)?;
            self.started_instruments.insert(name.to_owned());
        }
        self.instrument_in_use = Some(name.to_owned());
        Ok(())
    }

    /// Gives `command` to `axis` and waits until it is done, for `limit` at most; `step` is its
    /// name for a person.
    ///
    /// # Errors
    /// When there is no such linear axis, the machine is not started, or the command fails.
    pub fn command(
        &mut self,
        axis: &str,
        command: impl Into<AxisCommand>,
        step: &'static str,
        limit: Duration,
    ) -> Result<(), Failure> {
        let at = self.devices.axis_index(axis)?;
        self.require_supervised(at)?;
        let now = self.now();
        self.devices.axes[at].device.command(now, command.into());
        self.await_outcome(at, step, limit)
    }

    /// Gives `command` to `axis` and does not wait: see [`Machine::outcome`].
    ///
    /// # Errors
    /// When there is no such linear axis.
    pub fn begin(&mut self, axis: &str, command: AxisCommand) -> Result<(), Failure> {
        let at = self.devices.axis_index(axis)?;
        let now = self.now();
        self.devices.axes[at].device.command(now, command);
        Ok(())
    }

    /// How the command that was begun last for the linear `axis` ended; `None` while it runs, and
    /// when it has been asked for.
    ///
    /// # Errors
    /// When there is no such axis.
    pub fn outcome(&mut self, axis: &str) -> Result<Option<Result<(), Failure>>, Failure> {
        let at = self.devices.axis_index(axis)?;
        let outcome = self.devices.axes[at].device.poll_outcome();
        let device = || axis.to_owned();
        Ok(outcome.map(|it| {
            it.map_err(|source| Failure::Device {
                device: device(),
                source,
            })
        }))
    }

    /// Nothing begins to move while alarms do not count: after a stop, the machine is started
    /// again first.
    pub(crate) fn require_supervised(&self, at: usize) -> Result<(), Failure> {
        if self.supervision == Supervision::On {
            return Ok(());
        }
        let device = self.devices.name(at);
        Err(Failure::NotStarted { device })
    }

    /// Gives `command` to drive number `at`, whatever it moves, and waits until it is done.
    pub(crate) fn control(
        &mut self,
        at: usize,
        command: DriveCommand,
        step: &'static str,
        limit: Duration,
    ) -> Result<(), Failure> {
        if let DriveCommand::Enable | DriveCommand::EnterCyclic { .. } = command {
            self.require_supervised(at)?;
        }
        let now = self.now();
        self.devices.drive_mut(at).control(now, command);
        self.await_outcome(at, step, limit)
    }

    /// The soft limits of `axis`, the lower one first.
    ///
    /// # Errors
    /// When there is no such axis.
    pub fn soft_limits(&self, axis: &str) -> Result<(Metres, Metres), Failure> {
        let settings = self.axis_settings(axis)?;
        Ok((settings.soft_min, settings.soft_max))
    }
}
