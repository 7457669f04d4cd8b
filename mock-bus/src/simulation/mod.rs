//! Nodes, plant, buses and faults in one virtual time.
//!
//! Events happen in time order; at one moment in a fixed order: faults, the mains, bytes for
//! devices, frames that are complete, devices in the order of the configuration, and last the
//! arbitration of each free bus, so that all who want to send at that moment take part. The
//! same configuration, seed and calls give the same deliveries, bit by bit.

mod effects;
mod log;
mod mains;
mod port;
mod traffic;
mod travel;

#[cfg(test)]
mod linear_tests;
#[cfg(test)]
mod platform_tests;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod volumetric_tests;

use core::any::Any;
use core::cell::Cell;
use std::collections::VecDeque;

use units::Time;
use wire::can::BusError;
use wire::{Payload, Port};

use crate::config::{ConfigError, MachineConfig};
use crate::fault::{Edge, FaultConfig, FaultId, Plan};
use crate::node::Node;
use crate::plant::{Plant, Sight, Truth};
use log::{Direction, Log};
use port::PortState;

/// Whether a port can be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Link {
    /// Usable.
    Up,
    /// Set down; the same socket works when it comes up.
    Down,
    /// The adapter is gone; it must be opened anew.
    Gone,
}

/// What reaches the controller.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Event {
    /// A frame or bytes.
    Payload(Payload),
    /// The host's CAN controller reports an error.
    BusError(BusError),
    /// The port changed its state.
    Link(Link),
}

/// One thing that reaches the controller.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Delivery {
    /// Where.
    pub port: Port,
    /// When.
    pub at: Time,
    /// What.
    pub event: Event,
}

/// Why the machine does not accept what the controller sends.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum DeliverError {
    /// There is no such port.
    #[error("there is no port {}", port.0)]
    NoPort {
        /// Which port.
        port: Port,
    },
    /// A frame for a serial line, or bytes for a CAN bus.
    #[error("port {} cannot carry this payload", port.0)]
    WrongKind {
        /// Which port.
        port: Port,
    },
    /// The port is down or gone.
    #[error("port {} is {link:?}", port.0)]
    Unusable {
        /// Which port.
        port: Port,
        /// Its state.
        link: Link,
    },
    /// The host's transmit queue is full.
    #[error("port {}: the transmit queue is full", port.0)]
    QueueFull {
        /// Which port.
        port: Port,
    },
}

struct Slot {
    node: Box<dyn Node>,
    name: String,
    port: usize,
    powered: bool,
    next: Time,
}

/// A device that joins a machine without being in its configuration.
pub struct Guest {
    /// What faults call it.
    pub name: String,
    /// The port it is on.
    pub port: String,
    /// The device, without power yet.
    pub node: Box<dyn Node>,
}

/// One emulated machine in virtual time.
///
/// # Example
///
/// An analog module is asked for its name; the same seed gives the same log, bit by bit.
///
/// ```
/// use mock_bus::config::MachineConfig;
/// use mock_bus::simulation::{Event, Simulation};
/// use units::Time;
/// use wire::{Payload, Port};
///
/// let config = MachineConfig::parse(
///     r#"
///     name = "bench"
///     ports = [{ kind = "serial", name = "adc", baud_bit_per_s = 9600 }]
///     nodes = [{ name = "adc", port = "adc", device = { kind = "dcon_module", checksum = false } }]
///     "#,
/// )?;
/// let mut simulations = [Simulation::new(&config, 7)?, Simulation::new(&config, 7)?];
/// for simulation in &mut simulations {
///     let asked = Payload::Bytes(b"$01M\r".to_vec());
///     simulation.deliver(Time::from_seconds(1.0), Port(0), &asked)?;
///     let answer = simulation.advance_to_delivery(Time::from_seconds(2.0)).map(|it| it.event);
///     assert_eq!(answer, Some(Event::Payload(Payload::Bytes(b"!014117\r".to_vec()))));
/// }
/// assert_eq!(simulations[0].log_hash(), simulations[1].log_hash());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Simulation {
    config: MachineConfig,
    now: Time,
    plant: Plant,
    slots: Vec<Slot>,
    ports: Vec<PortState>,
    plan: Plan,
    outbox: VecDeque<Delivery>,
    mains_back: Time,
    log: Log,
    /// When something happens by itself next, until something changes that.
    next: Cell<Option<Time>>,
}

impl Simulation {
    /// The machine of `config`, switched on at time 0, with the noise and errors of `seed`.
    ///
    /// # Errors
    /// When the configuration contradicts itself.
    pub fn new(config: &MachineConfig, seed: u64) -> Result<Self, ConfigError> {
        Self::with_guests(config, seed, Vec::new())
    }

