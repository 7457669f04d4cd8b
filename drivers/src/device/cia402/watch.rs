//! Watch on what the axis does, by the request in force: place, speed, mode, power.

use units::{Coordinate, Counts, Time};
use wire::cia402::{OperationMode, PowerState};

use super::image::Sample;
use super::{Activity, Cia402Drive};
use crate::device::Alarm;
use crate::device::departure::{Asked, Departure};

/// A mode may be shown late once.
const OTHER_MODE_MAX: u8 = 2;

impl<Q: Coordinate> Cia402Drive<Q> {
    /// Judges a sample; outside of what was asked the drive is stopped at once.
    pub(super) fn watch_motion(&mut self, now: Time, sample: &Sample) {
        if self.is_switching() {
            return;
        }
        let enabled = sample.state() == PowerState::OperationEnabled;
        let alarm = match (self.kept, enabled) {
            (Some(PowerState::OperationEnabled), true) => self.judge_motion(sample),
            (None, true) => self.judge_power(),
            (Some(_) | None, _) => {
                self.told_unasked = false;
                None
            }
        };
        if let Some(alarm) = alarm {
            self.alarm(alarm);
            self.stop_by_itself(now);
        }
    }

    /// Whether the power state is on its way to another one, or not known yet.
    const fn is_switching(&self) -> bool {
        matches!(self.activity, Activity::Power(_) | Activity::Starting)
    }

    fn judge_power(&mut self) -> Option<Alarm> {
        let is_new = !core::mem::replace(&mut self.told_unasked, true);
        is_new.then(|| Alarm::EnabledUnasked {
            device: self.node.name(),
        })
    }

    fn judge_motion(&mut self, sample: &Sample) -> Option<Alarm> {
        if let Some(expected) = self.mode_in_force() {
            self.other_mode = match sample.mode == expected {
                true => 0,
                false => self.other_mode.saturating_add(1),
            };
            if self.other_mode >= OTHER_MODE_MAX {
                self.other_mode = 0;
                return Some(Alarm::WrongMode {
                    node: self.node.id(),
                    expected: expected.raw(),
                    seen: sample.mode.raw(),
                });
            }
        }
        let here = self.image.here().filter(|here| here.at == sample.at)?;
        let departure = self.envelope.judge(here.at, here.position);
        if self.image.plausible.stands() && departure.is_none() {
            let is_idle = matches!(self.activity, Activity::Idle);
            self.envelope.stand(here.position, is_idle);
        }
        departure.map(|departure| self.shown(departure))
    }

    /// A departure, in the units of the axis.
    pub(super) fn shown(&self, departure: Departure) -> Alarm {
        departure.to_alarm(self.node.name(), self.settings.scale, Counts(0))
    }

    /// The mode that the drive must show; `None` while that may change.
    fn mode_in_force(&self) -> Option<OperationMode> {
        match &self.activity {
            Activity::Idle
            | Activity::Latch(_)
            | Activity::Release
            | Activity::Reference { .. } => self.commanded_mode,
            Activity::Move(moving) if moving.has_announced() => self.commanded_mode,
            Activity::Move(_)
            | Activity::Starting
            | Activity::Power(_)
            | Activity::Halt(_)
            | Activity::Homing(_)
            | Activity::Mode(_) => None,
        }
    }

    /// The request whose motion is under way, for an operator.
    pub(super) const fn asked(&self) -> Asked {
        match &self.activity {
            Activity::Move(_) => Asked::Motion,
            Activity::Homing(_) => Asked::Homing,
            Activity::Halt(_) | Activity::Power(_) => Asked::Stop,
            Activity::Idle
            | Activity::Starting
            | Activity::Latch(_)
            | Activity::Mode(_)
            | Activity::Release
            | Activity::Reference { .. } => Asked::Hold,
        }
    }

    /// From now on set-points are followed; the first is the target in RPDO 1.
    pub(super) fn watch_set_points(&mut self) {
        let target = self.image.counting_on(self.target).0;
        if let Some(here) = self.image.here() {
            self.envelope.begin_following(here.at, target);
        }
    }
}
