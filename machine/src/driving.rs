//! The drive of an axis, linear or rotary, switched and stopped by whoever does not wait.

use drivers::device::DriveCommand;

use crate::failure::Failure;
use crate::machine::Machine;

/// The drive of a linear or rotary axis, to be told something by whoever does not wait.
///
/// Each of these begins something; [`Driving::outcome`] says how it ended.
pub struct Driving<'m> {
    machine: &'m mut Machine,
    /// Its number among all drives.
    at: usize,
}

impl<'m> Driving<'m> {
    /// The drive of `axis` of `machine`.
    ///
    /// # Errors
    /// When there is no such axis.
    pub fn of(machine: &'m mut Machine, axis: &str) -> Result<Self, Failure> {
        let at = machine.devices.drive_index(axis)?;
        Ok(Self { machine, at })
    }

    /// Slows down and stands, staying enabled; from which side it came there nobody knows. `false`: the cyclic loop has
    /// it in its hands, and brings it to rest together with the others.
    pub fn halt(&mut self) -> bool {
        let axis = self.machine.devices.axes.get(self.at);
        let is_cyclic = axis.is_some_and(|it| it.device.held().is_some());
        match (is_cyclic, self.machine.follows) {
            (true, true) => return false,
            // It stands at its last set-point: nothing sends it another one.
            (true, false) => self.give_up(DriveCommand::LeaveCyclic),
            (false, _) => self.give_up(DriveCommand::Halt),
        }
        true
    }

    /// Stops as fast as the quick stop deceleration allows, then disables.
    pub fn quick_stop(&mut self) {
        // Nothing follows set-points any more.
        self.machine.follows = false;
        self.give_up(DriveCommand::QuickStop);
    }

    /// Begins to switch the axis on.
    ///
    /// # Errors
    /// When the machine is not started.
    pub fn enable(&mut self) -> Result<(), Failure> {
        self.machine.require_supervised(self.at)?;
        self.control(DriveCommand::Enable);
        Ok(())
    }

    /// Begins to switch the axis off.
    pub fn disable(&mut self) {
        // Whoever pushes it meanwhile takes up what lost motion there is.
        self.give_up(DriveCommand::Disable);
    }

    /// How what was begun last ended; `None` while it runs, and when it has been asked for.
    pub fn outcome(&mut self) -> Option<Result<(), Failure>> {
        let outcome = self.machine.devices.drive_mut(self.at).poll_outcome()?;
        let failed = |source| Failure::Device {
            device: self.machine.devices.name(self.at),
            source,
        };
        Some(outcome.map_err(failed))
    }

    fn give_up(&mut self, command: DriveCommand) {
        // Of rotary axes nobody remembers it.
        if let Some(approach) = self.machine.approach.get_mut(self.at) {
            approach.forget();
        }
        self.control(command);
    }

    fn control(&mut self, command: DriveCommand) {
        let now = self.machine.now();
        self.machine
            .devices
            .drive_mut(self.at)
            .control(now, command);
    }
}
