//! The drive's own supervision: safe torque off, following error, limit switches, heartbeat, faults
//! and their reset.

use std::time::Duration;

use units::Time;
use wire::canopen::emcy::EmergencyCode;

use super::mechanism::Mechanism;
use super::motion::{Activity, After};
use super::power::Power;
use super::{Drive, PROFILE_POSITION};
use crate::node::canopen_server::register;

/// A limit switch stopped a motion; manufacturer specific.
const LIMIT_SWITCH: EmergencyCode = EmergencyCode(0xFF10);
/// A window of 0x6065 or 0x6067 that is switched off.
const NO_WINDOW: i64 = 0xFFFF_FFFF;

impl Drive {
    pub(super) fn supervise(&mut self, now: Time, m: &mut impl Mechanism) {
        self.watch_safe_torque_off(now, m);
        self.watch_itself(now, m);
        self.watch_sync(now, m);
        self.watch_following_error(now, m);
        self.watch_limit_switches(now, m);
    }

    /// Without torque there is no ramp: the motor coasts, and the position is not held.
    fn watch_safe_torque_off(&mut self, now: Time, m: &mut impl Mechanism) {
        let code = EmergencyCode::SAFE_TORQUE_OFF;
        if !self.safe_torque_off {
            if self.fault != Some(code) {
                self.server.clear(now, code);
            }
            return;
        }
        match self.power {
            Power::OperationEnabled | Power::QuickStopActive | Power::FaultReactionActive => {
                self.switch_off(m);
                self.fail(now, code, register::MANUFACTURER, m);
            }
            Power::ReadyToSwitchOn | Power::SwitchedOn => {
                self.server.raise(now, code, register::MANUFACTURER, [0; 5]);
                self.power = Power::SwitchOnDisabled;
                self.command = None;
            }
            Power::NotReady | Power::SwitchOnDisabled | Power::Fault => {}
        }
    }

    fn watch_itself(&mut self, now: Time, m: &mut impl Mechanism) {
        let faulted = matches!(self.power, Power::Fault | Power::FaultReactionActive);
        if let Some(code) = self.internal_error
            && !faulted
            && self.power != Power::NotReady
        {
            self.fail(now, code, register::PROFILE, m);
        }
    }

    /// |0x60F4| > 0x6065 for 0x6066 ms.
    fn watch_following_error(&mut self, now: Time, m: &mut impl Mechanism) {
        let window = self.get(0x6065);
        let demand = self.demand(now).position + self.cyclic.shortfall;
        let error = demand - self.actual(m) as f64;
        let outside = error.abs() > window as f64 && window != NO_WINDOW;
        if !self.servo_on || !outside {
            self.following_since = None;
            return;
        }
        let since = *self.following_since.get_or_insert(now);
        let time = Duration::from_millis(self.get(0x6066) as u64);
        if since + time <= now && self.power != Power::FaultReactionActive {
            self.fail(now, EmergencyCode::FOLLOWING_ERROR, register::PROFILE, m);
        }
    }

    /// Negative and positive limit switch in drive coordinates.
    pub(super) fn limits(&self, m: &impl Mechanism) -> (bool, bool) {
        let (negative, positive) = m.limit_switches();
        if self.sign() > 0 {
            (negative, positive)
        } else {
            (positive, negative)
        }
    }

    /// Whether a motion of this sign would go on into a pressed switch.
    pub(super) fn is_limited(&self, motion: f64, m: &impl Mechanism) -> bool {
        let (negative, positive) = self.limits(m);
        (negative && motion < 0.0) || (positive && motion > 0.0)
    }

    /// A motion into a limit switch is stopped and given up; homing knows switches itself.
    fn watch_limit_switches(&mut self, now: Time, m: &mut impl Mechanism) {
        if self.limits(m) == (false, false) {
            self.server.clear(now, LIMIT_SWITCH);
            return;
        }
        let outward = self.is_limited(self.demand(now).velocity, m);
        let planned = matches!(
            self.activity,
            Activity::Positioning | Activity::Cyclic | Activity::Velocity
        );
        if outward && planned {
            self.internal_limit = true;
            self.positioning.miss();
            self.ramp(now, self.acceleration(0x6085), After::Stay);
            let (negative, _) = self.limits(m);
            let detail = [u8::from(!negative), 0, 0, 0, 0];
            self.server
                .raise(now, LIMIT_SWITCH, register::MANUFACTURER, detail);
        }
    }

    /// Since when the axis stands at its target, within 0x6067.
    pub(super) fn watch_window(&mut self, now: Time, m: &impl Mechanism) {
        let window = self.get(0x6067);
        let target = self.profile.end_position();
        let distance = (target - self.actual(m) as f64).abs();
        let inside = window == NO_WINDOW || distance <= window as f64;
        let standing = self.power == Power::OperationEnabled
            && self.mode() == PROFILE_POSITION
            && self.activity == Activity::Standing
            && !self.positioning.missed;
        if standing && inside {
            self.in_window_since.get_or_insert(now);
        } else {
            self.in_window_since = None;
        }
    }

    /// The connection to the master is gone: what 0x6007 says.
    pub(super) fn abort_connection(&mut self, now: Time, m: &mut impl Mechanism) {
        match self.get(0x6007) {
            1 => self.fail(
                now,
                EmergencyCode::HEARTBEAT_LOST,
                register::COMMUNICATION,
                m,
            ),
            2 => self.disable_voltage(m),
            3 if self.power == Power::OperationEnabled => {
                self.command = None;
                self.quick_stop(now, m);
            }
            _ => {}
        }
    }

    fn disable_voltage(&mut self, m: &mut impl Mechanism) {
        match self.power {
            Power::ReadyToSwitchOn
            | Power::SwitchedOn
            | Power::OperationEnabled
            | Power::QuickStopActive => {
                self.command = None;
                self.switch_off(m);
                self.power = Power::SwitchOnDisabled;
            }
            Power::NotReady
            | Power::SwitchOnDisabled
            | Power::FaultReactionActive
            | Power::Fault => {}
        }
    }

    /// Transition 13, then 14: emergency, reaction 0x605E, fault.
    pub(super) fn fail(
        &mut self,
        now: Time,
        code: EmergencyCode,
        bits: u8,
        m: &mut impl Mechanism,
    ) {
        self.server.raise(now, code, bits, [0; 5]);
        self.fault = Some(code);
        self.command = None;
        self.following_since = None;
        let reaction = self.get(0x605E);
        if !self.servo_on || reaction == 0 {
            self.switch_off(m);
            self.power = Power::Fault;
            return;
        }
        self.power = Power::FaultReactionActive;
        self.positioning.abandon();
        let deceleration = self.acceleration(if reaction == 2 { 0x6085 } else { 0x6084 });
        self.ramp(now, deceleration, After::Off(Power::Fault));
    }

    /// Transition 15, on a rising edge of bit 7 and only when the cause is gone.
    pub(super) fn reset_fault(&mut self, now: Time) {
        let Some(code) = self.fault.filter(|_| self.power == Power::Fault) else {
            return;
        };
        let persists = match code {
            EmergencyCode::SAFE_TORQUE_OFF => self.safe_torque_off,
            EmergencyCode::HEARTBEAT_LOST => self.heartbeat_lost,
            _ => self.internal_error.is_some(),
        };
        if self.config.quirks.fault_reset_ignored {
            self.server.count_delivery("fault_reset_ignored");
            return;
        }
        if persists {
            return;
        }
        self.fault = None;
        self.power = Power::SwitchOnDisabled;
        self.server.clear(now, code);
    }
}
