//! An amplifier's parameters: what can be read and written, where, and within which limits.

use std::collections::BTreeMap;

use units::Time;
use wire::copley::{BAUD_AT_RESET, Bank, DesiredState, ErrorCode, Faults, HomingMethod, Parameter};

use super::super::config::CopleyAmpConfig;
use super::Amp;
use crate::plant::Plant;

/// Parameters 0xca and the like hold 32 bits with a sign.
const POSITION: (i64, i64) = (i32::MIN as i64, i32::MAX as i64);
/// Speeds, accelerations and windows are not negative.
const MAGNITUDE: (i64, i64) = (0, i32::MAX as i64);
/// The guide's range of rates (p. 7).
const RATE: (i64, i64) = (BAUD_AT_RESET as i64, 115_200);

/// Where a parameter can be written, and what.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Access {
    /// In both banks, within limits.
    Both(i64, i64),
    /// In RAM only, within limits.
    Ram(i64, i64),
    /// Only read, in RAM.
    ReadRam,
    /// Only read, in flash.
    ReadFlash,
}

fn access(parameter: Parameter) -> Result<Access, ErrorCode> {
    let both = |(low, high)| Ok(Access::Both(low, high));
    match parameter {
        Parameter::DESIRED_STATE => both((0, 42)),
        Parameter::SOFT_LIMIT_POSITIVE
        | Parameter::SOFT_LIMIT_NEGATIVE
        | Parameter::HOME_OFFSET
        | Parameter::POSITION_COMMAND => both(POSITION),
        Parameter::FOLLOWING_ERROR_LIMIT
        | Parameter::TRACKING_WINDOW
        | Parameter::HOMING_SPEED_FAST
        | Parameter::HOMING_SPEED_SLOW
        | Parameter::HOMING_ACCELERATION
        | Parameter::SPEED
        | Parameter::ACCELERATION
        | Parameter::DECELERATION
        | Parameter::ABORT_DECELERATION => both(MAGNITUDE),
        Parameter::TRACKING_WINDOW_TIME => both((0, 10_000)),
        Parameter::HOMING_METHOD => both((0, 883)),
        // The emulation has only trapezoidal profiles: absolute and relative.
        Parameter::PROFILE_TYPE => both((0, 256)),
        Parameter::BAUD => Ok(Access::Ram(RATE.0, RATE.1)),
        Parameter::FAULTS => Ok(Access::Ram(0, u32::MAX as i64)),
        Parameter::POSITION
        | Parameter::MOTOR_POSITION
        | Parameter::FOLLOWING_ERROR
        | Parameter::COMMANDED_POSITION
        | Parameter::FIRMWARE
        | Parameter::EVENT_STATUS
        | Parameter::UPTIME
        | Parameter::TRAJECTORY_STATUS => Ok(Access::ReadRam),
        Parameter::MODEL | Parameter::SERIAL_NUMBER => Ok(Access::ReadFlash),
        _ => Err(ErrorCode::UnknownParameter),
    }
}

/// What flash holds when the amplifier leaves its commissioning.
pub(super) fn in_flash(config: &CopleyAmpConfig) -> BTreeMap<u16, i64> {
    let counts = |mm: f64| config.counts_of_um(mm * 1e3);
    let acceleration = counts(config.acceleration_mm_per_s2) / 10;
    [
        (Parameter::DESIRED_STATE, config.state_at_power_on),
        // Positive below negative: no limits.
        (Parameter::SOFT_LIMIT_POSITIVE, -1),
        (Parameter::SOFT_LIMIT_NEGATIVE, 1),
        (
            Parameter::FOLLOWING_ERROR_LIMIT,
            config.counts_of_um(config.following_error_limit_um),
        ),
        (
            Parameter::TRACKING_WINDOW,
            config.counts_of_um(config.tracking_window_um),
        ),
        (
            Parameter::TRACKING_WINDOW_TIME,
            config.tracking_window_time_ms,
        ),
        (Parameter::HOMING_METHOD, HomingMethod::Here.raw()),
        (
            Parameter::HOMING_SPEED_FAST,
            counts(config.speed_mm_per_s) * 10,
        ),
        (Parameter::HOMING_SPEED_SLOW, counts(config.speed_mm_per_s)),
        (Parameter::HOMING_ACCELERATION, acceleration),
        (Parameter::HOME_OFFSET, 0),
        (Parameter::PROFILE_TYPE, 256),
        (Parameter::POSITION_COMMAND, 0),
        (Parameter::SPEED, counts(config.speed_mm_per_s) * 10),
        (Parameter::ACCELERATION, acceleration),
        (Parameter::DECELERATION, acceleration),
        (
            Parameter::ABORT_DECELERATION,
            counts(config.abort_deceleration_mm_per_s2) / 10,
        ),
        (Parameter::BAUD, i64::from(BAUD_AT_RESET)),
    ]
    .into_iter()
    .map(|(parameter, value)| (parameter.0, value))
    .collect()
}

