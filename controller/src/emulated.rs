//! Emulated machines for demonstrations and for anybody's tests: in virtual time in this
//! process, or on pseudo-terminals and SocketCAN in real (or scaled) time.
//!
//! This module is the only one of the package that knows `mock-bus` (the layout test checks
//! it): nothing of the emulator's truth can reach a procedure.

mod error;

use std::cell::{Ref, RefCell, RefMut};
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::rc::Rc;

use drivers::transport::SendError;
use drivers::transport::in_process::{InProcess, World};
use mock_bus::config::MachineConfig as EmulatedConfig;
use mock_bus::plant::{LineOptics as EmulatedOptics, LineSetUp};
use mock_bus::runner::{self, Options, RunError, Running};
use mock_bus::simulation::{DeliverError, Event, Link, Simulation};
use tempfile::TempDir;
use units::Time;
use wire::{Arrival, Input, LinkState, Payload, Port};

use crate::assemble;
use crate::config::MachineConfig;
use crate::failure::Failure;
use crate::ports::{self, Endpoint, Overrides};
use crate::volumetric::{LineOperator, LineOptics, LineTask};
use compensator::volumetric::{Axis, Point};

pub use error::EmulatedError;
pub use mock_bus::plant::HallDrift;

#[cfg(feature = "program")]
pub(crate) use mock_bus::plant::DriftLimits;

/// A simulated machine in virtual time, shared by a transport and whoever injects faults,
/// cycles its power or judges by its truth.
#[derive(Clone)]
pub struct Emulated {
    simulation: Rc<RefCell<Simulation>>,
    /// The controller's port numbers to the simulation's.
    ports: BTreeMap<Port, Port>,
    /// The controller's, by the place of the simulation's: asked for with everything that arrives.
    hosts: Vec<Option<Port>>,
}

impl Emulated {
    /// The machine that `toml` describes, with the noise and errors of `seed`, for a
    /// controller configured by `config`.
    ///
    /// ```
    /// use truestage::emulated::Emulated;
    /// use truestage::{Failure, Machine, config};
    /// use units::Metres;
    ///
    /// let machine = include_str!("../../configs/machines/linear.toml");
    /// let stage = include_str!("../../configs/emulated/linear.toml");
    /// let loaded = config::parse(machine, "linear.toml")?;
    /// let emulated = Emulated::new(stage, 7, &loaded.config)?;
    /// let mut machine = Machine::new(&loaded, Box::new(emulated.transport()));
    /// let refused = machine.guarded(|machine| {
    ///     machine.start()?;
    ///     machine.linear("x")?.move_to(Metres::from_mm(10.0))
    /// });
    /// let Err(failure) = refused else { panic!("it has no origin yet") };
    /// assert!(failure.to_string().contains("zero"), "{failure}");
    /// # Ok::<(), Failure>(())
    /// ```
    ///
    /// # Errors
    /// When the description is wrong or lacks a port.
    pub fn new(toml: &str, seed: u64, config: &MachineConfig) -> Result<Self, EmulatedError> {
        Self::with_config(&EmulatedConfig::parse(toml)?, seed, config)
    }

    /// The same of a description that has been read.
    ///
    /// # Errors
    /// When the description is wrong or lacks a port.
    pub fn with_config(
        emulated: &EmulatedConfig,
        seed: u64,
        config: &MachineConfig,
    ) -> Result<Self, EmulatedError> {
        let ports = match_ports(emulated, config)?;
        let simulation = Simulation::new(emulated, seed)?;
        let mut hosts = vec![None; emulated.ports.len()];
        for (host, simulated) in &ports {
            hosts[usize::from(simulated.0)] = Some(*host);
        }
        Ok(Self {
            simulation: Rc::new(RefCell::new(simulation)),
            ports,
            hosts,
        })
    }

    /// A transport to this machine.
    pub fn transport(&self) -> InProcess<Self> {
        InProcess::new(self.clone())
    }

