//! Scan: which devices are on the buses, found out without changing anything.
//!
//! Every node number of every CAN bus is asked for its device type (0x1000) and identity
//! (0x1018) by expedited SDO upload; nothing is written and no node changes its state. Devices on
//! serial lines are asked by their drivers, all at once; those that share a line take turns.

use core::time::Duration;
use std::collections::BTreeMap;

use drivers::device::Identity;
use drivers::device::canopen_node::ExpectedIdentity;
use drivers::transport::SendError;
use wire::can::CanFrame;
use wire::canopen::sdo::{SdoRequest, SdoResponse};
use wire::canopen::{Function, NodeId, Object};
use wire::{Arrival, Input, Payload, Port};

use crate::failure::Failure;
use crate::machine::Machine;
use crate::parts::{Bus, ExpectedNode};
use crate::waiting::Watched;

/// What a scan says of one node or device.
#[derive(Clone, Debug, PartialEq)]
pub struct Found {
    /// The bus or line.
    pub port: String,
    /// The node number, `None` on a serial line.
    pub node: Option<u8>,
    /// The device's name in the configuration, `None` when it is not there.
    pub name: Option<String>,
    /// Who it says it is; `None` when it did not answer.
    pub identity: Option<Identity>,
    /// What does not match, in the operator's words; empty when all does.
    pub mismatches: Vec<String>,
}

const DEVICE_TYPE: Object = Object::new(0x1000, 0);
const IDENTITY: [Object; 4] = [
    Object::new(0x1018, 1),
    Object::new(0x1018, 2),
    Object::new(0x1018, 3),
    Object::new(0x1018, 4),
];
/// So many requests are sent before answers are collected: no transmit queue overflows.
const BATCH: usize = 8;
/// What the nodes of one batch usually take to answer.
const BATCH_TIME: Duration = Duration::from_millis(10);
/// How long the last answers may take.
const ANSWER_LIMIT: Duration = Duration::from_millis(300);
/// For so long nodes of the configuration that did not answer are asked again.
const AGAIN_LIMIT: Duration = Duration::from_millis(600);

/// Devices on serial lines say themselves what is wrong, before this has passed.
const SERIAL_LIMIT: Duration = Duration::from_secs(15);

/// What each node said of each object; `None`: that it does not have it, or does not tell.
type Answers = BTreeMap<NodeId, BTreeMap<Object, Option<u32>>>;

/// A device on a serial line that was asked.
struct Asked {
    /// Its number.
    at: usize,
    port: Port,
    /// How it went; `None`: it has not answered yet.
    result: Option<Result<(), String>>,
}

impl Machine {
    /// Asks who is there. Only a bus that fails is an error: what is missing or wrong is in
    /// the result.
    ///
    /// # Errors
    /// When a bus or line cannot be used.
    pub fn scan(&mut self) -> Result<Vec<Found>, Failure> {
        Scan { machine: self }.everywhere()
    }
}

/// A scan that is under way.
struct Scan<'m> {
    machine: &'m mut Machine,
}

