//! SI quantities to the drive's integers; what does not fit is an error, never clamped.

use units::{Metres, MetresPerSecond, MetresPerSecondSquared};

use super::settings::Cia402Settings;
use crate::device::DeviceError;
use crate::wire::canopen::Object;

fn out_of_range(
    settings: &Cia402Settings,
    object: Object,
    what: &'static str,
    value: f64,
    limit: f64,
) -> DeviceError {
    DeviceError::OutOfRange {
        node: settings.common.node,
        object,
        what,
        value,
        limit,
    }
}

/// A position in drive coordinates.
pub(super) fn counts_i32(
    settings: &Cia402Settings,
    object: Object,
    what: &'static str,
    position: Metres,
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
            position.value(),
            limit.value(),
        )),
    }
}

/// A positive number of position units (per second, per second squared), at least 1.
fn positive(
    settings: &Cia402Settings,
    object: Object,
    what: &'static str,
    value: f64,
    limit: f64,
) -> Result<u32, DeviceError> {
    let unit = settings.scale.resolution().abs().value();
    let counts = (value / unit).round();
    // Drives hold these in 32 bits, some of them signed.
    if value > 0.0 && value <= limit && counts <= f64::from(i32::MAX) {
        Ok((counts as u32).max(1))
    } else {
        Err(out_of_range(settings, object, what, value, limit))
    }
}

pub(super) fn length_counts(
    settings: &Cia402Settings,
    object: Object,
    what: &'static str,
    length: Metres,
) -> Result<u32, DeviceError> {
    positive(settings, object, what, length.value(), f64::MAX)
}

pub(super) fn velocity_counts(
    settings: &Cia402Settings,
    object: Object,
    speed: MetresPerSecond,
) -> Result<u32, DeviceError> {
    let limit = settings.speed_max.value();
    positive(settings, object, "speed", speed.value(), limit)
}

pub(super) fn acceleration_counts(
    settings: &Cia402Settings,
    object: Object,
    acceleration: MetresPerSecondSquared,
) -> Result<u32, DeviceError> {
    let limit = settings.acceleration_max.value();
    let value = acceleration.value();
    positive(settings, object, "acceleration", value, limit)
}
