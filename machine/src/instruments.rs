//! Displacement instruments and analog modules: put into use, read, released again.

use core::time::Duration;

use drivers::device::{AnalogInput, DisplacementInstrument, DisplacementReading};

use crate::failure::Failure;
use crate::machine::Machine;
use crate::unit::Unit;

impl Machine {
    /// Starts `instrument`, unless it runs already (its datum stands then), and counts its alarms
    /// from now on.
    ///
    /// # Errors
    /// When there is no such instrument, or it does not answer or is another one.
    pub fn use_instrument(&mut self, instrument: &str) -> Result<(), Failure> {
        let at = self.instrument_index(instrument)?;
        self.use_device(self.instrument_device(at), instrument)
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

    /// The driver of `instrument`.
    ///
    /// # Errors
    /// When there is no such instrument.
    pub fn instrument(&self, instrument: &str) -> Result<&dyn DisplacementInstrument, Failure> {
        Ok(&*self.instruments[self.instrument_index(instrument)?].device)
    }

    /// Makes `instrument` read zero from now on.
    ///
    /// # Errors
    /// When there is no such instrument.
    pub fn set_instrument_datum(&mut self, instrument: &str) -> Result<(), Failure> {
        let at = self.instrument_index(instrument)?;
        let now = self.now();
        self.instruments[at].device.set_datum(now);
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
        let at = self.instrument_index(instrument)?;
        let now = self.now();
        self.instruments[at].device.begin_average(now, samples);
        // Four times the nominal time: the stream comes in batches over USB.
        let limit = Duration::from_secs_f64(1.0 + 4.0 * f64::from(samples) / rate_hz);
        self.await_outcome(self.instrument_device(at), "average of readings", limit)?;
        let average = self.instruments[at].device.average();
        Ok(average.expect("an average that ended well is there"))
    }

    /// The driver of the analog module `module`.
    ///
    /// # Errors
    /// When there is no such module.
    pub fn analog(&self, module: &str) -> Result<&dyn AnalogInput, Failure> {
        let at = place_of(&self.analogs, "analog module", module)?;
        Ok(&*self.analogs[at].device)
    }

    /// The drivers of all analog modules, in the order of their names.
    pub fn analogs(&self) -> impl Iterator<Item = &dyn AnalogInput> {
        self.analogs.iter().map(|unit| &*unit.device as _)
    }

    fn instrument_index(&self, name: &str) -> Result<usize, Failure> {
        place_of(&self.instruments, "instrument", name)
    }
}

fn place_of<D: ?Sized>(
    units: &[Unit<D>],
    what: &'static str,
    name: &str,
) -> Result<usize, Failure> {
    let place = units.iter().position(|unit| unit.name == name);
    place.ok_or_else(|| Failure::NoSuchDevice {
        what,
        name: name.to_owned(),
        known: units
            .iter()
            .map(|unit| unit.name.as_str())
            .collect::<Vec<_>>()
            .join(", "),
    })
}
