//! Moves of a linear axis that nobody waits for.

use drivers::device::AxisCommand;
use units::{Metres, MetresPerSecond};

use crate::failure::Failure;
use crate::machine::Machine;

/// A linear axis of a machine, to be moved by whoever does not wait.
///
/// [`Machine::outcome`] says how a move ended; [`Driving`](crate::Driving) stops it.
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
        let now = self.machine.now();
        let command = AxisCommand::MoveTo {
            target: set_point,
            speed,
            acceleration,
        };
        self.machine.devices.axes[self.at]
            .device
            .command(now, command);
        Ok(())
    }

    /// The move to `set_point` has ended there: from which side it came is remembered.
    pub fn arrived(&mut self, set_point: Metres) {
        self.machine.approach[self.at].update(set_point);
    }
}
