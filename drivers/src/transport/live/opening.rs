//! Opening live ports: what is opened, step by step, and why that can fail.

use std::path::Path;

use nix::poll::{PollFd, ppoll};
use nix::sys::time::TimeSpec;
use wire::Port;

use super::super::clock::Clock;
use super::super::lockstep::LockstepError;
use super::super::serial::{SerialError, SerialLine, SerialSettings};
use super::super::slcan::{SlcanFailure, SlcanPort, SlcanSettings};
use super::super::socketcan::{self, CanPort};
use super::{Live, LivePort, Slot, WAIT_MAX, WAITED_MAX, interest};

/// Why a port could not be opened.
#[derive(Debug, thiserror::Error)]
pub enum OpenError {
    /// No network interface of that name.
    #[error(
        "CAN interface {interface}: does not exist; `ip link` lists what there is, \
         `ip link add dev {interface} type vcan && ip link set {interface} up` makes a \
         virtual one"
    )]
    NoInterface {
        /// Its name.
        interface: String,
    },
    /// The kernel was built without CAN.
    #[error(
        "CAN interface {interface}: this kernel has no CAN sockets; try `modprobe can_raw`, \
         or use an SLCAN adapter"
    )]
    NoCan {
        /// Its name.
        interface: String,
    },
    /// Opening or setting up the CAN socket failed otherwise.
    #[error("CAN interface {interface}: {source}")]
    Can {
        /// Its name.
        interface: String,
        /// What the operating system said.
        source: std::io::Error,
    },
    /// The serial port could not be opened.
    #[error("{path}: {source}; {help}")]
    Serial {
        /// The device's path.
        path: String,
        /// What the operating system said.
        source: std::io::Error,
        /// What to do about it.
        help: &'static str,
    },
    /// The CAN adapter has no code for the bit rate.
    #[error(
        "{path}: SLCAN knows no bit rate of {bitrate} bit/s; it has 10, 20, 50, 100, 125, \
         250, 500, 800 and 1000 kbit/s"
    )]
    Bitrate {
        /// The device's path.
        path: String,
        /// The bit rate asked for.
        bitrate: u32,
    },
    /// The SLCAN adapter did not do what it was told.
    #[error("{path}: SLCAN adapter {failure}")]
    Slcan {
        /// The device's path.
        path: String,
        /// What went wrong.
        failure: SlcanFailure,
    },
    /// More ports than one thread waits for.
    #[error("more than {limit} CAN buses and serial lines: give some to another process")]
    TooManyPorts {
        /// How many there may be.
        limit: usize,
    },
    /// The clock that both ends share does not know the port.
    #[error(transparent)]
    Lockstep(#[from] LockstepError),
    /// Two ports have the same number.
    #[error("port {}: given twice", port.0)]
    DuplicatePort {
        /// The number.
        port: Port,
    },
}

impl OpenError {
    pub(in super::super) fn serial(path: &str, error: SerialError) -> Self {
        Self::Serial {
            path: path.to_owned(),
            source: error.source,
            help: error.help,
        }
    }
}

enum Plan {
    SocketCan(String),
    Slcan(String, SlcanSettings),
    Serial(String, SerialSettings),
}

/// What to open; see [`Live::builder`].
pub struct LiveBuilder {
    clock: Clock,
    plans: Vec<(Port, Plan)>,
}

impl LiveBuilder {
    /// A CAN interface of the kernel, such as `can0` or `vcan0`.
    #[must_use]
    pub fn socketcan(mut self, port: Port, interface: &str) -> Self {
        self.plans
            .push((port, Plan::SocketCan(interface.to_owned())));
        self
    }

    /// A CAN adapter that speaks SLCAN over a serial line or pty.
    #[must_use]
    pub fn slcan(mut self, port: Port, path: impl AsRef<Path>, settings: SlcanSettings) -> Self {
        self.plans.push((port, Plan::Slcan(text(path), settings)));
        self
    }

    /// A serial line.
    #[must_use]
    pub fn serial(mut self, port: Port, path: impl AsRef<Path>, settings: SerialSettings) -> Self {
        self.plans.push((port, Plan::Serial(text(path), settings)));
        self
    }

    /// Opens all of them.
    ///
    /// # Errors
    /// The first port that cannot be opened, its cause and what to do.
    pub fn build(self) -> Result<Live, OpenError> {
        let mut live = Live::without_ports(self.clock);
        for (port, plan) in self.plans {
            live.open(port, &plan)?;
        }
        Ok(live)
    }
}

fn text(path: impl AsRef<Path>) -> String {
    path.as_ref().to_string_lossy().into_owned()
}

impl Plan {
    /// Opens it; an adapter's start has begun then.
    fn open(&self, clock: Clock, port: Port) -> Result<Box<dyn LivePort>, OpenError> {
        Ok(match self {
            Self::SocketCan(interface) => Box::new(
                CanPort::open(clock, port, interface)
                    .map_err(|error| socketcan::open_error(interface.clone(), error))?,
            ),
            Self::Slcan(path, settings) => Box::new(SlcanPort::open(clock, port, path, *settings)?),
            Self::Serial(path, settings) => Box::new(
                SerialLine::open(clock, port, path, *settings)
                    .map_err(|error| OpenError::serial(path, error))?,
            ),
        })
    }

    /// What the other end of a shared clock knows it by.
    fn endpoint(&self) -> String {
        match self {
            Self::SocketCan(interface) => interface.clone(),
            Self::Slcan(path, _) | Self::Serial(path, _) => {
                std::fs::canonicalize(path).map_or_else(|_| path.clone(), text)
            }
        }
    }
}

impl Live {
    /// Begins the list of ports to open.
    pub const fn builder(clock: Clock) -> LiveBuilder {
        LiveBuilder {
            clock,
            plans: Vec::new(),
        }
    }

    fn open(&mut self, port: Port, plan: &Plan) -> Result<(), OpenError> {
        if self.ports.len() == WAITED_MAX {
            return Err(OpenError::TooManyPorts { limit: WAITED_MAX });
        }
        if self.index.insert(port, self.ports.len()).is_some() {
            return Err(OpenError::DuplicatePort { port });
        }
        let live = plan.open(self.clock.clone(), port)?;
        self.ports.push(Slot {
            port,
            live,
            ready: false,
            sync: None,
        });
        self.attach(port, &plan.endpoint())?;
        self.wait_for_start().map_err(|failure| OpenError::Slcan {
            path: plan.endpoint(),
            failure,
        })
    }

    /// Lets the port that was opened last finish its start; ends because every step of it has a
    /// deadline.
    fn wait_for_start(&mut self) -> Result<(), SlcanFailure> {
        loop {
            let Some(slot) = self.ports.last_mut() else {
                return Ok(());
            };
            if let Some(result) = slot.live.start_result() {
                return result;
            }
            let next = slot.live.next_event();
            if self.keeps_step() {
                self.step(next);
                continue;
            }
            let Some(slot) = self.ports.last_mut() else {
                return Ok(());
            };
            let ready = wait_one(&self.clock, &*slot.live);
            // Frames cannot come before the channel is open; link reports can wait.
            slot.live.progress(self.clock.now(), ready);
        }
    }
}

fn wait_one(clock: &Clock, port: &dyn LivePort) -> bool {
    let Some(descriptor) = port.descriptor() else {
        return false;
    };
    let mut descriptors = [PollFd::new(descriptor, interest(port))];
    let timeout = clock.until(port.next_event()).min(WAIT_MAX);
    matches!(
        ppoll(&mut descriptors, Some(TimeSpec::from(timeout)), None),
        Ok(count) if count > 0
    )
}
