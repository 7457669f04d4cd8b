//! Displacement instruments and analog modules: put into use, read, released again.

use core::time::Duration;

use drivers::device::DisplacementReading;

use crate::failure::Failure;
use crate::machine::Machine;

impl Machine {
    /// Starts `instrument`, unless it runs already (its datum stands then), and counts its alarms
    /// from now on.
    ///
    /// # Errors
    /// When there is no such instrument, or it does not answer or is another one.
    pub fn use_instrument(&mut self, instrument: &str) -> Result<(), Failure> {
        let at = self.devices.instrument_index(instrument)?;
        self.use_device(self.devices.instrument_device(at), instrument)
    }

    /// No instrument or camera is in use from now on: an operator may reach into its beam.
    pub fn leave_instrument(&mut self) {
        self.instrument_in_use = None;
    }

    /// Instruments may be taken away: one that comes back is identified again.
    pub fn forget_instruments(&mut self) {
        self.leave_instrument();
        self.started_instruments.clear();
    }

    /// Makes `instrument` read zero from now on.
    ///
    /// # Errors
    /// When there is no such instrument.
    pub fn set_instrument_datum(&mut self, instrument: &str) -> Result<(), Failure> {
        let at = self.devices.instrument_index(instrument)?;
        let now = self.now();
        self.devices.instruments[at].device.set_datum(now);
        Ok(())
    }

    /// The average of `samples` readings of `instrument`, which come at `rate_hz`. The machine
    /// should stand: nothing here waits for that.
    ///
    /// # Errors
    /// When there is no such instrument, or its readings stay away or are no good.
    pub fn average(
        &mut self,
        instrument: &str,
        samples: u32,
        rate_hz: f64,
    ) -> Result<DisplacementReading, Failure> {
        let at = self.devices.instrument_index(instrument)?;
        let now = self.now();
        self.devices.instruments[at]
            .device
            .begin_average(now, samples);
        // Four times the nominal time: the stream comes in batches over USB.
        let limit = Duration::from_secs_f64(1.0 + 4.0 * f64::from(samples) / rate_hz);
        self.await_outcome(
            self.devices.instrument_device(at),
            "average of readings",
            limit,
        )?;
        let average = self.devices.instruments[at].device.average();
        Ok(average.expect("an average that ended well is there"))
    }
}
