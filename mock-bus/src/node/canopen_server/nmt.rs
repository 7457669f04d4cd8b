//! NMT slave, heartbeat producer and consumers (CiA 301, 7.2.8 and 7.3.2).

use std::time::Duration;

use units::Time;
use wire::can::CanFrame;
use wire::canopen::NodeId;
use wire::canopen::emcy::EmergencyCode;
use wire::canopen::nmt::{NmtCommand, NmtState, emit_heartbeat};

use super::errors::{Errors, register};
use super::habits::Habits;
use super::heartbeat::Consumer;
use super::{CanopenServer, ServerEvent};

/// What the node's processor does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Phase {
    /// No power.
    Off,
    /// Initialisation; the boot-up message comes at its end.
    Booting { until: Time },
    /// One of the NMT states.
    Running(NmtState),
}

impl Phase {
    /// Whether SDO and EMCY work.
    pub(super) const fn communicates(self) -> bool {
        use NmtState::{Operational, PreOperational};
        matches!(self, Self::Running(PreOperational | Operational))
    }

    /// Whether PDOs work.
    pub(super) const fn is_operational(self) -> bool {
        matches!(self, Self::Running(NmtState::Operational))
    }
}

impl CanopenServer {
    /// The node gets power and boots.
    pub fn power_on(&mut self, now: Time) {
        self.dictionary.reset_all();
        self.rudeness.upper_limit_written = false;
        self.errors = Errors::default();
        self.emergency_free = now;
        self.publish_errors();
        self.restart(now);
    }

    /// The node loses power: everything volatile is gone, nothing more is sent.
    pub fn power_off(&mut self) {
        self.phase = Phase::Off;
        self.habits = Habits::default();
        self.lost_producer = None;
        self.sdo.reset();
        self.outbox.clear();
        self.events.clear();
        self.heartbeat_due = Time::NEVER;
        self.consumers.clear();
        self.listen_anew();
    }

    fn restart(&mut self, now: Time) {
        self.sdo.reset();
        self.outbox.clear();
        self.heartbeat_due = Time::NEVER;
        self.habits = Habits::default();
        self.reload_consumers(now);
        self.reload_pdos(now);
        let until = now + self.boot_delay;
        self.phase = Phase::Booting { until };
    }

    pub(super) fn boot_up(&mut self, now: Time) {
        self.outbox
            .send(emit_heartbeat(self.node, NmtState::BootUp));
        self.enter(now, NmtState::PreOperational);
        self.restart_heartbeat(now);
        self.habits_after_boot(now);
    }

    pub(super) fn handle_nmt(&mut self, now: Time, frame: &CanFrame) {
        let Ok((command, addressed)) = NmtCommand::parse(frame) else {
            return;
        };
        let for_us = addressed.is_none_or(|node| node == self.node);
        let is_broadcast = frame.data()[1] == 0;
        if !for_us || (addressed.is_none() && !is_broadcast) || self.nmt_state().is_none() {
            return;
        }
        match command {
            NmtCommand::Start => self.enter(now, NmtState::Operational),
            NmtCommand::Stop => self.enter(now, NmtState::Stopped),
            NmtCommand::EnterPreOperational => self.enter(now, NmtState::PreOperational),
            NmtCommand::ResetNode => {
                self.power_on(now);
                self.events.push_back(ServerEvent::ResetNode);
            }
            NmtCommand::ResetCommunication => {
                self.dictionary.reset_communication();
                self.publish_errors();
                self.restart(now);
                self.events.push_back(ServerEvent::ResetCommunication);
            }
        }
    }

    pub(super) fn enter(&mut self, now: Time, state: NmtState) {
        let before = std::mem::replace(&mut self.phase, Phase::Running(state));
        if before == self.phase {
            return;
        }
        if state == NmtState::Stopped {
            self.sdo.reset();
        }
        if state == NmtState::Operational {
            self.tpdos.iter_mut().for_each(|tpdo| tpdo.start(now));
        }
        self.events.push_back(ServerEvent::Nmt(state));
    }

    pub(super) fn produce_heartbeat(&mut self, now: Time) {
        let Some(state) = self.nmt_state() else {
            return;
        };
        if now < self.heartbeat_due {
            return;
        }
        self.heartbeat_due = self.heartbeat_due.max(now) + self.heartbeat_period();
        if !self
            .rudeness
            .switched("heartbeat_mute", |m| m.heartbeat_mute)
        {
            self.outbox.send(emit_heartbeat(self.node, state));
        }
    }

    fn heartbeat_period(&self) -> Duration {
        Duration::from_millis(self.get(0x1017, 0) as u64)
    }

    /// 0x1017 was written or the node booted: the first beat comes after one period.
    pub(super) fn restart_heartbeat(&mut self, now: Time) {
        let period = self.heartbeat_period();
        self.heartbeat_due = if period.is_zero() {
            Time::NEVER
        } else {
            now + period
        };
    }

    /// Without a watch no producer is missed any more.
    pub(super) fn reload_consumers(&mut self, now: Time) {
        let entries = self.get(0x1016, 0) as u8;
        let entry = |sub| Consumer::from_entry(self.get(0x1016, sub) as u32);
        self.consumers = (1..=entries).map(entry).collect();
        self.listen_anew();
        if let Some(producer) = self.lost_producer
            && self.consumers.iter().flatten().next().is_none()
        {
            self.find_heartbeat(now, producer);
        }
    }

    pub(super) fn handle_heartbeat(&mut self, now: Time, producer: NodeId) {
        if self.nmt_state().is_none() {
            return;
        }
        let watching = self.consumers.iter_mut().flatten();
        let watching = watching.filter(|consumer| consumer.producer == producer);
        let heard = watching.map(|consumer| consumer.heard(now)).count() > 0;
        if heard {
            self.find_heartbeat(now, producer);
        }
    }

    pub(super) fn watch_heartbeats(&mut self, now: Time) {
        if self.nmt_state().is_none() {
            return;
        }
        for place in 0..self.consumers.len() {
            if let Some(consumer) = &mut self.consumers[place]
                && consumer.expires(now)
            {
                let producer = consumer.producer;
                self.lose_heartbeat(now, producer);
            }
        }
    }

    /// EMCY 0x8130, then what 0x1029:01 says: 0 leave operational, 1 nothing, 2 stop.
    pub(super) fn lose_heartbeat(&mut self, now: Time, producer: NodeId) {
        self.lost_producer = Some(producer);
        let detail = [producer.raw(), 0, 0, 0, 0];
        let code = EmergencyCode::HEARTBEAT_LOST;
        self.raise(now, code, register::COMMUNICATION, detail);
        self.events.push_back(ServerEvent::HeartbeatLost(producer));
        match self.get(0x1029, 1) {
            0 if self.phase.is_operational() => self.enter(now, NmtState::PreOperational),
            2 => self.enter(now, NmtState::Stopped),
            _ => {}
        }
    }
}
