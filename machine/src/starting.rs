//! How a machine begins.

use compensator::apply::ApproachTracker;

use crate::failure::Failure;
use crate::kept_zero;
use crate::lookout::Lookout;
use crate::machine::{Machine, Supervision};

impl Machine {
    /// Starts SYNC, every axis and every analog module, and checks who they are; an axis whose drive proves that it
    /// kept its reference has its zero again ([`kept_zero::keep`]). Nothing moves. Instruments, and cameras that are no detectors, are started when a procedure first needs them: a machine
    /// in production may have none.
    ///
    /// # Errors
    /// When a device does not answer, is another one than configured, or refuses its set-up.
    pub fn start(&mut self) -> Result<(), Failure> {
        self.diagnosis.begin();
        self.catch_up();
        self.devices.lookouts.fill(Lookout::default());
        self.zeroed.fill(false);
        self.approach.iter_mut().for_each(ApproachTracker::forget);
        if self.ports.is_synchronous {
            self.ports.set_sync(&mut *self.transport, false)?;
        }
        self.ports.set_sync(&mut *self.transport, true)?;
        let machine_devices = self.devices.instrument_device(0);
        let detectors = self.devices.detector_cameras();
        let now = self.now();
        for at in (0..machine_devices).chain(detectors.iter().copied()) {
            self.devices.unit_mut(at).device.start(now);
        }
        for at in (0..machine_devices).chain(detectors) {
            self.await_start(at)?;
        }
        self.devices.open_lookouts();
        self.supervision = Supervision::On;
        kept_zero::take_up(self)
    }
}