    /// The same with further devices, which the configuration does not know.
    ///
    /// # Errors
    /// When the configuration contradicts itself or a guest is on a port that is not there.
    pub fn with_guests(
        config: &MachineConfig,
        seed: u64,
        guests: Vec<Guest>,
    ) -> Result<Self, ConfigError> {
        let mut simulation = Self {
            now: Time::ZERO,
            plant: Plant::new(&config.plant, seed),
            slots: slots(config, seed, guests)?,
            ports: config.ports.iter().map(PortState::new).collect(),
            plan: Plan::new(seed),
            outbox: VecDeque::new(),
            mains_back: Time::NEVER,
            log: Log::default(),
            next: Cell::new(None),
            config: config.clone(),
        };
        for fault in &config.faults {
            simulation.inject(fault.clone())?;
        }
        simulation.switch_on();
        Ok(simulation)
    }

    /// The virtual time.
    pub const fn now(&self) -> Time {
        self.now
    }

    /// The machine's configuration.
    pub const fn config(&self) -> &MachineConfig {
        &self.config
    }

    /// The physical truth, for judges only.
    pub const fn truth(&self) -> Truth<'_> {
        self.plant.truth()
    }

    /// When something happens next, a delivery that waits included.
    pub fn next_event(&self) -> Time {
        let waiting = self.outbox.front().map_or(Time::NEVER, |first| first.at);
        waiting.min(self.next_internal()).max(self.now)
    }

    /// Lets time pass up to `to`.
    pub fn advance(&mut self, to: Time) {
        loop {
            let next = self.next_internal();
            if next > to {
                break;
            }
            self.step(next);
        }
        self.move_clock(to);
    }

    /// Lets time pass until something reaches the controller, or up to `to`.
    pub fn advance_to_delivery(&mut self, to: Time) -> Option<Delivery> {
        loop {
            let waiting = self.outbox.front().map_or(Time::NEVER, |first| first.at);
            let internal = self.next_internal();
            if waiting <= internal.min(to) {
                self.move_clock(waiting);
                return self.outbox.pop_front();
            }
            if internal > to {
                self.move_clock(to);
                return None;
            }
            self.step(internal);
        }
    }

    /// Lets time pass to the next moment at which something reaches the controller, or to `to`;
    /// what has reached it by then is collected afterwards.
    pub fn advance_until_delivery(&mut self, to: Time) {
        loop {
            let waiting = self.outbox.front().map_or(Time::NEVER, |first| first.at);
            let internal = self.next_internal();
            let next = waiting.min(internal);
            if next > to {
                return self.move_clock(to);
            }
            if waiting <= internal {
                // Everything of that moment happens before the controller hears of it.
                return self.advance(waiting);
            }
            self.step(internal);
        }
    }

    /// The next thing that has reached the controller by now, in time order.
    pub fn collect(&mut self) -> Option<Delivery> {
        let first = self.outbox.front()?;
        if first.at > self.now {
            return None;
        }
        self.outbox.pop_front()
    }

    /// The controller sends at `at` (now, when that has passed).
    ///
    /// # Errors
    /// When the port cannot take it; nothing is sent then.
    pub fn deliver(&mut self, at: Time, port: Port, payload: &Payload) -> Result<(), DeliverError> {
        self.advance(at);
        let place = usize::from(port.0);
        let state = self
            .ports
            .get_mut(place)
            .ok_or(DeliverError::NoPort { port })?;
        state.take(self.now, port, payload)?;
        self.next.set(None);
        self.log
            .payload(self.now, port, Direction::FromHost, payload);
        if let Payload::Bytes(bytes) = payload
            && self.plan.echoes(&self.ports[place].name)
        {
            self.bytes_to_host(place, core::time::Duration::ZERO, bytes.clone());
        }
        Ok(())
    }

    /// Adds a fault; its times count from now.
    ///
    /// # Errors
    /// When it names a port or a node that is not there.
    ///
    /// # Example
    ///
    /// ```
    /// use mock_bus::config::MachineConfig;
    /// use mock_bus::fault::{Fault, FaultConfig};
    /// use mock_bus::simulation::Simulation;
    /// use units::Time;
    ///
    /// let config = MachineConfig::parse(
    ///     r#"
    ///     name = "bench"
    ///     ports = [{ kind = "can", name = "can0", bitrate_kbit_per_s = 1000 }]
    ///     nodes = [{ name = "drive", port = "can0", device = { kind = "cia402_drive" } }]
    ///     "#,
    /// )?;
    /// let mut simulation = Simulation::new(&config, 7)?;
    /// let mute = Fault::Mute { node: "drive".into() };
    /// let fault = simulation.inject(FaultConfig::permanent(mute))?;
    /// assert_eq!(simulation.advance_to_delivery(Time::from_seconds(5.0)), None, "no boot-up message");
    /// assert_eq!(simulation.fault_deliveries(fault), 1, "it was kept back");
    /// let nobody = Fault::Mute { node: "laser".into() };
    /// assert!(simulation.inject(FaultConfig::permanent(nobody)).is_err());
    /// # Ok::<(), mock_bus::config::ConfigError>(())
    /// ```
    pub fn inject(&mut self, fault: FaultConfig) -> Result<FaultId, ConfigError> {
        self.config
            .check_fault(&fault, |node| self.slot(node).is_some())?;
        self.next.set(None);
        Ok(self.plan.add(self.now, fault))
    }

    /// Ends a fault now.
    pub fn end_fault(&mut self, fault: FaultId) {
        self.next.set(None);
        self.plan.end(self.now, fault);
    }

    /// How often a fault has really happened.
    pub fn fault_deliveries(&self, fault: FaultId) -> u64 {
        self.plan.delivered(fault)
    }

    /// Somebody takes up the table's plate, turns it by so many lines against the table and
    /// fixes it again, a little off as ever. Nothing happens on a machine without one.
    pub fn turn_plate(&mut self, lines: f64) {
        self.plant.turn_plate(lines);
    }

    /// Somebody reads a line of the table's plate through the microscope.
    pub fn sight_line(&mut self, line: u32) -> Sight {
        self.plant.sight_line(line)
    }

    /// The device called `name`, when it is a `T`: for the faults that only it knows. It is
    /// advanced at the next step.
    pub fn node_mut<T: Node>(&mut self, name: &str) -> Option<&mut T> {
        let place = self.slot(name)?;
        let slot = &mut self.slots[place];
        if slot.powered {
            slot.next = self.now;
            self.next.set(None);
        }
        let node: &mut dyn Any = &mut *slot.node;
        node.downcast_mut()
    }

    /// Whether the port can be used.
    pub fn link(&self, port: Port) -> Option<Link> {
        Some(self.ports.get(usize::from(port.0))?.link)
    }

    /// The share of the time so far in which the CAN bus was occupied.
    pub fn bus_load(&self, port: Port) -> Option<f64> {
        let busy = self.ports.get(usize::from(port.0))?.busy()?;
        Some(busy.as_secs_f64() / self.now.seconds().max(1e-9))
    }

    /// A number that stands for everything that was sent and received, and when.
    pub const fn log_hash(&self) -> u64 {
        self.log.hash()
    }

    /// Keeps the event log as text from now on.
    pub fn keep_log(&mut self) {
        self.log.keep_text();
    }

    /// The event log's lines, where it is kept.
    pub fn log_lines(&self) -> &[String] {
        self.log.lines()
    }

    fn move_clock(&mut self, to: Time) {
        self.now = self.now.max(to);
        self.plant.advance(self.now);
    }

    fn next_internal(&self) -> Time {
        let next = self.next.get().unwrap_or_else(|| self.find_next());
        self.next.set(Some(next));
        next
    }

    fn find_next(&self) -> Time {
        let ports = self.ports.iter().map(|port| port.next_event(self.now));
        let slots = self.slots.iter().map(|slot| slot.next);
        let own = self.plan.next_edge().min(self.mains_back);
        ports.chain(slots).fold(own, Time::min)
    }

    /// Everything that is due at `next`; an arbitration only when nothing else is.
    fn step(&mut self, next: Time) {
        self.move_clock(next);
        self.next.set(None);
        if self.step_faults() | self.step_mains() | self.step_ports() | self.step_nodes() {
            return;
        }
        for port in &mut self.ports {
            port.arbitrate(self.now);
        }
    }

    fn step_faults(&mut self) -> bool {
        let mut any = false;
        while let Some(edge) = self.plan.poll_edge(self.now) {
            any = true;
            match edge {
                Edge::Begins(fault) => self.begin_fault(&fault),
                Edge::Ends(fault) => self.finish_fault(&fault),
                Edge::Sends(port, frame) => self.stranger_sends(&port, frame),
            }
        }
        any
    }

    fn step_ports(&mut self) -> bool {
        let mut any = false;
        for place in 0..self.ports.len() {
            while let Some((sender, payload)) = self.ports[place].arrived(self.now) {
                any = true;
                match payload {
                    Payload::Frame(frame) => self.frame_complete(place, sender, frame),
                    Payload::Bytes(_) | Payload::Control(_) => {
                        self.tell_nodes(place, sender, &payload)
                    }
                }
            }
        }
        any
    }

    fn step_nodes(&mut self) -> bool {
        let mut any = false;
        for place in 0..self.slots.len() {
            let slot = &mut self.slots[place];
            if slot.next > self.now {
                continue;
            }
            any = true;
            slot.node.advance(self.now, &mut self.plant);
            // A node that asks for this very moment again would stop the clock.
            slot.next = slot.node.next_event().max(Time(self.now.0 + 1));
            self.flush(place);
        }
        any
    }

    fn slot(&self, name: &str) -> Option<usize> {
        self.slots.iter().position(|slot| slot.name == name)
    }
}

fn slots(config: &MachineConfig, seed: u64, guests: Vec<Guest>) -> Result<Vec<Slot>, ConfigError> {
    let own = config.nodes.iter().map(|entry| Guest {
        name: entry.name.clone(),
        port: entry.port.clone(),
        node: entry.device.build(seed, &entry.name),
    });
    own.chain(guests)
        .map(|guest| match config.port(&guest.port) {
            Some(port) => Ok(Slot {
                node: guest.node,
                name: guest.name,
                port,
                powered: false,
                next: Time::NEVER,
            }),
            None => Err(ConfigError::NoPort {
                user: guest.name,
                port: guest.port,
            }),
        })
        .collect()
}