impl Scan<'_> {
    /// Why a question to `node` could not be sent: a bus that is gone is named.
    fn not_sent(&mut self, node: NodeId, source: SendError) -> Failure {
        let SendError::Unusable { port, state } = source else {
            let device = format!("{node} while scanning");
            return Failure::Send { device, source };
        };
        // What the port says of itself has arrived already.
        self.machine.catch_up();
        let port = self.machine.ports.name(port);
        match self.machine.diagnosis.is_bus_off(&port) {
            true => Failure::BusOff { port },
            false => Failure::Link { port, state },
        }
    }

    fn everywhere(&mut self) -> Result<Vec<Found>, Failure> {
        let mut found = Vec::new();
        for bus in self.machine.ports.buses.clone() {
            found.extend(self.scan_can(&bus)?);
        }
        found.extend(self.scan_serial()?);
        Ok(found)
    }

    fn scan_can(&mut self, bus: &Bus) -> Result<Vec<Found>, Failure> {
        let (port, name, expected) = (bus.port, &*bus.name, &bus.nodes);
        let mut answers = Answers::new();
        let all: Vec<_> = (1..=127).filter_map(NodeId::new).collect();
        let awaited: Vec<_> = expected.keys().copied().collect();
        self.machine
            .notices
            .observer
            .waiting(&format!("{name}: asking nodes 1 to 127 for their identity"));
        self.ask_once(port, &all, DEVICE_TYPE, &mut answers)?;
        let silent = silent(&awaited, DEVICE_TYPE, &answers);
        if !silent.is_empty() {
            let nodes: Vec<_> = silent.iter().map(ToString::to_string).collect();
            let text = format!("{name}: {} did not answer, asking again", nodes.join(", "));
            self.machine.notices.observer.waiting(&text);
        }
        self.ask_again(port, &awaited, DEVICE_TYPE, &mut answers)?;
        let present: Vec<_> = answers.keys().copied().collect();
        for object in IDENTITY {
            self.ask_once(port, &present, object, &mut answers)?;
            self.ask_again(port, &present, object, &mut answers)?;
        }
        let mut found: Vec<_> = answers
            .iter()
            .map(|(node, values)| judge(name, *node, values, expected.get(node)))
            .collect();
        let absent = expected
            .iter()
            .filter(|(node, _)| !answers.contains_key(node));
        found.extend(absent.map(|(node, it)| missing(name, *node, &it.device)));
        Ok(found)
    }

    /// Asks those of `awaited` again that did not answer: a node that has just been switched on
    /// boots for a moment.
    fn ask_again(
        &mut self,
        port: Port,
        awaited: &[NodeId],
        object: Object,
        answers: &mut Answers,
    ) -> Result<(), Failure> {
        let until = self.machine.now() + self.machine.patience.of(AGAIN_LIMIT);
        loop {
            let silent = silent(awaited, object, answers);
            if silent.is_empty() || self.machine.now() >= until {
                return Ok(());
            }
            self.ask_once(port, &silent, object, answers)?;
        }
    }

    /// Asks `nodes`, and waits a while for answers, no longer than until all have come.
    fn ask_once(
        &mut self,
        port: Port,
        nodes: &[NodeId],
        object: Object,
        answers: &mut Answers,
    ) -> Result<(), Failure> {
        for batch in nodes.chunks(BATCH) {
            for node in batch {
                let request = SdoRequest::UploadInitiate { object }.emit();
                let frame = CanFrame::standard(node.cob_id(Function::SdoRequest), &request);
                self.machine
                    .transport
                    .send(port, &Payload::Frame(frame))
                    .map_err(|source| self.not_sent(*node, source))?;
            }
            self.collect(port, BATCH_TIME, (batch, object), answers)?;
        }
        self.collect(port, ANSWER_LIMIT, (nodes, object), answers)
    }

    /// Takes answers until all `nodes` have said `object`, for `limit` at most.
    fn collect(
        &mut self,
        port: Port,
        limit: Duration,
        (nodes, object): (&[NodeId], Object),
        answers: &mut Answers,
    ) -> Result<(), Failure> {
        let until = self.machine.now() + limit;
        while self.machine.now() < until && !silent(nodes, object, answers).is_empty() {
            if let Some(arrival) = self.machine.transport.receive(until) {
                note_answer(&arrival, port, answers);
            }
            let now = self.machine.now();
            self.machine.notices.lives(now);
            if self.machine.stop.is_requested() {
                return Err(self.machine.stop.failure());
            }
        }
        Ok(())
    }

    /// Everything on a serial line: amplifiers, analog modules and instruments.
    fn scan_serial(&mut self) -> Result<Vec<Found>, Failure> {
        let mut asked = self.ask_lines();
        let limit = SERIAL_LIMIT;
        let mut wait = Watched::new(self.machine.now(), limit, self.machine.patience);
        while self.take_outcomes(&mut asked) && !wait.is_over(self.machine.now()) {
            let now = self.machine.now();
            let silent = asked.iter().filter(|it| it.result.is_none());
            let (devices, notices) = (&mut self.machine.devices, &mut self.machine.notices);
            wait.tell(now, silent.map(|it| it.at), devices, &mut *notices.observer);
            match self.machine.tick(wait.next()) {
                Ok(()) => {}
                Err(failure) => self.blame(failure, &mut asked)?,
            }
        }
        let waited = wait.waited(self.machine.now());
        let found = asked
            .into_iter()
            .map(|it| self.found_on_line(it, waited))
            .collect();
        Ok(found)
    }

    /// Asks every device on a serial line who it is.
    fn ask_lines(&mut self) -> Vec<Asked> {
        let now = self.machine.now();
        let mut asked = Vec::new();
        for at in 0..self.machine.devices.count() {
            let port = self.machine.devices.unit_mut(at).port;
            if self.machine.ports.lines.contains_key(&port) {
                self.machine.devices.unit_mut(at).device.identify(now);
                let result = None;
                asked.push(Asked { at, port, result });
            }
        }
        let names: Vec<_> = asked
            .iter()
            .map(|it| self.machine.devices.name(it.at))
            .collect();
        if !names.is_empty() {
            let text = format!(
                "serial lines: asking {} for their identity",
                names.join(", ")
            );
            self.machine.notices.observer.waiting(&text);
        }
        asked
    }

    /// Whether somebody has not answered yet.
    fn take_outcomes(&mut self, asked: &mut [Asked]) -> bool {
        let mut is_waited_for = false;
        for it in asked.iter_mut().filter(|it| it.result.is_none()) {
            if let Some(outcome) = self.machine.devices.unit_mut(it.at).device.poll_outcome() {
                let device = self.machine.devices.name(it.at);
                let failed = |source| Failure::Device { device, source }.to_string();
                it.result = Some(outcome.map_err(failed));
            }
            is_waited_for |= it.result.is_none();
        }
        is_waited_for
    }

    /// A line that cannot be used is the trouble of those on it, and of nobody else.
    fn blame(&self, failure: Failure, asked: &mut [Asked]) -> Result<(), Failure> {
        let is_theirs = |it: &Asked| match &failure {
            Failure::Link { port, .. } => self.machine.ports.name(it.port) == *port,
            Failure::Send { device, .. } | Failure::Alarm { device, .. } => {
                self.machine.devices.name(it.at) == *device
            }
            _ => false,
        };
        let mut theirs = asked.iter_mut().filter(|it| is_theirs(it)).peekable();
        if theirs.peek().is_none() {
            return Err(failure);
        }
        for it in theirs {
            it.result.get_or_insert(Err(failure.to_string()));
        }
        Ok(())
    }

    fn found_on_line(&mut self, asked: Asked, waited: Duration) -> Found {
        let Asked { at, port, result } = asked;
        let result = result.unwrap_or_else(|| {
            let (device, step) = (self.machine.devices.name(at), "answer");
            let overdue = Failure::Overdue {
                device,
                step,
                waited,
            };
            Err(overdue.to_string())
        });
        let identity = self.machine.devices.unit_mut(at).device.identity();
        Found {
            port: self.machine.ports.name(port),
            node: None,
            name: Some(self.machine.devices.name(at)),
            identity: identity.filter(|_| result.is_ok()),
            mismatches: result.err().into_iter().collect(),
        }
    }
}

