//! SI quantities to the amplifier's integers; what does not fit is an error, never clamped.

use units::{Coordinate, Counts, Quantity};
use wire::copley::Parameter;

use super::settings::CopleySettings;
use crate::device::{DeviceError, DeviceName};

/// `value` and `limit` in SI units, `unit` what a person reads them in.
pub(super) fn out_of_range<Q: Coordinate>(
    settings: &CopleySettings<Q>,
    parameter: Parameter,
    what: &'static str,
    (value, limit): (f64, f64),
    unit: &'static str,
) -> DeviceError {
    DeviceError::ParameterOutOfRange {
        device: DeviceName::Amplifier(settings.address),
        parameter,
        what,
        value: Q::in_unit(value),
        limit: Q::in_unit(limit),
        unit,
    }
}

/// A coordinate in counts of the amplifier, whose 0 has the coordinate `origin`.
pub(super) fn amplifier_counts<Q: Coordinate>(
    settings: &CopleySettings<Q>,
    parameter: Parameter,
    what: &'static str,
    coordinate: Q,
    origin: Counts,
) -> Result<i64, DeviceError> {
    let limit = settings.scale.resolution().abs() * f64::from(i32::MAX);
    let fits = coordinate.is_finite() && coordinate.abs() <= limit;
    let counts = settings.scale.to_counts(coordinate) - origin;
    if fits && i32::try_from(counts.0).is_ok() {
        return Ok(counts.0);
    }
    let range = (coordinate.value(), limit.value());
    Err(out_of_range(settings, parameter, what, range, Q::UNIT))
}

/// A positive number of `per_count` counts (per second, per second squared), at least 1.
fn positive<Q: Coordinate>(
    settings: &CopleySettings<Q>,
    parameter: Parameter,
    (what, unit): (&'static str, &'static str),
    (value, limit): (f64, f64),
    per_count: f64,
) -> Result<i64, DeviceError> {
    let count = settings.scale.resolution().abs().value();
    let number = (value / count * per_count).round();
    let limit = limit.min(f64::from(i32::MAX) * count / per_count);
    if value > 0.0 && value <= limit && number <= f64::from(i32::MAX) {
        return Ok((number as i64).max(1));
    }
    Err(out_of_range(
        settings,
        parameter,
        what,
        (value, limit),
        unit,
    ))
}

pub(super) fn length<Q: Coordinate>(
    settings: &CopleySettings<Q>,
    parameter: Parameter,
    what: &'static str,
    length: Q,
) -> Result<i64, DeviceError> {
    let text = (what, Q::UNIT);
    positive(settings, parameter, text, (length.value(), f64::MAX), 1.0)
}

/// In 0.1 counts/s.
pub(super) fn speed<Q: Coordinate>(
    settings: &CopleySettings<Q>,
    parameter: Parameter,
    speed: Q::Speed,
) -> Result<i64, DeviceError> {
    let range = (speed.value(), settings.speed_max.value());
    positive(settings, parameter, ("speed", Q::SPEED_UNIT), range, 10.0)
}

/// In 10 counts/s².
pub(super) fn acceleration<Q: Coordinate>(
    settings: &CopleySettings<Q>,
    parameter: Parameter,
    acceleration: Q::Acceleration,
) -> Result<i64, DeviceError> {
    let range = (acceleration.value(), settings.acceleration_max.value());
    let text = ("acceleration", Q::ACCELERATION_UNIT);
    positive(settings, parameter, text, range, 0.1)
}
