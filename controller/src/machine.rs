//! One machine: its devices, its transport, and what is known about its axes.
//!
//! The machine is driven by plain sequential procedures (the `cycle` folder) that call
//! [`Machine::tick`]; every wait of every procedure is that one function, so supervision,
//! heartbeats and the stop request hold at every moment, on real buses and in virtual time
//! alike (docs/decisions/0001).

use core::time::Duration;
use std::collections::{BTreeMap, BTreeSet};

use compensator::apply::ApproachTracker;
use compensator::error_table::Compensation;
use drivers::device::{
    AnalogInput, Axis, AxisCommand, AxisReading, DisplacementInstrument, DriveCommand,
    PoseInstrument, RotaryAxis,
};
use drivers::protocol::heartbeat::HeartbeatProducer;
use drivers::transport::Transport;
use units::{Metres, Time};
use wire::Port;
use wire::cia402::PowerState;

use crate::assemble;
use crate::bus_watch::BusWatch;
use crate::camera;
use crate::config::{AxisConfig, ConfigHash, Loaded, MachineConfig};
use crate::cycle::platform::PlatformState;
use crate::cycle::rotary::TableInUse;
use crate::cycle::{Datum, RunPlan};
use crate::failure::Failure;
use crate::host_watch::HostWatch;
use crate::observer::{Observer, Silent};
use crate::outbox::Outbox;
use crate::patience::Patience;
pub use crate::stop_request::StopRequest;
use crate::unit::Unit;

/// What is known about an axis beyond what its drive says.
#[derive(Default)]
pub(crate) struct AxisMemory {
    /// Zeroed by the Hall sensors since the drive was last powered.
    pub(crate) zeroed: bool,
    /// The calibration in use.
    pub(crate) compensation: Option<Compensation>,
    /// What was measured last, and how lengths were corrected since its datum.
    pub(crate) datum: Option<(RunPlan, Datum)>,
    /// The direction of the last motion.
    pub(crate) approach: ApproachTracker,
}

/// What is known about a rotary axis beyond what its drive says.
#[derive(Default)]
pub(crate) struct RotaryMemory {
    /// Zeroed on the index mark since the drive was last powered.
    pub(crate) zeroed: bool,
    /// The calibration in use.
    pub(crate) calibration: Option<TableInUse>,
    /// Where the plate was read last, in lines; `None` when somebody may have turned it since.
    pub(crate) plate_at: Option<f64>,
}

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
pub struct Machine {
    pub(crate) config: MachineConfig,
    pub(crate) config_hash: ConfigHash,
    pub(crate) patience: Patience,
    pub(crate) transport: Box<dyn Transport>,
    pub(crate) outbox: Outbox,
    pub(crate) port_names: BTreeMap<Port, String>,
    pub(crate) axes: Vec<Unit<dyn Axis>>,
    pub(crate) rotaries: Vec<Unit<dyn RotaryAxis>>,
    pub(crate) analogs: Vec<Unit<dyn AnalogInput>>,
    pub(crate) instruments: Vec<Unit<dyn DisplacementInstrument>>,
    pub(crate) cameras: Vec<Unit<dyn PoseInstrument>>,
    pub(crate) heartbeats: Vec<(Port, HeartbeatProducer)>,
    pub(crate) memory: BTreeMap<String, AxisMemory>,
    pub(crate) rotary_memory: BTreeMap<String, RotaryMemory>,
    pub(crate) platform: Option<PlatformState>,
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
    /// Lets all that is moved cyclically ask for SCHED_FIFO and locked memory
    /// ([`Engine::in_real_time`](crate::engine::Engine::in_real_time)). Not for simulated time, which
    /// passes as fast as the computer goes.
    pub const fn in_real_time(&mut self) {
        self.real_time = true;
    }

