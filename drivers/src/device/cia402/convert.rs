//! SI quantities to the drive's integers; what does not fit is an error, never clamped.

use units::{Coordinate, Quantity};
use wire::canopen::Object;

use super::settings::Cia402Settings;
use crate::device::DeviceError;

/// Beyond this a float no longer tells one count from the next.
pub(super) const EXACT_COUNTS: i64 = 1 << 52;

/// `value` and `limit` in SI units, `unit` what a person reads them in.
pub(super) fn out_of_range<Q: Coordinate>(
    settings: &Cia402Settings<Q>,
    object: Object,
    what: &'static str,
    (value, limit): (f64, f64),
    unit: &'static str,
) -> DeviceError {
    DeviceError::OutOfRange {
        node: settings.common.node,
        object,
        what,
        value: Q::in_unit(value),
        limit: Q::in_unit(limit),
        unit,
    }
}

/// A position in drive coordinates.
pub(super) fn counts_i32<Q: Coordinate>(
    settings: &Cia402Settings<Q>,
    object: Object,
    what: &'static str,
    position: Q,
) -> Result<i32, DeviceError> {
    let limit = settings.scale.resolution().abs() * f64::from(i32::MAX);
    let fits = position.is_finite() && position.abs() <= limit;
    let counts = settings.scale.to_counts(position).0;
    match i32::try_from(counts) {
        Ok(counts) if fits => Ok(counts),
        Ok(_) | Err(_) => Err(out_of_range(
            settings,
            object,
            what,
            (position.value(), limit.value()),
            Q::UNIT,
        )),
    }
}

/// A position of an axis that may have turned any number of times.
pub(super) fn position_counts<Q: Coordinate>(
    settings: &Cia402Settings<Q>,
    object: Object,
    what: &'static str,
    position: Q,
) -> Result<i64, DeviceError> {
    if settings.turn.is_none() {
        return counts_i32(settings, object, what, position).map(i64::from);
    }
    let limit = settings.scale.resolution().abs() * EXACT_COUNTS as f64;
    if position.is_finite() && position.abs() <= limit {
        return Ok(settings.scale.to_counts(position).0);
    }
    let range = (position.value(), limit.value());
    Err(out_of_range(settings, object, what, range, Q::UNIT))
}

/// A positive number of position units (per second, per second squared), at least 1.
fn positive<Q: Coordinate>(
    settings: &Cia402Settings<Q>,
    object: Object,
    what: &'static str,
    (value, limit): (f64, f64),
    unit: &'static str,
) -> Result<u32, DeviceError> {
    let count = settings.scale.resolution().abs().value();
    let counts = (value / count).round();
    // Drives hold these in 32 bits, some of them signed.
    let limit = limit.min(f64::from(i32::MAX) * count);
    if value > 0.0 && value <= limit && counts <= f64::from(i32::MAX) {
        Ok((counts as u32).max(1))
    } else {
        Err(out_of_range(settings, object, what, (value, limit), unit))
    }
}

pub(super) fn distance_counts<Q: Coordinate>(
    settings: &Cia402Settings<Q>,
    object: Object,
    what: &'static str,
    distance: Q,
) -> Result<u32, DeviceError> {
    let range = (distance.value(), f64::MAX);
    positive(settings, object, what, range, Q::UNIT)
}

pub(super) fn velocity_counts<Q: Coordinate>(
    settings: &Cia402Settings<Q>,
    object: Object,
    speed: Q::Speed,
) -> Result<u32, DeviceError> {
    let range = (speed.value(), settings.speed_max.value());
    positive(settings, object, "speed", range, Q::SPEED_UNIT)
}

pub(super) fn acceleration_counts<Q: Coordinate>(
    settings: &Cia402Settings<Q>,
    object: Object,
    acceleration: Q::Acceleration,
) -> Result<u32, DeviceError> {
    let range = (acceleration.value(), settings.acceleration_max.value());
    positive(
        settings,
        object,
        "acceleration",
        range,
        Q::ACCELERATION_UNIT,
    )
}
