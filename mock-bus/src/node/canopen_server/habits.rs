//! Habits of real nodes that cost a master its start: objects of their own choice, a second
//! boot-up, a SYNC of their own, node guarding in place of heartbeats.
//!
//! Source: CiA 301, 7.2.5 (SYNC producer, bit 30 of 0x1005), 7.2.8.2.2 (node guarding, life
//! guarding); the keys of [`Manners`](super::Manners) that ask for each are named with it.

use std::time::Duration;

use units::Time;
use wire::can::{CanFrame, CanId};
use wire::canopen::emcy::EmergencyCode;
use wire::canopen::nmt::{NmtState, emit_heartbeat};
use wire::canopen::pdo::MappedObject;
use wire::canopen::sdo::AbortCode;
use wire::canopen::sync::emit_sync;
use wire::canopen::{Function, Object};

use super::dictionary::{Bounds, Dictionary, Entry, Kind, Value};
use super::errors::register;
use super::manners::{Manners, Rudeness};
use super::named_objects::{ChangedWrite, NamedObject};
use super::rules::Area;
use super::{CanopenServer, ServerEvent};

/// "Unexpected SYNC data length" (CiA 301, table 26).
const SYNC_LENGTH: EmergencyCode = EmergencyCode(0x8240);
/// Bit 30 of 0x1005: the node produces SYNC.
const PRODUCES: i64 = 1 << 30;
const SYNC_IDENTIFIER: i64 = 0x80;

/// What the habits remember while the node runs.
#[derive(Clone, Debug)]
pub(super) struct Habits {
    /// When the node says again that it has booted.
    second_boot: Time,
    /// When its own SYNC is due.
    sync_due: Time,
    sync_counter: u8,
    guard: Guard,
}

/// Node guarding: the toggle bit and the life time.
#[derive(Clone, Debug)]
struct Guard {
    toggle: bool,
    deadline: Time,
}

impl Default for Habits {
    fn default() -> Self {
        Self {
            second_boot: Time::NEVER,
            sync_due: Time::NEVER,
            sync_counter: 0,
            guard: Guard {
                toggle: false,
                deadline: Time::NEVER,
            },
        }
    }
}

impl Habits {
    pub(super) fn next_event(&self) -> Time {
        let guard = self.guard.deadline;
        self.second_boot.min(self.sync_due).min(guard)
    }
}

/// Puts what the manners say of objects into the dictionary.
pub(super) fn insert(dictionary: &mut Dictionary, manners: &Manners) {
    if manners.own_sync_ms > 0 {
        let known = Bounds::OneOf(&[SYNC_IDENTIFIER, PRODUCES | SYNC_IDENTIFIER]);
        let sync = Entry::read_write(Kind::U32, PRODUCES | SYNC_IDENTIFIER).bounded(known);
        dictionary.insert(0x1005, 0, sync);
        dictionary.set_factory(0x1006, 0, i64::from(manners.own_sync_ms) * 1000);
    }
    let counter = i64::from(manners.sync_counter_overflow);
    dictionary.set_factory(0x1019, 0, counter);
    if manners.node_guarding_only {
        dictionary.set_factory(0x1017, 0, 0);
        dictionary.insert(0x100C, 0, Entry::read_write(Kind::U16, 0));
        dictionary.insert(0x100D, 0, Entry::read_write(Kind::U8, 0));
    }
}

impl Rudeness {
    /// Refuses `object` where the node lacks it.
    pub(super) fn refuse_absent(&mut self, object: Object) -> Result<(), AbortCode> {
        const HEARTBEAT: [NamedObject; 2] =
            [NamedObject::whole(0x1016), NamedObject::whole(0x1017)];
        let guarding = self.left.node_guarding_only;
        let absent = self.left.absent_objects.iter().copied();
        if let Some(named) = absent.into_iter().find(|named| named.means(object)) {
            self.count("absent_objects");
            return Err(self.absence(named));
        }
        if let Some(named) = HEARTBEAT.into_iter().find(|named| named.means(object))
            && guarding
        {
            self.count("node_guarding_only");
            return Err(self.absence(named));
        }
        Ok(())
    }

    fn absence(&mut self, named: NamedObject) -> AbortCode {
        if let Some(own) = self.left.absent_abort_code {
            self.count("absent_abort_code");
            return AbortCode::from_raw(own);
        }
        match named.sub {
            Some(_) => AbortCode::NoSuchSubIndex,
            None => AbortCode::NoSuchObject,
        }
    }

    /// Refuses a download to an object that is read-only here.
    pub(super) fn refuse_read_only(&mut self, object: Object) -> Result<(), AbortCode> {
        let mut read_only = self.left.read_only_objects.iter();
        if read_only.any(|named| named.means(object)) {
            self.count("read_only_objects");
            return Err(AbortCode::ReadOnly);
        }
        Ok(())
    }

    /// Refuses a value that this node does not take.
    pub(super) fn refuse_value(
        &mut self,
        object: Object,
        present: &Value,
        value: &Value,
    ) -> Result<(), AbortCode> {
        const SWITCH: i64 = 1 << 31;
        let (Value::Integer(present), Value::Integer(value)) = (present, value) else {
            return Ok(());
        };
        match Area::of(object.index) {
            Area::Parameters { .. } if object.sub == 1 && self.left.pdo_identifiers_fixed => {
                if present & !SWITCH != value & !SWITCH {
                    self.count("pdo_identifiers_fixed");
                    return Err(AbortCode::InvalidValue);
                }
            }
            Area::Mapping { .. } if object.sub > 0 => {
                self.refuse_absent(MappedObject::from_raw(*value as u32).object)?;
            }
            Area::Parameters { .. } | Area::Mapping { .. } | Area::Other => {}
        }
        self.refuse_order(object)
    }

