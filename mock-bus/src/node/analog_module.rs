//! When a CANopen module samples its analog inputs, which is the same for every profile.
//!
//! Inputs are sampled when they are asked for: at the SYNC of a synchronous TPDO, by SDO, and, while
//! the profile reports events, at the sampling period.

use std::time::Duration;

use units::Time;
use wire::Payload;
use wire::can::CanFrame;
use wire::canopen::nmt::NmtState;
use wire::canopen::{Function, NodeId, Object};

use super::Node;
use super::canopen_server::dictionary::Dictionary;
use super::canopen_server::{CanopenServer, Deliveries, Description, Manners, ServerEvent};
use crate::plant::Plant;

/// What the inputs are wired to.
pub trait Wires {
    /// Volts at a terminal of the plant.
    fn volts(&mut self, terminal: usize) -> f64;

    /// Degrees Celsius there; `None` where there is no sensor.
    fn celsius(&mut self, _terminal: usize) -> Option<f64> {
        None
    }
}

impl Wires for Plant {
    fn volts(&mut self, terminal: usize) -> f64 {
        self.analog_volts(terminal)
    }

    fn celsius(&mut self, terminal: usize) -> Option<f64> {
        self.analog_temperature(terminal).map(|it| it.value())
    }
}

/// What a module is like apart from its profile.
#[derive(Clone, Copy, Debug)]
pub struct Module<'a> {
    /// Its number, 1 to 127.
    pub node_id: u8,
    /// How long it takes to boot.
    pub boot_delay_ms: u64,
    /// How often it samples by itself.
    pub sampling_period_ms: u64,
    /// How many inputs it has.
    pub inputs: usize,
    /// What it spoils.
    pub manners: &'a Manners,
}

/// What a profile makes of a module.
pub trait Profile: Send {
    /// What it is like apart from its profile.
    fn module(&self) -> Module<'_>;

    /// What a master reads of it first.
    fn description(&self, node: NodeId) -> Description;

    /// What it has beyond that.
    fn dictionary(&self) -> Dictionary;

    /// Samples every input.
    fn sample(&self, server: &mut CanopenServer, wires: &mut dyn Wires);

    /// Whether a sample is wanted at this SYNC.
    fn samples_at_sync(&self, server: &CanopenServer) -> bool;

    /// Whether events are enabled.
    fn reports_events(&self, server: &CanopenServer) -> bool;

    /// What input `sub` (from 1) has to report, when `last` was reported last: its value and the
    /// object that carries it.
    fn event(&self, server: &CanopenServer, sub: u8, last: Option<i64>) -> Option<(i64, Object)>;
}

/// An emulated analog module on the bus.
///
/// # Example
///
/// ```
/// use mock_bus::node::Node;
/// use mock_bus::node::cia401_analog::{Cia401AnalogConfig, Cia401AnalogNode};
/// use mock_bus::plant::Plant;
/// use units::Time;
/// use wire::{Payload, can::CanFrame};
///
/// let mut module = Cia401AnalogNode::new(Cia401AnalogConfig { node_id: 5, ..Default::default() });
/// module.advance(Time::from_seconds(0.1), &mut Plant::default());
/// let boot_up = Payload::Frame(CanFrame::standard(0x705, &[0]));
/// assert_eq!(module.poll_transmit(), Some(boot_up));
/// ```
#[derive(Debug)]
pub struct AnalogModule<P> {
    profile: P,
    server: CanopenServer,
    sample_due: Time,
    /// What the last event reported, per input.
    reported: Vec<Option<i64>>,
}

impl<P: Profile> AnalogModule<P> {
    /// A module that was powered at [`Time::ZERO`] and boots.
    ///
    /// # Panics
    /// When its number is not 1 to 127, which reading a configuration file refuses.
    pub fn new(profile: P) -> Self {
        let module = profile.module();
        let node = NodeId::new(module.node_id).expect("node_id is 1 to 127");
        let server = CanopenServer::new(
            node,
            Duration::from_millis(module.boot_delay_ms),
            &profile.description(node),
            profile.dictionary(),
            module.manners.clone(),
        );
        Self {
            reported: vec![None; module.inputs],
            profile,
            server,
            sample_due: Time::NEVER,
        }
    }