    /// The simulation, to look at.
    pub fn simulation(&self) -> Ref<'_, Simulation> {
        self.simulation.borrow()
    }

    /// The simulation, to meddle with.
    pub fn simulation_mut(&self) -> RefMut<'_, Simulation> {
        self.simulation.borrow_mut()
    }

    /// As [`EmulatedOnPtys::power_cycle`].
    pub fn power_cycle(&self, drift: HallDrift) {
        self.simulation_mut().power_cycle(drift);
    }

    /// As [`EmulatedOnPtys::turn_plate`].
    pub fn turn_plate(&self, lines: f64) {
        self.simulation_mut().turn_plate(lines);
    }

    fn host_port(&self, simulated: Port) -> Option<Port> {
        self.hosts.get(usize::from(simulated.0)).copied().flatten()
    }
}

/// Controller port to simulation port, by name.
fn match_ports(
    emulated: &EmulatedConfig,
    config: &MachineConfig,
) -> Result<BTreeMap<Port, Port>, EmulatedError> {
    assemble::ports(config)
        .into_iter()
        .map(|(name, port)| {
            let place = emulated
                .port(&name)
                .ok_or_else(|| no_port(&name, emulated))?;
            let place = u8::try_from(place).expect("a machine has fewer than 256 ports");
            Ok((port, Port(place)))
        })
        .collect()
}

/// A simulated machine on pseudo-terminals, living in a thread of its own; its first CAN bus
/// can be on a SocketCAN interface instead.
pub struct EmulatedOnPtys {
    config: EmulatedConfig,
    running: Running,
    /// The SocketCAN interface, and the place of the port that is on it.
    interface: Option<(usize, String)>,
    time: EmulatedTime,
}

/// How the time of a machine on pseudo-terminals passes.
enum EmulatedTime {
    Wall(f64),
    /// The side channel's folder goes with it.
    Lockstep(TempDir),
}

impl EmulatedOnPtys {
    /// The machine that `toml` describes, `speed` times faster than the wall's clock.
    ///
    /// # Errors
    /// When the description is wrong or pseudo-terminals cannot be had.
    pub fn start(toml: &str, seed: u64, speed: f64) -> Result<Self, EmulatedError> {
        Self::start_on(toml, seed, EmulatedTime::Wall(speed), None)
    }

    /// The same with the first CAN bus on the SocketCAN interface `name` (`vcan0`, say).
    ///
    /// # Errors
    /// When the description is wrong, or the interface or pseudo-terminals cannot be had.
    pub fn start_on_socketcan(
        toml: &str,
        seed: u64,
        speed: f64,
        name: &str,
    ) -> Result<Self, EmulatedError> {
        Self::start_on(toml, seed, EmulatedTime::Wall(speed), Some(name))
    }

    /// The machine that `toml` describes, on a clock that it shares with its controller: frames
    /// and bytes pass the kernel, time passes only when neither has anything left to do.
    /// Nothing depends on how fast or how busy the computer is: one seed is one log.
    ///
    /// # Errors
    /// When the description is wrong, or pseudo-terminals, or a socket in the folder for
    /// temporary files, cannot be had.
    pub fn in_lockstep(toml: &str, seed: u64) -> Result<Self, EmulatedError> {
        Self::start_on(toml, seed, side_channel()?, None)
    }

    /// The same with the first CAN bus on the SocketCAN interface `name` (`vcan0`, say).
    ///
    /// # Errors
    /// As [`EmulatedOnPtys::in_lockstep`], or when the interface cannot be had.
    pub fn in_lockstep_on_socketcan(
        toml: &str,
        seed: u64,
        name: &str,
    ) -> Result<Self, EmulatedError> {
        Self::start_on(toml, seed, side_channel()?, Some(name))
    }

    fn start_on(
        toml: &str,
        seed: u64,
        time: EmulatedTime,
        interface: Option<&str>,
    ) -> Result<Self, EmulatedError> {
        let config = EmulatedConfig::parse(toml)?;
        let place = config.ports.iter().position(|port| port.is_can());
        let interface = place.zip(interface.map(str::to_owned));
        let options = Options {
            seed,
            pace: match &time {
                EmulatedTime::Wall(speed) => runner::Pace::Wall(*speed),
                EmulatedTime::Lockstep(folder) => runner::Pace::Lockstep(socket_in(folder)),
            },
            interfaces: interface
                .iter()
                .map(|(place, name)| (config.ports[*place].name().to_owned(), name.clone()))
                .collect(),
            ..Options::default()
        };
        Ok(Self {
            running: runner::spawn(&config, &options)?,
            config,
            interface,
            time,
        })
    }

