//! Behaviour of a drive with [quirks](super::quirks).

use std::time::Duration;

use units::Time;
use wire::canopen::emcy::EmergencyCode;
use wire::cia402::{Controlword, HomingStatus, Statusword};

use super::mechanism::Mechanism;
use super::motion::Activity;
use super::power::{Power, Transition};
use super::quirks::RpdoDeadline;
use super::{Drive, HOMING, PROFILE_POSITION, PROFILE_VELOCITY};
use crate::node::canopen_server::register;
use crate::node::profile::{MotionLimits, Profile};

/// "RPDO time-out" (CiA 301, table 26).
const RPDO_TIMEOUT: EmergencyCode = EmergencyCode(0x8250);
/// Farther than any axis, in counts.
const FAR: f64 = 1e12;
/// Bits 10 and 12 of a homing that was attained.
const ATTAINED: u16 = 0x1400;

/// What the quirks remember.
#[derive(Clone, Copy, Debug)]
pub(super) struct Memory {
    /// The bits of a homing before are still there.
    homing_bits_left: bool,
    stale_until: Time,
    /// 0x607A before the frame that is worked on.
    target_before: i64,
    /// 0x607A as the objects before the controlword have left it.
    target_in_order: i64,
    /// A set-point was acknowledged since the drive was enabled.
    acknowledged: bool,
    /// When a slow drive is enabled.
    pub(super) enable_due: Time,
}

impl Memory {
    pub(super) const NOTHING: Self = Self {
        homing_bits_left: false,
        stale_until: Time::ZERO,
        target_before: 0,
        target_in_order: 0,
        acknowledged: false,
        enable_due: Time::NEVER,
    };
}

impl Drive {
    /// The drive has booted.
    pub(super) fn remember_nothing(&mut self) {
        let quirks = self.config.quirks;
        self.memory = Memory {
            homing_bits_left: quirks.stale_homing_from_power_on,
            target_in_order: self.get(0x607A),
            ..Memory::NOTHING
        };
        if quirks
            .left_mode
            .is_some_and(|mode| i64::from(mode) != PROFILE_POSITION)
        {
            self.server.count_delivery("left_mode");
        }
    }

    /// A frame is about to be worked on.
    pub(super) fn note_target(&mut self) {
        self.memory.target_before = self.get(0x607A);
    }

    /// 0x607A was written.
    pub(super) fn note_target_in_order(&mut self) {
        self.memory.target_in_order = self.get(0x607A);
    }

    /// The target that an edge of the new set-point takes.
    pub(super) fn target_at_edge(&mut self) -> i64 {
        let target = self.get(0x607A);
        let quirks = self.config.quirks;
        let (name, taken) = if quirks.edge_before_target {
            ("edge_before_target", self.memory.target_before)
        } else if quirks.edge_in_mapping_order {
            ("edge_in_mapping_order", self.memory.target_in_order)
        } else {
            return target;
        };
        if taken != target {
            self.server.count_delivery(name);
        }
        taken
    }

    /// Whether a new set-point is passed over under HALT.
    pub(super) fn is_blocked_by_halt(&mut self, new: Controlword) -> bool {
        let blocked = self.config.quirks.halt_blocks_acknowledge && new.contains(Controlword::HALT);
        if blocked {
            self.server.count_delivery("halt_blocks_acknowledge");
        }
        blocked
    }

    /// 0x6060 was written: whether it has no effect.
    pub(super) fn ignores_mode(&mut self) -> bool {
        let quirks = self.config.quirks;
        let off = self.power != Power::OperationEnabled;
        let name = if quirks.mode_ignored_while_off && off {
            "mode_ignored_while_off"
        } else if quirks.halt_blocks_mode && self.controlword.contains(Controlword::HALT) {
            "halt_blocks_mode"
        } else {
            return false;
        };
        if self.get(0x6060) != self.mode() {
            self.server.count_delivery(name);
            let mode = self.mode();
            self.server.set(0x6060, 0, mode);
        }
        true
    }

    /// 0x6061.
    pub(super) fn show_mode(&mut self) {
        let mode = self.mode();
        let shown = self.config.quirks.mode_display_stuck.map(i64::from);
        if shown.is_some_and(|shown| shown != mode) {
            self.server.count_delivery("mode_display_stuck");
        }
        self.server.set(0x6061, 0, shown.unwrap_or(mode));
    }

    /// Whether `transition` has to wait for a drive that is slow to enable.
    pub(super) fn is_enabling(&mut self, now: Time, transition: Transition) -> bool {
        let delay = Duration::from_millis(self.config.quirks.enable_delay_ms);
        if transition != Transition::T4 || delay.is_zero() {
            self.memory.enable_due = Time::NEVER;
            return false;
        }
        if self.memory.enable_due == Time::NEVER {
            self.server.count_delivery("enable_delay_ms");
            self.memory.enable_due = now + delay;
        }
        now < self.memory.enable_due
    }

    /// The motor was switched on.
    pub(super) fn forget_acknowledge(&mut self) {
        self.memory.acknowledged = false;
    }

    /// A homing begins.
    pub(super) fn begin_stale_bits(&mut self, now: Time) {
        let stale = Duration::from_millis(self.config.quirks.stale_homing_ms);
        if std::mem::take(&mut self.memory.homing_bits_left) {
            self.memory.stale_until = now + stale;
        }
    }

    /// A homing was attained.
    pub(super) fn leave_homing_bits(&mut self) {
        self.memory.homing_bits_left = self.config.quirks.stale_homing_ms > 0;
    }

