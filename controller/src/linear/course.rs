//! What leads a linear axis to its targets: limits before anything moves, compensation, and the direction
//! of approach.

use compensator::apply::ApproachTracker;
use compensator::budget::{AxisBudget, Combined};
use compensator::error_table::uncertainty;
use compensator::error_table::{Compensation, EndPolicy, OutOfRange};
use units::{Approach, Metres, MetresPerSecond};

use crate::agreed::Agreed;
use crate::correction::Correction;
use crate::failure::Failure;

/// What corrects the moves of a linear axis, apart from the machine, for whoever begins moves without
/// waiting for them ([`machine::Moving`]). It is what was in use when
/// [`LinearStage::course`](crate::linear::LinearStage::course) gave it.
#[derive(Clone, Default)]
pub struct Course {
    /// The calibration in use.
    pub(crate) compensation: Option<Compensation>,
    /// How uncertain the calibration in use is, where it says so.
    pub(crate) budget: Option<AxisBudget>,
    /// Over which distance its positions were approached, where that was always the same.
    pub(crate) approach: Option<Metres>,
    /// Over which distance moves arrive, where the configuration says one.
    pub(crate) arrives_over: Option<Metres>,
    /// Over which distance they arrive from a side that is asked for, where the configuration says none: what calibrations
    /// begin beyond their first position.
    pub(crate) overrun: Option<Metres>,
    /// Standard uncertainty of the zero that was found last.
    pub(crate) zero: Option<Metres>,
}

/// What corrected a move.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Corrected {
    /// Nothing: no calibration is in use.
    No,
    /// The calibration, between its first and last position.
    Within,
    /// Beyond the calibrated range, from `first` to `last`: the deviation at its end is used, which
    /// was not measured there.
    Held {
        /// First calibrated position.
        first: Metres,
        /// Last calibrated position.
        last: Metres,
    },
    /// Beyond the calibrated range: the deviation of its end, fading to nothing over `distance`.
    Fading {
        /// First calibrated position.
        first: Metres,
        /// Last calibrated position.
        last: Metres,
        /// Where nothing is left of it, from the end on.
        distance: Metres,
    },
}

impl Corrected {
    /// Whether `axis` may go to `target` so.
    ///
    /// # Errors
    /// Nothing corrects it, or not as far as that, and nobody has agreed to it.
    pub fn require(self, axis: &str, target: Metres, agreed: Agreed) -> Result<(), Failure> {
        match self {
            Self::No if !agreed.uncompensated => Err(Failure::not_calibrated(axis)),
            Self::Held { first, last } | Self::Fading { first, last, .. } if !agreed.beyond => {
                let axis = axis.to_owned();
                Err(Failure::BeyondCalibrated {
                    axis,
                    target,
                    first,
                    last,
                })
            }
            Self::No | Self::Within | Self::Held { .. } | Self::Fading { .. } => Ok(()),
        }
    }

    /// For programs: `no`, `yes`, `held` or `fading`.
    pub const fn word(self) -> &'static str {
        match self {
            Self::No => "no",
            Self::Within => "yes",
            Self::Held { .. } => "held",
            Self::Fading { .. } => "fading",
        }
    }
}

/// Places that differ by less are one.
pub(super) const ROUNDING: Metres = Metres(1e-9);

/// A move that may be begun.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlannedMove {
    /// Where the drive is to be sent first, so that its last approach has the length of the configuration.
    pub by_way_of: Option<Metres>,
    /// Where the drive is to be sent.
    pub set_point: Metres,
    /// How fast.
    pub speed: MetresPerSecond,
    /// What corrects it.
    pub corrected: Corrected,
}

impl Course {
    /// The move of `axis` to `target` from where it is now, at its usual speed or, where that is slower, so
    /// fast that the correction changes no faster than its limit. It ends with an approach over `approach_mm` of
    /// the configuration, where that says one, unless the axis was sent just there before.
    ///
    /// # Errors
    /// Not zeroed, outside the soft limits, outside the calibrated range.
    pub fn plan(
        &self,
        machine: &machine::Machine,
        axis: &str,
        target: Metres,
    ) -> Result<PlannedMove, Failure> {
        machine.require_zeroed(axis)?;
        let Some(length) = self.arrives_over else {
            return self.plan_anywhere(machine, axis, target, Correction::On);
        };
        let mut planned = self.plan_arrival(machine, axis, (target, length), Correction::On)?;
        if was_sent_to(&machine.approach(axis)?, planned.set_point) {
            planned.by_way_of = None;
        }
        Ok(planned)
    }

