//! PDOs at run time: what the parameters in the dictionary make of them (CiA 301, 7.2.2).

use std::time::Duration;

use units::Time;
use wire::can::CanFrame;
use wire::canopen::pdo::{self, MappedObject, PdoCobId, Transmission};
use wire::canopen::{Object, pdo::extract};

use super::dictionary::Dictionary;
use super::rules::{is_dummy, mapping_index, parameters_index};

/// What both directions have in common.
#[derive(Clone, Debug)]
struct Parameters {
    cob_id: PdoCobId,
    transmission: Transmission,
    inhibit: Duration,
    timer: Duration,
    mapping: Vec<MappedObject>,
}

impl Parameters {
    fn read(dictionary: &Dictionary, transmit: bool, number: u16) -> Self {
        let index = parameters_index(transmit, number);
        let sub = |sub| dictionary.integer(index, sub) as u32;
        Self {
            cob_id: PdoCobId(sub(1)),
            transmission: Transmission::from_raw(sub(2) as u8),
            inhibit: Duration::from_micros(u64::from(sub(3)) * 100),
            timer: Duration::from_millis(u64::from(sub(5))),
            mapping: read_mapping(dictionary, mapping_index(transmit, number)),
        }
    }

    fn bytes(&self) -> usize {
        let bits: usize = self.mapping.iter().map(|m| usize::from(m.bits)).sum();
        bits.div_ceil(8)
    }
}

fn read_mapping(dictionary: &Dictionary, index: u16) -> Vec<MappedObject> {
    let count = dictionary.integer(index, 0) as u8;
    let raw = |sub| dictionary.integer(index, sub) as u32;
    (1..=count)
        .map(|sub| MappedObject::from_raw(raw(sub)))
        .collect()
}

/// A TPDO.
#[derive(Clone, Debug)]
pub(super) struct Tpdo {
    parameters: Parameters,
    last_sent: Option<[u8; 8]>,
    inhibited_until: Time,
    timer_due: Time,
    pending: bool,
    syncs: u8,
}

impl Tpdo {
    pub(super) fn read(dictionary: &Dictionary, number: u16, now: Time) -> Self {
        let parameters = Parameters::read(dictionary, true, number);
        let timer_due = due(now, parameters.timer);
        Self {
            parameters,
            last_sent: None,
            inhibited_until: Time::ZERO,
            timer_due,
            pending: false,
            syncs: 0,
        }
    }

    fn is_valid(&self) -> bool {
        self.parameters.cob_id.is_valid() && !self.parameters.mapping.is_empty()
    }

    /// Whether the TPDO is in use and sent at events.
    pub(super) fn is_event_driven(&self) -> bool {
        self.is_valid() && self.parameters.transmission == Transmission::Event
    }

    /// Whether the TPDO is in use and sent at SYNCs.
    pub(super) fn is_synchronous(&self) -> bool {
        use Transmission::{Synchronous, SynchronousAcyclic};
        let kind = self.parameters.transmission;
        self.is_valid() && matches!(kind, Synchronous(_) | SynchronousAcyclic)
    }

    /// Whether the SYNC that has just come is one at which it is sent, as far as its values do
    /// not matter.
    pub(super) fn is_turn(&self) -> bool {
        match self.parameters.transmission {
            Transmission::Synchronous(every) => {
                self.is_valid() && (self.syncs + 1).is_multiple_of(every)
            }
            Transmission::SynchronousAcyclic => self.is_valid(),
            Transmission::Event | Transmission::Unknown(_) => false,
        }
    }

    pub(super) fn maps(&self, object: Object) -> bool {
        self.parameters.mapping.iter().any(|m| m.object == object)
    }

    /// The payload that the present values give.
    fn payload(&self, dictionary: &Dictionary, exchange: bool) -> [u8; 8] {
        let mapping = &self.parameters.mapping;
        let mut payload = [0; 8];
        let mut offset = 0;
        for place in 0..mapping.len() {
            let mapped = match place {
                0 | 1 if exchange && mapping.len() > 1 => mapping[1 - place],
                _ => mapping[place],
            };
            let Object { index, sub } = mapped.object;
            let value = dictionary.integer(index, sub) as u64;
            let inserted = pdo::insert(&mut payload, offset, mapped.bits, value);
            inserted.expect("a mapping of more than 64 bits is refused when written");
            offset += usize::from(mapped.bits);
        }
        payload
    }

    /// The content changed since it was last sent: an event of the device.
    pub(super) fn note_change(&mut self, dictionary: &Dictionary) {
        if self.is_event_driven() && self.last_sent != Some(self.payload(dictionary, false)) {
            self.pending = true;
        }
    }

    /// The device has an event of its own.
    pub(super) fn trigger(&mut self) {
        self.pending |= self.is_event_driven();
    }

