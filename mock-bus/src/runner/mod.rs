//! The emulated machine on pseudo-terminals and SocketCAN interfaces.
//!
//! One thread waits for its clients and for the machine's next event. In real time it has absolute
//! deadlines: a late wake-up is caught up, never added, and simulated time is wall time times
//! `speed`. On a clock that it shares with its clients ([`Pace::Lockstep`]) time passes only when
//! nobody has anything left to do.

mod endpoint;
mod event_loop;
pub mod hand;
mod lockstep;
mod peer;
mod pty;
mod slcan_adapter;
mod vcan;
mod visitors;

#[cfg(test)]
mod lockstep_tests;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;
use std::io::{self, PipeReader, PipeWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{self, Receiver, Sender};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

use crate::config::{ConfigError, MachineConfig};
use crate::fault::{FaultConfig, FaultId};
use crate::plant::{HallDrift, LineSetUp};
use crate::simulation::Simulation;
use endpoint::Endpoint;
use event_loop::EventLoop;
use lockstep::Lockstep;
use units::Time;
use visitors::{Door, Visitors};

/// How an emulated machine's time passes.
#[derive(Clone, Debug, PartialEq)]
pub enum Pace {
    /// In real time: so many simulated seconds per real second.
    Wall(f64),
    /// Only when neither the machine nor its clients have anything left to do; they agree over
    /// a Unix socket at this path.
    Lockstep(PathBuf),
}

/// How a machine is run.
#[derive(Clone, Debug)]
pub struct Options {
    /// Seed of the machine's noise and errors.
    pub seed: u64,
    /// How its time passes.
    pub pace: Pace,
    /// Where hands reach it ([`hand`]) while it lives by the wall's clock; a lockstep clock's
    /// side channel serves them too.
    pub control: Option<PathBuf>,
    /// On a lockstep clock: how long a participant may compute or hang while everybody waits for
    /// it; in its own processor time, where it gets any.
    pub patience: Duration,
    /// On a lockstep clock: a participant that ends without taking leave is named, and the next
    /// one goes on with the machine, which ends otherwise.
    pub outlive: bool,
    /// SocketCAN interface for a CAN port, by the port's name; the others speak SLCAN.
    pub interfaces: BTreeMap<String, String>,
    /// Symbolic link to a port's terminal, by the port's name.
    pub links: BTreeMap<String, PathBuf>,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            seed: 0,
            pace: Pace::Wall(1.0),
            control: None,
            patience: Duration::from_secs(10),
            outlive: false,
            interfaces: BTreeMap::new(),
            links: BTreeMap::new(),
        }
    }
}

impl Options {
    fn door(&self) -> Option<&Path> {
        match &self.pace {
            Pace::Wall(_) => self.control.as_deref(),
            Pace::Lockstep(path) => Some(path),
        }
    }
}

/// Everything that a loop runs: the machine, its ports, and who comes by.
struct Site {
    machine: Simulation,
    endpoints: Vec<Endpoint>,
    jobs: Receiver<Job>,
    waker: PipeReader,
    visitors: Visitors,
}

/// Why a machine cannot be run.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The configuration contradicts itself.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// A terminal or an interface cannot be opened.
    #[error("port {port}: {source}")]
    Open {
        /// The port's name.
        port: String,
        /// What the operating system says.
        source: io::Error,
    },
    /// The clock cannot run at this speed.
    #[error("speed {seen}: expected a positive number")]
    Speed {
        /// What was asked for.
        seen: f64,
    },
    /// The socket beside the buses cannot be made.
    #[error("socket {}: {source}; the folder must exist, and no other program may listen there",
        path.display())]
    Door {
        /// Where.
        path: PathBuf,
        /// What the operating system says.
        source: io::Error,
    },
    /// The thread or its wake-up pipe cannot be made.
    #[error("cannot start the emulator's thread: {0}")]
    Start(#[from] io::Error),
    /// The machine has stopped.
    #[error("the emulated machine has stopped")]
    Stopped,
}

type Work = Box<dyn FnOnce(&mut Simulation) + Send>;

enum Job {
    Do(Work),
    Stop,
}

/// How often the computer has paused a machine that runs in real time: what its controller missed
/// then is not a fault of the machine.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pauses {
    /// How many there were.
    pub count: u64,
    /// The last one: when it ended, by the machine's clock, and its length on the wall.
    pub last: Option<(Time, Duration)>,
}

