//! What every linear axis can do: be switched on and off, move within its limits, stand still.

use core::time::Duration;

use compensator::apply::ApproachTracker;
use drivers::device::{AxisCommand, DriveCommand};
use units::{Metres, MetresPerSecond, Time};

use crate::failure::Failure;
use crate::machine::Machine;

/// The longest an axis may take to come to rest after its drive has called the target reached.
const SETTLING_LIMIT: Duration = Duration::from_secs(2);

impl Machine {
    /// Switches `axis`, linear or rotary, on.
    ///
    /// # Errors
    /// When the drive refuses or does not answer in time.
    pub fn enable(&mut self, axis: &str) -> Result<(), Failure> {
        let at = self.devices.drive_index(axis)?;
        self.control(at, DriveCommand::Enable, "enable", Duration::from_secs(5))
    }

    /// Switches `axis`, linear or rotary, off.
    ///
    /// # Errors
    /// When the drive refuses or does not answer in time.
    pub fn disable(&mut self, axis: &str) -> Result<(), Failure> {
        let at = self.devices.drive_index(axis)?;
        let limit = Duration::from_secs(5);
        self.control(at, DriveCommand::Disable, "disable", limit)
    }

    /// Acknowledges a fault of `axis`, linear or rotary, once.
    ///
    /// # Errors
    /// When the fault does not go: its cause is still there.
    pub fn reset_fault(&mut self, axis: &str) -> Result<(), Failure> {
        let at = self.devices.drive_index(axis)?;
        let limit = Duration::from_secs(5);
        self.control(at, DriveCommand::ResetFault, "fault reset", limit)
    }

    /// Refuses a target outside the soft limits.
    ///
    /// # Errors
    /// When it is, or there is no such axis.
    pub fn check_soft_limits(&self, axis: &str, target: Metres) -> Result<(), Failure> {
        let (min, max) = self.soft_limits(axis)?;
        // Written so that NaN is refused too.
        if target >= min && target <= max {
            return Ok(());
        }
        Err(Failure::SoftLimit {
            axis: axis.to_owned(),
            target,
            min,
            max,
        })
    }

    /// Starts the motions that `axes` have been prepared for, at one moment, and waits until each is
    /// done.
    ///
    /// # Errors
    /// When there is no such axis, the machine is not started, or a motion does not end well.
    pub fn start_together(&mut self, axes: &[&str]) -> Result<(), Failure> {
        let numbers = axes.iter().map(|axis| self.devices.axis_index(axis));
        let numbers: Vec<_> = numbers.collect::<Result<_, _>>()?;
        let now = self.now();
        for at in &numbers {
            self.require_supervised(*at)?;
            self.devices.axes[*at]
                .device
                .command(now, AxisCommand::Start);
        }
        for at in numbers {
            self.await_outcome(at, "move", self.settings[at].move_timeout)?;
        }
        Ok(())
    }

    /// When the last motion of `axis` was seen to be begun.
    ///
    /// # Errors
    /// When there is no such axis.
    pub fn started_at(&self, axis: &str) -> Result<Option<Time>, Failure> {
        Ok(self.devices.axes[self.devices.axis_index(axis)?]
            .device
            .started_at())
    }

    /// The direction of the last motion of `axis`.
    ///
    /// # Errors
    /// When there is no such axis.
    pub fn approach(&self, axis: &str) -> Result<ApproachTracker, Failure> {
        Ok(self.approach[self.devices.axis_index(axis)?])
    }

    /// Forgets from which side `axis` came to its position.
    ///
    /// # Errors
    /// When there is no such axis.
    pub fn forget_approach(&mut self, axis: &str) -> Result<(), Failure> {
        let at = self.devices.axis_index(axis)?;
        self.approach[at].forget();
        Ok(())
    }

    /// Waits until `axis` has stood still for `span` without a break.
    ///
    /// # Errors
    /// When there is no such axis, it does not come to rest, or as [`Machine::tick`].
    pub fn stand_still(&mut self, axis: &str, span: Duration) -> Result<(), Failure> {
        let limit = self.patience.of(SETTLING_LIMIT) + span;
        let start = self.now();
        let mut since = start;
        while self.now().since(since) < span {
            if self.now().since(start) > limit {
                let device = axis.to_owned();
                return Err(Failure::Overdue {
                    device,
                    step: "standing still",
                    waited: limit,
                });
            }
            self.tick(since + span)?;
            if !self.reading(axis)?.is_some_and(|reading| reading.standing) {
                since = self.now();
            }
        }
        Ok(())
    }

    /// One profile position move in drive coordinates, awaited. Soft limits are the caller's
    /// affair: procedures that look for the origin go beyond them.
    ///
    /// # Errors
    /// When there is no such axis, the machine is not started, or the move does not end well.
    pub fn profile_move(
        &mut self,
        axis: &str,
        target: Metres,
        speed: MetresPerSecond,
    ) -> Result<(), Failure> {
        let at = self.devices.axis_index(axis)?;
        let (acceleration, limit) = {
            let settings = &self.settings[at];
            (settings.acceleration, settings.move_timeout)
        };
        let command = AxisCommand::MoveTo {
            target,
            speed,
            acceleration,
        };
        let result = self.command(axis, command, "move", limit);
        let approach = &mut self.approach[at];
        if result.is_ok() {
            approach.update(target);
        } else {
            // Where it stopped, and from where it came there, nobody knows.
            approach.forget();
        }
        result
    }
}
