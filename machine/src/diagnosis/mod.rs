//! Causes of missing or false data, looked for in the traffic while the machine is stopped.
//!
//! Every frame is noted by the node that sent it. A failure opens a question about its device. The traffic from then on
//! until every drive has been stopped answers it: a node without power says nothing, one whose process data were
//! switched off still sends heartbeats, one that was reset boots. Nothing here waits, asks a clock or sends.

mod finding;
mod node_traffic;
mod question;

use core::time::Duration;
use std::collections::BTreeMap;

use units::Time;
use wire::can::{BusErrorClass, CanFrame, CanId};
use wire::canopen::sdo::SdoRequest;
use wire::canopen::{Function, NodeId};
use wire::{Arrival, Input, LinkState, Payload, Port};

pub use finding::Finding;
pub(crate) use question::is_wait;

use self::node_traffic::NodeTraffic;
use self::question::{Question, device_of, may_be_limit, questions, root};
use crate::bus_watch::is_absence;
use crate::failure::Failure;
use crate::parts;

/// The share of what comes is known after two of its windows.
const SHARE_PERIODS: u32 = 8;
/// The longest look for a cause after everything was stopped.
pub(crate) const LOOK_LIMIT: Duration = Duration::from_millis(400);

/// The traffic of all buses, and the question that it has to answer.
#[derive(Debug, Default)]
pub(crate) struct Diagnosis {
    buses: BTreeMap<Port, BusTraffic>,
    question: Option<Question>,
    /// How old the newest arrival was when it was taken: a computer that is behind judges by what it has heard.
    lag: Duration,
}

#[derive(Debug)]
struct BusTraffic {
    name: String,
    period: Duration,
    /// By the devices' names.
    devices: BTreeMap<String, NodeId>,
    drives: Vec<NodeId>,
    nodes: BTreeMap<NodeId, NodeTraffic>,
    /// When our controller left the bus.
    bus_off: Option<Time>,
    /// The newest loss of the interface.
    link_lost: Option<(Time, LinkState)>,
}

impl Diagnosis {
    pub(crate) fn new(buses: &[parts::Bus]) -> Self {
        let traffic = |bus: &parts::Bus| BusTraffic {
            name: bus.name.clone(),
            period: bus.sync_period,
            devices: bus
                .nodes
                .iter()
                .map(|(node, expected)| (expected.device.clone(), *node))
                .collect(),
            drives: bus.drives.clone(),
            nodes: bus
                .nodes
                .keys()
                .map(|node| (*node, NodeTraffic::default()))
                .collect(),
            bus_off: None,
            link_lost: None,
        };
        Self {
            buses: buses.iter().map(|bus| (bus.port, traffic(bus))).collect(),
            question: None,
            lag: Duration::ZERO,
        }
    }

    /// Forgets all traffic: the machine starts.
    pub(crate) fn begin(&mut self) {
        self.question = None;
        for bus in self.buses.values_mut() {
            bus.bus_off = None;
            bus.link_lost = None;
            bus.nodes
                .values_mut()
                .for_each(|node| *node = NodeTraffic::default());
        }
    }

    /// Takes what came in, and is looked at now.
    pub(crate) fn note(&mut self, arrival: &Arrival, now: Time) {
        self.lag = now.since(arrival.at);
        let Some(bus) = self.buses.get_mut(&arrival.port) else {
            return;
        };
        match &arrival.input {
            Input::Payload(Payload::Frame(frame)) => bus.note(arrival.at, frame),
            Input::Link(state @ (LinkState::Down | LinkState::Gone)) => {
                bus.link_lost = Some((arrival.at, *state));
            }
            Input::BusError(error) if error.class.contains(BusErrorClass::BUS_OFF) => {
                bus.bus_off = Some(arrival.at);
            }
            _ => {}
        }
    }

    /// Whether our controller left `bus`, where it can be used no more.
    pub(crate) fn is_bus_off(&self, bus: &str) -> bool {
        let mut buses = self.buses.values();
        buses.any(|traffic| traffic.name == bus && traffic.bus_off.is_some())
    }

    /// Nothing is asked.
    pub(crate) fn forget(&mut self) {
        self.question = None;
    }

    /// Opens the question of why `failure` happened, or none when it is not about the traffic of a node.
    pub(crate) fn ask(&mut self, now: Time, failure: &Failure) {
        self.question = device_of(failure).and_then(|device| {
            let mut buses = self.buses.iter();
            let (port, node) =
                buses.find_map(|(port, bus)| Some((*port, *bus.devices.get(device)?)))?;
            Some(Question {
                device: device.to_owned(),
                port,
                node,
                failed: now,
                is_absence: is_absence(root(failure)),
                may_be_limit: may_be_limit(root(failure)),
                planned: questions(root(failure)),
                asked: None,
                answer: None,
            })
        });
    }

