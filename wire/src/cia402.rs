//! Controlword, statusword and modes of CiA 402 drives (IEC 61800-7-201).

use bitflags::bitflags;
use core::fmt;

bitflags! {
    /// Object 0x6040.
    ///
    /// # Example
    ///
    /// ```
    /// use wire::cia402::Controlword;
    ///
    /// assert_eq!(Controlword::SHUTDOWN.bits(), 0x06);
    /// assert_eq!(Controlword::ENABLE_COMMAND.bits(), 0x0F);
    /// let begin = Controlword::ENABLE_COMMAND | Controlword::MODE_4;
    /// assert_eq!(begin.bits(), 0x1F, "a new set-point");
    /// ```
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
    pub struct Controlword: u16 {
        /// Bit 0.
        const SWITCH_ON = 1 << 0;
        /// Bit 1.
        const ENABLE_VOLTAGE = 1 << 1;
        /// Bit 2, active low: 0 asks for a quick stop.
        const NO_QUICK_STOP = 1 << 2;
        /// Bit 3.
        const ENABLE_OPERATION = 1 << 3;
        /// Bit 4: new set-point (profile position), start (homing), enable (interpolated).
        const MODE_4 = 1 << 4;
        /// Bit 5: change set immediately (profile position).
        const MODE_5 = 1 << 5;
        /// Bit 6: the target is relative (profile position).
        const MODE_6 = 1 << 6;
        /// Bit 7: a rising edge resets a fault.
        const FAULT_RESET = 1 << 7;
        /// Bit 8.
        const HALT = 1 << 8;
        /// Bit 9: change on set-point (profile position).
        const MODE_9 = 1 << 9;
        /// Transition 2, 6, 8 (command "shutdown").
        const SHUTDOWN = Self::ENABLE_VOLTAGE.bits() | Self::NO_QUICK_STOP.bits();
        /// Transition 3, 5.
        const SWITCH_ON_COMMAND = Self::SHUTDOWN.bits() | Self::SWITCH_ON.bits();
        /// Transition 4, 16.
        const ENABLE_COMMAND = Self::SWITCH_ON_COMMAND.bits() | Self::ENABLE_OPERATION.bits();
        /// Transition 7, 10, 11.
        const QUICK_STOP_COMMAND = Self::ENABLE_VOLTAGE.bits();
        const _ = !0;
    }
}

bitflags! {
    /// Object 0x6041.
    ///
    /// # Example
    ///
    /// ```
    /// use wire::cia402::{PowerState, Statusword};
    ///
    /// let status = Statusword::from_bits_retain(0x1637);
    /// assert_eq!(status.state(), PowerState::OperationEnabled);
    /// assert!(status.contains(Statusword::TARGET_REACHED));
    /// assert_eq!(Statusword::from_bits_retain(0x0218).state(), PowerState::Fault);
    /// ```
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
    pub struct Statusword: u16 {
        /// Bit 0.
        const READY_TO_SWITCH_ON = 1 << 0;
        /// Bit 1.
        const SWITCHED_ON = 1 << 1;
        /// Bit 2.
        const OPERATION_ENABLED = 1 << 2;
        /// Bit 3.
        const FAULT = 1 << 3;
        /// Bit 4.
        const VOLTAGE_ENABLED = 1 << 4;
        /// Bit 5, active low.
        const NO_QUICK_STOP = 1 << 5;
        /// Bit 6.
        const SWITCH_ON_DISABLED = 1 << 6;
        /// Bit 7.
        const WARNING = 1 << 7;
        /// Bit 9: the drive obeys the bus.
        const REMOTE = 1 << 9;
        /// Bit 10.
        const TARGET_REACHED = 1 << 10;
        /// Bit 11.
        const INTERNAL_LIMIT = 1 << 11;
        /// Bit 12: set-point acknowledged, homing attained, drive follows.
        const MODE_12 = 1 << 12;
        /// Bit 13: following error, homing error.
        const MODE_13 = 1 << 13;
        const _ = !0;
    }
}

/// A state of the power state machine.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum PowerState {
    /// Self-test.
    NotReadyToSwitchOn,
    /// No voltage may be applied.
    SwitchOnDisabled,
    /// High voltage may be applied.
    ReadyToSwitchOn,
    /// Voltage applied, no torque.
    SwitchedOn,
    /// The motor is under control.
    OperationEnabled,
    /// A quick stop runs or has stopped the motor.
    QuickStopActive,
    /// The drive's own reaction to a fault runs.
    FaultReactionActive,
    /// Faulted; waits for a reset.
    Fault,
    /// Bits that are no state.
    Unknown(u16),
}

