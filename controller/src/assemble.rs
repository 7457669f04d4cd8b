//! From the configuration's words to the drivers' and the compensator's settings.
//!
//! Here, and nowhere else, units of configuration become SI, and drivers and compensator,
//! which do not know each other, meet. A further kind of device is one arm of a `match`.

mod cia404;
mod copley;
mod cyclic;
mod parts;
mod patience;

use core::time::Duration;
use std::collections::BTreeMap;

pub use cia404::cia404_settings;
pub(crate) use cia404::voltage_digits;
pub use copley::copley_settings;
pub(crate) use parts::parts;
pub(crate) use patience::patient_drive;
pub(crate) use patience::patient_search;
use patience::{patient_node, patient_pdos};

use compensator::hall_zero;
use compensator::length_correction::{
    self, Cosine, DeadPath, EnvironmentUncertainty, MaterialExpansion,
};
use drivers::device::canopen_node::{ExpectedIdentity, NodeSettings};
use drivers::device::cia401::{ChannelSettings, Cia401Analog, Cia401Settings};
use drivers::device::cia402::{
    Cia402Drive, Cia402Settings, Cia402Timeouts, HomeOffset, OptionCodes,
};
use drivers::device::cia404::Cia404Analog;
use drivers::device::copley::CopleyAxis;
use drivers::device::dcon::{Dcon, DconSettings, InputRange};
use drivers::device::umd2::{Direction, Umd2, Umd2Settings};
use drivers::device::{AnalogInput, Axis, DisplacementInstrument, Environment};
use machine::{Patience, Unit};
use units::{
    Celsius, Metres, MetresPerSecond, MetresPerSecondSquared, Pascals, Radians, RelativeHumidity,
    Scale, Volts,
};
use wire::Port;
use wire::canopen::NodeId;

use crate::config::{
    AnalogConfig, AxisConfig, CanBus, Cia402AxisConfig, DconConfig, DriveConfig, HomeOffsetName,
    IdentityConfig, InstrumentConfig, InstrumentDevice, MachineConfig, ModuleConfig, NodeConfig,
    OptionCodesConfig,
};
use crate::linear::ZeroConfig;

/// Carbon dioxide in the air of a hall; its share in the index of air is below 1e-8.
const CO2_UMOL_PER_MOL: f64 = 450.0;
/// Relative standard uncertainty of a stabilised HeNe laser's wavelength.
const WAVELENGTH_U: f64 = 2e-8;
pub(crate) const CHECKED: &str = "the configuration was checked when it was loaded";

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

pub(crate) fn analogs(
    config: &MachineConfig,
    ports: &BTreeMap<String, Port>,
    patience: Patience,
) -> Vec<Unit<dyn AnalogInput>> {
    config
        .analog
        .iter()
        .map(|(name, analog)| {
            let device: Box<dyn AnalogInput> = match &analog.module {
                ModuleConfig::Cia401(node) => {
                    let bus = &config.can[&node.bus];
                    let settings = cia401_settings(analog, node, bus, patience);
                    Box::new(Cia401Analog::new(settings))
                }
                ModuleConfig::Cia404(module) => {
                    let bus = &config.can[&module.node.bus];
                    let settings = cia404_settings(analog, module, bus, patience);
                    Box::new(Cia404Analog::new(settings))
                }
                ModuleConfig::Dcon(module) => {
                    Box::new(Dcon::new(dcon_settings(analog, module, patience)))
                }
            };
            Unit {
                name: name.clone(),
                port: ports[analog.port()],
                device,
            }
        })
        .collect()
}

pub(crate) fn instruments(
    config: &MachineConfig,
    ports: &BTreeMap<String, Port>,
    patience: Patience,
) -> Vec<Unit<dyn DisplacementInstrument>> {
    config
        .instrument
        .iter()
        .map(|(name, instrument)| {
            let device: Box<dyn DisplacementInstrument> = match instrument.device {
                InstrumentDevice::Umd2 => Box::new(Umd2::new(umd2_settings(instrument, patience))),
            };
            Unit {
                name: name.clone(),
                port: ports[&instrument.line],
                device,
            }
        })
        .collect()
}

fn node_id(raw: u8) -> NodeId {
    NodeId::new(raw).expect(CHECKED)
}

pub(crate) const fn millis(ms: u16) -> Duration {
    Duration::from_millis(ms as u64)
}

pub(crate) fn node_settings(
    node: u8,
    bus: &CanBus,
    identity: &IdentityConfig,
    heartbeat_ms: (u16, u16, u16),
    patience: Patience,
) -> NodeSettings {
    let sync_period = bus.sync_period();
    let (producer, consumer, watch_master) = heartbeat_ms;
    let usual = NodeSettings::new(node_id(node), node_id(bus.master_node_id), sync_period);
    NodeSettings {
        expected: expected_identity(identity),
        heartbeat_period: millis(producer),
        consumer_time: patience.of(millis(consumer)),
        // 0x1016 has 16 bits of milliseconds.
        master_consumer_time: patience.of(millis(watch_master)).min(millis(u16::MAX)),
        missed_pdos_max: patient_pdos(&usual, millis(consumer), patience),
        timeouts: patient_node(usual.timeouts, patience),
        ..usual
    }
}