    /// The move of `axis` to `target` that ends with an approach from the side that `approach` begins at, unless that is how it
    /// came there last: lost motion is then taken up as whoever asks wants it. Over `approach_mm` of the configuration or,
    /// where that says none, over the overrun of its calibrations.
    ///
    /// # Errors
    /// As [`Self::plan`]; outside the soft limits where the approach begins; no length of an approach is configured.
    pub fn plan_from(
        &self,
        machine: &machine::Machine,
        axis: &str,
        target: Metres,
        approach: Approach,
    ) -> Result<PlannedMove, Failure> {
        machine.require_zeroed(axis)?;
        let is_free = |place| Ok(machine.check_soft_limits(axis, place)?);
        is_free(target)?;
        let length = self.arrives_over.or(self.overrun);
        let length = length.ok_or_else(|| no_length(axis))?;
        let (from, set_point) =
            self.arrival_from((axis, approach), (target, length), Correction::On, &is_free)?;
        let tracker = machine.approach(axis)?;
        let window = machine.axis_settings(axis)?.position_window;
        let reading = machine.reading(axis)?;
        let is_there = reading.is_some_and(|it| (it.position - set_point).abs() <= window * 2.0);
        let came_so =
            tracker.approach() == Some(approach) && was_sent_to(&tracker, set_point) && is_there;
        let begins_there = was_sent_to(&tracker, from);
        Ok(PlannedMove {
            by_way_of: (!came_so && !begins_there).then_some(from),
            set_point,
            speed: self.speed(machine, axis, Correction::On)?,
            corrected: self.corrected_by(Correction::On, target),
        })
    }

    /// What leads the axis by its encoder alone.
    #[must_use]
    pub fn uncompensated(&self) -> Self {
        Self {
            overrun: self.arrives_over.or(self.overrun),
            zero: self.zero,
            ..Self::default()
        }
    }

    /// The same without asking for a zero.
    pub(crate) fn plan_anywhere(
        &self,
        machine: &machine::Machine,
        axis: &str,
        target: Metres,
        correction: Correction,
    ) -> Result<PlannedMove, Failure> {
        machine.check_soft_limits(axis, target)?;
        let set_point = self.set_point(machine, axis, target, correction)?;
        machine.check_soft_limits(axis, set_point)?;
        Ok(PlannedMove {
            by_way_of: None,
            set_point,
            speed: self.speed(machine, axis, correction)?,
            corrected: self.corrected_by(correction, target),
        })
    }

    /// The move to `target` that ends with an approach over `length`: from the side that the axis comes from,
    /// or, where the soft limits leave no room for that, from the other one.
    pub(crate) fn plan_arrival(
        &self,
        machine: &machine::Machine,
        axis: &str,
        (target, length): (Metres, Metres),
        correction: Correction,
    ) -> Result<PlannedMove, Failure> {
        let speed = self.speed(machine, axis, correction)?;
        let here = machine.reading(axis)?.map(|reading| reading.position);
        let tracker = machine.approach(axis)?;
        let start = started(&tracker, here);
        let is_free = |place| Ok(machine.check_soft_limits(axis, place)?);
        let (from, set_point) =
            self.arrival((axis, &start), (target, length), correction, &is_free)?;
        Ok(PlannedMove {
            by_way_of: (!was_sent_to(&tracker, from)).then_some(from),
            set_point,
            speed,
            corrected: self.corrected_by(correction, target),
        })
    }

    /// Where an approach over `length` to `target` begins, and where it ends, for an axis that was brought where it
    /// is as `start` says; `is_free` refuses places that the axis must not go to.
    pub(crate) fn arrival(
        &self,
        (axis, start): (&str, &ApproachTracker),
        (target, length): (Metres, Metres),
        correction: Correction,
        is_free: &dyn Fn(Metres) -> Result<(), Failure>,
    ) -> Result<(Metres, Metres), Failure> {
        is_free(target)?;
        let of_side = |side| self.arrival_from((axis, side), (target, length), correction, is_free);
        let usual = start.approach_of(target).unwrap_or(Approach::Forward);
        of_side(usual).or_else(|_: Failure| of_side(usual.opposite()))
    }

    /// The same from one side.
    fn arrival_from(
        &self,
        (axis, side): (&str, Approach),
        (target, length): (Metres, Metres),
        correction: Correction,
        is_free: &dyn Fn(Metres) -> Result<(), Failure>,
    ) -> Result<(Metres, Metres), Failure> {
        let set_point = self.set_point_from(axis, target, side, correction)?;
        let from = set_point - length * side.sign();
        is_free(set_point).and_then(|()| is_free(from))?;
        Ok((from, set_point))
    }

    /// So fast that the correction changes no faster than its limit.
    fn speed(
        &self,
        machine: &machine::Machine,
        axis: &str,
        correction: Correction,
    ) -> Result<MetresPerSecond, Failure> {
        let own_speed = machine.axis_settings(axis)?.speed;
        Ok(match (correction, &self.compensation) {
            (Correction::On, Some(table)) => own_speed.min(table.speed_max()),
            _ => own_speed,
        })
    }

    fn set_point_from(
        &self,
        axis: &str,
        target: Metres,
        side: Approach,
        correction: Correction,
    ) -> Result<Metres, Failure> {
        let (Correction::On, Some(compensation)) = (correction, &self.compensation) else {
            return Ok(target);
        };
        let set_point = compensation.set_point(target, side);
        set_point.map_err(|source| out_of_calibration(axis, source))
    }

