//! What goes out after each tick.

use std::sync::Arc;

use machine::Machine;
use serde_json::json;

use super::{Keeper, Mode};
use crate::view::MachineState;

/// Counters change slowly and cost memory: once in so many ticks is enough.
const COUNTERS_EVERY: u64 = 256;

impl Keeper {
    /// What the machine as a whole is.
    pub(super) const fn machine_state(&self) -> MachineState {
        match self.mode {
            Mode::Starting => MachineState::Starting,
            Mode::Idle | Mode::Procedure => MachineState::Running,
            Mode::Safe => MachineState::ErrorStop,
            Mode::Ending => MachineState::Ending,
        }
    }

    /// Publishes the newest snapshot, and tells what axes changed their state.
    pub(crate) fn publish(&mut self, machine: &Machine) {
        self.tell_states(machine);
        let now = machine.now();
        let state = self.machine_state();
        let lease = self.holder(now).map(|it| (Arc::clone(&it.name), it.until));
        let motions = self.motions.list(&self.seats);
        let runs = self.runs.list();
        let events = self.events.list();
        let figures = self.figures.look(machine);
        // Kept here, as each buffer below is written in its own turn: they would disagree, and count backwards.
        if self.ticks % COUNTERS_EVERY == 1 || self.counters.is_empty() {
            self.counters = Arc::new(machine.devices().counters());
        }
        // What is there is of some earlier tick: everything is written over.
        let snapshot = self.output.input_buffer_mut();
        snapshot.now = now;
        snapshot.state = state;
        snapshot.cause.clone_from(&self.fault);
        snapshot.axes.clear();
        let samples = self.seats.iter().map(|seat| seat.sample(machine));
        snapshot.axes.extend(samples);
        snapshot.motions = motions;
        snapshot.runs = runs;
        snapshot.events = events;
        snapshot.lease = lease;
        snapshot.counters = Arc::clone(&self.counters);
        snapshot.figures = figures;
        snapshot.ticks = self.ticks;
        self.output.publish();
    }

    /// Publishes although no tick that was attended to has ended.
    pub(crate) fn publish_now(&mut self, machine: &Machine) {
        self.ticks += 1;
        self.publish(machine);
    }

    fn tell_states(&mut self, machine: &Machine) {
        let is_faulted = self.fault.is_some();
        for seat in &mut self.seats {
            let state = seat.state_now(machine, is_faulted);
            if state != seat.state {
                seat.state = state;
                self.events
                    .push("axis", &seat.name, json!({"state": state}));
            }
        }
    }
}
