//! The search for the cause of a failure, while the machine is stopped and after that.

use core::time::Duration;

use wire::Payload;

use crate::diagnosis::Finding;
use crate::failure::{Failure, Layered};
use crate::machine::{Machine, Supervision};

/// How long after a port has refused a frame its error frame may come.
const BUS_OFF_LIMIT: Duration = Duration::from_millis(20);

/// Returns what [`Machine::explain`] returned, or the cause that the traffic has shown since.
#[must_use]
pub fn diagnose<F: Layered>(machine: &mut Machine, failure: F) -> F {
    failure.map_machine(|failure| CauseSearch { machine }.diagnose(failure))
}

/// A machine of which the cause of a failure is looked for.
pub(crate) struct CauseSearch<'m> {
    pub(crate) machine: &'m mut Machine,
}

impl CauseSearch<'_> {
    fn diagnose(&mut self, failure: Failure) -> Failure {
        match failure {
            Failure::HeldUp {
                pause,
                ago,
                failure,
            } => {
                // A cause that lasts was there long after the pause.
                let cause = self.seek_cause(*failure, Finding::outlasts_pause);
                cause.unwrap_or_else(|failure| Failure::HeldUp {
                    pause,
                    ago,
                    failure: Box::new(failure),
                })
            }
            Failure::Link { port, state } => match self.was_bus_off(&port) {
                true => Failure::BusOff { port },
                false => Failure::Link { port, state },
            },
            known @ Failure::Babbling { .. } => known,
            failure => {
                let cause = self.seek_cause(failure, |_| true);
                cause.unwrap_or_else(|failure| failure)
            }
        }
    }

    /// Whether the controller of `port`, which takes nothing more, left its bus: it says so a moment later.
    fn was_bus_off(&mut self, port: &str) -> bool {
        let until = self.machine.now() + BUS_OFF_LIMIT;
        self.machine.supervision = Supervision::Stopping;
        while !self.machine.diagnosis.is_bus_off(port) && self.machine.now() < until {
            if self.machine.tick(until).is_err() {
                break;
            }
        }
        self.machine.supervision = Supervision::Off;
        self.machine.diagnosis.is_bus_off(port)
    }

    /// The cause of `failure`.
    ///
    /// # Errors
    /// The failure itself when none was seen that `counts`.
    fn seek_cause(
        &mut self,
        failure: Failure,
        counts: impl Fn(&Finding) -> bool,
    ) -> Result<Failure, Failure> {
        let now = self.machine.now();
        let is_own = |id| self.machine.diagnosis.is_own(id);
        let failure = self.machine.bus_watch.explain_by_peak(now, failure, is_own);
        let failure = match failure {
            Ok(babbling) => return Ok(babbling),
            Err(failure) => failure,
        };
        match self.machine.diagnosis.take_answer() {
            Some((device, finding)) if counts(&finding) => Ok(Failure::Explained {
                device,
                finding,
                failure: Box::new(failure),
            }),
            _ => Err(failure),
        }
    }

    /// Lets the traffic answer why it failed, as far as the stop itself has not shown it.
    pub(crate) fn look(&mut self) {
        // What was told to a drive that is not waited for still leaves.
        let _ = self.machine.send_pending();
        while let Some(until) = self.machine.diagnosis.look_until(self.machine.now()) {
            self.probe();
            if self.machine.tick(until).is_err() {
                break;
            }
        }
        self.machine.diagnosis.conclude(self.machine.now());
    }

    /// Asks the drive in question what its process data should say.
    pub(crate) fn probe(&mut self) {
        let now = self.machine.now();
        if let Some((port, frame)) = self.machine.diagnosis.poll_probe(now) {
            // A bus that takes nothing shows by what does not come.
            let _ = self.machine.transport.send(port, &Payload::Frame(frame));
        }
    }

    pub(crate) fn warn_unconfirmed(&mut self, at: usize, failure: &Failure) {
        let axis = self.machine.devices.name(at);
        let stops_itself = self.machine.devices.drive(at).watches_master();
        let finding = self.machine.diagnosis.finding_of(self.machine.now(), &axis);
        let why = match finding {
            Some(finding) => finding.cause(),
            None => failure.to_string(),
        };
        self.machine
            .notices
            .warn_unconfirmed(&axis, &why, stops_itself);
    }
}