impl Statusword {
    /// The state, by the standard's masks: bit 5 counts only where the standard gives it.
    pub const fn state(self) -> PowerState {
        let raw = self.bits();
        match (raw & 0x4F, raw & 0x6F) {
            (0x00, _) => PowerState::NotReadyToSwitchOn,
            (0x40, _) => PowerState::SwitchOnDisabled,
            (0x0F, _) => PowerState::FaultReactionActive,
            (0x08, _) => PowerState::Fault,
            (_, 0x21) => PowerState::ReadyToSwitchOn,
            (_, 0x23) => PowerState::SwitchedOn,
            (_, 0x27) => PowerState::OperationEnabled,
            (_, 0x07) => PowerState::QuickStopActive,
            _ => PowerState::Unknown(raw),
        }
    }
}

impl PowerState {
    /// The statusword bits of this state (mask 0x6F).
    pub const fn bits(self) -> u16 {
        match self {
            Self::NotReadyToSwitchOn => 0x00,
            Self::SwitchOnDisabled => 0x40,
            Self::ReadyToSwitchOn => 0x21,
            Self::SwitchedOn => 0x23,
            Self::OperationEnabled => 0x27,
            Self::QuickStopActive => 0x07,
            Self::FaultReactionActive => 0x0F,
            Self::Fault => 0x08,
            Self::Unknown(raw) => raw,
        }
    }
}

impl fmt::Display for PowerState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NotReadyToSwitchOn => "not ready to switch on",
            Self::SwitchOnDisabled => "switch on disabled",
            Self::ReadyToSwitchOn => "ready to switch on",
            Self::SwitchedOn => "switched on",
            Self::OperationEnabled => "operation enabled",
            Self::QuickStopActive => "quick stop active",
            Self::FaultReactionActive => "fault reaction active",
            Self::Fault => "fault",
            Self::Unknown(raw) => return write!(f, "unknown state (statusword {raw:#06X})"),
        })
    }
}

/// Object 0x6060 and 0x6061.
///
/// # Example
///
/// ```
/// use wire::cia402::OperationMode;
///
/// assert_eq!(OperationMode::from_raw(8), OperationMode::CyclicSynchronousPosition);
/// assert_eq!(OperationMode::from_raw(-3), OperationMode::Unknown(-3), "a manufacturer's");
/// assert_eq!(OperationMode::Homing.raw(), 6);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum OperationMode {
    /// No mode.
    None,
    /// Profile position.
    ProfilePosition,
    /// Profile velocity.
    ProfileVelocity,
    /// Torque.
    ProfileTorque,
    /// Homing.
    Homing,
    /// Interpolated position.
    InterpolatedPosition,
    /// Cyclic synchronous position.
    CyclicSynchronousPosition,
    /// Cyclic synchronous velocity.
    CyclicSynchronousVelocity,
    /// Reserved or manufacturer's.
    Unknown(i8),
}

impl OperationMode {
    /// From the object's value.
    pub const fn from_raw(raw: i8) -> Self {
        match raw {
            0 => Self::None,
            1 => Self::ProfilePosition,
            3 => Self::ProfileVelocity,
            4 => Self::ProfileTorque,
            6 => Self::Homing,
            7 => Self::InterpolatedPosition,
            8 => Self::CyclicSynchronousPosition,
            9 => Self::CyclicSynchronousVelocity,
            other => Self::Unknown(other),
        }
    }

    /// The object's value.
    pub const fn raw(self) -> i8 {
        match self {
            Self::None => 0,
            Self::ProfilePosition => 1,
            Self::ProfileVelocity => 3,
            Self::ProfileTorque => 4,
            Self::Homing => 6,
            Self::InterpolatedPosition => 7,
            Self::CyclicSynchronousPosition => 8,
            Self::CyclicSynchronousVelocity => 9,
            Self::Unknown(raw) => raw,
        }
    }
}

/// What homing reports in bits 10, 12 and 13 of the statusword.
///
/// # Example
///
/// ```
/// use wire::cia402::{HomingStatus, Statusword};
///
/// let status = Statusword::from_bits_retain(0x1637);
/// assert_eq!(HomingStatus::of(status), HomingStatus::Done);
/// let status = Statusword::from_bits_retain(0x2637);
/// assert_eq!(HomingStatus::of(status), HomingStatus::ErrorStopped);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum HomingStatus {
    /// Running.
    InProgress,
    /// Interrupted or not started.
    NotStarted,
    /// Attained, the target not yet reached.
    Attained,
    /// Done.
    Done,
    /// Failed, still moving.
    ErrorMoving,
    /// Failed, stopped.
    ErrorStopped,
    /// A reserved combination.
    Unknown(u16),
}

