//! What an amplifier says of itself, as bits.

use bitflags::bitflags;
use core::fmt;

bitflags! {
    /// [`Parameter::EVENT_STATUS`] (p. 46).
    ///
    /// # Example
    ///
    /// ```
    /// use wire::copley::EventStatus;
    ///
    /// let status = EventStatus::from_bits_retain(0x0800_0200);
    /// assert_eq!(status, EventStatus::IN_MOTION | EventStatus::POSITIVE_LIMIT_SWITCH);
    /// ```
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
    pub struct EventStatus: u32 {
        /// Bit 0.
        const SHORT_CIRCUIT = 1 << 0;
        /// Bit 1.
        const AMPLIFIER_HOT = 1 << 1;
        /// Bit 2.
        const OVER_VOLTAGE = 1 << 2;
        /// Bit 3.
        const UNDER_VOLTAGE = 1 << 3;
        /// Bit 4.
        const MOTOR_HOT = 1 << 4;
        /// Bit 5.
        const FEEDBACK_ERROR = 1 << 5;
        /// Bit 6.
        const PHASING_ERROR = 1 << 6;
        /// Bit 7.
        const CURRENT_LIMITED = 1 << 7;
        /// Bit 8.
        const VOLTAGE_LIMITED = 1 << 8;
        /// Bit 9.
        const POSITIVE_LIMIT_SWITCH = 1 << 9;
        /// Bit 10.
        const NEGATIVE_LIMIT_SWITCH = 1 << 10;
        /// Bit 11: the enable input is not active.
        const NOT_ENABLED_BY_INPUT = 1 << 11;
        /// Bit 12.
        const DISABLED_BY_SOFTWARE = 1 << 12;
        /// Bit 13: disabled, and slowing down before the power goes off.
        const STOPPING = 1 << 13;
        /// Bit 14.
        const BRAKED = 1 << 14;
        /// Bit 15: no power at the motor.
        const OUTPUTS_OFF = 1 << 15;
        /// Bit 16.
        const POSITIVE_SOFT_LIMIT = 1 << 16;
        /// Bit 17.
        const NEGATIVE_SOFT_LIMIT = 1 << 17;
        /// Bit 18: the following error is outside its limit.
        const TRACKING_ERROR = 1 << 18;
        /// Bit 19.
        const TRACKING_WARNING = 1 << 19;
        /// Bit 20.
        const RESET = 1 << 20;
        /// Bit 21.
        const WRAPPED = 1 << 21;
        /// Bit 22: a fault has latched; [`Parameter::FAULTS`] says which.
        const FAULT = 1 << 22;
        /// Bit 23.
        const AT_SPEED_LIMIT = 1 << 23;
        /// Bit 24.
        const AT_ACCELERATION_LIMIT = 1 << 24;
        /// Bit 25: the following error is outside the tracking window.
        const OUTSIDE_WINDOW = 1 << 25;
        /// Bit 26.
        const HOME_SWITCH = 1 << 26;
        /// Bit 27: the trajectory runs, or the axis has not settled behind it.
        const IN_MOTION = 1 << 27;
        /// Bit 28.
        const OUTSIDE_SPEED_WINDOW = 1 << 28;
        /// Bit 29: the motor's phase is not found yet.
        const NOT_PHASED = 1 << 29;
        /// Bit 30: a command signal is missing.
        const COMMAND_FAULT = 1 << 30;
        const _ = !0;
    }
}

bitflags! {
    /// [`Parameter::TRAJECTORY_STATUS`] (p. 48).
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
    pub struct TrajectoryStatus: u16 {
        /// Bit 9: a cam table ran dry.
        const CAM_UNDERFLOW = 1 << 9;
        /// Bit 11: the last homing failed.
        const HOMING_ERROR = 1 << 11;
        /// Bit 12: homed, and not since reset.
        const REFERENCED = 1 << 12;
        /// Bit 13: a homing runs.
        const HOMING = 1 << 13;
        /// Bit 14: the last move was aborted.
        const ABORTED = 1 << 14;
        /// Bit 15: the generator makes a profile.
        const RUNNING = 1 << 15;
        const _ = !0;
    }
}

