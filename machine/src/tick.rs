//! The one loop: whatever waits, waits here.
//!
//! A tick receives at most one arrival, hands it to the devices of its port, lets deadlines
//! fire, sends what the devices want to send, and judges their alarms. Nothing outside acts
//! by itself: every event comes through here.

use drivers::device::{Alarm, LineUse};
use drivers::transport::SendError;
use units::Time;
use wire::can::{BusError, BusErrorClass, ControllerProblem};
use wire::{Arrival, Input, LinkState, Payload, Port};

use crate::failure::Failure;
use crate::machine::{Machine, Supervision};
use crate::outbox::Sender;

/// So many warnings are kept for later.
const WARNINGS_HELD: usize = 32;

impl Machine {
    /// Lets the machine live until something happened or the clock reaches `until`.
    ///
    /// # Errors
    /// When somebody asked to stop, a bus failed, a device raised an alarm, or something
    /// could not be sent. The axes still move then: see [`Machine::guarded`].
    pub fn tick(&mut self, until: Time) -> Result<(), Failure> {
        self.send_pending()?;
        let again = self.outbox.poll_timeout(self.transport.now());
        let deadline = until.min(self.next_deadline()).min(again);
        self.host_watch.waits(deadline);
        let arrival = self.transport.receive(deadline);
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
        self.send_pending()?;
        self.judge_alarms()?;
        if self.supervision != Supervision::Stopping && self.stop.is_requested() {
            return Err(self.stop.failure());
        }
        Ok(())
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

    fn next_deadline(&self) -> Time {
        let beats = self
            .heartbeats
            .iter()
            .map(|(_, producer)| producer.poll_timeout());
        beats.fold(self.next_device_deadline(), Time::min)
    }

    pub(crate) fn take(&mut self, arrival: &Arrival) -> Result<(), Failure> {
        self.each_device(|port, device| {
            if port == arrival.port {
                device.handle(arrival.at, &arrival.input);
            }
        });
        if self.supervision == Supervision::Stopping {
            return Ok(());
        }
        let now = self.transport.now();
        if let Some(told) = self.bus_watch.observe(arrival, now)? {
            self.warn(told);
        }
        match arrival.input {
            Input::Link(state @ (LinkState::Down | LinkState::Gone)) => Err(Failure::Link {
                port: self.port_name(arrival.port),
                state,
            }),
            Input::BusError(error) if error.class.contains(BusErrorClass::BUS_OFF) => {
                Err(Failure::BusOff {
                    port: self.port_name(arrival.port),
                })
            }
            Input::BusError(error) => {
                self.warn_of(arrival.port, error);
                Ok(())
            }
            Input::Lost(frames) => {
                let port = self.port_name(arrival.port);
                let text =
                    format!("{port}: {frames} received frames were lost; is the host overloaded?");
                self.warn(text);
                Ok(())
            }
            Input::Link(LinkState::Up) | Input::Payload(_) => Ok(()),
        }
    }

    /// A bus that gets worse goes on, but somebody should look at its cable.
    fn warn_of(&mut self, port: Port, error: BusError) {
        let passive = ControllerProblem::RX_PASSIVE | ControllerProblem::TX_PASSIVE;
        let high = ControllerProblem::RX_WARNING | ControllerProblem::TX_WARNING;
        let state = match error.controller {
            it if it.intersects(passive) => "error-passive",
            it if it.intersects(high) => "many errors",
            _ => return,
        };
        let port = self.port_name(port);
        self.warn(format!(
            "{port}: {state}; check cable, termination and shield"
        ));
    }

    /// Tells the observer, or keeps it for later while a loop must not wait for him.
    fn warn(&mut self, text: String) {
        match &mut self.held_back {
            None => self.observer.warning(&text),
            Some(held) if held.len() < held.capacity() => held.push(text),
            // As many as anybody reads.
            Some(_) => {}
        }
    }

    /// Runs `procedure` without telling the observer anything meanwhile.
    pub(crate) fn holding_back<R>(&mut self, procedure: impl FnOnce(&mut Self) -> R) -> R {
        self.held_back = Some(Vec::with_capacity(WARNINGS_HELD));
        let result = procedure(self);
        for text in self.held_back.take().unwrap_or_default() {
            self.observer.warning(&text);
        }
        result
    }

    pub(crate) fn fire_deadlines(&mut self, now: Time) {
        self.each_device(|_, device| {
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
        for at in 0..self.device_count() {
            while let Some((port, payload)) = self.next_payload(at) {
                self.send(port, payload, Sender::Device(at))?;
            }
        }
        Ok(())
    }

    /// What device number `at` wants to send, when it has its turn.
    fn next_payload(&mut self, at: usize) -> Option<(Port, Payload)> {
        let unit = self.device_mut(at);
        let (port, own) = (unit.port, unit.device.line_use());
        if own == LineUse::Unshared {
            return unit.device.poll_transmit().map(|payload| (port, payload));
        }
        if !self.may_speak(at, port, own) {
            return None;
        }
        let payload = self.device_mut(at).device.poll_transmit()?;
        Some((port, payload))
    }

    /// Whether device number `at` has its turn on a line that it shares.
    fn may_speak(&mut self, at: usize, port: Port, own: LineUse) -> bool {
        let others: Vec<_> = (0..self.device_count())
            .filter(|other| *other != at)
            .filter_map(|other| {
                let unit = self.device_mut(other);
                (unit.port == port).then(|| (unit.device.line_use(), other < at))
            })
            .collect();
        own.may_speak(others)
    }

    fn send(&mut self, port: Port, payload: Payload, sender: Sender) -> Result<(), Failure> {
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
                port: self.port_name(port),
                state,
            }),
            source => Err(Failure::Send {
                device: match sender {
                    Sender::Heartbeat => "heartbeat".to_owned(),
                    Sender::Device(at) => self.device_name(at),
                },
                source,
            }),
        }
    }

    pub(crate) fn judge_alarms(&mut self) -> Result<(), Failure> {
        // Allocates nothing as long as nobody raises one, which is nearly always.
        let mut raised = Vec::new();
        let mut at = 0;
        self.each_device(|_, device| {
            while let Some(alarm) = device.poll_alarm() {
                raised.push((at, alarm));
            }
            at += 1;
        });
        for (at, alarm) in &raised {
            self.forget_reference(*at, alarm);
        }
        let first = raised.into_iter().find(|(at, _)| self.alarm_counts(*at));
        match first {
            Some((at, alarm)) if self.supervision == Supervision::On => Err(Failure::Alarm {
                device: self.device_name(at),
                alarm,
            }),
            _ => Ok(()),
        }
    }

    /// An instrument or a camera that nobody reads may have its beam blocked.
    fn alarm_counts(&self, at: usize) -> bool {
        at < self.instrument_device(0) || self.instrument_in_use == Some(self.device_name(at))
    }

    /// A drive that was reset has lost its origin, whoever is listening.
    fn forget_reference(&mut self, at: usize, alarm: &Alarm) {
        let lost = matches!(
            alarm,
            Alarm::UnexpectedBootUp { .. }
                | Alarm::DuplicateNode { .. }
                | Alarm::AmplifierRestarted { .. }
        );
        if !lost || at >= self.drive_count() {
            return;
        }
        self.zeroed[at] = false;
    }

    pub(crate) fn port_name(&self, port: Port) -> String {
        let mut buses = self.buses.iter();
        let bus = buses.find(|it| it.port == port).map(|it| &it.name);
        let name = bus.or_else(|| self.lines.get(&port));
        name.cloned().unwrap_or_else(|| format!("port {}", port.0))
    }
}
