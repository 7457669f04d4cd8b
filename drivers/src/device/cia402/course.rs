//! Whether the axis goes where its drive wants it to.
//!
//! The demand is the position and the following error (0x60F4 = demand − actual). When both have
//! left the place where the motion began, in opposite directions, then the motor phases are
//! swapped, or the encoder or the polarity is reversed: the further the axis goes, the harder the
//! drive pushes it on.

use units::{Coordinate, Counts};

use super::{Activity, Cia402Drive};
use crate::device::Alarm;

/// Where a motion began.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Course {
    demand: Counts,
    actual: Counts,
}

impl<Q: Coordinate> Cia402Drive<Q> {
    /// After each sample that was believed; `lagging`: the drive says that it cannot follow.
    pub(super) fn watch_course(&mut self, lagging: bool) {
        let target = match &self.activity {
            Activity::Move(moving) => Some(moving.target()),
            Activity::Homing(_) => None,
            Activity::Idle
            | Activity::Starting
            | Activity::Power(_)
            | Activity::Halt(_)
            | Activity::Latch(_)
            | Activity::Mode(_)
            | Activity::Release
            | Activity::Reference { .. } => {
                self.course = None;
                return;
            }
        };
        let (Some(sample), Some(behind)) = (self.image.sample(), self.image.following_error())
        else {
            return;
        };
        let actual = sample.position;
        let demand = actual + behind;
        let begun = *self.course.get_or_insert(Course { demand, actual });
        let moved = actual - begun.actual;
        // The following error comes a frame later: a drive that lags knows better already.
        let wanted = match target.filter(|_| lagging) {
            Some(target) => target - begun.demand,
            None => demand - begun.demand,
        };
        let margin = self.image.plausible.margin();
        let apart = wanted.0.signum() == -moved.0.signum();
        if apart && wanted.0.abs() > margin && moved.0.abs() > margin {
            self.course = None;
            let shown = |counts| self.settings.scale.to_coordinate(counts).into();
            let (wanted, moved) = (shown(wanted), shown(moved));
            let node = self.node.id();
            self.alarm(Alarm::WrongDirection {
                node,
                wanted,
                moved,
            });
        }
    }
}
