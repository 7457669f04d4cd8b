//! PDO traffic of the node (CiA 301, 7.2.2 and 7.2.5).

use units::Time;
use wire::can::CanFrame;
use wire::canopen::Object;
use wire::canopen::emcy::EmergencyCode;
use wire::canopen::sync::is_sync;

use super::errors::register;
use super::pdo::{Reception, Rpdo, Tpdo};
use super::rules::Area;
use super::{CanopenServer, ServerEvent};

const PDO_TOO_SHORT: EmergencyCode = EmergencyCode(0x8210);
const RPDO_TIMEOUT: EmergencyCode = EmergencyCode(0x8250);

impl CanopenServer {
    pub(super) fn reload_pdos(&mut self, now: Time) {
        for number in 0..self.rpdos.len() {
            self.rpdos[number] = Rpdo::read(&self.dictionary, number as u16);
        }
        for number in 0..self.tpdos.len() {
            self.tpdos[number] = Tpdo::read(&self.dictionary, number as u16, now);
        }
        self.listen_anew();
    }

    /// A parameter of one PDO was written.
    pub(super) fn reload_pdo(&mut self, now: Time, area: Area) {
        match area {
            Area::Parameters { transmit, number } | Area::Mapping { transmit, number } => {
                let place = usize::from(number);
                if transmit {
                    self.tpdos[place] = Tpdo::read(&self.dictionary, number, now);
                } else {
                    self.rpdos[place] = Rpdo::read(&self.dictionary, number);
                    self.listen_anew();
                }
            }
            Area::Other => {}
        }
    }

    pub(super) fn handle_rpdo(&mut self, now: Time, frame: &CanFrame) {
        if !self.phase.is_operational() {
            return;
        }
        let Some(rpdo) = self.rpdos.iter_mut().find(|rpdo| rpdo.takes(frame)) else {
            return;
        };
        match rpdo.receive(now, *frame) {
            Reception::Values(values) => self.take_over(&values),
            Reception::TooShort => {
                let detail = [frame.len() as u8, 0, 0, 0, 0];
                self.raise(now, PDO_TOO_SHORT, register::COMMUNICATION, detail);
                return;
            }
            Reception::Buffered => {}
            Reception::Ignored => return,
        }
        self.clear(now, PDO_TOO_SHORT);
        self.clear(now, RPDO_TIMEOUT);
    }

    /// All values first, then the events: a controlword sees the target that came with it.
    /// A value out of its entry's range is not taken over, and nobody is told.
    fn take_over(&mut self, values: &[(Object, u64)]) {
        for (object, raw) in values {
            let bytes = raw.to_le_bytes();
            let length = self.dictionary.length(*object).unwrap_or(0);
            if let Ok(value) = self.dictionary.check_value(*object, &bytes[..length]) {
                let value = self.rudeness.change_value(*object, value);
                self.dictionary.put(*object, value);
                self.events.push_back(ServerEvent::Written(*object));
            }
        }
    }

    /// Synchronous RPDOs take effect, then the device samples.
    pub(super) fn handle_sync(&mut self) {
        if !self.phase.is_operational() {
            return;
        }
        let mut buffered = Vec::new();
        for rpdo in &mut self.rpdos {
            buffered.extend(rpdo.synchronise());
        }
        self.take_over(&buffered);
        self.events.push_back(ServerEvent::Synchronised);
    }

    pub(super) fn expire_rpdos(&mut self, now: Time) {
        let mut expired = false;
        for rpdo in &mut self.rpdos {
            expired |= rpdo.expires(now);
        }
        if expired && self.phase.is_operational() {
            self.raise(now, RPDO_TIMEOUT, register::COMMUNICATION, [0; 5]);
            self.events.push_back(ServerEvent::RpdoLost);
        }
    }

    /// Whether a TPDO in use is sent at SYNCs: only then must the device sample at them.
    pub fn has_synchronous_tpdo(&self) -> bool {
        self.tpdos.iter().any(Tpdo::is_synchronous)
    }

    /// Whether a TPDO is sent at the SYNC that has just come.
    pub fn is_tpdo_turn(&self) -> bool {
        self.phase.is_operational() && self.tpdos.iter().any(Tpdo::is_turn)
    }

    /// Whether `frame` is a SYNC that does nothing but let the device sample: no event-driven TPDO
    /// may be due with it.
    pub fn only_samples_at(&self, frame: &CanFrame) -> bool {
        is_sync(frame) && self.phase.is_operational() && !self.reports_changes()
    }

    /// Whether a TPDO in use is sent at changes: only then must the device look for them.
    pub fn reports_changes(&self) -> bool {
        self.phase.is_operational() && self.tpdos.iter().any(Tpdo::is_event_driven)
    }

    /// Sends the TPDOs whose turn is at this SYNC.
    pub fn send_synchronous(&mut self, now: Time) {
        if !self.phase.is_operational() {
            return;
        }
        for number in 0..self.tpdos.len() {
            if self.tpdos[number].synchronise(&self.dictionary) {
                self.send_tpdo(now, number);
            }
        }
    }

    /// Sends the event-driven TPDOs whose content changed, as their inhibit times allow.
    pub fn send_changes(&mut self, now: Time) {
        if self.phase.is_operational() {
            let dictionary = &self.dictionary;
            self.tpdos
                .iter_mut()
                .for_each(|tpdo| tpdo.note_change(dictionary));
            self.send_due_tpdos(now);
        }
    }

    /// The device has an event of its own about `object`: event-driven TPDOs with it are sent.
    pub fn trigger(&mut self, now: Time, object: Object) {
        if self.phase.is_operational() {
            let concerned = self.tpdos.iter_mut().filter(|tpdo| tpdo.maps(object));
            concerned.for_each(Tpdo::trigger);
            self.send_due_tpdos(now);
        }
    }

    pub(super) fn send_due_tpdos(&mut self, now: Time) {
        if !self.phase.is_operational() {
            return;
        }
        for number in 0..self.tpdos.len() {
            if self.tpdos[number].is_due(now) {
                self.send_tpdo(now, number);
            }
        }
    }

    fn send_tpdo(&mut self, now: Time, number: usize) {
        let exchange = self.rudeness.switched("mapping_lies", |m| m.mapping_lies);
        let frame = self.tpdos[number].emit(now, &self.dictionary, exchange);
        let mute = self.rudeness.switched("tpdo_mute", |m| m.tpdo_mute);
        if !mute && !self.rudeness.take("tpdo_drops", |m| &mut m.tpdo_drops) {
            self.outbox.send(frame);
        }
    }

    pub(super) fn next_process_event(&self) -> Time {
        if !self.phase.is_operational() {
            return Time::NEVER;
        }
        let tpdos = self.tpdos.iter().map(Tpdo::next_event);
        let first = tpdos.fold(Time::NEVER, Time::min);
        let rpdos = self.rpdos.iter().map(Rpdo::deadline);
        rpdos.fold(first, Time::min)
    }
}