    /// The master's heartbeat has ended.
    pub(super) fn lose_master(&mut self, now: Time, m: &mut impl Mechanism) {
        self.heartbeat_lost = true;
        if !self.config.quirks.faults_on_lost_heartbeat {
            return self.abort_connection(now, m);
        }
        let faulted = matches!(self.power, Power::Fault | Power::FaultReactionActive);
        if !faulted && self.power != Power::NotReady {
            self.server.count_delivery("faults_on_lost_heartbeat");
            self.fail(
                now,
                EmergencyCode::HEARTBEAT_LOST,
                register::COMMUNICATION,
                m,
            );
        }
    }

    /// An RPDO is late.
    pub(super) fn lose_rpdo(&mut self, now: Time, m: &mut impl Mechanism) {
        if self.power != Power::OperationEnabled {
            return;
        }
        match self.config.quirks.rpdo_deadline {
            RpdoDeadline::Ignored => return,
            RpdoDeadline::QuickStop => {
                self.command = None;
                self.quick_stop(now, m);
            }
            RpdoDeadline::Fault => self.fail(now, RPDO_TIMEOUT, register::COMMUNICATION, m),
        }
        self.server.count_delivery("rpdo_deadline");
    }

    /// What the statusword shows in place of `polite`.
    pub(super) fn spoil_status(&mut self, now: Time, polite: Statusword) -> Statusword {
        let mut status = polite;
        if self.power == Power::OperationEnabled {
            status = match self.mode() {
                HOMING => self.spoil_homing(now, polite),
                PROFILE_POSITION => self.spoil_acknowledge(polite),
                _ => polite,
            };
        }
        let extra = Statusword::from_bits_retain(self.config.quirks.statusword_bits);
        if !status.contains(extra) {
            self.server.count_delivery("statusword_bits");
        }
        status | extra
    }

    fn spoil_homing(&mut self, now: Time, polite: Statusword) -> Statusword {
        let quirks = self.config.quirks;
        let attained = Statusword::from_bits_retain(ATTAINED);
        let waiting = self.homing == HomingStatus::NotStarted && self.memory.homing_bits_left;
        let (name, shown) = if quirks.homing_attained_stuck {
            ("homing_attained_stuck", polite | attained)
        } else if waiting || now < self.memory.stale_until {
            let others = polite - attained - Statusword::MODE_13;
            ("stale_homing_ms", others | attained)
        } else if quirks.homing_ends_without_bit_10 && self.homing == HomingStatus::Done {
            let shown = polite - Statusword::TARGET_REACHED;
            ("homing_ends_without_bit_10", shown)
        } else {
            return polite;
        };
        if shown != polite {
            self.server.count_delivery(name);
        }
        shown
    }

    fn spoil_acknowledge(&mut self, polite: Statusword) -> Statusword {
        let quirks = self.config.quirks;
        self.memory.acknowledged |= polite.contains(Statusword::MODE_12);
        let mut shown = polite;
        let name = if quirks.acknowledge_inverted {
            shown.toggle(Statusword::MODE_12);
            "acknowledge_inverted"
        } else if quirks.acknowledge_never_falls {
            shown.set(Statusword::MODE_12, self.memory.acknowledged);
            "acknowledge_never_falls"
        } else {
            return polite;
        };
        if shown != polite {
            self.server.count_delivery(name);
        }
        shown
    }

    /// A speed of the dictionary in counts per second.
    pub(super) fn speed(&self, index: u16, sub: u8) -> f64 {
        self.server.get(index, sub) as f64 * self.config.quirks.counts_per_speed()
    }

    /// An acceleration of the dictionary in counts per second squared.
    pub(super) fn acceleration(&self, index: u16) -> f64 {
        self.get(index) as f64 * self.config.quirks.counts_per_acceleration()
    }

    /// A homing speed in counts per second.
    pub(super) fn homing_speed(&self, sub: u8) -> f64 {
        self.speed(0x6099, sub) * self.config.quirks.homing_speed_factor.unwrap_or(1.0)
    }

    /// A motion was planned with the drive's own units.
    pub(super) fn count_units(&mut self) {
        let quirks = self.config.quirks;
        let homing = matches!(self.activity, Activity::Homing(_));
        let factor = quirks.homing_speed_factor.filter(|_| homing);
        let named = [
            ("speed_unit", quirks.speed_unit),
            ("acceleration_unit", quirks.acceleration_unit),
            ("homing_speed_factor", factor),
        ];
        for (name, value) in named {
            if value.is_some_and(|value| value != 1.0) {
                self.server.count_delivery(name);
            }
        }
    }

    /// Profile velocity: the drive runs at 0x60FF.
    pub(super) fn run_at_speed(&mut self, now: Time) {
        let velocity = self.speed(0x60FF, 0);
        let halted = self.controlword.contains(Controlword::HALT);
        let enabled = self.power == Power::OperationEnabled && self.servo_on;
        if self.mode() != PROFILE_VELOCITY || !enabled || halted || velocity == 0.0 {
            return;
        }
        if self.config.quirks.left_velocity != 0 {
            self.server.count_delivery("left_velocity");
        }
        let from = self.demand(now);
        let limits = MotionLimits {
            velocity: velocity.abs(),
            acceleration: self.acceleration(0x6083),
            deceleration: self.acceleration(0x6084),
        };
        let target = from.position + velocity.signum() * FAR;
        self.profile = Profile::to_target(now, from, target, limits);
        self.activity = Activity::Velocity;
        self.look_now();
    }

    /// A new controlword in operation enabled: HALT slows down, its end lets the drive run on.
    pub(super) fn control_velocity(&mut self, now: Time, old: Controlword, new: Controlword) {
        let halt = |word: Controlword| word.contains(Controlword::HALT);
        if halt(new) && !halt(old) {
            self.halt(now);
        } else if halt(old) && !halt(new) {
            self.run_at_speed(now);
        }
    }
}