    /// The soft limits: the upper one first.
    fn refuse_order(&mut self, object: Object) -> Result<(), AbortCode> {
        const LOWER: Object = Object::new(0x607D, 1);
        const UPPER: Object = Object::new(0x607D, 2);
        if object == UPPER {
            self.upper_limit_written = true;
        }
        let early = object == LOWER && !self.upper_limit_written;
        if early && self.switched("upper_soft_limit_first", |m| m.upper_soft_limit_first) {
            return Err(AbortCode::MaximumBelowMinimum);
        }
        Ok(())
    }

    /// Returns what becomes of a written value.
    pub(super) fn change_value(&mut self, object: Object, value: Value) -> Value {
        let changes = self.left.changed_writes.iter().copied();
        let mut concerned = changes.filter(|change| change.object.means(object));
        let Some(change): Option<ChangedWrite> = concerned.next() else {
            return value;
        };
        let changed = change.apply_to(value.clone());
        if changed != value {
            self.count("changed_writes");
        }
        changed
    }
}

impl CanopenServer {
    pub(super) fn habits_after_boot(&mut self, now: Time) {
        let again_ms = self.rudeness.left.boots_twice_after_ms;
        if again_ms > 0 {
            self.habits.second_boot = now + Duration::from_millis(again_ms);
        }
        self.restart_own_sync(now);
    }

    /// Whatever the habits have to do by `now`.
    pub(super) fn follow_habits(&mut self, now: Time) {
        if self.habits.next_event() > now {
            return;
        }
        if self.habits.second_boot <= now {
            self.habits.second_boot = Time::NEVER;
            self.rudeness.count("boots_twice_after_ms");
            self.outbox
                .send(emit_heartbeat(self.node, NmtState::BootUp));
            self.enter(now, NmtState::PreOperational);
            self.restart_heartbeat(now);
        }
        self.produce_sync(now);
        if self.habits.guard.deadline <= now {
            self.habits.guard.deadline = Time::NEVER;
            self.lose_heartbeat(now, self.node);
        }
    }

    /// 0x1005, 0x1006 or 0x1019 was written, or the node has booted.
    pub(super) fn restart_own_sync(&mut self, now: Time) {
        let period = self.own_sync_period();
        self.habits.sync_counter = 0;
        self.habits.sync_due = match period.is_zero() {
            true => Time::NEVER,
            false => now + period,
        };
    }

    fn own_sync_period(&self) -> Duration {
        match self.get(0x1005, 0) & PRODUCES != 0 {
            true => Duration::from_micros(self.get(0x1006, 0) as u64),
            false => Duration::ZERO,
        }
    }

    fn produce_sync(&mut self, now: Time) {
        if self.habits.sync_due > now {
            return;
        }
        self.habits.sync_due = now + self.own_sync_period();
        if !self.phase.communicates() {
            return;
        }
        self.rudeness.count("own_sync_ms");
        let counter = self.next_sync_counter();
        self.outbox.send(emit_sync(counter));
        // A node does not hear its own frames, and takes part in its own SYNC.
        self.handle_sync();
    }

    /// 1 to the value of 0x1019, over and over.
    fn next_sync_counter(&mut self) -> Option<u8> {
        let overflow = self.get(0x1019, 0) as u8;
        (overflow > 1).then(|| {
            self.habits.sync_counter = self.habits.sync_counter % overflow + 1;
            self.habits.sync_counter
        })
    }

    /// Whether a SYNC is as 0x1019 says it must be; an emergency where it is not.
    pub(super) fn takes_sync(&mut self, now: Time, frame: &CanFrame) -> bool {
        let counted = self.get(0x1019, 0) > 1;
        if counted && frame.len() != 1 {
            self.rudeness.count("sync_counter_overflow");
            let detail = [frame.len() as u8, 0, 0, 0, 0];
            self.raise(now, SYNC_LENGTH, register::COMMUNICATION, detail);
            return false;
        }
        if counted {
            self.clear(now, SYNC_LENGTH);
        }
        true
    }

    /// Whether a remote frame asks for the node's state.
    pub(super) fn is_guard_request(&self, frame: &CanFrame) -> bool {
        let own = self.node.cob_id(Function::ErrorControl);
        let asked = CanId::standard(own) == Some(frame.id());
        asked && frame.is_remote() && self.rudeness.left.node_guarding_only
    }

    /// Answers with the state and the toggle bit; the life time begins anew.
    pub(super) fn answer_guard(&mut self, now: Time) {
        const TOGGLE: u8 = 0x80;
        let Some(state) = self.nmt_state() else {
            return;
        };
        self.rudeness.count("node_guarding_only");
        let toggle = if self.habits.guard.toggle { TOGGLE } else { 0 };
        self.habits.guard.toggle = !self.habits.guard.toggle;
        let id = self.node.cob_id(Function::ErrorControl);
        let answer = CanFrame::standard(id, &[state.raw() | toggle]);
        self.outbox.send(answer);
        self.find_heartbeat(now, self.node);
        let life_ms = self.get(0x100C, 0) as u64 * self.get(0x100D, 0) as u64;
        self.habits.guard.deadline = match life_ms {
            0 => Time::NEVER,
            _ => now + Duration::from_millis(life_ms),
        };
    }

    /// The first sign of life after a loss.
    pub(super) fn find_heartbeat(&mut self, now: Time, producer: wire::canopen::NodeId) {
        if self.lost_producer.take().is_some() {
            self.clear(now, EmergencyCode::HEARTBEAT_LOST);
            self.events.push_back(ServerEvent::HeartbeatBack(producer));
        }
    }
}