    /// The next question to the drive: its statusword, which its process data should say, then its digital inputs.
    pub(crate) fn poll_probe(&mut self, now: Time) -> Option<(Port, CanFrame)> {
        let question = self.question.as_mut()?;
        let bus = self.buses.get(&question.port)?;
        let node = bus.nodes.get(&question.node)?;
        if node.heard.is_none() || !bus.drives.contains(&question.node) {
            return None;
        }
        let object = question.next_object(now, node)?;
        let request = SdoRequest::UploadInitiate { object };
        let cob_id = question.node.cob_id(Function::SdoRequest);
        Some((question.port, CanFrame::standard(cob_id, &request.emit())))
    }

    /// Until when it is worth to look further, `None` when nothing is asked.
    pub(crate) fn look_until(&self, now: Time) -> Option<Time> {
        let question = self.question.as_ref()?;
        let bus = self.buses.get(&question.port)?;
        let shares_known = question.failed + bus.period * SHARE_PERIODS;
        if now < shares_known {
            return Some(shares_known);
        }
        let node = bus.nodes.get(&question.node)?;
        let may_answer = question.is_absence || question.may_tell_more(now, bus, node);
        let until = question.failed + LOOK_LIMIT.max(question.silent_after(bus));
        let is_open = self.find(now).is_none() || question.may_tell_more(now, bus, node);
        (may_answer && now < until && is_open).then_some(until)
    }

    /// Answers the question by what was heard until now: SYNC ends, and process data with it.
    pub(crate) fn conclude(&mut self, now: Time) {
        let answer = self.find(now);
        if let Some(question) = &mut self.question {
            question.answer = answer;
        }
    }

    /// The device in question and the answer of [`Diagnosis::conclude`], once.
    pub(crate) fn take_answer(&mut self) -> Option<(String, Finding)> {
        let question = self.question.take()?;
        Some((question.device, question.answer?))
    }

    /// What is seen of `device` until now, for a warning.
    pub(crate) fn finding_of(&self, now: Time, device: &str) -> Option<Finding> {
        let question = self.question.as_ref()?;
        let finding = question.answer.clone().or_else(|| self.find(now));
        finding.filter(|_| question.device == device)
    }

    /// The identifiers that the node in question sends itself.
    pub(crate) fn is_own(&self, id: CanId) -> bool {
        let node = self.question.as_ref().map(|question| question.node);
        let CanId::Standard(cob_id) = id else {
            return false;
        };
        Function::of(cob_id).is_some_and(|(_, sender)| Some(sender) == node)
    }

    fn find(&self, now: Time) -> Option<Finding> {
        let heard = Time(now.0.saturating_sub(self.lag.as_nanos() as u64));
        let question = self.question.as_ref()?;
        let bus = self.buses.get(&question.port)?;
        let node = bus.nodes.get(&question.node)?;
        let lost = bus.link_lost.filter(|(at, _)| *at >= question.failed);
        if let Some((_, state)) = lost {
            let port = bus.name.clone();
            return Some(Finding::LinkLost { port, state });
        }
        if !question.is_absence {
            let frozen = question.frozen(bus, node);
            return frozen.or_else(|| question.on_limit_switch(node));
        }
        question
            .restarted(node)
            .or_else(|| question.silent(heard, bus, node))
            .or_else(|| question.alive(heard, bus, node))
            .or_else(|| question.frozen(bus, node))
            .or_else(|| question.on_limit_switch(node))
    }
}

impl BusTraffic {
    fn note(&mut self, at: Time, frame: &CanFrame) {
        let Some((function, node)) = frame.standard_id().and_then(Function::of) else {
            return;
        };
        if frame.is_remote() {
            return;
        }
        if let Some(traffic) = self.nodes.get_mut(&node) {
            traffic.note(at, function, frame, self.period);
        }
    }

    /// The nodes but `node` that were heard after `since`.
    fn others_after(&self, node: NodeId, since: Time) -> Vec<NodeId> {
        let others = self.nodes.iter().filter(|(other, _)| **other != node);
        let after = others.filter(|(_, traffic)| traffic.heard.is_some_and(|at| at > since));
        after.map(|(other, _)| *other).collect()
    }
}

#[cfg(test)]
mod tests;
