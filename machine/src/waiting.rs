//! Waiting for a device, and saying so.

use core::time::Duration;

use units::Time;

use crate::failure::Failure;
use crate::machine::Machine;

/// The longest a device may take to start: some boot for seconds.
const START_LIMIT: Duration = Duration::from_secs(15);
/// For so long nobody wonders.
const SILENT: Duration = Duration::from_secs(2);

impl Machine {
    /// Waits for the outcome of device number `at`.
    pub(crate) fn await_outcome(
        &mut self,
        at: usize,
        step: &'static str,
        limit: Duration,
    ) -> Result<(), Failure> {
        self.await_told(at, step, limit, Time::NEVER)
    }

    /// Waits for the start of device number `at`, which may not be there: whoever watches is told
    /// what is being waited for.
    pub(crate) fn await_start(&mut self, at: usize) -> Result<(), Failure> {
        let tell = self.silent_until();
        self.await_told(at, "start", START_LIMIT, tell)
    }

    fn await_told(
        &mut self,
        at: usize,
        step: &'static str,
        limit: Duration,
        mut tell: Time,
    ) -> Result<(), Failure> {
        let begun = self.now();
        let limit = self.patience.of(limit);
        let deadline = begun + limit;
        loop {
            if let Some(outcome) = self.device_mut(at).device.poll_outcome() {
                let device = self.device_name(at);
                return outcome.map_err(|source| Failure::Device { device, source });
            }
            if self.now() >= deadline {
                return Err(Failure::Overdue {
                    device: self.device_name(at),
                    step,
                    waited: limit,
                });
            }
            if self.now() >= tell {
                self.tell_waiting(at, self.now().since(begun), limit);
                tell = self.silent_until();
            }
            self.tick(deadline.min(tell))?;
        }
    }

    /// When whoever watches should hear again what is waited for.
    pub(crate) fn silent_until(&self) -> Time {
        self.now() + self.patience.of(SILENT)
    }

    /// Tells what device number `at` is waited for, and how long still, in seconds of the wall.
    pub(crate) fn tell_waiting(&mut self, at: usize, waited: Duration, limit: Duration) {
        let [waited, limit] = [waited, limit].map(|it| self.patience.on_the_wall(it).as_secs_f64());
        let what = match self.device_mut(at).device.looks_for() {
            Some(what) => format!("looking for {what}"),
            None => "has not answered yet".into(),
        };
        let name = self.device_name(at);
        self.observer.waiting(&format!(
            "{name}: {what} ({waited:.0} s of at most {limit:.0} s)"
        ));
    }
}
