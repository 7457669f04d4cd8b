//! How a machine comes to rest: in order, or because something failed.

use drivers::device::DriveCommand;

use crate::failure::Failure;
use crate::machine::{Machine, STOP_LIMIT, Supervision};

impl Machine {
    /// Disables every axis in a controlled way and stops supervision and SYNC.
    ///
    /// # Errors
    /// When an axis cannot be disabled; the others are tried all the same.
    pub fn shut_down(&mut self) -> Result<(), Failure> {
        let mut result = Ok(());
        self.supervision = Supervision::Stopping;
        for axis in self.axis_names() {
            result = result.and(self.command(&axis, DriveCommand::Disable, "disable", STOP_LIMIT));
        }
        self.supervision = Supervision::Off;
        result.and(self.set_sync(false))
    }

    /// Runs `procedure`; when it fails, stops and disables every axis before the failure is
    /// returned.
    ///
    /// # Errors
    /// What `procedure` returns.
    pub fn guarded<R>(
        &mut self,
        procedure: impl FnOnce(&mut Self) -> Result<R, Failure>,
    ) -> Result<R, Failure> {
        let result = procedure(self);
        // Why it failed must be asked before stopping it takes its time.
        let now = self.now();
        result.map_err(|failure| {
            let failure = self.bus_watch.explain(now, failure);
            self.make_safe();
            failure
        })
    }

    /// Quick stop and disable on every axis that can still be reached. Never fails: it does
    /// what can be done, and the drives' own watch on our heartbeat does the rest.
    pub fn make_safe(&mut self) {
        self.supervision = Supervision::Stopping;
        self.instrument_in_use = None;
        // Nothing that waited may be sent after the stop.
        self.outbox.clear();
        let now = self.now();
        for unit in &mut self.axes {
            unit.device.control(now, DriveCommand::QuickStop);
        }
        for at in 0..self.axes.len() {
            // A drive that is gone cannot confirm; the others must still be stopped.
            let stopped = self.await_outcome(at, "quick stop", STOP_LIMIT);
            self.tell_unconfirmed(at, stopped);
        }
        for (at, axis) in self.axis_names().into_iter().enumerate() {
            let disabled = self.command(&axis, DriveCommand::Disable, "disable", STOP_LIMIT);
            self.tell_unconfirmed(at, disabled);
        }
        for memory in self.memory.values_mut() {
            memory.approach.forget();
        }
        if let Some(platform) = &mut self.platform {
            platform.interrupted_before_it_ends();
        }
        let _ = self.set_sync(false);
        self.supervision = Supervision::Off;
    }

    /// The operator must not read "stopped" of an axis that did not say so.
    fn tell_unconfirmed(&mut self, at: usize, outcome: Result<(), Failure>) {
        if let Err(failure) = outcome {
            let axis = self.device_name(at);
            self.observer.warning(&format!(
                "axis {axis} did not confirm that it stopped ({failure}); its drive watches our \
                 heartbeat and stops by itself: make sure before you reach in"
            ));
        }
    }
}
