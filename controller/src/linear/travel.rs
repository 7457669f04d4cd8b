//! Moves: limits before anything moves, compensation, and the direction of approach.

use compensator::apply::ApproachTracker;
use compensator::error_table::{Compensation, OutOfRange};
use units::{Approach, Metres};

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

    /// The set-point that brings the point to `target` from where the axis is now.
    pub(crate) fn set_point(
        &self,
        target: Metres,
        correction: Correction,
    ) -> Result<Metres, Failure> {
        let compensation = self.compensation();
        let (Correction::On, Some(compensation)) = (correction, compensation) else {
            return Ok(target);
        };
        let tracker = self.core.approach(self.axis)?;
        let here = self
            .core
            .reading(self.axis)?
            .map(|reading| reading.position);
        set_point_of(compensation, &tracker, here, target).map_err(|source| {
            Failure::OutOfCalibration {
                axis: self.axis.to_owned(),
                source,
            }
        })
    }

    /// Moves without asking for a zero: procedures that make the zero use it too.
    pub(crate) fn travel(
        &mut self,
        target: Metres,
        correction: Correction,
    ) -> Result<Metres, Failure> {
        self.core.check_soft_limits(self.axis, target)?;
        let set_point = self.set_point(target, correction)?;
        self.core.check_soft_limits(self.axis, set_point)?;
        let own_speed = self.core.axis_settings(self.axis)?.speed;
        let speed = match (correction, self.compensation()) {
            // So fast that the correction changes no faster than its limit.
            (Correction::On, Some(table)) => own_speed.min(table.speed_max()),
            _ => own_speed,
        };
        self.core.profile_move(self.axis, set_point, speed)?;
        Ok(set_point)
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
    use units::MetresPerSecond;

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
