//! An emulated CANopen node: object dictionary, SDO server, NMT, heartbeat, EMCY and PDOs.
//!
//! Purpose: the communication half of every CAN node of the emulator. The device half (a
//! drive, an analog module) owns a [`CanopenServer`], refreshes its process values, hands it
//! frames and time, and acts on its [`ServerEvent`]s.
//!
//! Source: CiA 301 (V4.2), clauses named where they are implemented. It shares with the
//! drivers only the byte codecs. Absent: TIME, node guarding, remote frames (ignored), LSS,
//! 29-bit identifiers, MPDOs, more than one SDO server.

mod block;
pub mod communication;
pub mod dictionary;
mod errors;
mod exchange;
mod habits;
mod heartbeat;
mod listening;
pub mod manners;
mod named_objects;
mod nmt;
mod outbox;
mod pdo;
mod process_data;
mod rules;
mod sdo;
mod sdo_traffic;
#[cfg(test)]
mod tests;

use std::collections::VecDeque;
use std::time::Duration;

use units::Time;
use wire::can::CanFrame;
use wire::canopen::emcy::EmergencyCode;
use wire::canopen::nmt::{NMT_COB_ID, NmtState, parse_heartbeat};
use wire::canopen::sync::{SYNC_COB_ID, is_sync};
use wire::canopen::{Function, NodeId, Object};

pub use communication::{Description, Identity, PdoDefault};
pub use dictionary::Dictionary;
pub use errors::register;
pub use manners::{Deliveries, Manners};
pub use named_objects::{ChangedWrite, NamedObject};

use errors::Errors;
use habits::Habits;
use heartbeat::Consumer;
use listening::Listening;
use manners::Rudeness;
use nmt::Phase;
use outbox::Outbox;
use pdo::{Rpdo, Tpdo};
use sdo::SdoServer;

/// How long the SDO server waits for the client within a transfer.
const SDO_TIMEOUT: Duration = Duration::from_secs(1);

/// What the device half must know.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ServerEvent {
    /// A master wrote this object, by SDO or RPDO; its value is in the dictionary.
    Written(Object),
    /// A SYNC came. The device updates its process values, then calls
    /// [`CanopenServer::send_synchronous`].
    Synchronised,
    /// The NMT state changed.
    Nmt(NmtState),
    /// The application was reset: all objects have their power-on values.
    ResetNode,
    /// The communication was reset: the connection to the master is gone.
    ResetCommunication,
    /// A watched producer fell silent (0x1016).
    HeartbeatLost(NodeId),
    /// It is back.
    HeartbeatBack(NodeId),
    /// No RPDO came within its deadline (0x1400:05).
    RpdoLost,
}

/// The communication half of an emulated CANopen node.
///
/// # Example
///
/// A node with one parameter of its own, which takes 1 and 6 only.
///
/// ```
/// use mock_bus::node::canopen_server::dictionary::{Bounds, Entry, Kind};
/// use mock_bus::node::canopen_server::{CanopenServer, Description, Dictionary, Identity, Manners};
/// use std::time::Duration;
/// use units::Time;
/// use wire::can::CanFrame;
/// use wire::canopen::NodeId;
///
/// let node = NodeId::new(1).expect("1 to 127");
/// let mut own = Dictionary::default();
/// let mode = Entry::read_write(Kind::I8, 1).bounded(Bounds::OneOf(&[1, 6]));
/// own.insert(0x6060, 0, mode);
/// let device = Description {
///     device_type: 0x0002_0192,
///     device_name: "a drive".into(),
///     hardware_version: "1".into(),
///     software_version: "1".into(),
///     identity: Identity::default(),
///     heartbeat_ms: 0,
///     rpdos: vec![],
///     tpdos: vec![],
/// };
/// let mut server = CanopenServer::new(node, Duration::ZERO, &device, own, Manners::default());
/// server.advance(Time::ZERO);
/// assert_eq!(server.poll_transmit(), Some(CanFrame::standard(0x701, &[0])), "it has booted");
/// let mut write = |value: u8| {
///     let request = CanFrame::standard(0x601, &[0x2F, 0x60, 0x60, 0, value, 0, 0, 0]);
///     server.handle(Time::ZERO, &request);
///     server.poll_transmit().map(|it| it.to_string())
/// };
/// assert_eq!(write(6), Some("581#6060600000000000".into()));
/// assert_eq!(write(2), Some("581#8060600030000906".into()), "0x06090030: invalid value");
/// ```
#[derive(Debug)]
pub struct CanopenServer {
    node: NodeId,
    boot_delay: Duration,
    dictionary: Dictionary,
    phase: Phase,
    sdo: SdoServer,
    rpdos: Vec<Rpdo>,
    tpdos: Vec<Tpdo>,
    heartbeat_due: Time,
    consumers: Vec<Option<Consumer>>,
    /// Who fell silent and has not been heard since.
    lost_producer: Option<NodeId>,
    listening: Listening,
    errors: Errors,
    emergency_free: Time,
    outbox: Outbox,
    events: VecDeque<ServerEvent>,
    rudeness: Rudeness,
    habits: Habits,
}

