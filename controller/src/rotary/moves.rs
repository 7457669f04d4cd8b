//! Moves of a rotary axis that are compensated, and the calibration they use.

use compensator::rotary::PeriodicCompensation;
use units::Radians;

use crate::failure::Failure;
use crate::rotary::table::RotaryTable;
use crate::rotary::{RotaryMoved, Way};
use crate::store::Store;

impl RotaryTable<'_> {
    /// Turns the table to `angle`, compensated where it has a calibration.
    ///
    /// # Errors
    /// Before anything moves: not zeroed, no angle. While moving: whatever stops the machine.
    pub fn move_to(&mut self, angle: Radians, way: Way) -> Result<RotaryMoved, Failure> {
        self.core.require_zeroed(self.axis)?;
        let course = self.course();
        let planned = course.plan(self.axis, self.reading()?, angle, way)?;
        self.turn_to(planned.set_point, Way::Turns)?;
        Ok(course.moved(&planned, self.reading()?))
    }

    /// Loads the calibration that `store` says is active for the table, after
    /// checking that it belongs to this machine; returns its name, `None` when there is none.
    ///
    /// # Errors
    /// When it is damaged, of another kind, belongs to another machine or breaks a limit.
    pub fn load_active(&mut self, store: &Store) -> Result<Option<String>, Failure> {
        let Some(in_use) = self.subject().in_use(store)? else {
            return Ok(None);
        };
        let id = in_use.id.clone();
        self.memory.calibration = Some(in_use);
        Ok(Some(id))
    }

    /// The calibration in use.
    pub fn compensation(&self) -> Option<&PeriodicCompensation> {
        let calibration = self.memory.calibration.as_ref()?;
        Some(&calibration.compensation)
    }

    /// Uses no calibration any more.
    pub fn forget_calibration(&mut self) {
        self.memory.calibration = None;
    }
}
