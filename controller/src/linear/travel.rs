//! Moves that are waited for.

use units::{Approach, Metres};

use crate::correction::Correction;
use crate::failure::Failure;
use crate::linear::course::PlannedMove;
use crate::linear::stage::LinearStage;

impl LinearStage<'_> {
    /// Moves the point of the axis to `target` (machine coordinates), compensated when a
    /// calibration is in use, and returns the set-point the drive was sent. The move ends with an approach
    /// over `approach_mm` of the configuration, where it says one.
    ///
    /// # Errors
    /// Before anything moves: not zeroed, outside the soft limits, outside the calibrated
    /// range. While moving: whatever stops the machine.
    pub fn move_to(&mut self, target: Metres) -> Result<Metres, Failure> {
        self.core.require_zeroed(self.axis)?;
        self.arrive(target, Correction::On)
    }

    /// [`Self::move_to`] with an approach from the side that `approach` begins at ([`Course::plan_from`](crate::linear::Course::plan_from)).
    ///
    /// # Errors
    /// As [`Self::move_to`] and [`Course::plan_from`](crate::linear::Course::plan_from).
    pub fn move_to_from(&mut self, target: Metres, approach: Approach) -> Result<Metres, Failure> {
        let planned = self
            .course()
            .plan_from(self.core.machine, self.axis, target, approach)?;
        self.follow(&planned)
    }

    fn follow(&mut self, planned: &PlannedMove) -> Result<Metres, Failure> {
        if let Some(from) = planned.by_way_of {
            self.core.profile_move(self.axis, from, planned.speed)?;
        }
        self.core
            .profile_move(self.axis, planned.set_point, planned.speed)?;
        Ok(planned.set_point)
    }

    /// Moves without asking for a zero: procedures that make the zero use it too.
    pub(crate) fn travel(
        &mut self,
        target: Metres,
        correction: Correction,
    ) -> Result<Metres, Failure> {
        let course = &self.memory.course;
        let planned = course.plan_anywhere(self.core.machine, self.axis, target, correction)?;
        self.follow(&planned)
    }

    /// Moves to `target` as [`Self::travel`], so that the move ends with an approach over the length of the
    /// configuration, where it says one: what lost motion and servo do at the end is then always the same.
    pub(crate) fn arrive(
        &mut self,
        target: Metres,
        correction: Correction,
    ) -> Result<Metres, Failure> {
        let Some(length) = self.approach_length() else {
            return self.travel(target, correction);
        };
        let (course, to) = (&self.memory.course, (target, length));
        let planned = course.plan_arrival(self.core.machine, self.axis, to, correction)?;
        self.follow(&planned)
    }

    /// The length of approaches, where the configuration says one.
    pub(crate) fn approach_length(&self) -> Option<Metres> {
        let own = self.config.compensation.as_ref();
        own.and_then(|it| it.approach_mm).map(Metres::from_mm)
    }

    /// By how much the ends of calibrations are overrun, where there are any.
    pub(crate) fn overrun(&self) -> Option<Metres> {
        let own = self.config.calibrate.as_ref()?;
        (own.overrun_mm > 0.0).then(|| Metres::from_mm(own.overrun_mm))
    }
}
