//! What analog modules on CANopen have in common: the start, PDOs that are too short, alarms.

use std::collections::VecDeque;

use units::Time;
use wire::can::CanFrame;

use super::canopen_node::{CanopenNode, NodeEvent};
use super::{Alarm, DeviceError};
use crate::protocol::script::Step;

/// The node of a module, and what is to be told of it.
#[derive(Debug)]
pub(super) struct AnalogNode {
    pub(super) node: CanopenNode,
    starting: bool,
    told_short: bool,
    short_pdos: u64,
    pub(super) outcome: Option<Result<(), DeviceError>>,
    pub(super) alarms: VecDeque<Alarm>,
}

/// What the module itself acts on.
pub(super) enum Heard {
    Pdo {
        number: u8,
        frame: CanFrame,
    },
    /// It was reset: what it said before is no longer so.
    Reset,
}

impl AnalogNode {
    /// One that is not started.
    pub(super) const fn new(node: CanopenNode) -> Self {
        Self {
            node,
            starting: false,
            told_short: false,
            short_pdos: 0,
            outcome: None,
            alarms: VecDeque::new(),
        }
    }

    pub(super) fn start(&mut self, now: Time) {
        self.outcome = None;
        self.told_short = false;
        self.alarms.clear();
        self.starting = true;
        self.node.start(now, Vec::new());
    }

    /// Whether a sample that comes now would be the first of a start.
    pub(super) fn awaits_its_first(&self) -> bool {
        self.starting && self.node.is_operational()
    }

    /// The first sample has come.
    pub(super) fn up(&mut self, now: Time) {
        self.node.up(now);
        self.finish(Ok(()));
    }

    fn finish(&mut self, result: Result<(), DeviceError>) {
        self.starting = false;
        self.outcome = Some(result);
    }

    /// What has come next; a module that has said who it is gets its `configuration`.
    pub(super) fn hear(
        &mut self,
        now: Time,
        configuration: impl Fn() -> Vec<Step>,
    ) -> Option<Heard> {
        while let Some(event) = self.node.poll_event() {
            match event {
                NodeEvent::Described(_) => self.node.configure(now, configuration()),
                NodeEvent::Operational => {}
                NodeEvent::ScriptDone(_) => self.finish(Ok(())),
                NodeEvent::Failed(error) => self.finish(Err(error)),
                NodeEvent::Alarm(alarm) => {
                    let was_reset = matches!(alarm, Alarm::UnexpectedBootUp { .. });
                    self.alarms.push_back(alarm);
                    if was_reset {
                        return Some(Heard::Reset);
                    }
                }
                NodeEvent::Pdo { number, frame } => return Some(Heard::Pdo { number, frame }),
                NodeEvent::PdoSilent { waited } => {
                    self.alarms.push_back(Alarm::StaleSample { waited });
                }
            }
        }
        None
    }

    /// Whether a PDO of `seen` bytes has the `expected` ones. One that has not is counted, and told
    /// once until a whole one comes.
    pub(super) fn is_whole(&mut self, expected: usize, seen: usize) -> bool {
        if seen >= expected {
            self.told_short = false;
            return true;
        }
        self.short_pdos += 1;
        if !core::mem::replace(&mut self.told_short, true) {
            self.alarms.push_back(Alarm::PdoTooShort {
                node: self.node.id(),
                expected,
                seen,
            });
        }
        false
    }

    pub(super) fn counters(&self) -> Vec<(&'static str, u64)> {
        let mut counters = self.node.counters();
        counters.push(("pdos too short", self.short_pdos));
        counters
    }
}
