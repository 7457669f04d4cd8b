//! Moves of a linear axis that nobody waits for: begun, asked for, halted.

use drivers::device::{AxisCommand, DriveCommand};
use units::{Metres, MetresPerSecond};

use crate::failure::Failure;
use crate::machine::Machine;

/// A linear axis of a machine, to be moved by whoever does not wait.
///
/// Each of these begins something; [`Machine::outcome`] says how it ended.
pub struct Moving<'m> {
    machine: &'m mut Machine,
    /// Its number among the linear axes.
    at: usize,
}

impl<'m> Moving<'m> {
    /// The linear axis `axis` of `machine`.
    ///
    /// # Errors
    /// When there is no such axis.
    pub fn of(machine: &'m mut Machine, axis: &str) -> Result<Self, Failure> {
        let at = machine.devices.axis_index(axis)?;
        Ok(Self { machine, at })
    }

    /// Begins a profile position move to `set_point`, in drive coordinates. Soft limits are the caller's affair.
    ///
    /// # Errors
    /// When the machine is not started.
    pub fn begin(&mut self, set_point: Metres, speed: MetresPerSecond) -> Result<(), Failure> {
        let acceleration = self.machine.settings[self.at].acceleration;
        self.machine.require_supervised(self.at)?;
        self.command(AxisCommand::MoveTo {
            target: set_point,
            speed,
            acceleration,
        });
        Ok(())
    }

    /// The move to `set_point` has ended there: from which side it came is remembered.
    pub fn arrived(&mut self, set_point: Metres) {
        self.machine.approach[self.at].update(set_point);
    }

    /// Slows down and stands, staying enabled; from which side it came there nobody knows.
    pub fn halt(&mut self) {
        self.give_up(DriveCommand::Halt);
    }

    /// Stops as fast as the quick stop deceleration allows, then disables.
    pub fn quick_stop(&mut self) {
        self.give_up(DriveCommand::QuickStop);
    }

    /// Begins to switch the axis on.
    ///
    /// # Errors
    /// When the machine is not started.
    pub fn enable(&mut self) -> Result<(), Failure> {
        self.machine.require_supervised(self.at)?;
        self.command(DriveCommand::Enable.into());
        Ok(())
    }

    /// Begins to switch the axis off.
    pub fn disable(&mut self) {
        self.command(DriveCommand::Disable.into());
    }

    fn give_up(&mut self, command: DriveCommand) {
        self.machine.approach[self.at].forget();
        self.command(command.into());
    }

    fn command(&mut self, command: AxisCommand) {
        let now = self.machine.now();
        self.machine.devices.axes[self.at]
            .device
            .command(now, command);
    }
}
