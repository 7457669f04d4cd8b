//! Enable, disable, quick stop and fault reset of a drive.

use units::{Coordinate, Time};
use wire::cia402::{Controlword, PowerState};

use super::start::CONTROLWORD;
use super::{Activity, Cia402Drive};
use crate::device::{DeviceError, Seen};
use crate::protocol::power_state::{Goal, PowerFailure, PowerSequence, PowerStep};
use crate::protocol::script::Step;

/// A change of the power state under way.
#[derive(Debug)]
pub(super) struct Power {
    sequence: PowerSequence,
    since: Time,
}

impl Power {
    pub(super) fn poll_timeout(&self) -> Time {
        self.sequence.poll_timeout()
    }
}

const fn step_name(goal: Goal) -> &'static str {
    match goal {
        Goal::OperationEnabled => "enabling",
        Goal::SwitchOnDisabled => "disabling",
        Goal::QuickStop => "the quick stop",
        Goal::FaultReset => "the fault reset",
    }
}

const fn stops(goal: Goal) -> bool {
    match goal {
        Goal::SwitchOnDisabled | Goal::QuickStop => true,
        Goal::OperationEnabled | Goal::FaultReset => false,
    }
}

impl<Q: Coordinate> Cia402Drive<Q> {
    pub(super) fn begin_enable(&mut self, now: Time) {
        let follows = self.is_cyclic() && self.state() == Some(PowerState::OperationEnabled);
        if let Some(sample) = self.image.sample().filter(|_| !follows) {
            // The target in RPDO 1 counts only at an edge, but a true one is the better company.
            self.target = sample.shown;
        }
        self.begin_power(now, Goal::OperationEnabled);
    }

    pub(super) fn begin_disable(&mut self, now: Time) {
        self.begin_power(now, Goal::SwitchOnDisabled);
    }

    pub(super) fn begin_reset(&mut self, now: Time) {
        self.begin_power(now, Goal::FaultReset);
    }

    /// Goes out at once, whatever runs and whatever state the drive is in.
    pub(super) fn begin_quick_stop(&mut self, now: Time) {
        self.image.plausible.watch_rest();
        self.begin_power(now, Goal::QuickStop);
        if !self.node.is_in_service() {
            // A node that left operational hears no RPDO, but perhaps SDO.
            let stop = Controlword::QUICK_STOP_COMMAND.bits();
            let step = Step::write(CONTROLWORD.object, stop, "stopping by SDO");
            self.node.run(now, vec![step]);
        }
    }

    fn begin_power(&mut self, now: Time, goal: Goal) {
        self.kept = None;
        self.reached = None;
        let sequence = PowerSequence::new(now, goal, self.settings.timeouts.transition);
        let first = sequence.first();
        self.activity = Activity::Power(Power {
            sequence,
            since: now,
        });
        // Everything else waits for the next statusword: the last one may be out of date.
        if let Some(control) = first {
            self.send_control(now, control);
        }
    }

    pub(super) fn advance_power(&mut self, now: Time) {
        let standing = self.image.plausible.stands();
        self.keep_target_at_axis();
        let (Activity::Power(power), Some(sample)) = (&mut self.activity, self.image.sample())
        else {
            return;
        };
        let goal = power.sequence.goal();
        let since = power.since;
        // Stopped is what the drive says after it has had the command, not what it said before.
        let fresh = sample.at.since(since) >= self.settings.common.sync_period * 2;
        match power.sequence.next(now, sample.status, standing) {
            PowerStep::Command(control) if control == self.control => {
                if self.repeat_at == Time::NEVER {
                    self.send_control(now, control);
                }
            }
            PowerStep::Command(control) => self.send_control(now, control),
            PowerStep::Done(_) if !fresh && stops(goal) => {
                if now >= power.poll_timeout() {
                    let seen = Seen::Power(sample.status.state());
                    self.time_out(now, since, "a statusword after the command", seen);
                }
            }
            PowerStep::Done(control) => {
                if control != self.control {
                    self.send_control(now, control);
                }
                self.kept =
                    (goal == Goal::OperationEnabled).then_some(PowerState::OperationEnabled);
                self.finish(Ok(()));
            }
            PowerStep::Failed(failure) => self.power_failed(now, goal, since, failure),
        }
    }

    fn power_failed(&mut self, now: Time, goal: Goal, since: Time, failure: PowerFailure) {
        let step = step_name(goal);
        if goal == Goal::FaultReset {
            // Bit 7 goes back, so that the next reset has an edge.
            self.send_control(now, Controlword::empty());
        }
        match failure {
            PowerFailure::Faulted { state } | PowerFailure::Wanders { state } => {
                let node = self.node.id();
                self.finish(Err(DeviceError::DriveRefused { node, step, state }));
            }
            PowerFailure::TimedOut { from, awaited, .. } => {
                self.time_out(now, since, awaited, Seen::Power(from));
            }
        }
    }

    pub(super) fn power_timeout(&mut self, now: Time) {
        let Activity::Power(power) = &self.activity else {
            return;
        };
        if now < power.poll_timeout() {
            return;
        }
        if self.image.sample().is_some() {
            self.advance_power(now);
        } else {
            let since = power.since;
            self.time_out(now, since, "a statusword", Seen::Nothing);
        }
    }
}
