//! What happens at one moment.

use units::Time;

use super::Simulation;
use crate::bus::Sender;
use crate::fault::Edge;

impl Simulation {
    pub(super) fn find_next(&self) -> Time {
        let ports = self.ports.iter().map(|port| port.next_event(self.now));
        ports.fold(self.next_own(), Time::min)
    }

    /// When something happens next that is no port's.
    fn next_own(&self) -> Time {
        let own = self.plan.next_edge().min(self.mains_back);
        let slots = self.slots.iter().map(|slot| slot.next);
        slots.fold(own, Time::min)
    }

    /// Everything that is due at `next`, and an arbitration once nothing else is.
    pub(super) fn step(&mut self, next: Time) {
        self.now = self.now.max(next);
        self.next.set(None);
        let any = self.step_faults() | self.step_mains() | self.step_ports() | self.step_nodes();
        if !any || !self.is_anything_due() {
            let now = self.now;
            self.ports.iter_mut().for_each(|port| port.arbitrate(now));
        }
    }

    /// Whether this moment is not over, the controller's answer to what it gets now included.
    fn is_anything_due(&self) -> bool {
        let now = self.now;
        self.outbox.front().is_some_and(|first| first.at <= now)
            || self.next_own() <= now
            || self.ports.iter().any(|port| port.arrives_by(now))
    }

    fn step_faults(&mut self) -> bool {
        if self.plan.next_edge() > self.now {
            return false;
        }
        self.plant.advance(self.now);
        while let Some(edge) = self.plan.poll_edge(self.now) {
            match edge {
                Edge::Begins(fault) => self.begin_fault(&fault),
                Edge::Ends(fault) => self.finish_fault(&fault),
                Edge::Sends(port, frame) => self.stranger_sends(&port, frame),
            }
        }
        true
    }

    fn step_ports(&mut self) -> bool {
        let mut any = false;
        for place in 0..self.ports.len() {
            if !self.ports[place].arrives_by(self.now) {
                continue;
            }
            any = true;
            while let Some((sender, frame)) = self.ports[place].complete(self.now) {
                self.frame_complete(place, sender, frame);
            }
            while let Some(payload) = self.ports[place].arrived(self.now) {
                self.tell_nodes(place, Sender::Host, &payload);
            }
        }
        any
    }

    fn step_nodes(&mut self) -> bool {
        let mut any = false;
        for place in 0..self.slots.len() {
            let slot = &mut self.slots[place];
            if slot.next > self.now {
                continue;
            }
            any = true;
            self.plant.advance(self.now);
            slot.node.advance(self.now, &mut self.plant);
            // A node that asks for this very moment again would stop the clock.
            slot.next = slot.node.next_event().max(Time(self.now.0 + 1));
            self.flush(place);
        }
        any
    }
}
