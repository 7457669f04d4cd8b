//! What the drive shows: statusword and process values.

use std::time::Duration;

use units::Time;
use wire::cia402::{HomingStatus, Statusword};

use super::mechanism::Mechanism;
use super::motion::Activity;
use super::power::Power;
use super::{CYCLIC_POSITION, Drive, HOMING, PROFILE_POSITION, PROFILE_VELOCITY};

impl Drive {
    /// Brings the process values in the dictionary up to date.
    pub(super) fn publish(&mut self, now: Time, m: &mut impl Mechanism) {
        self.take_edges(m);
        let actual = self.actual(m);
        let demand = self.demand(now);
        let shown = if self.servo_on {
            demand.position.round() as i64
        } else {
            actual
        };
        let sign = self.sign();
        let (negative, positive) = m.limit_switches();
        let inputs = i64::from(negative) | i64::from(positive) << 1;
        let interlock = i64::from(self.safe_torque_off) << 3;
        let increments = match self.config.increments_are_homed {
            true => actual,
            false => m.counts() - self.counted_from,
        };
        let unit = self.config.quirks.counts_per_speed();
        let in_units = |speed: f64| (speed / unit).round() as i64;
        let values = [
            (0x6062, self.shown(shown)),
            (0x6063, increments),
            (0x6064, self.shown(actual)),
            (0x606B, in_units(demand.velocity)),
            (0x606C, in_units(sign as f64 * m.speed())),
            (0x60F4, shown - actual),
            (0x60FC, sign * (shown - self.offset)),
            (0x60FD, inputs | interlock),
        ];
        for (index, value) in values {
            self.server.set(index, 0, value);
        }
        let fault = self.fault.map_or(0, |code| i64::from(code.0));
        self.server.set(0x603F, 0, fault);
        self.show_mode();
        let polite = self.statusword(now);
        let status = self.spoil_status(now, polite);
        self.show_status(now, i64::from(status.bits()));
    }

    /// Shows the statusword, unless it sticks.
    fn show_status(&mut self, now: Time, status: i64) {
        let quirks = self.config.quirks;
        let reached = self.power == Power::OperationEnabled
            && self.mode() == PROFILE_POSITION
            && self.is_at_target(now);
        if quirks.target_never_reached && reached {
            self.server.count_delivery("target_never_reached");
        }
        if !quirks.statusword_stuck {
            self.server.set(0x6041, 0, status);
        } else if status != self.get(0x6041) {
            self.server.count_delivery("statusword_stuck");
        }
    }

    fn statusword(&self, now: Time) -> Statusword {
        let state = Statusword::from_bits_retain(self.power.wire().bits());
        let mut status = state | Statusword::VOLTAGE_ENABLED;
        status.set(Statusword::REMOTE, !self.local_control);
        status.set(Statusword::INTERNAL_LIMIT, self.internal_limit);
        if let Some(bit) = self.config.homed_bit.filter(|_| self.homed) {
            status |= Statusword::from_bits_retain(1_u16.unbounded_shl(bit.into()));
        }
        let enabled = self.power == Power::OperationEnabled;
        match self.mode() {
            HOMING if enabled => status | homing_bits(self.homing),
            PROFILE_POSITION if enabled => {
                status.set(Statusword::TARGET_REACHED, self.target_reached(now));
                status.set(Statusword::MODE_12, self.positioning.bit_12());
                status.set(Statusword::MODE_13, self.following_since.is_some());
                status
            }
            CYCLIC_POSITION if enabled => {
                let follows = self.activity == Activity::Cyclic;
                status.set(Statusword::MODE_12, follows);
                status.set(Statusword::MODE_13, self.following_since.is_some());
                status
            }
            PROFILE_VELOCITY if enabled => status | Statusword::TARGET_REACHED,
            _ => {
                let stopped = self.power == Power::QuickStopActive && self.profile.is_done(now);
                status.set(Statusword::TARGET_REACHED, stopped);
                status
            }
        }
    }

    /// Bit 10 in profile position: in the window 0x6067 for the time 0x6068, or halted.
    /// It stays 1 from the move before until a new set-point is taken.
    pub(super) fn target_reached(&self, now: Time) -> bool {
        !self.config.quirks.target_never_reached && self.is_at_target(now)
    }

    /// The same of a drive that owns up to it.
    fn is_at_target(&self, now: Time) -> bool {
        use wire::cia402::Controlword;
        if self.controlword.contains(Controlword::HALT) {
            return self.profile.is_done(now);
        }
        let time = Duration::from_millis(self.get(0x6068) as u64);
        self.in_window_since
            .is_some_and(|since| since + time <= now)
    }
}

/// Bits 10, 12 and 13 of the statusword in homing mode.
fn homing_bits(status: HomingStatus) -> Statusword {
    Statusword::from_bits_retain(match status {
        HomingStatus::InProgress => 0x0000,
        HomingStatus::NotStarted => 0x0400,
        HomingStatus::Attained => 0x1000,
        HomingStatus::Done => 0x1400,
        HomingStatus::ErrorMoving => 0x2000,
        HomingStatus::ErrorStopped => 0x2400,
        HomingStatus::Unknown(bits) => bits,
    })
}