impl HomingStatus {
    /// From a statusword in homing mode.
    pub const fn of(status: Statusword) -> Self {
        match status.bits() & 0x3400 {
            0x0000 => Self::InProgress,
            0x0400 => Self::NotStarted,
            0x1000 => Self::Attained,
            0x1400 => Self::Done,
            0x2000 => Self::ErrorMoving,
            0x2400 => Self::ErrorStopped,
            other => Self::Unknown(other),
        }
    }
}

/// A statusword in words: its state, and each bit that says more, by its name in the mode that the drive is in.
///
/// # Example
///
/// ```
/// use wire::cia402::{NamedStatus, OperationMode, Statusword};
///
/// let word = Statusword::from_bits_retain(0x1237);
/// let mode = Some(OperationMode::Homing);
/// let text = "statusword 0x1237: operation enabled; homing attained, not target reached";
/// assert_eq!(NamedStatus { word, mode }.to_string(), text);
/// let word = Statusword::from_bits_retain(0x0240);
/// let text = "statusword 0x0240: switch on disabled; voltage off: mains, STO, enable input";
/// assert_eq!(NamedStatus { word, mode: None }.to_string(), text);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NamedStatus {
    /// The statusword.
    pub word: Statusword,
    /// The mode that gives bits 10, 12 and 13 their names, where it is known.
    pub mode: Option<OperationMode>,
}

impl NamedStatus {
    /// The bits of `word` in `mode`, where that is known.
    pub const fn new(word: Statusword, mode: Option<OperationMode>) -> Self {
        Self { word, mode }
    }

    /// The bits that belong to the mode.
    fn mode_bits(self) -> Vec<&'static str> {
        let has = |bit: Statusword| self.word.contains(bit);
        let is_on = self.word.state() == PowerState::OperationEnabled;
        match self.mode {
            Some(OperationMode::Homing) => match HomingStatus::of(self.word) {
                HomingStatus::InProgress if !is_on => vec![],
                HomingStatus::InProgress => vec!["homing in progress"],
                HomingStatus::NotStarted => vec!["homing interrupted or not started"],
                HomingStatus::Attained => vec!["homing attained, not target reached"],
                HomingStatus::Done => vec!["homing attained, target reached"],
                HomingStatus::ErrorMoving => vec!["homing error, still moving"],
                HomingStatus::ErrorStopped => vec!["homing error, stopped"],
                HomingStatus::Unknown(_) => vec!["homing attained and homing error at once"],
            },
            Some(OperationMode::ProfilePosition) => {
                let mut bits = vec![match has(Statusword::TARGET_REACHED) {
                    true => "target reached",
                    false => "not target reached",
                }];
                bits.extend(has(Statusword::MODE_12).then_some("set-point acknowledged"));
                bits.extend(has(Statusword::MODE_13).then_some("following error"));
                bits
            }
            Some(OperationMode::CyclicSynchronousPosition) => {
                let mut bits = vec![match has(Statusword::MODE_12) {
                    true => "follows its set-points",
                    false => "does not follow its set-points",
                }];
                bits.extend(has(Statusword::MODE_13).then_some("following error"));
                bits
            }
            _ => {
                let named = [
                    (Statusword::TARGET_REACHED, "target reached"),
                    (
                        Statusword::MODE_12,
                        "bit 12: set-point acknowledged, or homing attained",
                    ),
                    (
                        Statusword::MODE_13,
                        "bit 13: following error, or homing error",
                    ),
                ];
                let set = named.iter().filter(|(bit, _)| has(*bit));
                set.map(|(_, name)| *name).collect()
            }
        }
    }

    /// The bits that mean the same in each mode, where they say something.
    fn common_bits(self) -> Vec<&'static str> {
        let has = |bit: Statusword| self.word.contains(bit);
        let mut bits = Vec::new();
        let needs_voltage = !matches!(
            self.word.state(),
            PowerState::NotReadyToSwitchOn | PowerState::Unknown(_)
        );
        if needs_voltage && !has(Statusword::VOLTAGE_ENABLED) {
            bits.push("voltage off: mains, STO, enable input");
        }
        if has(Statusword::WARNING) {
            bits.push("warning");
        }
        if has(Statusword::INTERNAL_LIMIT) {
            bits.push("internal limit active: limit switch, soft limit, speed or torque");
        }
        if !has(Statusword::REMOTE) {
            bits.push("not remote: it does not obey the bus");
        }
        bits
    }
}

