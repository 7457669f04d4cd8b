//! An axis that runs until its time is over or its soft limit is reached.

use core::time::Duration;

use drivers::device::DriveCommand;
use machine::{Moving, STOP_LIMIT};
use units::{Metres, MetresPerSecond};

use crate::failure::Failure;
use crate::linear::stage::LinearStage;

/// How often an end is looked for.
const LOOK: Duration = Duration::from_millis(20);

/// How a jog ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Jogged {
    /// Where the axis stands, by its encoder.
    pub(crate) position: Metres,
    /// Whether it ended at the soft limit.
    pub(crate) is_at_limit: bool,
}

impl LinearStage<'_> {
    /// # Errors
    /// When `speed` is above that of the axis's configuration.
    pub(crate) fn check_jog(&self, speed: MetresPerSecond) -> Result<(), Failure> {
        let usual = self.core.axis_settings(self.axis)?.speed;
        if speed.value().abs() <= usual.value() {
            return Ok(());
        }
        Err(Failure::Usage {
            what: format!(
                "axis {}: {:.3} mm/s is faster than it usually moves, {:.3} mm/s",
                self.axis,
                speed.value().abs() * 1e3,
                usual.value() * 1e3
            ),
            help: "jog it slower, or change `speed_mm_per_s` of its section".into(),
        })
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
        let limit = match speed.value() > 0.0 {
            true => settings.soft_max,
            false => settings.soft_min,
        };
        let end = duration.map(|it| self.core.now() + it);
        let speed = MetresPerSecond(speed.value().abs());
        Moving::of(self.core.machine, self.axis)?.begin(limit, speed)?;
        let is_at_limit = loop {
            let look = self.core.now() + LOOK;
            self.core.tick(look)?;
            if let Some(outcome) = self.core.outcome(self.axis)? {
                outcome?;
                break true;
            }
            if end.is_some_and(|end| self.core.now() >= end) {
                self.core
                    .command(self.axis, DriveCommand::Halt, "halt", STOP_LIMIT)?;
                break false;
            }
        };
        self.core.forget_approach(self.axis)?;
        let reading = self.core.reading(self.axis)?;
        Ok(Jogged {
            position: reading.map_or(limit, |it| it.position),
            is_at_limit,
        })
    }
}
