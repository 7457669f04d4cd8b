//! Opening live ports: what is opened, step by step, and why that can fail.

use std::path::Path;

use nix::poll::{PollFd, ppoll};
use nix::sys::time::TimeSpec;
use wire::{Port, Ports};

use super::super::clock::Clock;
use super::super::live_port::LivePort;
use super::super::open_error::OpenError;
use super::super::serial::{SerialLine, SerialSettings};
use super::super::slcan::{SlcanFailure, SlcanPort, SlcanSettings};
use super::super::socketcan::{self, CanPort};
use super::{Live, Slot, WAIT_MAX, WAITED_MAX, interest};

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
    ///
    /// # Example
    ///
    /// ```no_run
    /// use drivers::transport::Transport;
    /// use drivers::transport::clock::Clock;
    /// use drivers::transport::live::{Live, SerialSettings};
    /// use units::Time;
    /// use wire::{Payload, Port};
    ///
    /// let mut ports = Live::builder(Clock::real())
    ///     .socketcan(Port(0), "can0")
    ///     .serial(Port(1), "/dev/ttyUSB0", SerialSettings::new(9_600))
    ///     .build()?;
    /// ports.send(Port(1), &Payload::Bytes(b"#01\r".to_vec()))?;
    /// while let Some(arrival) = ports.receive(Time::from_seconds(1.0)) {
    ///     assert!(arrival.port <= Port(1));
    /// }
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
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
                self.step(next, Ports::NONE);
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
