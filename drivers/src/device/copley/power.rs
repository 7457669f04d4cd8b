//! Enable, disable, quick stop and fault reset.

use units::{Coordinate, Time};
use wire::cia402::PowerState;
use wire::copley::{DesiredState, EventStatus, Faults, Parameter};

use super::script::{Step, read};
use super::{Activity, CopleyAxis};
use crate::device::{DeviceError, Urgency};

/// Any of these, and the motor is not under control.
const OFF: EventStatus = EventStatus::NOT_ENABLED_BY_INPUT
    .union(EventStatus::DISABLED_BY_SOFTWARE)
    .union(EventStatus::STOPPING)
    .union(EventStatus::OUTPUTS_OFF)
    .union(EventStatus::NOT_PHASED);

const ENABLING: &str = "enabling";
const DISABLING: &str = "disabling";
const RESETTING: &str = "the fault reset";

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    /// Asked which faults have latched.
    Checking,
    /// Told to enable.
    Enabling,
    AwaitingOn,
    /// Told to abort the move.
    Stopping,
    AwaitingRest,
    /// Told to disable.
    Disabling,
    AwaitingOff,
    /// Asked which faults there are to be cleared.
    Listing,
    /// Told to clear them, and asked again.
    Clearing,
}

/// A change of the power state under way.
#[derive(Clone, Copy, Debug)]
pub(super) struct Power {
    phase: Phase,
    since: Time,
    deadline: Time,
}

impl Power {
    pub(super) const fn deadline(&self) -> Time {
        self.deadline
    }
}

impl<Q: Coordinate> CopleyAxis<Q> {
    pub(super) fn is_enabled(&self) -> bool {
        !self.image.events.intersects(OFF | EventStatus::FAULT)
    }

    pub(super) fn state(&self) -> PowerState {
        let events = self.image.events;
        if events.contains(EventStatus::FAULT) {
            PowerState::Fault
        } else if events.contains(EventStatus::STOPPING) {
            PowerState::QuickStopActive
        } else if events.intersects(OFF) {
            PowerState::SwitchOnDisabled
        } else {
            PowerState::OperationEnabled
        }
    }

    fn enter_power(&mut self, phase: Phase, since: Time, deadline: Time) {
        self.envelope.release();
        self.activity = Activity::Power(Power {
            phase,
            since,
            deadline,
        });
    }

    pub(super) fn begin_enable(&mut self, now: Time, was_moving: bool) {
        self.was_enabled = true;
        let deadline = now + self.settings.timeouts.transition;
        self.enter_power(Phase::Checking, now, deadline);
        let mut steps = self.abort_first(was_moving);
        steps.push(read(Parameter::FAULTS, ENABLING));
        self.run(now, steps, Urgency::Command);
    }

    pub(super) fn begin_disable(&mut self, now: Time) {
        self.kept = false;
        let deadline = now + self.settings.timeouts.transition;
        self.disable(now, deadline, Urgency::Command);
    }

    fn disable(&mut self, now: Time, deadline: Time, urgency: Urgency) {
        self.enter_power(Phase::Disabling, now, deadline);
        let off = DesiredState::Disabled.raw();
        let steps = vec![Step::write(Parameter::DESIRED_STATE, off, DISABLING)];
        self.run(now, steps, urgency);
    }

    /// As soon as the exchange under way has ended, whoever's it is.
    pub(super) fn begin_quick_stop(&mut self, now: Time) {
        self.kept = false;
        self.image.plausible.watch_rest();
        let deadline = now + self.settings.timeouts.standing;
        self.enter_power(Phase::Stopping, now, deadline);
        let steps = vec![Step::abort("the quick stop")];
        self.run(now, steps, Urgency::Stop);
    }

    pub(super) fn begin_reset(&mut self, now: Time) {
        self.kept = false;
        let deadline = now + self.settings.timeouts.transition;
        self.enter_power(Phase::Listing, now, deadline);
        let steps = vec![read(Parameter::FAULTS, RESETTING)];
        self.run(now, steps, Urgency::Command);
    }

