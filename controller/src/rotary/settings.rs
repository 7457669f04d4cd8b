//! Rotary axes, from the configuration's words to the driver's.

use core::time::Duration;
use std::collections::BTreeMap;

use compensator::rotary::{
    PeriodicCompensation, PeriodicInterpolation, PeriodicLimits, PeriodicTable,
};
use drivers::device::RotaryAxis;
use drivers::device::cia402::{
    Cia402Drive, Cia402Settings, Cia402Timeouts, Edge, LatchSettings, PositionRange, Turn,
};
use units::{Radians, RadiansPerSecond, RadiansPerSecondSquared, Scale};
use wire::Port;

use crate::config::{CanBus, MachineConfig};
use crate::failure::Failure;
use crate::hardware::drive::HOLD_SHARE;
use crate::hardware::drive::cia402::{home_offset, option_codes, patient_drive, stated_units};
use crate::hardware::kept_zero::KeptZeroConfig;
use crate::hardware::{CHECKED, millis};
use crate::rotary::failure::RotaryFailure;
use crate::rotary::{
    EdgeName, LineDetectorConfig, PeriodicInterpolationName, PositionRangeName,
    RotaryCompensationConfig, RotaryConfig, RotaryDevice,
};
use machine::Patience;
use machine::Unit;

pub(crate) fn rotaries(
    config: &MachineConfig,
    ports: &BTreeMap<String, Port>,
    patience: Patience,
) -> Vec<Unit<dyn RotaryAxis>> {
    config
        .rotary
        .iter()
        .map(|(name, rotary)| {
            let device: Box<dyn RotaryAxis> = match rotary.device {
                RotaryDevice::Cia402 => {
                    Cia402Drive::rotary(rotary_settings(rotary, &config.can, patience))
                }
            };
            Unit {
                name: name.clone(),
                port: ports[&rotary.node.bus],
                device,
            }
        })
        .collect()
}

/// The drive of a rotary axis, as its driver is told.
///
/// # Panics
/// When the configuration has not been checked.
pub fn rotary_settings(
    rotary: &RotaryConfig,
    can: &BTreeMap<String, CanBus>,
    patience: Patience,
) -> Cia402Settings<Radians> {
    let common = rotary.node.settings(can, patience);
    let per_s = |deg: f64| RadiansPerSecond(deg.to_radians());
    let per_s2 = |deg: f64| RadiansPerSecondSquared(deg.to_radians());
    let quick_stop = per_s2(rotary.quick_stop_deceleration_deg_per_s2);
    let acceleration = per_s2(rotary.acceleration_deg_per_s2);
    let usual = Cia402Settings::rotary(
        common,
        turn(rotary),
        per_s(rotary.speed_max_deg_per_s),
        acceleration.max(quick_stop),
    )
    .expect(CHECKED);
    let resolution = usual.scale.resolution();
    Cia402Settings {
        scale: Scale::new(if rotary.reverse {
            -resolution
        } else {
            resolution
        })
        .expect(CHECKED),
        latch: rotary.line_detector.as_ref().map(latch),
        following_error: Some((
            Radians::from_arcsec(rotary.following_error_limit_arcsec),
            millis(rotary.following_error_timeout_ms),
        )),
        position_window: Radians::from_arcsec(rotary.position_window_arcsec),
        position_window_time: millis(rotary.position_window_time_ms),
        hold_limit: Some(hold_limit(rotary)),
        quick_stop_deceleration: Some(quick_stop),
        homing_acceleration: acceleration,
        stall_max: patience.beyond(usual.common.sync_period),
        home_offset: home_offset(rotary.home_offset),
        reference_proof: rotary.kept_zero.as_ref().map(KeptZeroConfig::proof),
        stated_units: stated_units(rotary.speed_unit, rotary.acceleration_unit),
        options: option_codes(&rotary.option_codes, usual.options),
        timeouts: patient_drive(
            Cia402Timeouts {
                homing: index_limit(rotary).unwrap_or(usual.timeouts.homing),
                ..usual.timeouts
            },
            patience,
        ),
        ..usual
    }
}

/// How far it may be from where it stood while nothing turns it.
fn hold_limit(rotary: &RotaryConfig) -> Radians {
    let usual = HOLD_SHARE * rotary.following_error_limit_arcsec;
    let limit = rotary.hold_limit_arcsec.unwrap_or(usual);
    Radians::from_arcsec(limit.max(rotary.position_window_arcsec))
}

/// How long the index mark may be looked for: it comes once in a turn.
pub(crate) fn index_limit(rotary: &RotaryConfig) -> Option<Duration> {
    let speed = rotary.zero.as_ref()?.index_speed_deg_per_s;
    Some(Duration::from_secs_f64(10.0 + 2.0 * 360.0 / speed))
}

/// How a table is drawn between its lines; band-limited where nothing is said of it.
pub(crate) fn interpolation_of(config: Option<&RotaryCompensationConfig>) -> PeriodicInterpolation {
    match config.map(|it| it.interpolation) {
        Some(PeriodicInterpolationName::Linear) => PeriodicInterpolation::Linear,
        Some(PeriodicInterpolationName::BandLimited) | None => PeriodicInterpolation::BandLimited,
    }
}

/// The compensation of a rotary axis from its table, within the limits of the configuration.
///
/// # Errors
/// When it breaks a limit of size or slope.
pub(crate) fn periodic_compensation(
    config: &RotaryCompensationConfig,
    axis: &str,
    table: PeriodicTable,
) -> Result<PeriodicCompensation, Failure> {
    let interpolation = interpolation_of(Some(config));
    let limits = PeriodicLimits {
        size: Radians::from_arcsec(config.size_limit_arcsec),
        slope: config.slope_limit,
    };
    PeriodicCompensation::new(table, interpolation, limits).map_err(|source| {
        let axis = axis.to_owned();
        RotaryFailure::Compensation { axis, source }.into()
    })
}

const fn turn(rotary: &RotaryConfig) -> Turn {
    Turn {
        counts: rotary.counts_per_turn,
        range: match rotary.position_range {
            PositionRangeName::CountsOn => PositionRange::CountsOn,
            PositionRangeName::ToLastCount => PositionRange::ToLastCount,
            PositionRangeName::ToFirstCount => PositionRange::ToFirstCount,
        },
    }
}

const fn latch(detector: &LineDetectorConfig) -> LatchSettings {
    LatchSettings {
        edge: match detector.edge {
            EdgeName::Positive => Edge::Positive,
            EdgeName::Negative => Edge::Negative,
        },
        source: detector.input,
    }
}
