//! One machine: its devices, its transport, and what its drives remember.

use core::time::Duration;
use std::collections::{BTreeMap, BTreeSet};

use compensator::apply::ApproachTracker;
use drivers::device::{
    AnalogInput, Axis, AxisCommand, AxisReading, DisplacementInstrument, DriveCommand, RotaryAxis,
};
use drivers::protocol::heartbeat::HeartbeatProducer;
use drivers::transport::Transport;
use units::{Metres, Time};
use wire::Port;
use wire::cia402::PowerState;

use crate::bus_watch::BusWatch;
use crate::failure::Failure;
use crate::host_watch::HostWatch;
use crate::observer::{Observer, Silent};
use crate::outbox::Outbox;
use crate::parts::{AxisSettings, Bus, Camera, Parts};
use crate::patience::Patience;
use crate::stop_request::StopRequest;
use crate::unit::Unit;

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
    pub(crate) buses: Vec<Bus>,
    pub(crate) lines: BTreeMap<Port, String>,
    pub(crate) axes: Vec<Unit<dyn Axis>>,
    /// In the order of `axes`.
    pub(crate) settings: Vec<AxisSettings>,
    /// In the order of `axes`: the direction of the last motion.
    pub(crate) approach: Vec<ApproachTracker>,
    pub(crate) rotaries: Vec<Unit<dyn RotaryAxis>>,
    /// By the numbers of the drives: zeroed since it was last powered.
    pub(crate) zeroed: Vec<bool>,
    pub(crate) analogs: Vec<Unit<dyn AnalogInput>>,
    pub(crate) instruments: Vec<Unit<dyn DisplacementInstrument>>,
    pub(crate) cameras: Vec<Camera>,
    pub(crate) heartbeats: Vec<(Port, HeartbeatProducer)>,
    pub(crate) supervision: Supervision,
    pub(crate) bus_watch: BusWatch,
    pub(crate) host_watch: HostWatch,
    /// The instruments and cameras that were started, by name.
    pub(crate) started_instruments: BTreeSet<String>,
    /// The instrument or camera whose readings a procedure needs now: only its alarms count.
    pub(crate) instrument_in_use: Option<String>,
    pub(crate) observer: Box<dyn Observer>,
    /// Warnings for which there is no time now: whoever takes them may make their writer wait.
    pub(crate) held_back: Option<Vec<String>>,
    pub(crate) stop: StopRequest,
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
        let heartbeat = |bus: &Bus| (bus.port, HeartbeatProducer::new(bus.master, bus.heartbeat));
        Self {
            heartbeats: parts.buses.iter().map(heartbeat).collect(),
            bus_watch: BusWatch::new(&parts.buses),
            host_watch: HostWatch::default(),
            approach: vec![ApproachTracker::new(); axes.len()],
            zeroed: vec![false; axes.len() + parts.rotaries.len()],
            axes,
            settings,
            rotaries: parts.rotaries,
            analogs: parts.analogs,
            instruments: parts.instruments,
            cameras: parts.cameras,
            buses: parts.buses,
            lines: parts.lines,
            patience: parts.patience,
            transport,
            outbox: Outbox::default(),
            supervision: Supervision::Off,
            started_instruments: BTreeSet::new(),
            instrument_in_use: None,
            observer: Box::new(Silent),
            held_back: None,
            stop: StopRequest::default(),
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
        self.observer = observer;
    }

    /// The observer that is told about progress.
    pub fn observer(&mut self) -> &mut dyn Observer {
        &mut *self.observer
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

    /// The names of the axes.
    pub fn axis_names(&self) -> Vec<String> {
        self.axes.iter().map(|unit| unit.name.clone()).collect()
    }

    /// Within which `axis` is moved.
    ///
    /// # Errors
    /// When there is no such linear axis.
    pub fn axis_settings(&self, axis: &str) -> Result<&AxisSettings, Failure> {
        Ok(&self.settings[self.axis_index(axis)?])
    }

    /// Whether the (linear or rotary) `axis` was zeroed since its drive was last powered.
    pub fn is_zeroed(&self, axis: &str) -> bool {
        self.drive_index(axis)
            .is_ok_and(|at| self.zeroed[at] && self.drive(at).is_homed())
    }

    /// Says that `axis` has its zero, until its drive loses power or the machine is started anew;
    /// or that it has none.
    ///
    /// # Errors
    /// When there is no such axis.
    pub fn set_zeroed(&mut self, axis: &str, zeroed: bool) -> Result<(), Failure> {
        let at = self.drive_index(axis)?;
        self.zeroed[at] = zeroed;
        Ok(())
    }

    /// Coordinates mean something only after the zero.
    ///
    /// # Errors
    /// When there is no such axis, or it was not zeroed.
    pub fn require_zeroed(&self, axis: &str) -> Result<(), Failure> {
        self.drive_index(axis)?;
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
        Ok(self.axis(axis)?.device.reading())
    }

    /// The newest power state of the (linear or rotary) `axis`, `None` before its drive has
    /// said one.
    ///
    /// # Errors
    /// When there is no such axis.
    pub fn power_state(&self, axis: &str) -> Result<Option<PowerState>, Failure> {
        Ok(self.drive(self.drive_index(axis)?).power_state())
    }

    /// Starts SYNC, every axis and every analog module, and checks who they are. Nothing
    /// moves. Instruments and cameras are started when a procedure first needs them: a machine
    /// in production may have none.
    ///
    /// # Errors
    /// When a device does not answer, is another one than configured, or refuses its set-up.
    pub fn start(&mut self) -> Result<(), Failure> {
        self.catch_up();
        self.zeroed.fill(false);
        self.approach.iter_mut().for_each(ApproachTracker::forget);
        self.set_sync(true)?;
        let machine_devices = self.instrument_device(0);
        let now = self.now();
        for at in 0..machine_devices {
            self.device_mut(at).device.start(now);
        }
        for at in 0..machine_devices {
            self.await_start(at)?;
        }
        self.supervision = Supervision::On;
        Ok(())
    }

    /// Starts device number `at`, an instrument or a camera called `name`, unless it runs already,
    /// and counts its alarms from now on.
    pub(crate) fn use_device(&mut self, at: usize, name: &str) -> Result<(), Failure> {
        if !self.started_instruments.contains(name) {
            let now = self.now();
            self.device_mut(at).device.start(now);
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
        let at = self.axis_index(axis)?;
        self.require_supervised(at)?;
        let now = self.now();
        self.axes[at].device.command(now, command.into());
        self.await_outcome(at, step, limit)
    }

    /// Gives `command` to `axis` and does not wait: see [`Machine::outcome`].
    ///
    /// # Errors
    /// When there is no such linear axis.
    pub fn begin(&mut self, axis: &str, command: AxisCommand) -> Result<(), Failure> {
        let at = self.axis_index(axis)?;
        let now = self.now();
        self.axes[at].device.command(now, command);
        Ok(())
    }

    /// How the command that was begun last for the linear `axis` ended; `None` while it runs, and
    /// when it has been asked for.
    ///
    /// # Errors
    /// When there is no such axis.
    pub fn outcome(&mut self, axis: &str) -> Result<Option<Result<(), Failure>>, Failure> {
        let at = self.axis_index(axis)?;
        let outcome = self.axes[at].device.poll_outcome();
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
        let device = self.device_name(at);
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
        self.drive_mut(at).control(now, command);
        self.await_outcome(at, step, limit)
    }

    pub(crate) fn set_sync(&mut self, on: bool) -> Result<(), Failure> {
        for bus in &self.buses {
            let period = on.then_some(bus.sync_period);
            self.transport
                .set_sync(bus.port, period)
                .map_err(|source| Failure::Send {
                    device: format!("SYNC on {}", bus.name),
                    source,
                })?;
        }
        Ok(())
    }

    fn axis(&self, axis: &str) -> Result<&Unit<dyn Axis>, Failure> {
        let at = self.axis_index(axis)?;
        Ok(&self.axes[at])
    }

    pub(crate) fn axis_index(&self, axis: &str) -> Result<usize, Failure> {
        self.axes
            .iter()
            .position(|unit| unit.name == axis)
            .ok_or_else(|| Failure::NoSuchAxis {
                axis: axis.to_owned(),
                known: self.axis_names().join(", "),
            })
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
