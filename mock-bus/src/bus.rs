//! A CAN bus: one frame at a time, the lowest identifier first, as long as its bits take.
//!
//! Source: ISO 11898-1 (arbitration). A frame takes its worst-case length of stuffed bits, so
//! the model is never faster than a real bus. The host's interface is a queue whose head
//! alone competes, as in Linux; a device's controller offers all its frames.
//!
//! Absent: acknowledge, error counters of the devices.

use core::time::Duration;
use units::Time;
use wire::can::{CanFrame, CanId};

/// Who sent a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sender {
    /// The controller under test.
    Host,
    /// A device, by its place in the configuration.
    Node(usize),
    /// Nobody that is configured: an injected fault.
    Stranger,
}

#[derive(Clone, Copy, Debug)]
struct Queued {
    sender: Sender,
    frame: CanFrame,
}

/// One bus.
///
/// # Example
///
/// ```
/// use mock_bus::bus::{CanBus, Sender};
/// use units::Time;
/// use wire::can::CanFrame;
///
/// let mut bus = CanBus::new(500);
/// bus.send(Sender::Host, CanFrame::standard(0x601, &[0; 8]));
/// bus.send(Sender::Node(0), CanFrame::standard(0x181, &[0; 8]));
/// bus.start(Time::ZERO);
/// assert_eq!(bus.done_at(), Time(270_000), "135 bits of 2 µs");
/// let first = bus.complete(bus.done_at()).map(|(sender, _)| sender);
/// assert_eq!(first, Some(Sender::Node(0)), "the lower identifier wins");
/// ```
#[derive(Clone, Debug)]
pub struct CanBus {
    bit_ns: u64,
    /// In the order of their arrival.
    pending: Vec<Queued>,
    on_wire: Option<(Queued, Time)>,
    busy: Duration,
}

impl CanBus {
    /// A quiet bus.
    pub fn new(bitrate_kbit_per_s: u32) -> Self {
        Self {
            bit_ns: 1_000_000 / u64::from(bitrate_kbit_per_s.max(1)),
            pending: Vec::new(),
            on_wire: None,
            busy: Duration::ZERO,
        }
    }

    /// Queues a frame; it competes as soon as the bus is free.
    pub fn send(&mut self, sender: Sender, frame: CanFrame) {
        self.pending.push(Queued { sender, frame });
    }

    /// How many frames the host has waiting.
    pub fn host_waiting(&self) -> usize {
        self.pending
            .iter()
            .filter(|queued| queued.sender == Sender::Host)
            .count()
    }

    /// Whether `sender` has a frame waiting.
    pub fn has_waiting(&self, sender: Sender) -> bool {
        self.pending.iter().any(|queued| queued.sender == sender)
    }

    /// Whether a frame could start now.
    pub fn wants_start(&self) -> bool {
        self.on_wire.is_none() && !self.pending.is_empty()
    }

    /// The winner of the arbitration goes onto the wire.
    pub fn start(&mut self, now: Time) {
        if self.on_wire.is_some() {
            return;
        }
        let Some(winner) = self.winner() else {
            return;
        };
        let queued = self.pending.remove(winner);
        let span = Duration::from_nanos(u64::from(queued.frame.worst_case_bits()) * self.bit_ns);
        self.busy += span;
        self.on_wire = Some((queued, now + span));
    }

    fn winner(&self) -> Option<usize> {
        let host_head = self
            .pending
            .iter()
            .position(|queued| queued.sender == Sender::Host);
        (0..self.pending.len())
            .filter(|at| self.pending[*at].sender != Sender::Host || Some(*at) == host_head)
            .min_by_key(|at| (arbitration(&self.pending[*at].frame), *at))
    }

    /// When the frame on the wire is complete; [`Time::NEVER`] when there is none.
    pub fn done_at(&self) -> Time {
        self.on_wire.map_or(Time::NEVER, |(_, done)| done)
    }

    /// The frame that is complete by `now`, and who sent it.
    pub fn complete(&mut self, now: Time) -> Option<(Sender, CanFrame)> {
        let (queued, _) = self.on_wire.take_if(|(_, done)| *done <= now)?;
        Some((queued.sender, queued.frame))
    }

    /// Forgets everything that `sender` has waiting, and breaks off what it has on the wire.
    pub fn forget(&mut self, sender: Sender) {
        self.on_wire.take_if(|(queued, _)| queued.sender == sender);
        self.pending.retain(|queued| queued.sender != sender);
    }

    /// How long the bus has been occupied altogether.
    pub const fn busy(&self) -> Duration {
        self.busy
    }
}

/// Dominant bits win: a smaller number goes first. A standard frame beats an extended one
/// with the same leading bits, a data frame a remote one.
fn arbitration(frame: &CanFrame) -> u32 {
    let remote = u32::from(frame.is_remote());
    match frame.id() {
        CanId::Standard(id) => u32::from(id) << 20 | remote,
        CanId::Extended(id) => (id >> 18) << 20 | 1 << 19 | (id & 0x3_FFFF) << 1 | remote,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(id: u16) -> CanFrame {
        CanFrame::standard(id, &[0; 8])
    }

    fn order(bus: &mut CanBus) -> Vec<u32> {
        let mut ids = Vec::new();
        let mut now = Time::ZERO;
        while bus.wants_start() {
            bus.start(now);
            now = bus.done_at();
            ids.push(bus.complete(now).unwrap().1.id().raw());
        }
        ids
    }

    #[test]
    fn the_lowest_identifier_of_all_devices_goes_first() {
        let mut bus = CanBus::new(1000);
        for id in [0x701, 0x181, 0x080, 0x281] {
            bus.send(Sender::Node(0), frame(id));
        }
        assert_eq!(order(&mut bus), [0x080, 0x181, 0x281, 0x701]);
    }

    #[test]
    fn the_hosts_frames_keep_their_order() {
        let mut bus = CanBus::new(1000);
        bus.send(Sender::Host, frame(0x601));
        bus.send(Sender::Host, frame(0x080));
        bus.send(Sender::Node(0), frame(0x181));
        assert_eq!(order(&mut bus), [0x181, 0x601, 0x080]);
    }

    #[test]
    fn a_frame_takes_its_bits() {
        let mut bus = CanBus::new(500);
        bus.send(Sender::Host, frame(0x181));
        bus.start(Time(1000));
        assert_eq!(bus.done_at(), Time(1000 + 135 * 2000));
        assert_eq!(bus.complete(Time(1000)), None);
        assert_eq!(bus.busy(), Duration::from_micros(270));
    }

    #[test]
    fn a_standard_frame_beats_an_extended_one_with_the_same_start() {
        let extended = CanFrame::new(CanId::Extended(0x181 << 18), &[]).unwrap();
        assert!(arbitration(&frame(0x181)) < arbitration(&extended));
        assert!(arbitration(&extended) < arbitration(&frame(0x182)));
    }
}
