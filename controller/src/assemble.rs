//! From the configuration's words to the drivers' and the compensator's settings.
//!
//! Here, and nowhere else, units of configuration become SI, and drivers and compensator,
//! which do not know each other, meet. A further kind of device is one arm of a `match`.

mod copley;
mod cyclic;
mod parts;
mod patience;

use core::time::Duration;
use std::collections::BTreeMap;

pub use copley::copley_settings;
pub(crate) use parts::parts;
pub(crate) use patience::patient_drive;
pub(crate) use patience::patient_search;

use compensator::{hall_zero, length_correction};
use drivers::device::cia402::{
    Cia402Drive, Cia402Settings, Cia402Timeouts, HomeOffset, OptionCodes,
};
use drivers::device::copley::CopleyAxis;
use drivers::device::{Axis, Environment};
use machine::{Patience, Unit};
use units::{
    Celsius, Metres, MetresPerSecond, MetresPerSecondSquared, Pascals, RelativeHumidity, Scale,
    Volts,
};
use wire::Port;

use crate::config::{
    AxisConfig, CanBus, Cia402AxisConfig, DriveConfig, HomeOffsetName, MachineConfig,
    OptionCodesConfig,
};
use crate::hardware::node::node_settings;
use crate::hardware::{CHECKED, millis};
use crate::linear::ZeroConfig;

/// Port numbers by name: CAN buses first, then serial lines, each in the order of names.
pub fn ports(config: &MachineConfig) -> BTreeMap<String, Port> {
    config
        .can
        .keys()
        .chain(config.serial.keys())
        .zip(0..)
        .map(|(name, number)| (name.clone(), Port(number)))
        .collect()
}

pub(crate) fn axes(
    config: &MachineConfig,
    ports: &BTreeMap<String, Port>,
    patience: Patience,
) -> Vec<Unit<dyn Axis>> {
    config
        .axis
        .iter()
        .map(|(name, axis)| {
            let device = axis_device(axis, config, patience);
            Unit {
                name: name.clone(),
                port: ports[axis.port()],
                device,
            }
        })
        .collect()
}

/// The driver of an axis; the configuration has been checked.
pub fn axis_device(axis: &AxisConfig, config: &MachineConfig, patience: Patience) -> Box<dyn Axis> {
    match &axis.drive {
        DriveConfig::Cia402(drive) => {
            let settings = cia402_settings(axis, drive, &config.can[&drive.bus], patience);
            Box::new(Cia402Drive::new(settings))
        }
        DriveConfig::Copley(drive) => {
            let settings = copley_settings(axis, drive, &config.serial[&drive.line], patience);
            Box::new(CopleyAxis::new(settings))
        }
    }
}

pub(crate) const fn home_offset(name: HomeOffsetName) -> HomeOffset {
    match name {
        HomeOffsetName::PositionAtHome => HomeOffset::IsPositionAtHome,
        HomeOffsetName::ZeroFromHome => HomeOffset::IsZeroFromHome,
    }
}

pub(crate) fn option_codes(config: &OptionCodesConfig, usual: OptionCodes) -> OptionCodes {
    OptionCodes {
        quick_stop: config.quick_stop.or(usual.quick_stop),
        shutdown: config.shutdown.or(usual.shutdown),
        disable: config.disable.or(usual.disable),
        halt: config.halt.or(usual.halt),
        fault_reaction: config.fault_reaction.or(usual.fault_reaction),
        ..usual
    }
}

/// How long a drive may look for its limit switch, over twice the travel and some more.
pub(crate) fn reference_limit(zero: &ZeroConfig, axis: &AxisConfig) -> Duration {
    let travel_mm = axis.soft_max_mm - axis.soft_min_mm + 50.0;
    Duration::from_secs_f64(10.0 + 2.0 * travel_mm / zero.reference_speed_mm_per_s)
}