    /// A machine over `transport`, whose ports are numbered as [`assemble::ports`] says.
    /// Nothing is sent yet.
    pub fn new(loaded: &Loaded, transport: Box<dyn Transport>) -> Self {
        let config = loaded.config.clone();
        let ports = assemble::ports(&config);
        Self {
            axes: assemble::axes(&config, &ports, loaded.patience),
            rotaries: assemble::rotaries(&config, &ports, loaded.patience),
            analogs: assemble::analogs(&config, &ports, loaded.patience),
            instruments: assemble::instruments(&config, &ports, loaded.patience),
            cameras: camera::cameras(&config, &ports, loaded.patience),
            heartbeats: assemble::heartbeats(&config, &ports),
            bus_watch: BusWatch::new(&config, &ports),
            host_watch: HostWatch::default(),
            memory: config
                .axis
                .keys()
                .map(|name| (name.clone(), AxisMemory::default()))
                .collect(),
            rotary_memory: BTreeMap::new(),
            port_names: ports.into_iter().map(|(name, port)| (port, name)).collect(),
            config_hash: loaded.hash.clone(),
            patience: loaded.patience,
            platform: PlatformState::of(&config),
            config,
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

    /// Who is told about progress.
    pub fn observe(&mut self, observer: Box<dyn Observer>) {
        self.observer = observer;
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

    /// The configuration.
    pub const fn config(&self) -> &MachineConfig {
        &self.config
    }

    /// Of what a calibration depends on.
    pub const fn config_hash(&self) -> &ConfigHash {
        &self.config_hash
    }

    /// The names of the axes.
    pub fn axis_names(&self) -> Vec<String> {
        self.axes.iter().map(|unit| unit.name.clone()).collect()
    }

    /// The configuration of `axis`.
    ///
    /// # Errors
    /// When there is no such axis.
    pub fn axis_config(&self, axis: &str) -> Result<&AxisConfig, Failure> {
        self.config
            .axis
            .get(axis)
            .ok_or_else(|| Failure::NoSuchAxis {
                axis: axis.to_owned(),
                known: self.axis_names().join(", "),
            })
    }

    /// Whether `axis` was zeroed since its drive was last powered.
    pub fn is_zeroed(&self, axis: &str) -> bool {
        self.memory.get(axis).is_some_and(|memory| memory.zeroed)
            && self.axis(axis).is_ok_and(|unit| unit.device.is_homed())
    }

    /// Coordinates mean something only after the zero.
    pub(crate) fn require_zeroed(&self, axis: &str) -> Result<(), Failure> {
        if self.is_zeroed(axis) {
            return Ok(());
        }
        Err(Failure::NotZeroed {
            axis: axis.to_owned(),
        })
    }

    /// The calibration `axis` uses now.
    pub fn compensation(&self, axis: &str) -> Option<&Compensation> {
        self.memory.get(axis)?.compensation.as_ref()
    }

    /// Uses `compensation` (or none) for every move of `axis` from now on.
    ///
    /// # Errors
    /// When there is no such axis.
    pub fn set_compensation(
        &mut self,
        axis: &str,
        compensation: Option<Compensation>,
    ) -> Result<(), Failure> {
        self.axis_config(axis)?;
        self.remember(axis).compensation = compensation;
        Ok(())
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
        for memory in self.memory.values_mut() {
            memory.zeroed = false;
            memory.approach.forget();
        }
        for memory in self.rotary_memory.values_mut() {
            memory.zeroed = false;
        }
        if let Some(platform) = &mut self.platform {
            platform.forget();
        }
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

    /// Starts an instrument, unless it runs already (its datum stands then), and counts its
    /// alarms from now on.
    pub(crate) fn use_instrument(&mut self, name: &str) -> Result<(), Failure> {
        self.use_device(self.instrument_device(self.instrument_index(name)), name)
    }

    /// The same for device number `at`, an instrument or a camera called `name`.
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

    /// Gives `command` to `axis` and waits until it is done.
    pub(crate) fn command(
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
        for (port, name) in &self.port_names {
            let Some(bus) = self.config.can.get(name) else {
                continue;
            };
            let period = on.then(|| Duration::from_secs_f64(bus.sync_period_ms * 1e-3));
            self.transport
                .set_sync(*port, period)
                .map_err(|source| Failure::Send {
                    device: format!("SYNC on {name}"),
                    source,
                })?;
        }
        Ok(())
    }

    pub(crate) fn remember(&mut self, axis: &str) -> &mut AxisMemory {
        self.memory.entry(axis.to_owned()).or_default()
    }

    pub(crate) fn axis(&self, axis: &str) -> Result<&Unit<dyn Axis>, Failure> {
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

    /// Where `axis` should be sent so that the point arrives at `target`.
    pub(crate) fn soft_limits(&self, axis: &str) -> Result<(Metres, Metres), Failure> {
        let config = self.axis_config(axis)?;
        Ok((
            Metres::from_mm(config.soft_min_mm),
            Metres::from_mm(config.soft_max_mm),
        ))
    }
}

/// The longest a stop may take before the next drive is tried.
pub(crate) const STOP_LIMIT: Duration = Duration::from_secs(2);