pub(super) fn get(
    amp: &Amp,
    now: Time,
    bank: Bank,
    parameter: Parameter,
    plant: &Plant,
) -> Result<String, ErrorCode> {
    match (access(parameter)?, bank) {
        (Access::Both(..), Bank::Flash) => return Ok(amp.flash(parameter).to_string()),
        (Access::Ram(..) | Access::ReadRam, Bank::Flash) | (Access::ReadFlash, Bank::Ram) => {
            return Err(ErrorCode::NotInThisBank);
        }
        (Access::Both(..) | Access::Ram(..) | Access::ReadRam, Bank::Ram)
        | (Access::ReadFlash, Bank::Flash) => {}
    }
    let position = amp.position(plant);
    Ok(match parameter {
        Parameter::MODEL => return Ok(amp.config.model.clone()),
        Parameter::SERIAL_NUMBER => i64::from(amp.config.serial_number),
        // Version 5.12.
        Parameter::FIRMWARE => 0x050C,
        Parameter::POSITION | Parameter::MOTOR_POSITION => position,
        Parameter::COMMANDED_POSITION => amp.commanded(now, plant),
        Parameter::FOLLOWING_ERROR => amp.commanded(now, plant) - position,
        Parameter::EVENT_STATUS => i64::from(amp.event_status(now, plant).bits()),
        Parameter::TRAJECTORY_STATUS => i64::from(amp.trajectory.bits()),
        Parameter::FAULTS => i64::from(amp.latched.bits()),
        Parameter::UPTIME => now.since(amp.booted_at).as_millis() as i64,
        // The processor's clock cannot make the rate exactly.
        Parameter::BAUD => {
            let rate = amp.ram(Parameter::BAUD);
            rate + rate / 3000
        }
        other => amp.ram(other),
    }
    .to_string())
}

pub(super) fn set(
    amp: &mut Amp,
    now: Time,
    bank: Bank,
    parameter: Parameter,
    value: i64,
    plant: &mut Plant,
) -> Result<(), ErrorCode> {
    let (low, high) = match (access(parameter)?, bank) {
        (Access::Both(low, high), _) | (Access::Ram(low, high), Bank::Ram) => (low, high),
        (Access::Ram(..), Bank::Flash) => return Err(ErrorCode::NotInThisBank),
        (Access::ReadRam | Access::ReadFlash, _) => return Err(ErrorCode::ReadOnly),
    };
    if !(low..=high).contains(&value) || !is_supported(parameter, value) {
        return Err(ErrorCode::OutOfRange);
    }
    if bank == Bank::Flash {
        amp.write_flash(parameter, value);
        return Ok(());
    }
    if parameter == Parameter::FAULTS {
        amp.clear_faults(Faults::from_bits_retain(value as u32));
        return Ok(());
    }
    amp.ram.insert(parameter.0, value);
    match parameter {
        Parameter::DESIRED_STATE => match DesiredState::from_raw(value) {
            DesiredState::ProgrammedPosition => amp.enable(now),
            DesiredState::Disabled | DesiredState::Unknown(_) => amp.disable(now, plant),
        },
        Parameter::BAUD => amp.set_new_rate(value as u32),
        _ => {}
    }
    Ok(())
}

/// Of a range with gaps.
const fn is_supported(parameter: Parameter, value: i64) -> bool {
    match parameter {
        Parameter::DESIRED_STATE => matches!(value, 0 | 21),
        Parameter::PROFILE_TYPE => matches!(value, 0 | 256),
        Parameter::HOMING_METHOD => {
            !matches!(HomingMethod::from_raw(value), HomingMethod::Unknown(_))
        }
        _ => true,
    }
}
