//! A table that turns until its time is over or its drive counts no further.

use core::time::Duration;

use units::{AxisSpeed, RadiansPerSecond};

use crate::failure::Failure;
use crate::jogging::{Jogged, require_usual, run_on};
use crate::rotary::table::RotaryTable;

impl RotaryTable<'_> {
    /// # Errors
    /// When `speed` is above that of the axis's configuration.
    pub(crate) fn check_jog(&self, speed: RadiansPerSecond) -> Result<(), Failure> {
        let usual = RadiansPerSecond(self.config.speed_deg_per_s.to_radians());
        require_usual(self.axis, (speed.into(), usual.into()), "speed_deg_per_s")
    }

    /// Turns the table at `speed`, its sign says which way, for so long at most and as far as its drive counts; it
    /// stands afterwards. Nothing corrects it.
    ///
    /// # Errors
    /// Before anything moves: not zeroed. While moving: whatever stops the machine.
    pub(crate) fn jog(
        &mut self,
        speed: RadiansPerSecond,
        duration: Option<Duration>,
    ) -> Result<Jogged, Failure> {
        self.core.require_zeroed(self.axis)?;
        let way = AxisSpeed::from(speed).approach();
        let devices = self.core.devices();
        let last = devices.rotary_last_position(self.axis, way)?;
        let last = last.expect("an axis that was zeroed has been read");
        let command = self.move_command(last, speed.abs());
        self.core.turning(self.axis)?.begin(command)?;
        let is_at_end = run_on(self.core.machine, &[self.axis], duration)?;
        Ok(Jogged {
            position: self.reading()?.into(),
            is_at_end,
        })
    }
}