    /// The time that its controller lives by; `name` is what the emulator calls it.
    ///
    /// # Errors
    /// When the machine's thread has ended.
    pub fn pace(&self, name: &str) -> Result<ports::Pace, Failure> {
        match &self.time {
            EmulatedTime::Wall(speed) => Ok(ports::Pace::Wall(*speed)),
            EmulatedTime::Lockstep(folder) => ports::Pace::lockstep(&socket_in(folder), name),
        }
    }

    /// Where its side channel is, for programs that are given it as `--clock lockstep:PATH`;
    /// `None` where time is the wall's.
    pub fn clock(&self) -> Option<PathBuf> {
        match &self.time {
            EmulatedTime::Wall(_) => None,
            EmulatedTime::Lockstep(folder) => Some(socket_in(folder)),
        }
    }

    /// Where a controller configured by `config` finds its buses and lines.
    ///
    /// # Errors
    /// When the machine lacks one of them.
    pub fn overrides(&self, config: &MachineConfig) -> Result<Overrides, EmulatedError> {
        let mut overrides = Overrides::default();
        for name in assemble::ports(config).into_keys() {
            let place = self
                .config
                .port(&name)
                .ok_or_else(|| no_port(&name, &self.config))?;
            overrides.set(&name, self.endpoint(place));
        }
        Ok(overrides)
    }

    fn endpoint(&self, place: usize) -> Endpoint {
        let path = self.running.ports()[place].clone();
        match &self.interface {
            Some((on_it, name)) if *on_it == place => Endpoint::SocketCan(name.clone()),
            _ if self.config.ports[place].is_can() => Endpoint::Slcan(path),
            _ => Endpoint::Serial(path),
        }
    }

    /// A line for each port: its name and its path.
    pub fn description(&self) -> Vec<String> {
        let ports = self
            .config
            .ports
            .iter()
            .zip(self.running.ports())
            .enumerate();
        ports
            .map(|(place, (port, path))| {
                let kind = match self.endpoint(place) {
                    Endpoint::SocketCan(_) => "SocketCAN",
                    Endpoint::Slcan(_) => "SLCAN",
                    Endpoint::Serial(_) => "serial",
                };
                format!("{:<8} {kind:<6} {}", port.name(), path.display())
            })
            .collect()
    }

    /// The running machine, to inject faults into and to look at.
    pub const fn running(&self) -> &Running {
        &self.running
    }

    /// The mains goes off now and comes back by itself; the Hall sensors drift to `drift`.
    ///
    /// # Errors
    /// When the machine's thread has ended.
    pub fn power_cycle(&self, drift: HallDrift) -> Result<(), EmulatedError> {
        Ok(self.running.power_cycle(drift)?)
    }

    /// Somebody turns the plate on the rotary table by so many lines and fixes it again.
    ///
    /// # Errors
    /// When the machine's thread has ended.
    pub fn turn_plate(&self, lines: f64) -> Result<(), EmulatedError> {
        Ok(self.running.turn_plate(lines)?)
    }

    /// Somebody mounts the moving optic of `task` and sets the laser up along its line, from where the
    /// machine stands.
    ///
    /// # Errors
    /// When the machine's thread has ended.
    pub fn set_up_line(&self, task: &LineTask) -> Result<(), EmulatedError> {
        Ok(self.running.set_up_line(line_set_up(task))?)
    }

    /// Somebody packs laser and optics up again.
    ///
    /// # Errors
    /// When the machine's thread has ended.
    pub fn take_line_away(&self) -> Result<(), EmulatedError> {
        Ok(self.running.take_line_away()?)
    }
}

fn side_channel() -> Result<EmulatedTime, EmulatedError> {
    let folder = tempfile::Builder::new().prefix("truestage").tempdir();
    Ok(EmulatedTime::Lockstep(folder.map_err(RunError::Start)?))
}