    /// The set-point that brings the point to `target` from where the axis is now.
    fn set_point(
        &self,
        machine: &machine::Machine,
        axis: &str,
        target: Metres,
        correction: Correction,
    ) -> Result<Metres, Failure> {
        let (Correction::On, Some(compensation)) = (correction, &self.compensation) else {
            return Ok(target);
        };
        let tracker = machine.approach(axis)?;
        let here = machine.reading(axis)?.map(|reading| reading.position);
        let set_point = set_point_of(compensation, &tracker, here, target);
        set_point.map_err(|source| out_of_calibration(axis, source))
    }

    /// Where the point stands when the drive's encoder says `encoder`; `None` without a calibration.
    pub fn place(&self, encoder: Metres, approach: Approach) -> Option<Metres> {
        let table = self.compensation.as_ref()?;
        Some(encoder + table.deviation(encoder, approach).ok()?)
    }

    /// Standard uncertainty of the zero that the axis has, where one is known.
    pub const fn zero_uncertainty(&self) -> Option<Metres> {
        self.zero
    }

    /// How uncertain it is where the point stands after a corrected stop at `position`; `None` where
    /// the calibration in use says nothing of it: beyond its range, or when it has no budget.
    ///
    /// That is the calibration's budget, with the zero that the axis has now, the scatter of one stop and, unless the
    /// axis `has_arrived` by all of a move that [`Self::plan`] gave, what lost motion may do.
    pub fn uncertainty_at(
        &self,
        position: Metres,
        approach: Approach,
        has_arrived: bool,
    ) -> Option<Combined> {
        let length = self.arrives_over.filter(|_| has_arrived);
        self.uncertainty_after(length, position, approach)
    }

    /// The same after an approach over `length`: where the positions were approached so, lost motion does what
    /// it did then.
    pub(crate) fn uncertainty_after(
        &self,
        length: Option<Metres>,
        position: Metres,
        approach: Approach,
    ) -> Option<Combined> {
        let calibrated = self.budget.as_ref()?;
        let zero = self.zero.map(|it| (it, None));
        let unlike = match length.is_some() && length == self.approach {
            true => None,
            false => Some(self.lost_motion_at(position)?),
        };
        let of_stops = uncertainty::budget_of_stops(calibrated, zero, unlike).ok()?;
        of_stops.at(position, approach)
    }

    /// How far both approaches are apart; `None` where only one of them was measured.
    fn lost_motion_at(&self, position: Metres) -> Option<Metres> {
        let compensation = self.compensation.as_ref()?;
        let at = |approach| {
            let is_known = compensation.table().knows(approach);
            let deviation = compensation.deviation(position, approach).ok();
            deviation.filter(|_| is_known)
        };
        Some((at(Approach::Reverse)? - at(Approach::Forward)?).abs())
    }

    fn corrected_by(&self, correction: Correction, target: Metres) -> Corrected {
        match correction {
            Correction::On => self.corrected(target),
            Correction::Off => Corrected::No,
        }
    }

    /// What corrects a move to `target`.
    pub(crate) fn corrected(&self, target: Metres) -> Corrected {
        let table = self.compensation.as_ref();
        table.map_or(Corrected::No, |table| corrected_at(table, target))
    }
}

fn out_of_calibration(axis: &str, source: OutOfRange) -> Failure {
    let axis = axis.to_owned();
    Failure::OutOfCalibration { axis, source }
}

fn corrected_at(table: &Compensation, target: Metres) -> Corrected {
    let (first, last) = table.table().range();
    if target >= first && target <= last {
        return Corrected::Within;
    }
    match table.end_policy() {
        // Never driven: the move itself is refused.
        EndPolicy::Refuse => Corrected::Within,
        EndPolicy::Hold => Corrected::Held { first, last },
        EndPolicy::FadeOut(distance) => Corrected::Fading {
            first,
            last,
            distance,
        },
    }
}

fn no_length(axis: &str) -> Failure {
    Failure::Usage {
        what: format!(
            "axis {axis}: nothing says over which length it approaches a place; nothing was moved"
        ),
        help: format!(
            "give approach_mm in [axis.{axis}.compensation], or overrun_mm of its calibrations, or leave the approach out"
        ),
    }
}

/// Whether that was the set-point of the last motion.
fn was_sent_to(tracker: &ApproachTracker, place: Metres) -> bool {
    let last = tracker.last();
    last.is_some_and(|it| (it - place).abs() <= ROUNDING)
}

/// `tracker`, which with no motion remembered (after a zero) starts `here`.
pub(super) fn started(tracker: &ApproachTracker, here: Option<Metres>) -> ApproachTracker {
    let mut from = *tracker;
    if from == ApproachTracker::new()
        && let Some(here) = here
    {
        from.update(here);
    }
    from
}

/// The set-point for `target` from the side from which the drive will really come.
///
/// Which side that is depends on the set-point itself: over less than the deviation, target and
/// set-point may lie on different sides of where the axis is. With no motion remembered (after
/// a zero), `here` says where it starts.
pub(super) fn set_point_of(
    compensation: &Compensation,
    tracker: &ApproachTracker,
    here: Option<Metres>,
    target: Metres,
) -> Result<Metres, OutOfRange> {
    let from = started(tracker, here);
    let usual = from.approach().unwrap_or(Approach::Forward);
    for approach in [usual, usual.opposite()] {
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