/// A machine that runs on its own thread until it is dropped.
pub struct Running {
    ports: Vec<PathBuf>,
    jobs: Sender<Job>,
    wake: PipeWriter,
    pauses: Arc<Mutex<Pauses>>,
    thread: Option<JoinHandle<io::Result<()>>>,
}

/// Runs the machine with every port on a pseudo-terminal, CAN buses behind SLCAN adapters.
///
/// # Errors
/// When the configuration contradicts itself or a terminal cannot be opened.
///
/// # Example
///
/// ```
/// use mock_bus::config::MachineConfig;
/// use mock_bus::runner::spawn_on_ptys;
///
/// let config = MachineConfig::parse(
///     r#"
///     name = "bench"
///     ports = [{ kind = "serial", name = "adc", baud_bit_per_s = 9600 }]
///     nodes = [{ name = "adc", port = "adc", device = { kind = "dcon_module" } }]
///     "#,
/// )?;
/// let machine = spawn_on_ptys(&config, 7, 1.0)?;
/// assert_eq!(machine.ports().len(), 1, "a terminal for somebody's driver");
/// assert!(machine.ports()[0].exists());
/// machine.stop()?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn spawn_on_ptys(config: &MachineConfig, seed: u64, speed: f64) -> Result<Running, RunError> {
    spawn(
        config,
        &Options {
            seed,
            pace: Pace::Wall(speed),
            ..Options::default()
        },
    )
}

/// Runs the machine with its first CAN bus on a SocketCAN interface, all else on ptys.
///
/// # Errors
/// When the configuration contradicts itself, or the interface or a terminal cannot be opened.
pub fn spawn_on_vcan(
    config: &MachineConfig,
    seed: u64,
    speed: f64,
    interface: &str,
) -> Result<Running, RunError> {
    let can = config.ports.iter().find(|port| port.is_can());
    let interfaces = can.map(|port| (port.name().to_owned(), interface.to_owned()));
    let options = Options {
        seed,
        pace: Pace::Wall(speed),
        interfaces: interfaces.into_iter().collect(),
        ..Options::default()
    };
    spawn(config, &options)
}

/// Runs the machine as `options` say.
///
/// # Errors
/// When the configuration contradicts itself, or an interface or a terminal cannot be opened.
pub fn spawn(config: &MachineConfig, options: &Options) -> Result<Running, RunError> {
    if let Pace::Wall(seen) = options.pace
        && !(seen.is_finite() && seen > 0.0)
    {
        return Err(RunError::Speed { seen });
    }
    // The devices are built on the machine's own thread; this one only proves that they can be.
    Simulation::new(config, options.seed)?;
    let (config, options) = (config.clone(), options.clone());
    let endpoints = open_endpoints(&config, &options)?;
    let ports = paths(&endpoints, &config, &options);
    let door = options.door().map(open_door).transpose()?;
    let (jobs, inbox) = mpsc::channel();
    let (waker, wake) = io::pipe()?;
    let pauses = Arc::<Mutex<Pauses>>::default();
    let noted = Arc::clone(&pauses);
    let thread = std::thread::Builder::new()
        .name("mock-bus".to_owned())
        .spawn(move || {
            let machine = Simulation::new(&config, options.seed).map_err(io::Error::other)?;
            let site = Site {
                machine,
                endpoints,
                jobs: inbox,
                waker,
                visitors: Visitors::new(door),
            };
            match options.pace {
                Pace::Wall(speed) => EventLoop::new(site, speed, noted).run(),
                Pace::Lockstep(_) => Lockstep::new(site, options.patience, options.outlive).run(),
            }
        })?;
    Ok(Running {
        ports,
        jobs,
        wake,
        pauses,
        thread: Some(thread),
    })
}

fn open_door(path: &Path) -> Result<Door, RunError> {
    Door::open(path).map_err(|source| RunError::Door {
        path: path.to_owned(),
        source,
    })
}

fn open_endpoints(config: &MachineConfig, options: &Options) -> Result<Vec<Endpoint>, RunError> {
    let open = |(place, port): (usize, &crate::config::PortConfig)| {
        let interface = options.interfaces.get(port.name()).map(String::as_str);
        let link = options.links.get(port.name()).map(PathBuf::as_path);
        Endpoint::open(place, port, interface, link).map_err(|source| RunError::Open {
            port: port.name().to_owned(),
            source,
        })
    };
    config.ports.iter().enumerate().map(open).collect()
}

