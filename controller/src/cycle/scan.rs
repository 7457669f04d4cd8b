//! Scan: who is on the buses, asked without changing anything.
//!
//! Every node number of every CAN bus is asked for its device type (0x1000) and identity
//! (0x1018) by expedited SDO upload; nothing is written and no node changes its state. Devices on
//! serial lines are asked by their drivers.

use core::time::Duration;
use std::collections::BTreeMap;

use drivers::device::Identity;
use drivers::transport::{Arrival, Input, Payload, Port};
use drivers::wire::can::CanFrame;
use drivers::wire::canopen::sdo::{SdoRequest, SdoResponse};
use drivers::wire::canopen::{Function, NodeId, Object};

use crate::assemble;
use crate::config::IdentityConfig;
use crate::failure::Failure;
use crate::machine::Machine;

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
/// So often a node of the configuration that did not answer is asked again.
const ASKED_AGAIN_MAX: u32 = 2;
/// How long the last answers may take.
const PATIENCE: Duration = Duration::from_millis(300);

/// Devices on serial lines say themselves what is wrong, before this has passed.
const SERIAL_LIMIT: Duration = Duration::from_secs(15);

type Answers = BTreeMap<NodeId, BTreeMap<Object, u32>>;

impl Machine {
    /// Asks who is there. Only a bus that fails is an error: what is missing or wrong is in
    /// the result.
    ///
    /// # Errors
    /// When a bus or line cannot be used.
    pub fn scan(&mut self) -> Result<Vec<Found>, Failure> {
        let mut found = Vec::new();
        let ports: Vec<_> = self
            .port_names
            .iter()
            .map(|(port, name)| (*port, name.clone()))
            .collect();
        for (port, name) in ports {
            if self.config.can.contains_key(&name) {
                found.extend(self.scan_can(port, &name)?);
            }
        }
        found.extend(self.scan_serial());
        Ok(found)
    }

    fn scan_can(&mut self, port: Port, name: &str) -> Result<Vec<Found>, Failure> {
        let mut answers = Answers::new();
        let all: Vec<_> = (1..=127).filter_map(NodeId::new).collect();
        let expected = assemble::expected_nodes(&self.config, name);
        let awaited: Vec<_> = expected.keys().filter_map(|it| NodeId::new(*it)).collect();
        self.ask(port, &all, &awaited, DEVICE_TYPE, &mut answers)?;
        let present: Vec<_> = answers.keys().copied().collect();
        for object in IDENTITY {
            self.ask(port, &present, &present, object, &mut answers)?;
        }
        let mut found: Vec<_> = answers
            .iter()
            .map(|(node, values)| judge(name, *node, values, expected.get(&node.raw())))
            .collect();
        for (node, (device, _)) in &expected {
            if !answers.keys().any(|present| present.raw() == *node) {
                found.push(missing(name, *node, device));
            }
        }
        Ok(found)
    }

    /// Asks `nodes`, and waits a while for answers. Those that are `awaited` are asked again: a
    /// node that has just been switched on boots for a moment.
    fn ask(
        &mut self,
        port: Port,
        nodes: &[NodeId],
        awaited: &[NodeId],
        object: Object,
        answers: &mut Answers,
    ) -> Result<(), Failure> {
        self.ask_once(port, nodes, object, answers)?;
        for _ in 0..ASKED_AGAIN_MAX * self.patience {
            let has = |node| answers.get(node).is_some_and(|it| it.contains_key(&object));
            let silent: Vec<_> = awaited.iter().filter(|it| !has(it)).copied().collect();
            if silent.is_empty() {
                break;
            }
            self.ask_once(port, &silent, object, answers)?;
        }
        Ok(())
    }

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
                self.transport
                    .send(port, &Payload::Frame(frame))
                    .map_err(|source| Failure::Send {
                        device: format!("{node} while scanning"),
                        source,
                    })?;
            }
            self.collect(port, Duration::from_millis(10), answers);
        }
        self.collect(port, PATIENCE, answers);
        Ok(())
    }

    fn collect(&mut self, port: Port, patience: Duration, answers: &mut Answers) {
        let until = self.transport.now() + patience;
        while self.transport.now() < until {
            if let Some(arrival) = self.transport.receive(until) {
                note_answer(&arrival, port, answers);
            }
        }
    }

    /// Everything on a serial line: amplifiers, analog modules and instruments.
    fn scan_serial(&mut self) -> Vec<Found> {
        let lines: Vec<_> = (0..self.device_count())
            .filter(|at| {
                let port = self.device_mut(*at).port;
                self.config.serial.contains_key(&self.port_names[&port])
            })
            .collect();
        lines
            .into_iter()
            .map(|at| {
                let now = self.now();
                self.device_mut(at).device.identify(now);
                let started = self.await_outcome(at, "answer", SERIAL_LIMIT);
                let port = self.device_mut(at).port;
                Found {
                    port: self.port_names[&port].clone(),
                    node: None,
                    name: Some(self.device_name(at)),
                    identity: self
                        .device_mut(at)
                        .device
                        .identity()
                        .filter(|_| started.is_ok()),
                    mismatches: started
                        .err()
                        .map(|error| error.to_string())
                        .into_iter()
                        .collect(),
                }
            })
            .collect()
    }
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
    match SdoResponse::parse(frame.data()) {
        Ok(SdoResponse::UploadExpedited { object, data }) => {
            let mut bytes = [0; 4];
            bytes[..data.data().len()].copy_from_slice(data.data());
            answers
                .entry(node)
                .or_default()
                .insert(object, u32::from_le_bytes(bytes));
        }
        // An abort is an answer too: somebody is there.
        Ok(SdoResponse::Abort { .. }) => {
            answers.entry(node).or_default();
        }
        _ => {}
    }
}

fn judge(
    port: &str,
    node: NodeId,
    values: &BTreeMap<Object, u32>,
    expected: Option<&(String, IdentityConfig)>,
) -> Found {
    let value = |object: Object| values.get(&object).copied().unwrap_or(0);
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
        Some((_, expected)) => differences(&identity, expected),
    };
    Found {
        port: port.to_owned(),
        node: Some(node.raw()),
        name: expected.map(|(name, _)| name.clone()),
        identity: Some(identity),
        mismatches,
    }
}

fn differences(seen: &Identity, expected: &IdentityConfig) -> Vec<String> {
    let comparisons = [
        ("device type", Some(expected.device_type), seen.device_type),
        ("vendor", Some(expected.vendor_id), seen.vendor),
        ("product", Some(expected.product_code), seen.product),
        ("revision", expected.revision, seen.revision),
        ("serial number", expected.serial_number, seen.serial),
    ];
    comparisons
        .into_iter()
        .filter_map(|(what, expected, seen)| Some((what, expected?, seen)))
        .filter(|(_, expected, seen)| expected != seen)
        .map(|(what, expected, seen)| format!("{what} is {seen:#X}, configured {expected:#X}"))
        .collect()
}

fn missing(port: &str, node: u8, device: &str) -> Found {
    Found {
        port: port.to_owned(),
        node: Some(node),
        name: Some(device.to_owned()),
        identity: None,
        mismatches: vec!["does not answer: power, cable, bit rate or node number?".to_owned()],
    }
}