    pub(super) fn power_step_done(&mut self, now: Time) {
        let Activity::Power(Power {
            phase,
            since,
            deadline,
        }) = self.activity
        else {
            return;
        };
        let faults = self.script.number(Parameter::FAULTS).unwrap_or(0);
        let faults = Faults::from_bits_retain(faults as u32);
        match phase {
            Phase::Checking if !faults.is_empty() => self.faulted(ENABLING, faults),
            Phase::Checking => {
                self.enter_power(Phase::Enabling, since, deadline);
                let on = DesiredState::ProgrammedPosition.raw();
                let steps = vec![Step::write(Parameter::DESIRED_STATE, on, ENABLING)];
                self.run(now, steps, Urgency::Command);
            }
            Phase::Enabling => self.await_power(now, Phase::AwaitingOn),
            Phase::Stopping => self.await_power(now, Phase::AwaitingRest),
            Phase::Disabling => self.await_power(now, Phase::AwaitingOff),
            Phase::Listing if faults.is_empty() => self.finish(Ok(())),
            Phase::Listing => {
                self.enter_power(Phase::Clearing, since, deadline);
                let mask = faults.bits().into();
                let steps = vec![
                    Step::write(Parameter::FAULTS, mask, RESETTING).once(),
                    read(Parameter::FAULTS, RESETTING),
                ];
                self.run(now, steps, Urgency::Command);
            }
            Phase::Clearing if faults.is_empty() => {
                self.look.faults = false;
                self.finish(Ok(()));
            }
            Phase::Clearing => self.faulted(RESETTING, faults),
            Phase::AwaitingOn | Phase::AwaitingRest | Phase::AwaitingOff => {}
        }
    }

    fn faulted(&mut self, step: &'static str, faults: Faults) {
        let device = self.name();
        self.finish(Err(DeviceError::Faulted {
            device,
            step,
            faults,
        }));
    }

    /// What was commanded shows in looks that come after.
    fn await_power(&mut self, now: Time, phase: Phase) {
        if let Activity::Power(power) = &mut self.activity {
            power.phase = phase;
            self.look_anew(now);
        }
    }

    pub(super) fn power_unanswered(&mut self, now: Time, step: Step) {
        let Activity::Power(Power {
            phase, deadline, ..
        }) = self.activity
        else {
            return;
        };
        match phase {
            // Whether it was heard or not: without power it stops as well.
            Phase::Stopping => self.disable(now, deadline, Urgency::Stop),
            // Not cleared twice: what is left is read.
            Phase::Clearing if !step.repeatable => {
                self.run(
                    now,
                    vec![read(Parameter::FAULTS, RESETTING)],
                    Urgency::Command,
                );
            }
            Phase::Checking
            | Phase::Enabling
            | Phase::AwaitingOn
            | Phase::AwaitingRest
            | Phase::Disabling
            | Phase::AwaitingOff
            | Phase::Listing
            | Phase::Clearing => {
                let attempts = self.script.failures;
                let error = self.unanswered(step.text, attempts);
                self.finish(Err(error));
            }
        }
    }

    /// After each whole look.
    pub(super) fn advance_power(&mut self, now: Time) {
        let Activity::Power(Power {
            phase, deadline, ..
        }) = self.activity
        else {
            return;
        };
        let events = self.image.events;
        match phase {
            Phase::AwaitingOn if self.is_enabled() => {
                self.kept = true;
                self.envelope.take_hold(None);
                self.finish(Ok(()));
            }
            Phase::AwaitingRest => {
                let off = events.contains(EventStatus::OUTPUTS_OFF);
                let rests =
                    !events.contains(EventStatus::IN_MOTION) || self.image.plausible.stands();
                if off || rests {
                    self.disable(now, deadline, Urgency::Stop);
                }
            }
            Phase::AwaitingOff
                if events.contains(EventStatus::OUTPUTS_OFF)
                    && !events.contains(EventStatus::STOPPING) =>
            {
                self.finish(Ok(()));
            }
            Phase::AwaitingOn
            | Phase::AwaitingOff
            | Phase::Checking
            | Phase::Enabling
            | Phase::Stopping
            | Phase::Disabling
            | Phase::Listing
            | Phase::Clearing => {}
        }
    }

    pub(super) fn power_timeout(&mut self, now: Time) {
        let Activity::Power(Power {
            phase,
            since,
            deadline,
        }) = self.activity
        else {
            return;
        };
        if now < deadline {
            return;
        }
        let seen = self.seen_events();
        match phase {
            Phase::Stopping | Phase::AwaitingRest => {
                // It does not come to rest: then without power.
                let deadline = now + self.settings.timeouts.transition;
                self.disable(now, deadline, Urgency::Stop);
            }
            Phase::Checking | Phase::Enabling | Phase::AwaitingOn => {
                self.time_out(now, since, "the amplifier to be enabled", seen);
            }
            Phase::Disabling | Phase::AwaitingOff => {
                self.time_out(now, since, "the amplifier to be disabled", seen);
            }
            Phase::Listing | Phase::Clearing => {
                self.time_out(now, since, "the faults to be cleared", seen);
            }
        }
    }
}
