//! The one loop: whatever waits, waits here.
//!
//! A tick receives at most one arrival, hands it to the devices of its port, lets deadlines
//! fire, sends what the devices want to send, and judges their alarms. Nothing outside acts
//! by itself: every event comes through here.

use drivers::device::Alarm;
use drivers::transport::SendError;
use units::Time;
use wire::can::{BusError, BusErrorClass, ControllerProblem};
use wire::canopen::emcy::Emergency;
use wire::{Arrival, Input, LinkState, Payload, Port};

use crate::failure::Failure;
use crate::machine::{Machine, Supervision, call_attendant};
use crate::outbox::Sender;

impl Machine {
    /// Lets the machine live until something happened or the clock reaches `until`.
    ///
    /// # Errors
    /// When somebody asked to stop, a bus failed, a device raised an alarm, something
    /// could not be sent, or an [`Attendant`](crate::Attendant) ends what runs. The axes still move then: see [`Machine::guarded`].
    pub fn tick(&mut self, until: Time) -> Result<(), Failure> {
        self.send_pending()?;
        let begun = self.transport.now();
        let again = self.outbox.poll_timeout(begun);
        let beats = self.heartbeats.iter().map(|(_, beat)| beat.poll_timeout());
        let next = beats.fold(self.devices.next_deadline(), Time::min);
        let deadline = until.min(next).min(again);
        self.host_watch.waits(begun, deadline);
        let unhurried = self.devices.unhurried_ports();
        let arrival = self.transport.receive_unhurried(deadline, unhurried);
        // What has arrived is older than the clock when this thread was held up: deadlines are
        // judged at the time of what was heard, so that nothing counts as missing that only
        // waits behind this arrival.
        let now = arrival
            .as_ref()
            .map_or_else(|| self.transport.now(), |arrival| arrival.at);
        if let Some(arrival) = arrival {
            self.take(&arrival)?;
        }
        self.fire_deadlines(now);
        let wanted = self.ports.is_synchronous;
        self.devices.keep_looking(now, wanted, &mut self.notices);
        self.notices.lives(now);
        self.send_pending()?;
        self.judge_alarms()?;
        if self.supervision != Supervision::Stopping && self.stop.is_requested() {
            return Err(self.stop.failure());
        }
        let attended = call_attendant(self);
        if self.supervision == Supervision::Stopping {
            // Nothing keeps a stop from finishing.
            return Ok(());
        }
        attended
    }

    /// Ticks until the clock reaches `until`.
    ///
    /// # Errors
    /// As [`Machine::tick`].
    pub fn run_until(&mut self, until: Time) -> Result<(), Failure> {
        while self.now() < until {
            self.tick(until)?;
        }
        Ok(())
    }

    /// Takes note of what arrived while nobody listened, and acts on none of it.
    pub(crate) fn catch_up(&mut self) {
        let now = self.now();
        self.supervision = Supervision::Stopping;
        while let Some(arrival) = self.transport.receive(now) {
            let is_old = arrival.at < now;
            // Nothing is judged while stopping.
            let _ = self.take(&arrival);
            if !is_old {
                break;
            }
        }
        let _ = self.judge_alarms();
        self.supervision = Supervision::Off;
    }

    pub(crate) fn take(&mut self, arrival: &Arrival) -> Result<(), Failure> {
        self.bus_account.heard(arrival);
        self.devices.each(|port, device| {
            if port == arrival.port {
                device.handle(arrival.at, &arrival.input);
            }
        });
        let now = self.transport.now();
        self.diagnosis.note(arrival, now);
        if self.supervision == Supervision::Stopping {
            self.bus_watch.count(arrival, now);
            return Ok(());
        }
        if let Some(told) = self.bus_watch.observe(arrival, now)? {
            self.notices.warn(told);
        }
        match arrival.input {
            Input::Link(state @ (LinkState::Down | LinkState::Gone)) => Err(Failure::Link {
                port: self.ports.name(arrival.port),
                state,
            }),
            Input::BusError(error) if error.class.contains(BusErrorClass::BUS_OFF) => {
                Err(Failure::BusOff {
                    port: self.ports.name(arrival.port),
                })
            }
            Input::BusError(error) => {
                if let Some(state) = worse(error) {
                    let port = self.ports.name(arrival.port);
                    self.notices.warn(format!(
                        "{port}: {state}; check cable, termination and shield"
                    ));
                }
                Ok(())
            }
            Input::Lost(frames) => {
                let port = self.ports.name(arrival.port);
                let text =
                    format!("{port}: {frames} received frames were lost; is the host overloaded?");
                self.notices.warn(text);
                Ok(())
            }
            Input::Link(LinkState::Up) | Input::Payload(_) => Ok(()),
        }
    }

    pub(crate) fn fire_deadlines(&mut self, now: Time) {
        self.devices.each(|_, device| {
            if device.poll_timeout() <= now {
                device.handle_timeout(now);
            }
        });
    }

