//! From the configuration's words to a machine's parts and the compensator's settings; what a device is told
//! is in its family's file (`hardware/`).

mod parts;
mod patience;

use core::time::Duration;
use std::collections::BTreeMap;

pub(crate) use parts::parts;
pub(crate) use patience::patient_search;

use compensator::{hall_zero, length_correction};
use drivers::device::Environment;
use units::{Celsius, Metres, MetresPerSecond, Pascals, RelativeHumidity, Volts};
use wire::Port;

use crate::config::{MachineConfig, MotionConfig};
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

/// The search's settings, in a frame whose zero is the nominal zero.
pub(crate) fn hall_settings(zero: &ZeroConfig, axis: &MotionConfig) -> hall_zero::Settings {
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
