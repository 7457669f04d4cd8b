//! What passed on each CAN bus, as far as this computer heard and sent it.

use std::collections::BTreeMap;

use wire::can::{CanFrame, CanId};
use wire::{Arrival, Input, Payload, Port};

use crate::parts::Bus;

/// What passed on one bus since the machine was made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BusCounts {
    /// Frames, heard and sent; SYNCs of a SYNC thread are not among them.
    pub frames: u64,
    /// Their bits, halfway between the fewest and the most stuff bits.
    pub bits: u64,
    /// Frames that came and that this computer did not take.
    pub lost: u64,
    /// Error frames: the controller's own words on trouble on the bus.
    pub errors: u64,
}

/// The counts of all buses. Counting asks for no memory: the cyclic engine counts, too.
#[derive(Debug, Default)]
pub(crate) struct BusAccount(BTreeMap<Port, BusCounts>);

impl BusAccount {
    pub(crate) fn new(buses: &[Bus]) -> Self {
        let counts = buses.iter().map(|it| (it.port, BusCounts::default()));
        Self(counts.collect())
    }

    pub(crate) fn of(&self, port: Port) -> BusCounts {
        self.0.get(&port).copied().unwrap_or_default()
    }

    pub(crate) fn heard(&mut self, arrival: &Arrival) {
        let Some(counts) = self.0.get_mut(&arrival.port) else {
            return;
        };
        match &arrival.input {
            Input::Payload(Payload::Frame(frame)) => counts.frame(frame),
            Input::Lost(frames) => counts.lost += u64::from(*frames),
            Input::BusError(_) => counts.errors += 1,
            Input::Payload(_) | Input::Link(_) => {}
        }
    }

    pub(crate) fn sent(&mut self, port: Port, payload: &Payload) {
        if let (Some(counts), Payload::Frame(frame)) = (self.0.get_mut(&port), payload) {
            counts.frame(frame);
        }
    }
}

impl BusCounts {
    fn frame(&mut self, frame: &CanFrame) {
        self.frames += 1;
        self.bits += u64::from(bits(frame));
    }
}

/// Between the shortest form and the longest, with every stuff bit there may be.
pub(crate) fn bits(frame: &CanFrame) -> u32 {
    let overhead = match frame.id() {
        CanId::Standard(_) => 47,
        CanId::Extended(_) => 67,
    };
    overhead + 8 * frame.data().len() as u32
}
