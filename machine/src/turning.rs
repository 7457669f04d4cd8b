//! What every rotary axis can do: turn, and latch where lines pass.

use core::time::Duration;

use drivers::device::{AxisCommand, DeviceError, LatchCommand, Latched, RotaryAxis};
use units::{Radians, RadiansPerSecond};

use crate::failure::Failure;
use crate::machine::Machine;

/// The longest a drive may take to arm or disarm its touch probe.
const LATCH_LIMIT: Duration = Duration::from_secs(5);

/// A rotary axis of a machine, to be turned.
pub struct Turning<'m> {
    machine: &'m mut Machine,
    /// Its number among the rotary axes.
    at: usize,
}

impl Machine {
    /// The rotary axis `axis`, to be turned.
    ///
    /// # Errors
    /// When there is no such axis.
    pub fn turning(&mut self, axis: &str) -> Result<Turning<'_>, Failure> {
        let at = self.devices.rotary_index(axis)?;
        Ok(Turning { machine: self, at })
    }
}

impl Turning<'_> {
    /// Gives `command` to the axis and waits until it is done, for `limit` at most; `step` is its
    /// name for a person.
    ///
    /// # Errors
    /// When the machine is not started, or the command fails.
    pub fn command(
        &mut self,
        command: AxisCommand<Radians>,
        step: &'static str,
        limit: Duration,
    ) -> Result<(), Failure> {
        self.begin(command)?;
        self.machine.await_outcome(self.drive(), step, limit)
    }

    /// Gives `command` to the axis and does not wait.
    ///
    /// # Errors
    /// When the machine is not started.
    pub fn begin(&mut self, command: AxisCommand<Radians>) -> Result<(), Failure> {
        self.machine.require_supervised(self.drive())?;
        let now = self.machine.now();
        self.device_mut().command(now, command);
        Ok(())
    }

    /// How the command that was begun last ended; `None` while it runs, and when it has been asked for.
    ///
    /// # Errors
    /// How it failed.
    pub fn outcome(&mut self) -> Option<Result<(), Failure>> {
        let outcome = self.device_mut().poll_outcome()?;
        Some(outcome.map_err(|source| self.failed(source)))
    }

    /// Arms or disarms the touch probe.
    ///
    /// # Errors
    /// When the drive refuses.
    pub fn latch(&mut self, command: LatchCommand<Radians>) -> Result<(), Failure> {
        let now = self.machine.now();
        self.device_mut().latch(now, command);
        let at = self.drive();
        self.machine.await_outcome(at, "touch probe", LATCH_LIMIT)
    }

    /// Refuses a turn in which edges, no nearer than `spacing`, would be lost at `speed`.
    ///
    /// # Errors
    /// When they would.
    pub fn check_latch_speed(
        &self,
        spacing: Radians,
        speed: RadiansPerSecond,
    ) -> Result<(), Failure> {
        let possible = self.device().check_latch_speed(spacing, speed);
        possible.map_err(|source| self.failed(source))
    }

    /// What the touch probe has latched and nobody took yet.
    pub fn take_latched(&mut self) -> Vec<Latched<Radians>> {
        let device = self.device_mut();
        core::iter::from_fn(|| device.poll_latched()).collect()
    }

    fn failed(&self, source: DeviceError) -> Failure {
        let device = self.machine.devices.name(self.drive());
        Failure::Device { device, source }
    }

    fn device(&self) -> &dyn RotaryAxis {
        &*self.machine.devices.rotaries[self.at].device
    }

    fn device_mut(&mut self) -> &mut dyn RotaryAxis {
        &mut *self.machine.devices.rotaries[self.at].device
    }

    /// The number of its drive.
    fn drive(&self) -> usize {
        self.machine.devices.axes.len() + self.at
    }
}
