//! The amplifier's own supervision, and the state that it reports.

use units::Time;
use wire::copley::{EventStatus, Faults, Parameter, TrajectoryStatus};

use super::amp::{Amp, Stage, milliseconds};
use crate::plant::Plant;

/// These cannot be cleared (p. 48).
const FATAL: Faults = Faults::FLASH_DAMAGED
    .union(Faults::INTERNAL)
    .union(Faults::LOGIC_FAILED);

impl Amp {
    /// What is wrong from now on; every fault latches and takes the power off.
    pub(super) fn set_causes(&mut self, causes: Faults) {
        self.causes = causes;
        self.look_now();
    }

    pub(super) fn clear_faults(&mut self, mask: Faults) {
        if !self.config.quirks.faults_stay {
            let cleared = mask - FATAL - self.causes;
            self.latched.remove(cleared);
        }
    }

    pub(super) fn watch(&mut self, now: Time, plant: &mut Plant) {
        self.torque_off = plant.safe_torque_off(self.config.axis);
        if self.torque_off && self.stage != Stage::Off {
            self.fail(Faults::SAFE_TORQUE_OFF, plant);
        }
        if !self.causes.is_empty() {
            let causes = self.causes;
            self.fail(causes, plant);
        }
        let error = self.commanded(now, plant) - self.position(plant);
        let limit = self.ram(Parameter::FOLLOWING_ERROR_LIMIT);
        self.tracking_error = self.controls() && error.abs() > limit;
        if self.tracking_error {
            self.fail(Faults::FOLLOWING_ERROR, plant);
            // The bit stays as long as the fault does.
            self.tracking_error = true;
        } else {
            self.tracking_error = self.latched.contains(Faults::FOLLOWING_ERROR);
        }
    }

    fn fail(&mut self, faults: Faults, plant: &mut Plant) {
        self.latched.insert(faults);
        if self.stage != Stage::Off {
            let moved = self.trajectory.contains(TrajectoryStatus::RUNNING);
            self.switch_off(plant);
            if moved {
                self.trajectory.insert(TrajectoryStatus::ABORTED);
            }
        }
    }

    /// Behind a move, until the axis has been in the tracking window for its time.
    pub(super) fn watch_settling(&mut self, now: Time, plant: &Plant) {
        if !self.settling || self.trajectory.contains(TrajectoryStatus::RUNNING) {
            return;
        }
        let error = self.commanded(now, plant) - self.position(plant);
        if error.abs() > self.ram(Parameter::TRACKING_WINDOW) {
            self.settled_since = None;
            return;
        }
        let since = *self.settled_since.get_or_insert(now);
        let time = milliseconds(self.ram(Parameter::TRACKING_WINDOW_TIME) as f64);
        if now >= since + time && !self.config.quirks.never_settles {
            self.settling = false;
        }
    }

    /// Negative and positive, in force once homed.
    pub(super) fn soft_limits_hit(&self, now: Time, plant: &Plant) -> (bool, bool) {
        let negative = self.ram(Parameter::SOFT_LIMIT_NEGATIVE);
        let positive = self.ram(Parameter::SOFT_LIMIT_POSITIVE);
        let in_force =
            self.trajectory.contains(TrajectoryStatus::REFERENCED) && positive >= negative;
        let position = self.commanded(now, plant);
        (
            in_force && position < negative,
            in_force && position > positive,
        )
    }

    pub(super) fn event_status(&self, now: Time, plant: &Plant) -> EventStatus {
        let (negative_switch, positive_switch) = plant.limit_switches(self.config.axis);
        let (negative_limit, positive_limit) = self.soft_limits_hit(now, plant);
        let error = (self.commanded(now, plant) - self.position(plant)).abs();
        let window = self.ram(Parameter::TRACKING_WINDOW);
        let running = self.trajectory.contains(TrajectoryStatus::RUNNING);
        let disabled = self.ram(Parameter::DESIRED_STATE) == 0;
        let causes = self.causes;
        let bits = [
            (
                EventStatus::SHORT_CIRCUIT,
                causes.contains(Faults::SHORT_CIRCUIT),
            ),
            (
                EventStatus::AMPLIFIER_HOT,
                causes.contains(Faults::AMPLIFIER_HOT),
            ),
            (
                EventStatus::OVER_VOLTAGE,
                causes.contains(Faults::OVER_VOLTAGE),
            ),
            (
                EventStatus::UNDER_VOLTAGE,
                causes.contains(Faults::UNDER_VOLTAGE),
            ),
            (EventStatus::MOTOR_HOT, causes.contains(Faults::MOTOR_HOT)),
            (
                EventStatus::FEEDBACK_ERROR,
                causes.contains(Faults::FEEDBACK),
            ),
            (EventStatus::PHASING_ERROR, causes.contains(Faults::PHASING)),
            (EventStatus::POSITIVE_LIMIT_SWITCH, positive_switch),
            (EventStatus::NEGATIVE_LIMIT_SWITCH, negative_switch),
            (EventStatus::NOT_ENABLED_BY_INPUT, self.torque_off),
            (EventStatus::DISABLED_BY_SOFTWARE, disabled),
            (EventStatus::STOPPING, self.stage == Stage::Stopping),
            (EventStatus::OUTPUTS_OFF, !self.controls()),
            (EventStatus::POSITIVE_SOFT_LIMIT, positive_limit),
            (EventStatus::NEGATIVE_SOFT_LIMIT, negative_limit),
            (EventStatus::TRACKING_ERROR, self.tracking_error),
            (EventStatus::FAULT, !self.latched.is_empty()),
            (
                EventStatus::OUTSIDE_WINDOW,
                self.controls() && error > window,
            ),
            (EventStatus::IN_MOTION, running || self.settling),
        ];
        bits.into_iter()
            .filter_map(|(bit, on)| on.then_some(bit))
            .fold(EventStatus::empty(), |status, bit| status | bit)
    }
}
