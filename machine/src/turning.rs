//! What every rotary axis can do: turn, and latch where lines pass.

use core::time::Duration;

use drivers::device::{AxisCommand, AxisReading, LatchCommand, Latched};
use units::{Radians, RadiansPerSecond};

use crate::failure::Failure;
use crate::machine::Machine;

/// The longest a drive may take to arm or disarm its touch probe.
const LATCH_LIMIT: Duration = Duration::from_secs(5);

impl Machine {
    /// The names of the rotary axes.
    pub fn rotary_names(&self) -> Vec<String> {
        self.rotaries.iter().map(|unit| unit.name.clone()).collect()
    }

    /// The newest sample of the rotary axis `axis`; its position counts on over the turns.
    ///
    /// # Errors
    /// When there is no such axis.
    pub fn rotary_reading(&self, axis: &str) -> Result<Option<AxisReading<Radians>>, Failure> {
        Ok(self.rotaries[self.rotary_index(axis)?].device.reading())
    }

    /// Gives `command` to the rotary axis `axis` and waits until it is done, for `limit` at most;
    /// `step` is its name for a person.
    ///
    /// # Errors
    /// When there is no such axis, the machine is not started, or the command fails.
    pub fn turn_command(
        &mut self,
        axis: &str,
        command: AxisCommand<Radians>,
        step: &'static str,
        limit: Duration,
    ) -> Result<(), Failure> {
        let at = self.rotary_index(axis)?;
        let drive = self.axes.len() + at;
        self.require_supervised(drive)?;
        let now = self.now();
        self.rotaries[at].device.command(now, command);
        self.await_outcome(drive, step, limit)
    }

    /// Arms or disarms the touch probe of the rotary axis `axis`.
    ///
    /// # Errors
    /// When there is no such axis, or its drive refuses.
    pub fn latch(&mut self, axis: &str, command: LatchCommand<Radians>) -> Result<(), Failure> {
        let at = self.rotary_index(axis)?;
        let now = self.now();
        self.rotaries[at].device.latch(now, command);
        self.await_outcome(self.axes.len() + at, "touch probe", LATCH_LIMIT)
    }

    /// Refuses a turn of `axis` in which edges, no nearer than `spacing`, would be lost at `speed`.
    ///
    /// # Errors
    /// When they would, or there is no such axis.
    pub fn check_latch_speed(
        &self,
        axis: &str,
        spacing: Radians,
        speed: RadiansPerSecond,
    ) -> Result<(), Failure> {
        let device = &self.rotaries[self.rotary_index(axis)?].device;
        device
            .check_latch_speed(spacing, speed)
            .map_err(|source| Failure::Device {
                device: axis.to_owned(),
                source,
            })
    }

    /// What the touch probe of `axis` has latched and nobody took yet.
    ///
    /// # Errors
    /// When there is no such axis.
    pub fn take_latched(&mut self, axis: &str) -> Result<Vec<Latched<Radians>>, Failure> {
        let at = self.rotary_index(axis)?;
        let device = &mut self.rotaries[at].device;
        Ok(core::iter::from_fn(|| device.poll_latched()).collect())
    }

    /// The number of a named rotary axis among those.
    fn rotary_index(&self, axis: &str) -> Result<usize, Failure> {
        let at = self.rotaries.iter().position(|unit| unit.name == axis);
        at.ok_or_else(|| Failure::NoSuchAxis {
            axis: axis.to_owned(),
            known: self.rotary_names().join(", "),
        })
    }
}