/// Those of `nodes` that have not answered about `object`.
fn silent(nodes: &[NodeId], object: Object, answers: &Answers) -> Vec<NodeId> {
    let has = |node: &&NodeId| {
        let said = answers.get(*node);
        said.is_some_and(|it| it.contains_key(&object))
    };
    nodes.iter().filter(|it| !has(it)).copied().collect()
}

fn note_answer(arrival: &Arrival, port: Port, answers: &mut Answers) {
    let Input::Payload(Payload::Frame(frame)) = &arrival.input else {
        return;
    };
    if arrival.port != port {
        return;
    }
    let Some((Function::SdoResponse, node)) = frame.standard_id().and_then(Function::of) else {
        return;
    };
    let (object, value) = match SdoResponse::parse(frame.data()) {
        Ok(SdoResponse::UploadExpedited { object, data }) => {
            let mut bytes = [0; 4];
            bytes[..data.data().len()].copy_from_slice(data.data());
            (object, Some(u32::from_le_bytes(bytes)))
        }
        // An abort is an answer too: somebody is there.
        Ok(SdoResponse::Abort { object, .. }) => (object, None),
        _ => return,
    };
    answers.entry(node).or_default().insert(object, value);
}

fn judge(
    port: &str,
    node: NodeId,
    values: &BTreeMap<Object, Option<u32>>,
    expected: Option<&ExpectedNode>,
) -> Found {
    let value = |object: Object| values.get(&object).copied().flatten().unwrap_or(0);
    let identity = Identity {
        device_type: value(DEVICE_TYPE),
        vendor: value(IDENTITY[0]),
        product: value(IDENTITY[1]),
        revision: value(IDENTITY[2]),
        serial: value(IDENTITY[3]),
        name: String::new(),
    };
    let mismatches = match expected {
        None => vec!["is not in the configuration".to_owned()],
        Some(expected) => differences(&identity, &expected.identity),
    };
    Found {
        port: port.to_owned(),
        node: Some(node.raw()),
        name: expected.map(|it| it.device.clone()),
        identity: Some(identity),
        mismatches,
    }
}

fn differences(seen: &Identity, expected: &ExpectedIdentity) -> Vec<String> {
    let comparisons = [
        ("device type", expected.device_type, seen.device_type),
        ("vendor", expected.vendor, seen.vendor),
        ("product", expected.product, seen.product),
        ("revision", expected.revision, seen.revision),
        ("serial number", expected.serial, seen.serial),
    ];
    comparisons
        .into_iter()
        .filter_map(|(what, expected, seen)| Some((what, expected?, seen)))
        .filter(|(_, expected, seen)| expected != seen)
        .map(|(what, expected, seen)| format!("{what} is {seen:#X}, configured {expected:#X}"))
        .collect()
}

fn missing(port: &str, node: NodeId, device: &str) -> Found {
    Found {
        port: port.to_owned(),
        node: Some(node.raw()),
        name: Some(device.to_owned()),
        identity: None,
        mismatches: vec![
            "does not answer; check its power, cable, bit rate and node number".to_owned(),
        ],
    }
}