    pub(crate) fn send_pending(&mut self) -> Result<(), Failure> {
        let flushed = self.outbox.flush(&mut *self.transport, self.patience);
        flushed.or_else(|refusal| self.judge_refusal(refusal))?;
        let now = self.transport.now();
        self.host_watch.looks(now);
        for at in 0..self.heartbeats.len() {
            let (port, producer) = &mut self.heartbeats[at];
            producer.handle_timeout(now);
            if let Some(frame) = producer.poll_transmit() {
                let port = *port;
                self.send(port, Payload::Frame(frame), Sender::Heartbeat)?;
            }
        }
        for at in 0..self.devices.count() {
            while let Some((port, payload)) = self.devices.next_payload(at) {
                self.send(port, payload, Sender::Device(at))?;
            }
        }
        Ok(())
    }

    fn send(&mut self, port: Port, payload: Payload, sender: Sender) -> Result<(), Failure> {
        self.bus_account.sent(port, &payload);
        let sent = self
            .outbox
            .send(&mut *self.transport, port, payload, sender);
        sent.or_else(|refusal| self.judge_refusal(refusal))
    }

    fn judge_refusal(&self, (sender, source): (Sender, SendError)) -> Result<(), Failure> {
        match source {
            // While stopping, what can be sent is sent; the drives' watchdogs do the rest.
            _ if self.supervision == Supervision::Stopping => Ok(()),
            SendError::Unusable { port, state } => Err(Failure::Link {
                port: self.ports.name(port),
                state,
            }),
            source => Err(Failure::Send {
                device: match sender {
                    Sender::Heartbeat => "heartbeat".to_owned(),
                    Sender::Device(at) => self.devices.name(at),
                },
                source,
            }),
        }
    }

    pub(crate) fn judge_alarms(&mut self) -> Result<(), Failure> {
        // Allocates nothing as long as nobody raises one, which is nearly always.
        let mut raised = Vec::new();
        let mut at = 0;
        self.devices.each(|_, device| {
            while let Some(alarm) = device.poll_alarm() {
                raised.push((at, alarm));
            }
            at += 1;
        });
        for (at, alarm) in raised.iter().filter(|it| it.0 < self.devices.drive_count()) {
            if takes_reference(alarm) {
                self.zeroed[*at] = false;
            }
            // Nothing is done with files before everything has been stopped.
            self.doubted[*at] |= !is_of_communication(alarm);
        }
        if self.supervision == Supervision::Off {
            for (at, alarm) in &raised {
                // Its driver stops it; nothing else is under way that could end.
                if let Alarm::EnabledUnasked { .. } = alarm {
                    let device = self.devices.name(*at);
                    self.notices
                        .warn(format!("{device}: {alarm}; it was stopped"));
                }
            }
        }
        // An instrument or a camera that nobody reads may have its beam blocked.
        let machines_own = self.devices.instrument_device(0);
        let is_used = |at| self.instrument_in_use == Some(self.devices.name(at));
        let mut raised = raised.into_iter();
        let first = raised.find(|(at, _)| *at < machines_own || is_used(*at));
        match first {
            Some((at, alarm)) if self.supervision == Supervision::On => Err(Failure::Alarm {
                device: self.devices.name(at),
                alarm,
            }),
            _ => Ok(()),
        }
    }
}

/// A bus that gets worse goes on, but somebody should look at its cable.
fn worse(error: BusError) -> Option<&'static str> {
    let passive = ControllerProblem::RX_PASSIVE | ControllerProblem::TX_PASSIVE;
    let high = ControllerProblem::RX_WARNING | ControllerProblem::TX_WARNING;
    match error.controller {
        it if it.intersects(passive) => Some("error-passive"),
        it if it.intersects(high) => Some("many errors"),
        _ => None,
    }
}

/// A drive that was reset, that lost count, or whose encoder failed, has lost its origin, whoever is listening.
const fn takes_reference(alarm: &Alarm) -> bool {
    /// The class of a sensor's errors (CiA 402, error codes; 0x7305 is the first incremental encoder).
    const SENSOR: u16 = 0x7300;
    match alarm {
        Alarm::UnexpectedBootUp { .. }
        | Alarm::DuplicateNode { .. }
        | Alarm::AmplifierRestarted { .. }
        | Alarm::PositionJump { .. } => true,
        Alarm::Emergency { emergency, .. } => class_of(emergency) == SENSOR,
        _ => false,
    }
}

/// That a drive was not heard says nothing of where its axis is. After anything else it is zeroed again, whatever it proves.
const fn is_of_communication(alarm: &Alarm) -> bool {
    /// The class of errors of communication (CiA 301, table 26).
    const COMMUNICATION: u16 = 0x8100;
    match alarm {
        Alarm::HeartbeatLost { .. }
        | Alarm::UnexpectedNmtState { .. }
        | Alarm::PdoLost { .. }
        | Alarm::PdoTooShort { .. } => true,
        Alarm::Emergency { emergency, .. } => class_of(emergency) == COMMUNICATION,
        _ => false,
    }
}

/// What sort of error it is: the upper half of its code (CiA 301, table 26).
const fn class_of(emergency: &Emergency) -> u16 {
    emergency.code.0 & 0xFF00
}
