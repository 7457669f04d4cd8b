//! Who has power: the mains, and what is brought along and switched on by hand.

use units::Time;

use super::Simulation;
use crate::bus::Sender;
use crate::plant::{HallDrift, LineSetUp};

impl Simulation {
    /// The mains goes off now and comes back after the configured time; meanwhile the Hall
    /// sensors drift to `drift` and nobody holds the stage.
    pub fn power_cycle(&mut self, drift: HallDrift) {
        for place in 0..self.slots.len() {
            let entry = self.config.nodes.get(place);
            if !entry.is_some_and(|entry| entry.own_mains || entry.brought_along) {
                self.power_off(place);
            }
        }
        self.plant.power_cycle(drift);
        self.mains_back = self.now + self.config.power_off();
        self.next.set(None);
    }

    /// The mains goes off, or comes back, and stays so; sensors do not drift meanwhile.
    pub fn switch_mains(&mut self, on: bool) {
        if on {
            self.switch_on();
        } else {
            let drift = self.plant.hall_drift();
            self.power_cycle(drift);
        }
        self.mains_back = Time::NEVER;
        self.next.set(None);
    }

    /// Somebody sets a laser up along a line of three axes, from where their tool stands, and
    /// switches on what was brought along for it.
    pub fn set_up_line(&mut self, set_up: &LineSetUp) {
        self.plant.set_up_line(set_up);
        self.power_what_was_brought(true);
    }

    /// Somebody packs the laser up again.
    pub fn take_line_away(&mut self) {
        self.plant.take_line_away();
        self.power_what_was_brought(false);
    }

    pub(super) fn switch_on(&mut self) {
        for place in 0..self.slots.len() {
            if !self.is_brought_along(place) {
                self.power_on(place);
            }
        }
    }

    fn is_brought_along(&self, place: usize) -> bool {
        let entry = self.config.nodes.get(place);
        entry.is_some_and(|entry| entry.brought_along)
    }

    fn power_what_was_brought(&mut self, on: bool) {
        for place in 0..self.slots.len() {
            match (self.is_brought_along(place), on) {
                (true, true) => self.power_on(place),
                (true, false) => self.power_off(place),
                (false, _) => {}
            }
        }
    }

    pub(super) fn step_mains(&mut self) -> bool {
        if self.mains_back > self.now {
            return false;
        }
        self.mains_back = Time::NEVER;
        self.switch_on();
        true
    }

    pub(super) fn power_off(&mut self, place: usize) {
        self.next.set(None);
        let slot = &mut self.slots[place];
        if !core::mem::take(&mut slot.powered) {
            return;
        }
        slot.next = Time::NEVER;
        slot.node.power_off(self.now, &mut self.plant);
        while slot.node.poll_transmit().is_some() {}
        let port = slot.port;
        self.ports[port].forget(Sender::Node(place));
    }

    pub(super) fn power_on(&mut self, place: usize) {
        self.next.set(None);
        let slot = &mut self.slots[place];
        if slot.powered {
            return;
        }
        slot.powered = true;
        slot.node.power_on(self.now, &mut self.plant);
        slot.next = slot.node.next_event();
        self.flush(place);
    }
}
