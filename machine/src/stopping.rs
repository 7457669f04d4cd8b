//! How a machine comes to rest: in order, or because something failed.

use core::time::Duration;
use std::collections::BTreeMap;

use compensator::apply::ApproachTracker;
use drivers::device::DriveCommand;

use crate::cause_search::{CauseSearch, diagnose};
use crate::coasting::{COAST_LIMIT, await_rest};
use crate::diagnosis::is_wait;
use crate::failure::{Failure, Layered};
use crate::kept_zero;
use crate::machine::{Machine, Supervision};
use crate::release::release_watches;
use crate::waiting::Watched;

/// The longest a stop may take before the next drive is tried.
pub const STOP_LIMIT: Duration = Duration::from_secs(2);
/// The longest that the whole of [`Machine::make_safe`] takes, with a second for the search of a cause. A second
/// request to stop counts for nothing before.
pub const LONGEST_STOP: Duration = Duration::from_secs(15);
const _: () = assert!(
    LONGEST_STOP.as_secs() == 2 * STOP_LIMIT.as_secs() + COAST_LIMIT.as_secs() + 1,
    "it is the sum of its parts"
);
/// How long the slowest module may take to send again after a rest.
const AWAKE_LIMIT: Duration = Duration::from_secs(1);

impl Machine {
    /// Disables every axis in a controlled way and stops supervision and SYNC.
    ///
    /// # Errors
    /// When an axis cannot be disabled; the others are tried all the same.
    pub fn shut_down(&mut self) -> Result<(), Failure> {
        let mut result = Ok(());
        self.supervision = Supervision::Stopping;
        for at in 0..self.devices.drive_count() {
            result = result.and(self.control(at, DriveCommand::Disable, "disable", STOP_LIMIT));
        }
        release_watches(self);
        self.supervision = Supervision::Off;
        result.and(self.ports.set_sync(&mut *self.transport, false))
    }

    /// Rests for `span`: every axis is switched off and no SYNC is sent, while heartbeats go on, so
    /// that each drive keeps its origin. Then SYNC runs again and every axis and module must have sent.
    ///
    /// # Errors
    /// When an axis cannot be disabled, a bus fails, somebody asks to stop, or a device is silent
    /// afterwards.
    pub fn idle(&mut self, span: Duration) -> Result<(), Failure> {
        for at in 0..self.devices.drive_count() {
            self.control(at, DriveCommand::Disable, "disable", STOP_LIMIT)?;
        }
        // Without SYNC the silence of the devices is no alarm.
        self.supervision = Supervision::Off;
        self.ports.set_sync(&mut *self.transport, false)?;
        let until = self.now() + span;
        self.run_until(until)?;
        self.ports.set_sync(&mut *self.transport, true)?;
        let resumed = self.now();
        let deadline = resumed + self.patience.of(AWAKE_LIMIT);
        while let Some(device) = self.devices.silent_since(resumed) {
            if self.now() >= deadline {
                return Err(Failure::Overdue {
                    device,
                    step: "process data after a rest",
                    waited: self.now().since(resumed),
                });
            }
            self.tick(deadline)?;
        }
        self.supervision = Supervision::On;
        Ok(())
    }

    /// Runs `procedure`; when it fails, stops and disables every axis before the failure is
    /// returned.
    ///
    /// # Errors
    /// What `procedure` returns.
    pub fn guarded<R, F: Layered>(
        &mut self,
        procedure: impl FnOnce(&mut Self) -> Result<R, F>,
    ) -> Result<R, F> {
        let result = procedure(self);
        result.map_err(|failure| {
            // Why it failed must be asked before stopping it takes its time.
            let failure = self.explain(failure);
            self.make_safe();
            diagnose(self, failure)
        })
    }

    /// The failure that has just happened, or its cause: a sender that fills a bus, or this
    /// computer, which was held up. Where a procedure judged something else while the computer was
    /// held up, the observer is told so. [`Machine::make_safe`] looks for more of its cause, and
    /// [`diagnose`] returns that.
    pub fn explain<F: Layered>(&mut self, failure: F) -> F {
        let now = self.now();
        if failure.depends_on_time()
            && let Some(lost) = self.host_watch.lost(now)
        {
            self.notices.warn(lost.to_string());
        }
        self.diagnosis.forget();
        failure.map_machine(|failure| {
            self.bus_watch.ask();
            self.diagnosis.ask(now, &failure);
            if is_wait(&failure) {
                // What it says before it is stopped tells more.
                CauseSearch { machine: self }.probe();
            }
            let failure = self.bus_watch.explain(now, failure);
            self.host_watch.explain(now, failure)
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
        let drives = 0..self.devices.drive_count();
        // One that was off all the time is told to stop, and not waited for.
        let may_move: Vec<usize> = drives
            .clone()
            .filter(|at| self.devices.may_move(*at))
            .collect();
        for at in drives {
            self.devices
                .drive_mut(at)
                .control(now, DriveCommand::QuickStop);
        }
        let mut unconfirmed = BTreeMap::new();
        // All were told at once, so all share one limit.
        let wait = Watched::in_silence(now, STOP_LIMIT, self.patience);
        for at in &may_move {
            // A drive that is gone cannot confirm; the others must still be stopped.
            if let Err(failure) = self.await_watched(*at, "quick stop", wait.clone()) {
                unconfirmed.insert(*at, failure);
            }
        }
        if !unconfirmed.is_empty() {
            CauseSearch { machine: self }.probe();
        }
        let now = self.now();
        for at in &may_move {
            self.devices
                .drive_mut(*at)
                .control(now, DriveCommand::Disable);
        }
        let wait = Watched::in_silence(now, STOP_LIMIT, self.patience);
        for at in &may_move {
            if let Err(failure) = self.await_watched(*at, "disable", wait.clone()) {
                unconfirmed.entry(*at).or_insert(failure);
            }
        }
        // One that is silent is warned of below.
        let is_heard = |at: &usize| {
            let place = self.devices.drive(*at).place();
            !unconfirmed.contains_key(at) || place.is_some_and(|place| place.at > now)
        };
        let heard = may_move.iter().copied().filter(is_heard).collect();
        await_rest(self, heard);
        let mut search = CauseSearch { machine: self };
        search.look();
        for (at, failure) in unconfirmed {
            search.warn_unconfirmed(at, &failure);
        }
        release_watches(self);
        self.approach.iter_mut().for_each(ApproachTracker::forget);
        let _ = self.ports.set_sync(&mut *self.transport, false);
        self.supervision = Supervision::Off;
        kept_zero::forget_doubted(self);
    }
}

/// Lets the drives of a stopped `machine` send on: their drivers stop one that is enabled by itself. Alarms end nothing
/// meanwhile.
pub fn watch_stopped(machine: &mut Machine) {
    // A bus that is gone has failed before.
    let _ = machine.ports.set_sync(&mut *machine.transport, true);
}