impl CanopenServer {
    /// A node that was powered at [`Time::ZERO`] and boots.
    ///
    /// `application` holds the objects outside 0x1000-0x1FFF.
    pub fn new(
        node: NodeId,
        boot_delay: Duration,
        device: &Description,
        application: Dictionary,
        manners: Manners,
    ) -> Self {
        let mut dictionary = application;
        communication::insert(&mut dictionary, node, device);
        habits::insert(&mut dictionary, &manners);
        let number = |count: usize| 0..count as u16;
        let rpdos = number(device.rpdos.len()).map(|n| Rpdo::read(&dictionary, n));
        let rpdos = rpdos.collect();
        let tpdos = number(device.tpdos.len()).map(|n| Tpdo::read(&dictionary, n, Time::ZERO));
        let tpdos = tpdos.collect();
        let mut server = Self {
            node,
            boot_delay,
            phase: Phase::Off,
            sdo: SdoServer::new(SDO_TIMEOUT),
            rpdos,
            tpdos,
            dictionary,
            heartbeat_due: Time::NEVER,
            consumers: Vec::new(),
            lost_producer: None,
            listening: Listening::default(),
            errors: Errors::default(),
            emergency_free: Time::ZERO,
            outbox: Outbox::default(),
            events: VecDeque::new(),
            rudeness: Rudeness::new(manners),
            habits: Habits::default(),
        };
        server.power_on(Time::ZERO);
        server
    }

    /// The node's identifier.
    pub const fn node(&self) -> NodeId {
        self.node
    }

    /// The NMT state, `None` while off or booting.
    pub const fn nmt_state(&self) -> Option<NmtState> {
        match self.phase {
            Phase::Running(state) => Some(state),
            Phase::Off | Phase::Booting { .. } => None,
        }
    }

    /// Whether the node has power.
    pub const fn is_powered(&self) -> bool {
        !matches!(self.phase, Phase::Off)
    }

    /// The number at `index` and `sub`; the device asks only for its own objects.
    pub fn get(&self, index: u16, sub: u8) -> i64 {
        self.dictionary.integer(index, sub)
    }

    /// Changes a process value.
    pub fn set(&mut self, index: u16, sub: u8, value: i64) {
        self.dictionary.set_integer(index, sub, value);
    }

    /// The manners that are left; writing them spoils what comes next.
    pub fn manners_mut(&mut self) -> &mut Manners {
        &mut self.rudeness.left
    }

    /// Which faults were delivered, and how often.
    pub const fn deliveries(&self) -> &Deliveries {
        &self.rudeness.delivered
    }

    /// Counts a fault of the device's own as delivered, under the name of the key that asked
    /// for it.
    pub fn count_delivery(&mut self, name: &'static str) {
        self.rudeness.count(name);
    }

    /// Whether `frame` means anything to this node.
    pub fn concerns(&self, frame: &CanFrame) -> bool {
        let id = frame.standard_id().filter(|_| !frame.is_remote());
        id.is_some_and(|id| self.listening.contains(id)) || self.is_guard_request(frame)
    }

