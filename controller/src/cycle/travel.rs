//! Moves: limits before anything moves, compensation, and the direction of approach.

use core::time::Duration;

use compensator::apply::ApproachTracker;
use compensator::error_table::{Compensation, OutOfRange};
use drivers::device::{AxisCommand, DriveCommand};
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
    /// Switches `axis`, linear or rotary, on.
    ///
    /// # Errors
    /// When the drive refuses or does not answer in time.
    pub fn enable(&mut self, axis: &str) -> Result<(), Failure> {
        let at = self.drive_index(axis)?;
        self.control(at, DriveCommand::Enable, "enable", Duration::from_secs(5))
    }

    /// Switches `axis`, linear or rotary, off.
    ///
    /// # Errors
    /// When the drive refuses or does not answer in time.
    pub fn disable(&mut self, axis: &str) -> Result<(), Failure> {
        let at = self.drive_index(axis)?;
        let limit = Duration::from_secs(5);
        self.control(at, DriveCommand::Disable, "disable", limit)
    }

    /// Acknowledges a fault of `axis`, linear or rotary, once.
    ///
    /// # Errors
    /// When the fault does not go: its cause is still there.
    pub fn reset_fault(&mut self, axis: &str) -> Result<(), Failure> {
        let at = self.drive_index(axis)?;
        let limit = Duration::from_secs(5);
        self.control(at, DriveCommand::ResetFault, "fault reset", limit)
    }

    /// Moves the point of `axis` to `target` (machine coordinates), compensated when a
    /// calibration is in use, and returns the set-point the drive was sent.
    ///
    /// # Errors
    /// Before anything moves: not zeroed, outside the soft limits, outside the calibrated
    /// range. While moving: whatever stops the machine.
    pub fn move_to(&mut self, axis: &str, target: Metres) -> Result<Metres, Failure> {
        self.require_zeroed(axis)?;
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
        let tracker = &self
            .memory
            .get(axis)
            .expect("every axis has its memory")
            .approach;
        let here = self.reading(axis)?.map(|reading| reading.position);
        set_point_of(compensation, tracker, here, target).map_err(|source| {
            Failure::OutOfCalibration {
                axis: axis.to_owned(),
                source,
            }
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
        let result = self.command(axis, command, "move", limit);
        let approach = &mut self.remember(axis).approach;
        if result.is_ok() {
            approach.update(target);
        } else {
            // Where it stopped, and from where it came there, nobody knows.
            approach.forget();
        }
        result
    }
}

/// The set-point for `target` from the side from which the drive will really come.
///
/// Which side that is depends on the set-point itself: over less than the deviation, target and
/// set-point may lie on different sides of where the axis is. With no motion remembered (after
/// a zero), `here` says where it starts.
fn set_point_of(
    compensation: &Compensation,
    tracker: &ApproachTracker,
    here: Option<Metres>,
    target: Metres,
) -> Result<Metres, OutOfRange> {
    let mut from = *tracker;
    if from == ApproachTracker::new()
        && let Some(here) = here
    {
        from.update(here);
    }
    let usual = from.approach().unwrap_or(Approach::Forward);
    let other = match usual {
        Approach::Forward => Approach::Reverse,
        Approach::Reverse => Approach::Forward,
    };
    for approach in [usual, other] {
        if let Ok(set_point) = compensation.set_point(target, approach)
            && from.approach_of(set_point) == Some(approach)
        {
            return Ok(set_point);
        }
    }
    // Within the lost motion of where it is, no side is right: the one asked for is the best.
    compensation.set_point(target, from.approach_of(target).unwrap_or(usual))
}

#[cfg(test)]
mod tests {
    use super::*;
    use compensator::error_table::{EndPolicy, ErrorTable, Interpolation, Limits, Node};

    /// Forward 2 µm too far, reverse 5 µm.
    fn compensation() -> Compensation {
        let node = |mm: f64| Node {
            position: Metres::from_mm(mm),
            forward: Some(Metres::from_um(2.0)),
            reverse: Some(Metres::from_um(5.0)),
            u_forward: None,
            u_reverse: None,
        };
        let limits = Limits {
            size: Metres::from_um(50.0),
            slope: 0.01,
            rate: MetresPerSecond(1.0),
        };
        let table = ErrorTable::new(vec![node(-10.0), node(10.0)]).unwrap();
        Compensation::new(table, Interpolation::Linear, limits, EndPolicy::Hold).unwrap()
    }

    #[track_caller]
    fn check(moves_um: &[f64], here_um: Option<f64>, target_um: f64, expected_um: f64) {
        let mut tracker = ApproachTracker::new();
        for um in moves_um {
            tracker.update(Metres::from_um(*um));
        }
        let here = here_um.map(Metres::from_um);
        let target = Metres::from_um(target_um);
        let seen = set_point_of(&compensation(), &tracker, here, target).unwrap();
        assert!((seen.um() - expected_um).abs() < 1e-6, "{}", seen.um());
    }

    #[test]
    fn the_first_move_after_a_zero_is_corrected_for_the_side_it_really_comes_from() {
        check(&[], Some(0.0), -2000.0, -2005.0);
        check(&[], Some(0.0), 2000.0, 1998.0);
        check(&[], None, -2000.0, -2002.0);
    }

    #[test]
    fn a_remembered_direction_says_more_than_the_encoder() {
        check(&[0.0, 1000.0], Some(0.0), 500.0, 495.0);
        check(&[0.0, 1000.0], Some(0.0), 1500.0, 1498.0);
    }

    /// The set-point of 1000 µm was 998 µm: 999 µm lies beyond that, its set-point before it.
    #[test]
    fn a_step_smaller_than_the_deviation_is_corrected_for_the_drives_own_direction() {
        check(&[0.0, 998.0], Some(998.0), 999.0, 994.0);
        check(&[0.0, 998.0], Some(998.0), 1001.0, 999.0);
    }
}
