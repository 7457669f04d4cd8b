//! What controlwords set off: transitions of the power state machine and their ramps.

use std::time::Duration;

use units::Time;
use wire::cia402::Controlword;

use super::mechanism::Mechanism;
use super::motion::{Activity, After};
use super::power::{Command, Power, Transition, transition};
use super::{CYCLIC_POSITION, Drive, HOMING, PROFILE_POSITION, PROFILE_VELOCITY};

impl Drive {
    pub(super) fn on_controlword(&mut self, now: Time, m: &mut impl Mechanism) {
        if self.local_control {
            return;
        }
        let new = Controlword::from_bits_retain(self.get(0x6040) as u16);
        let old = std::mem::replace(&mut self.controlword, new);
        if new.contains(Controlword::FAULT_RESET) && !old.contains(Controlword::FAULT_RESET) {
            self.reset_fault(now);
        }
        self.command = Some(Command::of(new));
        self.keep_enabled(now, m);
        let before = self.power;
        self.pass_power(now, m);
        if before == Power::OperationEnabled && self.power == before {
            match self.mode() {
                PROFILE_POSITION => self.control_positioning(now, old, new, m),
                HOMING => self.control_homing(now, old, new, m),
                CYCLIC_POSITION => self.control_cyclic(now, old, new),
                PROFILE_VELOCITY => self.control_velocity(now, old, new),
                _ => {}
            }
        }
        // With set-points of a bus the controlword comes at every SYNC: see `on_sync`.
        if self.activity != Activity::Cyclic {
            self.command_servo(now, m);
        }
    }

    /// "Enable" during the ramp of a disable command: the drive stays enabled.
    fn keep_enabled(&mut self, now: Time, m: &mut impl Mechanism) {
        let enable = self.command == Some(Command::EnableOperation);
        if self.power != Power::OperationEnabled || !enable {
            return;
        }
        match self.activity {
            Activity::Ramp(After::Off(_)) => self.activity = Activity::Ramp(After::Stay),
            Activity::Braking { .. } => self.open_brake(now, m),
            _ => {}
        }
    }

    /// Whether the drive is about to take the torque away.
    const fn is_leaving(&self) -> bool {
        matches!(
            self.activity,
            Activity::Ramp(After::Off(_)) | Activity::Braking { .. }
        )
    }

    fn resumable(&self) -> bool {
        self.get(0x605A) >= 5
    }

    /// What the master has commanded and the drive has not done yet.
    fn wanted_transition(&self) -> Option<Transition> {
        let stopped = self.power == Power::QuickStopActive;
        transition(self.power, self.command?, stopped && self.resumable())
    }

    fn count_refusal(&mut self) {
        let refused = self.config.quirks.enable_refused;
        if refused && self.wanted_transition() == Some(Transition::T4) {
            self.server.count_delivery("enable_refused");
        }
    }

    /// The transition that waits for its time; `None` also where something forbids it.
    pub(super) fn pending_transition(&self) -> Option<Transition> {
        let wanted = self.wanted_transition()?;
        let leaving = self.is_leaving();
        let forbidden = match wanted {
            Transition::T2 => self.safe_torque_off || self.internal_error.is_some(),
            Transition::T4 => self.config.quirks.enable_refused,
            Transition::T5 | Transition::T8 | Transition::T16 => leaving,
            Transition::T3
            | Transition::T6
            | Transition::T7
            | Transition::T9
            | Transition::T10
            | Transition::T11
            | Transition::T12 => false,
        };
        (!forbidden).then_some(wanted)
    }

    /// At most one transition per [`super::Cia402DriveConfig::power_transition_ms`]: masters
    /// see the states in between.
    pub(super) fn pass_power(&mut self, now: Time, m: &mut impl Mechanism) {
        if now < self.power_free {
            return;
        }
        self.count_refusal();
        let pending = self.pending_transition();
        if pending.is_none() {
            self.memory.enable_due = Time::NEVER;
        }
        if let Some(transition) = pending
            && !self.is_enabling(now, transition)
        {
            self.memory.enable_due = Time::NEVER;
            self.perform(now, transition, m);
            self.power_free = now + Duration::from_millis(self.config.power_transition_ms);
        }
    }

    fn perform(&mut self, now: Time, transition: Transition, m: &mut impl Mechanism) {
        match transition {
            Transition::T2 | Transition::T6 => self.power = Power::ReadyToSwitchOn,
            Transition::T3 => self.power = Power::SwitchedOn,
            Transition::T7 | Transition::T10 => self.power = Power::SwitchOnDisabled,
            Transition::T4 => {
                self.power = Power::OperationEnabled;
                self.switch_on(now, m);
            }
            Transition::T5 => self.leave(now, self.get(0x605C), Power::SwitchedOn, m),
            Transition::T8 => self.leave(now, self.get(0x605B), Power::ReadyToSwitchOn, m),
            Transition::T9 | Transition::T12 => {
                self.switch_off(m);
                self.power = Power::SwitchOnDisabled;
            }
            Transition::T11 => self.quick_stop(now, m),
            Transition::T16 => self.resume_operation(now),
        }
    }

    /// Options 0x605B and 0x605C: 0 lets the motor coast, 1 slows down first.
    fn leave(&mut self, now: Time, option: i64, to: Power, m: &mut impl Mechanism) {
        if option == 0 {
            self.positioning.abandon();
            self.release(now, to, m);
        } else {
            self.positioning.abandon();
            self.ramp(now, self.acceleration(0x6084), After::Off(to));
        }
    }

    /// 0x605A: 0 coasts, 1 and 2 slow down and disable, 5 and 6 slow down and stay.
    pub(super) fn quick_stop(&mut self, now: Time, m: &mut impl Mechanism) {
        let option = self.get(0x605A);
        if option == 0 {
            self.switch_off(m);
            self.power = Power::SwitchOnDisabled;
            return;
        }
        let deceleration = self.acceleration(if option == 1 || option == 5 {
            0x6084
        } else {
            0x6085
        });
        let after = if self.resumable() {
            After::Stay
        } else {
            After::Off(Power::SwitchOnDisabled)
        };
        self.power = Power::QuickStopActive;
        self.positioning.abandon();
        self.ramp(now, deceleration, after);
    }

    fn resume_operation(&mut self, now: Time) {
        self.power = Power::OperationEnabled;
        self.positioning = super::Positioning::at(self.profile.end_position());
        self.in_window_since = None;
        self.homing = super::HomingStatus::NotStarted;
        if !self.profile.is_done(now) {
            self.activity = Activity::Ramp(After::Stay);
        }
        self.run_at_speed(now);
    }
}