fn expected_identity(identity: &IdentityConfig) -> ExpectedIdentity {
    ExpectedIdentity {
        device_type: Some(identity.device_type),
        vendor: Some(identity.vendor_id),
        product: Some(identity.product_code),
        revision: identity.revision,
        serial: identity.serial_number,
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

/// What every module on CAN is told; the configuration has been checked.
pub(crate) fn module_settings(node: &NodeConfig, bus: &CanBus, patience: Patience) -> NodeSettings {
    let heartbeats = (
        node.heartbeat_producer_ms,
        node.heartbeat_consumer_ms,
        node.watch_master_ms,
    );
    node_settings(node.node_id, bus, &node.identity, heartbeats, patience)
}

/// A CiA 401 module, as its driver is told; the configuration has been checked.
///
/// # Panics
/// With more channels than a process data object has.
pub fn cia401_settings(
    analog: &AnalogConfig,
    node: &NodeConfig,
    bus: &CanBus,
    patience: Patience,
) -> Cia401Settings {
    let common = module_settings(node, bus, patience);
    let channels: Vec<_> = analog
        .channels
        .iter()
        .zip(&analog.full_scale_v)
        .map(|(channel, volts)| ChannelSettings {
            input: channel + 1,
            full_scale: Volts(*volts),
        })
        .collect();
    Cia401Settings::new(common, &channels).expect(CHECKED)
}

/// The one input range that all channels of a DCON module have.
pub(crate) fn dcon_range(full_scale_v: &[f64]) -> Option<InputRange> {
    let (first, rest) = full_scale_v.split_first()?;
    let all_same = rest.iter().all(|volts| volts == first);
    InputRange::ending_at(Volts(*first)).filter(|_| all_same)
}

/// A DCON module, as its driver is told; the configuration has been checked.
///
/// # Panics
/// When its channels have different ranges.
pub fn dcon_settings(
    analog: &AnalogConfig,
    module: &DconConfig,
    patience: Patience,
) -> DconSettings {
    let (period, address) = (module.poll_period_ms, module.address);
    let range = dcon_range(&analog.full_scale_v).expect(CHECKED);
    let usual = DconSettings::new(address, range, analog.channels.clone());
    DconSettings {
        checksum: module.checksum,
        period: Duration::from_secs_f64(period * 1e-3),
        answer_timeout: patience.of(usual.answer_timeout),
        stale_after: patience.of(usual.stale_after),
        ..usual
    }
}

/// A µMD interferometer, as its driver is told.
pub fn umd2_settings(instrument: &InstrumentConfig, patience: Patience) -> Umd2Settings {
    let usual = Umd2Settings::default();
    Umd2Settings {
        optics_factor: instrument.optics_factor,
        direction: if instrument.reverse {
            Direction::Reversed
        } else {
            Direction::AsCounted
        },
        sample_rate_hz: instrument.sample_rate_hz,
        stream_timeout: patience.of(usual.stream_timeout),
        start_timeout: patience.of(usual.start_timeout),
        environment_age_max: patience.of(usual.environment_age_max),
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

/// What an instrument's counter counts.
pub(crate) fn half_wavelength(instrument: &InstrumentConfig) -> Metres {
    Umd2Settings::default().vacuum_wavelength / (2.0 * f64::from(instrument.optics_factor))
}

/// Which corrections an instrument's readings get.
pub(crate) fn correction_settings(instrument: &InstrumentConfig) -> length_correction::Settings {
    let material = MaterialExpansion {
        per_kelvin: instrument.expansion_per_kelvin,
        u_per_kelvin: instrument.expansion_per_kelvin.abs() * 0.1,
    };
    let dead_path = DeadPath {
        length: Metres::from_mm(instrument.dead_path_mm),
        u_length: Metres::from_mm(1.0),
    };
    let cosine = Cosine {
        angle: Radians(instrument.misalignment_mrad * 1e-3),
        u_angle: Radians(0.2e-3),
    };
    length_correction::Settings {
        air: instrument.correct_air,
        vacuum_wavelength: Umd2Settings::default().vacuum_wavelength,
        u_relative_wavelength: WAVELENGTH_U,
        co2_umol_per_mol: CO2_UMOL_PER_MOL,
        material_expansion: instrument.correct_material.then_some(material),
        dead_path: (instrument.correct_dead_path && instrument.correct_air).then_some(dead_path),
        cosine: instrument.correct_cosine.then_some(cosine),
        u_environment: EnvironmentUncertainty {
            air_temperature: Celsius(0.1),
            pressure: Pascals(20.0),
            humidity: RelativeHumidity(0.03),
            material_temperature: Celsius(0.1),
            co2_umol_per_mol: 100.0,
        },
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