fn socket_in(folder: &TempDir) -> PathBuf {
    folder.path().join("clock")
}

/// What the hand does when it is asked for a line.
fn line_set_up(task: &LineTask) -> LineSetUp {
    let metres = |point: Point| [point.x, point.y, point.z];
    let way = metres(task.end - task.start);
    let unit = |axis: Axis| Axis::ALL.map(|it| f64::from(u8::from(it == axis)));
    LineSetUp {
        optics: match task.optics {
            LineOptics::Linear => EmulatedOptics::Linear,
            LineOptics::Straightness { across } => EmulatedOptics::Straightness {
                across: unit(across),
            },
            LineOptics::Angular { about } => EmulatedOptics::Angular { about: unit(about) },
        },
        along: way.map(|it| it.value()),
        tool_offset: metres(task.tool),
    }
}

/// The emulated machine's own hand, at once.
impl LineOperator for Emulated {
    fn ask_line(&mut self, task: &LineTask) -> Result<(), Failure> {
        self.simulation_mut().set_up_line(&line_set_up(task));
        Ok(())
    }

    fn is_set_up(&mut self) -> Result<bool, Failure> {
        Ok(true)
    }

    fn pack_up(&mut self) -> Result<(), Failure> {
        self.simulation_mut().take_line_away();
        Ok(())
    }
}

/// Likewise on pseudo-terminals.
impl LineOperator for &EmulatedOnPtys {
    fn ask_line(&mut self, task: &LineTask) -> Result<(), Failure> {
        Ok(self.set_up_line(task)?)
    }

    fn is_set_up(&mut self) -> Result<bool, Failure> {
        Ok(true)
    }

    fn pack_up(&mut self) -> Result<(), Failure> {
        Ok(self.take_line_away()?)
    }
}

fn no_port(name: &str, emulated: &EmulatedConfig) -> EmulatedError {
    let known: Vec<_> = emulated.ports.iter().map(|port| port.name()).collect();
    EmulatedError::NoPort {
        name: name.to_owned(),
        known: known.join(", "),
    }
}

impl World for Emulated {
    fn now(&self) -> Time {
        self.simulation.borrow().now()
    }

    fn next_event(&self) -> Time {
        self.simulation.borrow().next_event()
    }

    fn advance(&mut self, to: Time) {
        self.simulation.borrow_mut().advance(to);
    }

    fn advance_until_arrival(&mut self, to: Time) -> Time {
        let mut simulation = self.simulation.borrow_mut();
        simulation.advance_until_delivery(to);
        simulation.now()
    }

    fn deliver(&mut self, at: Time, port: Port, payload: &Payload) -> Result<(), SendError> {
        let inner = *self.ports.get(&port).ok_or(SendError::WrongKind { port })?;
        self.simulation
            .borrow_mut()
            .deliver(at, inner, payload)
            .map_err(|error| match error {
                DeliverError::NoPort { .. } | DeliverError::WrongKind { .. } => {
                    SendError::WrongKind { port }
                }
                DeliverError::Unusable { link, .. } => SendError::Unusable {
                    port,
                    state: link_state(link),
                },
                DeliverError::QueueFull { .. } => SendError::QueueFull { port },
            })
    }

    fn collect(&mut self) -> Option<Arrival> {
        loop {
            let delivery = self.simulation.borrow_mut().collect()?;
            // A line that the controller's configuration does not use is nobody's business.
            let Some(port) = self.host_port(delivery.port) else {
                continue;
            };
            let input = match delivery.event {
                Event::Payload(payload) => Input::Payload(payload),
                Event::BusError(error) => Input::BusError(error),
                Event::Link(link) => Input::Link(link_state(link)),
            };
            return Some(Arrival {
                port,
                at: delivery.at,
                input,
            });
        }
    }
}

const fn link_state(link: Link) -> LinkState {
    match link {
        Link::Up => LinkState::Up,
        Link::Down => LinkState::Down,
        Link::Gone => LinkState::Gone,
    }
}