impl fmt::Display for NamedStatus {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let raw = self.word.bits();
        match self.word.state() {
            PowerState::Unknown(_) => write!(f, "statusword {raw:#06X}: no known state")?,
            state => write!(f, "statusword {raw:#06X}: {state}")?,
        }
        for bit in self.mode_bits().into_iter().chain(self.common_bits()) {
            write!(f, "; {bit}")?;
        }
        Ok(())
    }
}

/// A unit as CiA 303-2 codes one: prefix, numerator, denominator, in the bytes from the highest down.
///
/// # Example
///
/// ```
/// use wire::cia402::UnitCode;
///
/// assert_eq!(UnitCode(0x00B4_4700).to_string(), "turns/min, 0x00B44700");
/// assert_eq!(UnitCode(0xFD01_0300).to_string(), "1e-3 m/s, 0xFD010300");
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct UnitCode(pub u32);

impl fmt::Display for UnitCode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [_, per, what, prefix] = self.0.to_le_bytes();
        let name = |code| match code {
            0x01 => Some("m"),
            0x03 => Some("s"),
            0x10 => Some("rad"),
            0x41 => Some("deg"),
            0x47 => Some("min"),
            0xB4 => Some("turns"),
            0xB5 => Some("increments"),
            0xC0 => Some("turns/min"),
            _ => None,
        };
        if let (Some(what), Some(per)) = (name(what), name(per)) {
            match prefix.cast_signed() {
                0 => write!(f, "{what}/{per}, ")?,
                exponent => write!(f, "1e{exponent} {what}/{per}, ")?,
            }
        }
        write!(f, "{:#010X}", self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check_state(raw: u16, expected: PowerState) {
        assert_eq!(Statusword::from_bits_retain(raw).state(), expected);
    }

    #[test]
    fn states_are_read_by_masks_whatever_bit_5_is() {
        check_state(0x0250, PowerState::SwitchOnDisabled);
        check_state(0x0270, PowerState::SwitchOnDisabled);
        check_state(0x0231, PowerState::ReadyToSwitchOn);
        check_state(0x0233, PowerState::SwitchedOn);
        check_state(0x1637, PowerState::OperationEnabled);
        check_state(0x0217, PowerState::QuickStopActive);
        check_state(0x0218, PowerState::Fault);
        check_state(0x0238, PowerState::Fault);
        check_state(0x021F, PowerState::FaultReactionActive);
        check_state(0x0200, PowerState::NotReadyToSwitchOn);
        check_state(0x0211, PowerState::Unknown(0x0211));
    }

    /// Kollmorgen AKD CANopen manual, p. 145: the statusword of a finished homing.
    #[test]
    fn a_real_drives_homing_trace_is_done() {
        let status = Statusword::from_bits_retain(0x1637);
        assert_eq!(HomingStatus::of(status), HomingStatus::Done);
    }

    #[test]
    fn commands_have_the_standards_bits() {
        assert_eq!(Controlword::SHUTDOWN.bits(), 0x06);
        assert_eq!(Controlword::SWITCH_ON_COMMAND.bits(), 0x07);
        assert_eq!(Controlword::ENABLE_COMMAND.bits(), 0x0F);
        assert_eq!(Controlword::QUICK_STOP_COMMAND.bits(), 0x02);
    }

    #[track_caller]
    fn check_named(raw: u16, mode: Option<OperationMode>, expected: &str) {
        let word = Statusword::from_bits_retain(raw);
        assert_eq!(NamedStatus { word, mode }.to_string(), expected);
    }

    #[test]
    fn bits_are_named_by_the_mode_that_gives_them_their_meaning() {
        check_named(
            0x0637,
            None,
            "statusword 0x0637: operation enabled; target reached",
        );
        check_named(
            0x0237,
            Some(OperationMode::ProfilePosition),
            "statusword 0x0237: operation enabled; not target reached",
        );
        check_named(
            0x2237,
            Some(OperationMode::CyclicSynchronousPosition),
            "statusword 0x2237: operation enabled; does not follow its set-points; following error",
        );
        check_named(
            0x2637,
            Some(OperationMode::Homing),
            "statusword 0x2637: operation enabled; homing error, stopped",
        );
        check_named(
            0x0088,
            None,
            "statusword 0x0088: fault; voltage off: mains, STO, enable input; warning; not remote: it does not obey \
             the bus",
        );
        check_named(0x0211, None, "statusword 0x0211: no known state");
    }

    #[test]
    fn modes_keep_manufacturers_values() {
        assert_eq!(OperationMode::from_raw(-3), OperationMode::Unknown(-3));
        assert_eq!(OperationMode::from_raw(8).raw(), 8);
    }
}
