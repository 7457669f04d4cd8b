//! How frames and bytes get from whoever sends them to whoever hears them.

use core::time::Duration;

use units::Time;
use wire::can::CanFrame;
use wire::{Payload, Port};

use super::port::Medium;
use super::{Delivery, Event, Link, Simulation};
use crate::bus::Sender;

impl Simulation {
    /// A frame has been on the wire: the faults first, then everybody else hears it.
    pub(super) fn frame_complete(&mut self, place: usize, sender: Sender, frame: CanFrame) {
        let node = match sender {
            Sender::Node(place) => Some(self.slots[place].name.as_str()),
            Sender::Host | Sender::Stranger => None,
        };
        let fate = self.plan.frame_fate(&self.ports[place].name, node, frame);
        if fate.held_back && fate.copies > 0 {
            self.ports[place].hold_back(sender, fate.frame);
            return;
        }
        for _ in 0..fate.copies {
            self.spread(place, sender, fate.frame, fate.delay);
        }
        self.release_held_back(place);
    }

    /// A frame that was held back comes now, after its successor or because nothing holds it.
    pub(super) fn release_held_back(&mut self, place: usize) {
        if let Some((sender, frame)) = self.ports[place].held_back() {
            self.spread(place, sender, frame, Duration::ZERO);
        }
    }

    fn spread(&mut self, place: usize, sender: Sender, frame: CanFrame, delay: Duration) {
        let payload = Payload::Frame(frame);
        self.tell_nodes(place, sender, &payload);
        if sender != Sender::Host && self.ports[place].link == Link::Up {
            let at = self.ports[place].handed_over(self.now + delay);
            self.tell_host(at, place, Event::Payload(payload));
        }
    }

    pub(super) fn tell_nodes(&mut self, port: usize, sender: Sender, payload: &Payload) {
        for place in 0..self.slots.len() {
            let slot = &mut self.slots[place];
            if slot.port != port || !slot.powered || sender == Sender::Node(place) {
                continue;
            }
            if !slot.node.concerns(payload) {
                continue;
            }
            slot.node.handle(self.now, payload, &mut self.plant);
            slot.next = slot.node.next_event();
            self.flush(place);
        }
    }

    /// What the node wants to send goes to its bus or line.
    pub(super) fn flush(&mut self, place: usize) {
        let port = self.slots[place].port;
        while let Some(payload) = self.slots[place].node.poll_transmit() {
            match payload {
                Payload::Frame(frame) => self.ports[port].send_frame(Sender::Node(place), frame),
                Payload::Bytes(bytes) => self.node_bytes(place, port, bytes),
                // The host's end of the line is the host's.
                Payload::Control(_) => {}
            }
        }
    }

    fn node_bytes(&mut self, place: usize, port: usize, bytes: Vec<u8>) {
        let mut run = self.ports[port].take_kept();
        run.extend_from_slice(&bytes);
        let node = &self.slots[place].name;
        let fate = self
            .plan
            .bytes_fate(&self.ports[port].name, Some(node), run);
        self.ports[port].keep(fate.kept_for_later);
        for (delay, run) in fate.runs {
            self.bytes_to_host(port, delay, run);
        }
    }

    pub(super) fn bytes_to_host(&mut self, place: usize, delay: Duration, bytes: Vec<u8>) {
        let port = &mut self.ports[place];
        if port.link != Link::Up || bytes.is_empty() {
            return;
        }
        let through = port.line_time(self.now + delay, bytes.len());
        let at = port.handed_over(through);
        self.tell_host(at, place, Event::Payload(Payload::Bytes(bytes)));
    }

    pub(super) fn tell_host(&mut self, at: Time, place: usize, event: Event) {
        let delivery = Delivery {
            port: Port(place as u8),
            at,
            event,
        };
        self.log.delivery(&delivery);
        let before = self.outbox.partition_point(|waiting| waiting.at <= at);
        self.outbox.insert(before, delivery);
    }

    pub(super) fn stranger_sends(&mut self, port: &str, frame: CanFrame) {
        if let Some(place) = self.config.port(port)
            && let Medium::Can(can) = &mut self.ports[place].medium
            && !can.bus.has_waiting(Sender::Stranger)
        {
            can.bus.send(Sender::Stranger, frame);
        }
    }
}