fn paths(endpoints: &[Endpoint], config: &MachineConfig, options: &Options) -> Vec<PathBuf> {
    let interface = |name: &str| options.interfaces.get(name).map(PathBuf::from);
    endpoints
        .iter()
        .zip(&config.ports)
        .map(|(endpoint, port)| match endpoint.path() {
            Some(path) => path.to_owned(),
            None => interface(port.name()).unwrap_or_default(),
        })
        .collect()
}

impl Running {
    /// For each port of the configuration the terminal's path, or the interface's name.
    pub fn ports(&self) -> &[PathBuf] {
        &self.ports
    }

    /// Does something with the machine on its thread, and gives back what came of it.
    ///
    /// # Errors
    /// When the machine has stopped.
    pub fn with<R: Send + 'static>(
        &self,
        work: impl FnOnce(&mut Simulation) -> R + Send + 'static,
    ) -> Result<R, RunError> {
        let (answer, result) = mpsc::channel();
        let work: Work = Box::new(move |machine| {
            // Whoever asked may have gone; then nobody wants the answer.
            let _ = answer.send(work(machine));
        });
        self.jobs
            .send(Job::Do(work))
            .map_err(|_| RunError::Stopped)?;
        self.wake_up();
        result.recv().map_err(|_| RunError::Stopped)
    }

    /// Adds a fault; its times count from now.
    ///
    /// # Errors
    /// When it names what is not there, or the machine has stopped.
    pub fn inject(&self, fault: FaultConfig) -> Result<FaultId, RunError> {
        Ok(self.with(move |machine| machine.inject(fault))??)
    }

    /// Ends a fault now.
    ///
    /// # Errors
    /// When the machine has stopped.
    pub fn end_fault(&self, fault: FaultId) -> Result<(), RunError> {
        self.with(move |machine| machine.end_fault(fault))
    }

    /// How often a fault has really happened.
    ///
    /// # Errors
    /// When the machine has stopped.
    pub fn fault_deliveries(&self, fault: FaultId) -> Result<u64, RunError> {
        self.with(move |machine| machine.fault_deliveries(fault))
    }

    /// Switches the mains off and on again; see [`Simulation::power_cycle`].
    ///
    /// # Errors
    /// When the machine has stopped.
    pub fn power_cycle(&self, drift: HallDrift) -> Result<(), RunError> {
        self.with(move |machine| machine.power_cycle(drift))
    }

    /// Turns the table's plate by so many lines; see [`Simulation::turn_plate`].
    ///
    /// # Errors
    /// When the machine has stopped.
    pub fn turn_plate(&self, lines: f64) -> Result<(), RunError> {
        self.with(move |machine| machine.turn_plate(lines))
    }

    /// Sets a laser up along a line; see [`Simulation::set_up_line`].
    ///
    /// # Errors
    /// When the machine has stopped.
    pub fn set_up_line(&self, set_up: LineSetUp) -> Result<(), RunError> {
        self.with(move |machine| machine.set_up_line(&set_up))
    }

    /// Packs the laser up again; see [`Simulation::take_line_away`].
    ///
    /// # Errors
    /// When the machine has stopped.
    pub fn take_line_away(&self) -> Result<(), RunError> {
        self.with(Simulation::take_line_away)
    }

    /// How often the computer has held it up so far.
    pub fn pauses(&self) -> Pauses {
        *self.pauses.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Whether the machine has come to an end by itself; [`Running::stop`] says why.
    pub fn has_ended(&self) -> bool {
        self.thread.as_ref().is_none_or(JoinHandle::is_finished)
    }

    /// Stops the machine and waits for its end.
    ///
    /// # Errors
    /// When it had to stop before, because a terminal or interface failed.
    pub fn stop(mut self) -> io::Result<()> {
        self.end()
    }

    fn end(&mut self) -> io::Result<()> {
        let Some(thread) = self.thread.take() else {
            return Ok(());
        };
        // Both fail only when the thread has ended already.
        let _ = self.jobs.send(Job::Stop);
        self.wake_up();
        match thread.join() {
            Ok(result) => result,
            Err(panic) => std::panic::resume_unwind(panic),
        }
    }

    /// What the machine ended by, of itself.
    #[cfg(test)]
    fn thread_result(mut self) -> io::Result<()> {
        let thread = self.thread.take().expect("it was not stopped");
        thread.join().expect("it does not panic")
    }

    fn wake_up(&self) {
        let _ = (&self.wake).write_all(&[0]);
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        if !std::thread::panicking() {
            // Nobody is left to hear of a failure.
            let _ = self.end();
        }
    }
}