/// The drive of an axis, as its driver is told; the configuration has been checked.
pub fn cia402_settings(
    axis: &AxisConfig,
    can: &Cia402AxisConfig,
    bus: &CanBus,
    patience: Patience,
) -> Cia402Settings {
    let heartbeats = (
        can.heartbeat_producer_ms,
        can.heartbeat_consumer_ms,
        can.watch_master_ms,
    );
    let common = node_settings(can.node_id, bus, &can.identity, heartbeats, patience);
    let homing = axis.zero.as_ref().map(|zero| reference_limit(zero, axis));
    let scale = Scale::new(Metres(axis.resolution_nm * 1e-9)).expect(CHECKED);
    let speed_max = MetresPerSecond(axis.speed_max_mm_per_s * 1e-3);
    let acceleration = MetresPerSecondSquared(axis.acceleration_mm_per_s2 * 1e-3);
    let quick_stop = MetresPerSecondSquared(axis.quick_stop_deceleration_mm_per_s2 * 1e-3);
    let usual = Cia402Settings::new(common, scale, speed_max, acceleration.max(quick_stop));
    Cia402Settings {
        soft_limits: Some((
            Metres::from_mm(axis.soft_min_mm),
            Metres::from_mm(axis.soft_max_mm),
        )),
        following_error: Some((
            Metres::from_um(axis.following_error_limit_um),
            millis(can.following_error_timeout_ms),
        )),
        position_window: Metres::from_um(axis.position_window_um),
        position_window_time: millis(axis.position_window_time_ms),
        quick_stop_deceleration: Some(quick_stop),
        stall_max: patience.beyond(usual.common.sync_period),
        home_offset: home_offset(can.home_offset),
        options: option_codes(&can.option_codes, usual.options),
        synchronous_start: can.synchronous_start,
        timeouts: patient_drive(
            Cia402Timeouts {
                homing: homing.unwrap_or(usual.timeouts.homing),
                ..usual.timeouts
            },
            patience,
        ),
        ..usual
    }
}

/// The search's settings, in a frame whose zero is the nominal zero.
pub(crate) fn hall_settings(zero: &ZeroConfig, axis: &AxisConfig) -> hall_zero::Settings {
    let speed = MetresPerSecond(zero.search_speed_mm_per_s * 1e-3);
    hall_zero::Settings {
        vc: Volts(zero.level_below_peak_v),
        vc0: Volts(zero.turn_below_peak_v),
        delta1: Volts(zero.delta1_mv * 1e-3),
        delta2: Volts(zero.delta2_mv * 1e-3),
        delta3: Volts(zero.delta3_mv * 1e-3),
        delta4: Volts(zero.delta4_mv * 1e-3),
        samples: zero.samples,
        speed,
        creep_speed: speed * 0.1,
        search_limit: Metres::from_mm(zero.search_limit_mm),
        time_limit: Duration::from_secs_f64(zero.time_limit_s),
        soft_min: Metres::from_mm(axis.soft_min_mm),
        soft_max: Metres::from_mm(axis.soft_max_mm),
        rail_low: Volts(zero.rail_low_v),
        rail_high: Volts(zero.rail_high_v),
        noise: Volts(zero.noise_mv * 1e-3),
        ..hall_zero::Settings::default()
    }
}

/// What the instrument's sensors say, as the corrections take it. A silent sensor becomes NaN,
/// which they refuse by the sensor's name: no value is made up.
pub(crate) fn correction_environment(environment: &Environment) -> length_correction::Environment {
    length_correction::Environment {
        air_temperature: environment.air_temperature.unwrap_or(Celsius(f64::NAN)),
        pressure: environment.pressure.unwrap_or(Pascals(f64::NAN)),
        humidity: environment.humidity.unwrap_or(RelativeHumidity(f64::NAN)),
        material_temperature: environment
            .material_temperature
            .unwrap_or(Celsius(f64::NAN)),
    }
}
