//! An axis that runs until its time is over or its soft limit is reached.

use core::time::Duration;

use machine::Moving;
use units::{Approach, AxisSpeed, MetresPerSecond};

use crate::failure::Failure;
use crate::jogging::{Jogged, require_usual, run_on};
use crate::linear::stage::LinearStage;

impl LinearStage<'_> {
    /// # Errors
    /// When `speed` is above that of the axis's configuration.
    pub(crate) fn check_jog(&self, speed: MetresPerSecond) -> Result<(), Failure> {
        let usual = self.core.axis_settings(self.axis)?.speed;
        require_usual(self.axis, (speed.into(), usual.into()), "speed_mm_per_s")
    }

    /// Runs the axis at `speed`, its sign says which way, for so long at most and as far as its soft limit; it stands
    /// afterwards.
    ///
    /// # Errors
    /// Before anything moves: not zeroed. While moving: whatever stops the machine.
    pub(crate) fn jog(
        &mut self,
        speed: MetresPerSecond,
        duration: Option<Duration>,
    ) -> Result<Jogged, Failure> {
        self.core.require_zeroed(self.axis)?;
        let settings = self.core.axis_settings(self.axis)?;
        let limit = match AxisSpeed::from(speed).approach() {
            Approach::Forward => settings.soft_max,
            Approach::Reverse => settings.soft_min,
        };
        Moving::of(self.core.machine, self.axis)?.begin(limit, speed.abs())?;
        let is_at_end = run_on(self.core.machine, &[self.axis], duration)?;
        self.core.forget_approach(self.axis)?;
        let reading = self.core.reading(self.axis)?;
        Ok(Jogged {
            position: reading.map_or(limit, |it| it.position).into(),
            is_at_end,
        })
    }
}
