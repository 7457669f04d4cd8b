//! Moves: limits before anything moves, compensation, and the direction of approach.

use core::time::Duration;

use drivers::device::AxisCommand;
use units::{Approach, Metres, MetresPerSecond, MetresPerSecondSquared};

use crate::failure::Failure;
use crate::machine::Machine;

/// The longest an axis may take to come to rest after its drive has called the target reached.
const SETTLING_LIMIT: Duration = Duration::from_secs(2);

/// Whether a move is corrected by the active calibration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Correction {
    /// The drive is sent the target as it is.
    Off,
    /// The drive is sent the set-point that makes the stage arrive at the target.
    On,
}

impl Machine {
    /// Switches `axis` on.
    ///
    /// # Errors
    /// When the drive refuses or does not answer in time.
    pub fn enable(&mut self, axis: &str) -> Result<(), Failure> {
        self.command(axis, AxisCommand::Enable, "enable", Duration::from_secs(5))
    }

    /// Switches `axis` off.
    ///
    /// # Errors
    /// When the drive refuses or does not answer in time.
    pub fn disable(&mut self, axis: &str) -> Result<(), Failure> {
        self.command(
            axis,
            AxisCommand::Disable,
            "disable",
            Duration::from_secs(5),
        )
    }

    /// Acknowledges a fault of `axis`, once.
    ///
    /// # Errors
    /// When the fault does not go: its cause is still there.
    pub fn reset_fault(&mut self, axis: &str) -> Result<(), Failure> {
        self.command(
            axis,
            AxisCommand::ResetFault,
            "fault reset",
            Duration::from_secs(5),
        )
    }

    /// Moves the point of `axis` to `target` (machine coordinates), compensated when a
    /// calibration is in use, and returns the set-point the drive was sent.
    ///
    /// # Errors
    /// Before anything moves: not zeroed, outside the soft limits, outside the calibrated
    /// range. While moving: whatever stops the machine.
    pub fn move_to(&mut self, axis: &str, target: Metres) -> Result<Metres, Failure> {
        if !self.is_zeroed(axis) {
            return Err(Failure::NotZeroed {
                axis: axis.to_owned(),
            });
        }
        self.travel(axis, target, Correction::On)
    }

    /// The set-point that brings the point to `target` from where the axis is now.
    pub(crate) fn set_point(
        &self,
        axis: &str,
        target: Metres,
        correction: Correction,
    ) -> Result<Metres, Failure> {
        let compensation = self.compensation(axis);
        let (Correction::On, Some(compensation)) = (correction, compensation) else {
            return Ok(target);
        };
        let memory = self.memory.get(axis).expect("every axis has its memory");
        // With no known motion before, forward is as good a guess as any, and the first
        // move of every procedure is long enough to make it true.
        let approach = memory
            .approach
            .approach_of(target)
            .unwrap_or(Approach::Forward);
        compensation
            .set_point(target, approach)
            .map_err(|source| Failure::OutOfCalibration {
                axis: axis.to_owned(),
                source,
            })
    }

    /// Moves without asking for a zero: procedures that make the zero use it too.
    pub(crate) fn travel(
        &mut self,
        axis: &str,
        target: Metres,
        correction: Correction,
    ) -> Result<Metres, Failure> {
        self.check_soft_limits(axis, target)?;
        let set_point = self.set_point(axis, target, correction)?;
        self.check_soft_limits(axis, set_point)?;
        let speed = match (correction, self.compensation(axis)) {
            // So fast that the correction changes no faster than its limit.
            (Correction::On, Some(table)) => self.travel_speed(axis)?.min(table.speed_max()),
            _ => self.travel_speed(axis)?,
        };
        self.profile_move(axis, set_point, speed)?;
        Ok(set_point)
    }

    pub(crate) fn check_soft_limits(&self, axis: &str, target: Metres) -> Result<(), Failure> {
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

    pub(crate) fn travel_speed(&self, axis: &str) -> Result<MetresPerSecond, Failure> {
        Ok(MetresPerSecond(
            self.axis_config(axis)?.speed_mm_per_s * 1e-3,
        ))
    }

    pub(crate) fn acceleration(&self, axis: &str) -> Result<MetresPerSecondSquared, Failure> {
        Ok(MetresPerSecondSquared(
            self.axis_config(axis)?.acceleration_mm_per_s2 * 1e-3,
        ))
    }

    /// Waits until `axis` has stood still for `span` without a break.
    pub(crate) fn stand_still(&mut self, axis: &str, span: Duration) -> Result<(), Failure> {
        let limit = SETTLING_LIMIT * self.patience + span;
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

    /// One profile position move in drive coordinates, awaited.
    pub(crate) fn profile_move(
        &mut self,
        axis: &str,
        target: Metres,
        speed: MetresPerSecond,
    ) -> Result<(), Failure> {
        let acceleration = self.acceleration(axis)?;
        let limit = Duration::from_secs_f64(self.axis_config(axis)?.move_timeout_s);
        let command = AxisCommand::MoveTo {
            target,
            speed,
            acceleration,
        };
        self.command(axis, command, "move", limit)?;
        self.remember(axis).approach.update(target);
        Ok(())
    }
}
