//! Moves that are waited for.

use units::Metres;

use crate::correction::Correction;
use crate::failure::Failure;
use crate::linear::stage::LinearStage;

impl LinearStage<'_> {
    /// Moves the point of the axis to `target` (machine coordinates), compensated when a
    /// calibration is in use, and returns the set-point the drive was sent.
    ///
    /// # Errors
    /// Before anything moves: not zeroed, outside the soft limits, outside the calibrated
    /// range. While moving: whatever stops the machine.
    pub fn move_to(&mut self, target: Metres) -> Result<Metres, Failure> {
        self.core.require_zeroed(self.axis)?;
        self.travel(target, Correction::On)
    }

    /// Moves without asking for a zero: procedures that make the zero use it too.
    pub(crate) fn travel(
        &mut self,
        target: Metres,
        correction: Correction,
    ) -> Result<Metres, Failure> {
        let course = &self.memory.course;
        let planned = course.plan_anywhere(self.core.machine, self.axis, target, correction)?;
        self.core
            .profile_move(self.axis, planned.set_point, planned.speed)?;
        Ok(planned.set_point)
    }
}