    /// Entering operational: an event-driven PDO is sent once, a counted one starts counting.
    pub(super) fn start(&mut self, now: Time) {
        self.last_sent = None;
        self.syncs = 0;
        self.timer_due = due(now, self.parameters.timer);
    }

    /// A SYNC came: whether this TPDO's turn is now.
    pub(super) fn synchronise(&mut self, dictionary: &Dictionary) -> bool {
        if !self.is_valid() {
            return false;
        }
        match self.parameters.transmission {
            Transmission::Synchronous(every) => {
                self.syncs = (self.syncs + 1) % every;
                self.syncs == 0
            }
            Transmission::SynchronousAcyclic => {
                self.last_sent != Some(self.payload(dictionary, false))
            }
            Transmission::Event | Transmission::Unknown(_) => false,
        }
    }

    /// Whether an event or the event timer asks for the TPDO now.
    pub(super) fn is_due(&mut self, now: Time) -> bool {
        if self.is_event_driven() && self.timer_due <= now {
            self.pending = true;
        }
        self.pending && self.inhibited_until <= now
    }

    pub(super) fn emit(&mut self, now: Time, dictionary: &Dictionary, exchange: bool) -> CanFrame {
        let payload = self.payload(dictionary, exchange);
        self.last_sent = Some(match exchange {
            true => self.payload(dictionary, false),
            false => payload,
        });
        self.pending = false;
        self.inhibited_until = now + self.parameters.inhibit;
        self.timer_due = due(now, self.parameters.timer);
        let length = self.parameters.bytes();
        CanFrame::standard(self.parameters.cob_id.cob_id(), &payload[..length])
    }

    pub(super) fn next_event(&self) -> Time {
        if !self.is_event_driven() {
            return Time::NEVER;
        }
        let pending = if self.pending {
            self.inhibited_until
        } else {
            Time::NEVER
        };
        pending.min(self.timer_due.max(self.inhibited_until))
    }
}

fn due(now: Time, timer: Duration) -> Time {
    if timer.is_zero() {
        Time::NEVER
    } else {
        now + timer
    }
}

/// What an RPDO does with a frame.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Reception {
    /// Values for the objects, to be taken over now.
    Values(Vec<(Object, u64)>),
    /// Kept until the next SYNC.
    Buffered,
    /// Fewer bytes than mapped, for the first time since a good one.
    TooShort,
    /// Again too short.
    Ignored,
}

/// An RPDO.
#[derive(Clone, Debug)]
pub(super) struct Rpdo {
    parameters: Parameters,
    buffered: Option<CanFrame>,
    short: bool,
    deadline: Time,
}

impl Rpdo {
    pub(super) fn read(dictionary: &Dictionary, number: u16) -> Self {
        Self {
            parameters: Parameters::read(dictionary, false, number),
            buffered: None,
            short: false,
            deadline: Time::NEVER,
        }
    }

    /// The identifier of its frames, while it is in use.
    pub(super) fn listens_to(&self) -> Option<u16> {
        let cob_id = self.parameters.cob_id;
        cob_id.is_valid().then(|| cob_id.cob_id())
    }

    pub(super) fn takes(&self, frame: &CanFrame) -> bool {
        let id = frame.standard_id();
        id.is_some() && id == self.listens_to()
    }

    pub(super) fn receive(&mut self, now: Time, frame: CanFrame) -> Reception {
        if frame.len() < self.parameters.bytes() {
            let known = std::mem::replace(&mut self.short, true);
            return if known {
                Reception::Ignored
            } else {
                Reception::TooShort
            };
        }
        self.short = false;
        self.deadline = due(now, self.parameters.timer);
        match self.parameters.transmission {
            Transmission::Event | Transmission::Unknown(_) => {
                Reception::Values(self.values(&frame))
            }
            Transmission::Synchronous(_) | Transmission::SynchronousAcyclic => {
                self.buffered = Some(frame);
                Reception::Buffered
            }
        }
    }

    /// A SYNC came: what was received since the last one.
    pub(super) fn synchronise(&mut self) -> Vec<(Object, u64)> {
        let frame = self.buffered.take();
        frame.map_or_else(Vec::new, |frame| self.values(&frame))
    }

    fn values(&self, frame: &CanFrame) -> Vec<(Object, u64)> {
        let mut offset = 0;
        let mut values = Vec::with_capacity(self.parameters.mapping.len());
        for mapped in &self.parameters.mapping {
            let value = extract(frame.data(), offset, mapped.bits);
            offset += usize::from(mapped.bits);
            let real = value.filter(|_| !is_dummy(*mapped));
            values.extend(real.map(|value| (mapped.object, value)));
        }
        values
    }

    /// `true` once, when no RPDO came within the event timer after the last one.
    pub(super) fn expires(&mut self, now: Time) -> bool {
        let expired = self.deadline <= now;
        if expired {
            self.deadline = Time::NEVER;
        }
        expired
    }

    pub(super) fn deadline(&self) -> Time {
        self.deadline
    }
}
