//! Waiting for a device, and saying so.

use core::time::Duration;

use units::Time;

use crate::devices::Devices;
use crate::failure::Failure;
use crate::machine::Machine;
use crate::observer::Observer;
use crate::patience::Patience;

/// The longest a device may take to start: some boot for seconds.
const START_LIMIT: Duration = Duration::from_secs(15);
/// For so long nobody wonders.
const SILENT: Duration = Duration::from_secs(2);

/// A wait for devices that may not be there: whoever watches is told what is being waited for.
#[derive(Clone)]
pub(crate) struct Watched {
    patience: Patience,
    begun: Time,
    limit: Duration,
    /// When whoever watches should hear again what is waited for.
    tell: Time,
}

impl Watched {
    /// From `now` for `limit` and what `patience` adds.
    pub(crate) fn new(now: Time, limit: Duration, patience: Patience) -> Self {
        Self {
            patience,
            begun: now,
            limit: patience.of(limit),
            tell: now + patience.of(SILENT),
        }
    }

    /// The same, of a device that is there: nobody is told anything.
    pub(crate) fn in_silence(now: Time, limit: Duration, patience: Patience) -> Self {
        Self {
            tell: Time::NEVER,
            ..Self::new(now, limit, patience)
        }
    }

    /// How long it may last.
    pub(crate) const fn limit(&self) -> Duration {
        self.limit
    }

    /// How long it has lasted.
    pub(crate) fn waited(&self, now: Time) -> Duration {
        now.since(self.begun)
    }

    pub(crate) fn is_over(&self, now: Time) -> bool {
        now >= self.begun + self.limit
    }

    /// When to look again.
    pub(crate) fn next(&self) -> Time {
        (self.begun + self.limit).min(self.tell)
    }

    /// Tells that the devices `at` are waited for, and how long still, in seconds of the wall, when
    /// it is time for that.
    pub(crate) fn tell(
        &mut self,
        now: Time,
        at: impl IntoIterator<Item = usize>,
        devices: &mut Devices,
        observer: &mut dyn Observer,
    ) {
        if now < self.tell {
            return;
        }
        let [waited, limit] =
            [self.waited(now), self.limit].map(|it| self.patience.on_the_wall(it).as_secs_f64());
        for at in at {
            let what = match devices.unit_mut(at).device.looks_for() {
                Some(what) => format!("looking for {what}"),
                None => "has not answered yet".into(),
            };
            let name = devices.name(at);
            observer.waiting(&format!(
                "{name}: {what} ({waited:.0} s of at most {limit:.0} s)"
            ));
        }
        self.tell = now + self.patience.of(SILENT);
    }
}

impl Machine {
    /// Waits for the outcome of device number `at`.
    pub(crate) fn await_outcome(
        &mut self,
        at: usize,
        step: &'static str,
        limit: Duration,
    ) -> Result<(), Failure> {
        let wait = Watched::in_silence(self.now(), limit, self.patience);
        self.await_watched(at, step, wait)
    }

    /// Waits for the start of device number `at`, which may not be there.
    pub(crate) fn await_start(&mut self, at: usize) -> Result<(), Failure> {
        let wait = Watched::new(self.now(), START_LIMIT, self.patience);
        self.await_watched(at, "start", wait)
    }

    pub(crate) fn await_watched(
        &mut self,
        at: usize,
        step: &'static str,
        mut wait: Watched,
    ) -> Result<(), Failure> {
        loop {
            if let Some(outcome) = self.devices.unit_mut(at).device.poll_outcome() {
                let device = self.devices.name(at);
                return outcome.map_err(|source| Failure::Device { device, source });
            }
            let now = self.now();
            if wait.is_over(now) {
                return Err(Failure::Overdue {
                    device: self.devices.name(at),
                    step,
                    waited: wait.limit(),
                });
            }
            wait.tell(now, [at], &mut self.devices, &mut *self.notices.observer);
            self.tick(wait.next())?;
        }
    }
}