    /// What it still spoils; writing it spoils what comes next.
    pub fn manners_mut(&mut self) -> &mut Manners {
        self.server.manners_mut()
    }

    /// Which faults were delivered, and how often.
    pub const fn deliveries(&self) -> &Deliveries {
        self.server.deliveries()
    }

    pub(super) fn handle_frame(&mut self, now: Time, frame: &CanFrame, wires: &mut dyn Wires) {
        if !self.server.is_powered() || !self.server.concerns(frame) {
            return;
        }
        let own_request = self.server.node().cob_id(Function::SdoRequest);
        if frame.standard_id() == Some(own_request) {
            self.profile.sample(&mut self.server, wires);
        }
        self.server.handle(now, frame);
        self.settle(now, wires);
    }

    pub(super) fn pass_time(&mut self, now: Time, wires: &mut dyn Wires) {
        if !self.server.is_powered() {
            return;
        }
        if self.sample_due <= now {
            let period_ms = self.profile.module().sampling_period_ms.max(1);
            self.sample_due = now + Duration::from_millis(period_ms);
            self.profile.sample(&mut self.server, wires);
            self.report_events(now);
        }
        self.server.advance(now);
        self.settle(now, wires);
    }

    fn settle(&mut self, now: Time, wires: &mut dyn Wires) {
        while let Some(event) = self.server.poll_event() {
            match event {
                ServerEvent::Synchronised => {
                    if self.profile.samples_at_sync(&self.server) {
                        self.profile.sample(&mut self.server, wires);
                    }
                    self.server.send_synchronous(now);
                }
                ServerEvent::Written(_)
                | ServerEvent::Nmt(_)
                | ServerEvent::ResetNode
                | ServerEvent::ResetCommunication => self.schedule(now),
                ServerEvent::HeartbeatLost(_)
                | ServerEvent::HeartbeatBack(_)
                | ServerEvent::RpdoLost => {}
            }
        }
    }

    /// The converter runs by itself only while events are enabled and may be sent.
    fn schedule(&mut self, now: Time) {
        let operational = self.server.nmt_state() == Some(NmtState::Operational);
        if !(operational && self.profile.reports_events(&self.server)) {
            self.sample_due = Time::NEVER;
            self.reported.fill(None);
        } else if self.sample_due == Time::NEVER {
            self.sample_due = now;
        }
    }

    /// Which inputs have an event, and the TPDOs that carry them.
    fn report_events(&mut self, now: Time) {
        for (sub, reported) in (1..).zip(&mut self.reported) {
            if let Some((value, object)) = self.profile.event(&self.server, sub, *reported) {
                *reported = Some(value);
                self.server.trigger(now, object);
            }
        }
    }

    #[cfg(test)]
    pub(super) fn next_frame(&mut self) -> Option<CanFrame> {
        self.server.poll_transmit()
    }
}

impl<P: Profile + 'static> Node for AnalogModule<P> {
    fn concerns(&self, payload: &Payload) -> bool {
        matches!(payload, Payload::Frame(frame) if self.server.concerns(frame))
    }

    fn handle(&mut self, now: Time, payload: &Payload, plant: &mut Plant) {
        if let Payload::Frame(frame) = payload {
            self.handle_frame(now, frame, plant);
        }
    }

    fn advance(&mut self, now: Time, plant: &mut Plant) {
        self.pass_time(now, plant);
    }

    fn next_event(&self) -> Time {
        self.sample_due.min(self.server.next_event())
    }

    fn poll_transmit(&mut self) -> Option<Payload> {
        self.server.poll_transmit().map(Payload::Frame)
    }

    fn power_off(&mut self, _now: Time, _plant: &mut Plant) {
        self.sample_due = Time::NEVER;
        self.server.power_off();
    }

    fn power_on(&mut self, now: Time, _plant: &mut Plant) {
        self.reported.fill(None);
        self.server.power_on(now);
    }
}