    /// What it listens to depends on its RPDOs and on whom it watches: whatever changes these calls
    /// this.
    fn listen_anew(&mut self) {
        let own = [
            NMT_COB_ID,
            SYNC_COB_ID,
            self.node.cob_id(Function::SdoRequest),
        ];
        let watched = self.consumers.iter().flatten();
        let watched = watched.map(|consumer| consumer.producer.cob_id(Function::ErrorControl));
        let rpdos = self.rpdos.iter().filter_map(Rpdo::listens_to);
        self.listening = Listening::default();
        self.listening
            .extend(own.into_iter().chain(watched).chain(rpdos));
    }

    /// Takes a frame from the bus.
    pub fn handle(&mut self, now: Time, frame: &CanFrame) {
        self.advance(now);
        if self.is_guard_request(frame) {
            return self.answer_guard(now);
        }
        let Some(id) = frame.standard_id().filter(|_| !frame.is_remote()) else {
            return;
        };
        if id == NMT_COB_ID {
            self.handle_nmt(now, frame);
        } else if is_sync(frame) {
            if self.takes_sync(now, frame) {
                self.handle_sync();
            }
        } else if id == self.node.cob_id(Function::SdoRequest) {
            self.handle_sdo(now, frame);
        } else if let Ok((producer, _)) = parse_heartbeat(frame) {
            self.handle_heartbeat(now, producer);
        } else {
            self.handle_rpdo(now, frame);
        }
    }

    /// Lets time pass up to `now`.
    pub fn advance(&mut self, now: Time) {
        if let Phase::Booting { until } = self.phase
            && until <= now
        {
            self.boot_up(now);
        }
        self.produce_heartbeat(now);
        self.watch_heartbeats(now);
        self.expire_sdo(now);
        self.expire_rpdos(now);
        self.follow_habits(now);
        self.send_due_tpdos(now);
        self.outbox.release(now);
    }

    /// When [`CanopenServer::advance`] has something to do.
    pub fn next_event(&self) -> Time {
        let boot = match self.phase {
            Phase::Booting { until } => until,
            Phase::Off => return Time::NEVER,
            Phase::Running(_) => Time::NEVER,
        };
        let own = boot.min(self.heartbeat_due).min(self.sdo.deadline());
        let frames = self.outbox.next_event().min(self.next_process_event());
        let consumers = self.consumers.iter().flatten().map(Consumer::deadline);
        let own = own.min(self.habits.next_event());
        consumers.fold(own.min(frames), Time::min)
    }

    /// The next frame the node sends.
    pub fn poll_transmit(&mut self) -> Option<CanFrame> {
        self.outbox.poll()
    }

    /// The next thing the device half must know.
    pub fn poll_event(&mut self) -> Option<ServerEvent> {
        self.events.pop_front()
    }

    /// An error begins: error register, history, emergency message.
    pub fn raise(&mut self, now: Time, code: EmergencyCode, bits: u8, detail: [u8; 5]) {
        if let Some(message) = self.errors.raise(code, bits, detail) {
            self.publish_errors();
            self.send_emergency(now, message.emit(self.node));
        }
    }

    /// An error is over; nothing happens when it was not there.
    pub fn clear(&mut self, now: Time, code: EmergencyCode) {
        if let Some(message) = self.errors.clear(code) {
            self.publish_errors();
            self.send_emergency(now, message.emit(self.node));
        }
    }

    /// Emergencies are sent in pre-operational and operational, one per inhibit time (0x1015).
    fn send_emergency(&mut self, now: Time, frame: CanFrame) {
        if !self.phase.communicates() {
            return;
        }
        let due = self.emergency_free.max(now);
        let inhibit = Duration::from_micros(self.get(0x1015, 0) as u64 * 100);
        self.emergency_free = due + inhibit;
        self.outbox.send_at(now, due, frame);
    }

    fn publish_errors(&mut self) {
        self.set(0x1001, 0, i64::from(self.errors.register()));
        let history = std::mem::take(&mut self.errors.history);
        self.set(0x1003, 0, history.len() as i64);
        for (sub, raw) in (1..).zip(&history) {
            self.set(0x1003, sub, i64::from(*raw));
        }
        self.errors.history = history;
    }
}