bitflags! {
    /// [`Parameter::FAULTS`] (p. 48).
    ///
    /// # Example
    ///
    /// ```
    /// use wire::copley::Faults;
    ///
    /// let faults = Faults::from_bits_retain(0x0004_0200);
    /// assert_eq!(faults.to_string(), "following error, safe torque off");
    /// assert_eq!(Faults::empty().to_string(), "no fault");
    /// ```
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
    pub struct Faults: u32 {
        /// Bit 0; cannot be cleared.
        const FLASH_DAMAGED = 1 << 0;
        /// Bit 1; cannot be cleared.
        const INTERNAL = 1 << 1;
        /// Bit 2.
        const SHORT_CIRCUIT = 1 << 2;
        /// Bit 3.
        const AMPLIFIER_HOT = 1 << 3;
        /// Bit 4.
        const MOTOR_HOT = 1 << 4;
        /// Bit 5.
        const OVER_VOLTAGE = 1 << 5;
        /// Bit 6.
        const UNDER_VOLTAGE = 1 << 6;
        /// Bit 7.
        const FEEDBACK = 1 << 7;
        /// Bit 8.
        const PHASING = 1 << 8;
        /// Bit 9.
        const FOLLOWING_ERROR = 1 << 9;
        /// Bit 10.
        const OVER_CURRENT = 1 << 10;
        /// Bit 11; hardly to be cleared.
        const LOGIC_FAILED = 1 << 11;
        /// Bit 12.
        const COMMAND_LOST = 1 << 12;
        /// Bit 14.
        const SAFETY_CIRCUIT = 1 << 14;
        /// Bit 15.
        const CURRENT_UNCONTROLLED = 1 << 15;
        /// Bit 16.
        const MOTOR_UNCONNECTED = 1 << 16;
        /// Bit 18.
        const SAFE_TORQUE_OFF = 1 << 18;
        const _ = !0;
    }
}

impl fmt::Display for Faults {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        const NAMES: [(Faults, &str); 17] = [
            (Faults::FLASH_DAMAGED, "flash memory damaged"),
            (Faults::INTERNAL, "internal error"),
            (Faults::SHORT_CIRCUIT, "short circuit"),
            (Faults::AMPLIFIER_HOT, "amplifier too hot"),
            (Faults::MOTOR_HOT, "motor too hot"),
            (Faults::OVER_VOLTAGE, "supply voltage too high"),
            (Faults::UNDER_VOLTAGE, "supply voltage too low"),
            (Faults::FEEDBACK, "encoder fault"),
            (Faults::PHASING, "motor phasing"),
            (Faults::FOLLOWING_ERROR, "following error"),
            (Faults::OVER_CURRENT, "current too high"),
            (Faults::LOGIC_FAILED, "logic device failed"),
            (Faults::COMMAND_LOST, "command signal lost"),
            (Faults::SAFETY_CIRCUIT, "safety circuit inconsistent"),
            (
                Faults::CURRENT_UNCONTROLLED,
                "motor current cannot be controlled",
            ),
            (Faults::MOTOR_UNCONNECTED, "motor not connected"),
            (Faults::SAFE_TORQUE_OFF, "safe torque off"),
        ];
        let mut rest = *self;
        let mut separator = "";
        for (fault, name) in NAMES {
            if self.contains(fault) {
                write!(f, "{separator}{name}")?;
                separator = ", ";
                rest.remove(fault);
            }
        }
        match (rest.is_empty(), self.is_empty()) {
            (true, true) => f.write_str("no fault"),
            (true, false) => Ok(()),
            (false, _) => write!(f, "{separator}bits {:#x}", rest.bits()),
        }
    }
}
