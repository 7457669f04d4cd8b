//! The drive's object dictionary (CiA 402-2) and its default PDOs.

use units::portable::log10;
use wire::canopen::pdo::MappedObject;
use wire::canopen::{Function, NodeId};

use super::config::Cia402DriveConfig;
use super::quirks::UnitObjects;
use crate::node::canopen_server::dictionary::{Access, Bounds, Dictionary, Entry, Kind, Mapping};
use crate::node::canopen_server::{Description, PdoDefault};

/// Servo drive, CiA 402.
const DEVICE_TYPE: u32 = 0x0002_0192;
/// PP, HM, CSP (CiA 402-2, 0x6502).
const SUPPORTED_MODES: i64 = 1 << 0 | 1 << 5 | 1 << 7;
/// The homing methods this drive knows.
const HOMING_METHODS: &[i64] = &[0, 17, 18, 35, 37];
const HOMING_METHODS_WITH_INDEX: &[i64] = &[0, 1, 2, 17, 18, 33, 34, 35, 37];
/// "increments" as an SI unit (CiA 303-2).
const UNIT_INCREMENTS: i64 = 0x00B5_0000;
/// "per second" in an SI unit.
const PER_SECOND: i64 = 0x0000_0300;
const PER_SECOND_SQUARED: i64 = 0x0000_5700;
/// Bytes of 0x2000, enough for a block upload of several blocks of ordinary clients.
const LOG_BYTES: usize = 889;
/// The most bytes 0x2001 takes.
const NOTEBOOK_BYTES: usize = 4096;

/// The values the drive itself owns.
pub(super) fn dictionary(config: &Cia402DriveConfig) -> Dictionary {
    let mut dictionary = Dictionary::default();
    insert_control(&mut dictionary, config);
    insert_positions(&mut dictionary, config);
    insert_profile(&mut dictionary, config);
    insert_homing(&mut dictionary, config);
    insert_factors(&mut dictionary, config);
    insert_range(&mut dictionary, config);
    insert_probe(&mut dictionary, config);
    insert_motor(&mut dictionary);
    insert_manufacturer(&mut dictionary);
    dictionary
}

fn transmit(kind: Kind) -> Entry {
    Entry::read_only(kind, 0).mapped(Mapping::Transmit)
}

fn both(kind: Kind, value: i64) -> Entry {
    Entry::read_write(kind, value).mapped(Mapping::Both)
}

fn option(known: &'static [i64], value: i64) -> Entry {
    Entry::read_write(Kind::I16, value).bounded(Bounds::OneOf(known))
}

fn positive(counts: i64) -> Entry {
    both(Kind::U32, counts).bounded(Bounds::Between(1, i64::from(u32::MAX)))
}

/// A speed in the drive's own unit.
fn speed(config: &Cia402DriveConfig, counts_per_s: i64) -> Entry {
    let value = in_units(counts_per_s, config.quirks.counts_per_speed());
    if !config.quirks.speeds_of_16_bits {
        return positive(value);
    }
    let most = i64::from(u16::MAX);
    both(Kind::U16, value.min(most)).bounded(Bounds::Between(1, most))
}

/// An acceleration in the drive's own unit.
fn acceleration(config: &Cia402DriveConfig, counts_per_s2: i64) -> Entry {
    let unit = config.quirks.counts_per_acceleration();
    positive(in_units(counts_per_s2, unit))
}

fn in_units(counts: i64, unit: f64) -> i64 {
    ((counts as f64 / unit).round() as i64).max(1)
}

fn insert_control(dictionary: &mut Dictionary, config: &Cia402DriveConfig) {
    use Kind::{I8, U16, U32};
    let abort = i64::from(config.abort_connection_option);
    dictionary.insert(0x6007, 0, option(&[0, 1, 2, 3], abort));
    dictionary.insert(0x603F, 0, transmit(U16));
    dictionary.insert(0x6040, 0, both(U16, 0));
    dictionary.insert(0x6041, 0, transmit(U16));
    let quick_stop = i64::from(config.quick_stop_option);
    dictionary.insert(0x605A, 0, option(&[0, 1, 2, 5, 6], quick_stop));
    dictionary.insert(0x605B, 0, option(&[0, 1], 0));
    dictionary.insert(0x605C, 0, option(&[0, 1], 1));
    dictionary.insert(0x605D, 0, option(&[1, 2], 1));
    dictionary.insert(0x605E, 0, option(&[0, 1, 2], 2));
    let left = config.quirks.left_mode;
    let modes: &[i64] = match left {
        Some(3) => &[0, 1, 3, 6, 8],
        _ => &[0, 1, 6, 8],
    };
    let mode = i64::from(left.unwrap_or(1));
    dictionary.insert(0x6060, 0, both(I8, mode).bounded(Bounds::OneOf(modes)));
    let display = Entry::read_only(I8, mode).mapped(Mapping::Transmit);
    dictionary.insert(0x6061, 0, display);
    dictionary.insert(0x6502, 0, Entry::constant(U32, SUPPORTED_MODES));
    dictionary.insert(0x60FD, 0, transmit(U32));
}

fn insert_positions(dictionary: &mut Dictionary, config: &Cia402DriveConfig) {
    use Kind::{I16, I32, U8, U16, U32};
    for index in [0x6062, 0x6063, 0x6064, 0x60F4, 0x60FC] {
        dictionary.insert(index, 0, transmit(I32));
    }
    let speed = match config.quirks.speeds_of_16_bits {
        true => I16,
        false => I32,
    };
    dictionary.insert(0x606B, 0, transmit(speed));
    dictionary.insert(0x606C, 0, transmit(speed));
    let power_on = config.power_on();
    dictionary.insert(0x6065, 0, both(U32, power_on.following_error_window));
    let timeout = i64::from(config.following_error_timeout_ms);
    dictionary.insert(0x6066, 0, both(U16, timeout));
    dictionary.insert(0x6067, 0, both(U32, power_on.position_window));
    let time = i64::from(config.position_window_time_ms);
    dictionary.insert(0x6068, 0, both(U16, time));
    dictionary.insert(0x6077, 0, transmit(I16));
    dictionary.insert(0x607A, 0, both(I32, 0));
    let limit = |value: i32| Entry::read_write(I32, i64::from(value));
    dictionary.insert_array(0x607D, vec![limit(i32::MIN), limit(i32::MAX)]);
    let polarity = Entry::read_write(U8, 0).bounded(Bounds::OneOf(&[0, 0x40, 0x80, 0xC0]));
    dictionary.insert(0x607E, 0, polarity);
    dictionary.insert(0x60B0, 0, both(I32, 0));
}

fn insert_profile(dictionary: &mut Dictionary, config: &Cia402DriveConfig) {
    use Kind::{I8, I32, U8};
    let power_on = config.power_on();
    dictionary.insert(0x607F, 0, speed(config, power_on.max_velocity));
    dictionary.insert(0x6081, 0, speed(config, power_on.velocity));
    dictionary.insert(0x6083, 0, acceleration(config, power_on.acceleration));
    dictionary.insert(0x6084, 0, acceleration(config, power_on.acceleration));
    let quick_stop = acceleration(config, power_on.quick_stop_deceleration);
    dictionary.insert(0x6085, 0, quick_stop);
    dictionary.insert(0x6086, 0, option(&[0], 0));
    let left = f64::from(config.quirks.left_velocity) / config.quirks.counts_per_speed();
    dictionary.insert(0x60FF, 0, both(I32, left.round() as i64));
    let units = Entry::read_write(U8, 0);
    let exponent = Entry::read_write(I8, -3).bounded(Bounds::Between(-6, 0));
    dictionary.insert_array(0x60C2, vec![units, exponent]);
    dictionary.insert(0x60F2, 0, Entry::read_write(Kind::U16, 0));
    dictionary.insert(0x6072, 0, both(Kind::U16, 1000));
    dictionary.insert(0x6402, 0, Entry::constant(Kind::U16, 0x000A));
}

fn insert_homing(dictionary: &mut Dictionary, config: &Cia402DriveConfig) {
    use Kind::{I8, I32};
    dictionary.insert(0x607C, 0, both(I32, 0));
    let methods = if config.has_index {
        HOMING_METHODS_WITH_INDEX
    } else {
        HOMING_METHODS
    };
    let method = both(I8, 0).bounded(Bounds::OneOf(methods));
    dictionary.insert(0x6098, 0, method);
    let power_on = config.power_on();
    let switch = speed(config, power_on.homing_switch_speed);
    let zero = speed(config, power_on.homing_zero_speed);
    dictionary.insert_array(0x6099, vec![switch, zero]);
    let homing = acceleration(config, power_on.homing_acceleration);
    dictionary.insert(0x609A, 0, homing);
    let known = methods[1..].iter();
    let known = known.map(|method| Entry::constant(I8, *method));
    dictionary.insert_array(0x60E3, known.collect());
}

/// Increments are the user unit, so that 0x6064 counts encoder increments; 0x60A8 says how
/// long one is wherever SI can say it. All ratios of the position factor are 1.
fn insert_factors(dictionary: &mut Dictionary, config: &Cia402DriveConfig) {
    use Kind::U32;
    const PER_TURN: i64 = 100_000;
    let ratio = |a: i64, b: i64| vec![Entry::read_write(U32, a), Entry::read_write(U32, b)];
    dictionary.insert_array(0x608F, ratio(PER_TURN, 1));
    dictionary.insert_array(0x6091, ratio(1, 1));
    dictionary.insert_array(0x6092, ratio(PER_TURN, 1));
    let (position, velocity) = match config.rotary {
        Some(_) => (UNIT_INCREMENTS, UNIT_INCREMENTS | PER_SECOND),
        None => units(config.encoder_resolution_nm),
    };
    dictionary.insert(0x60A8, 0, Entry::read_write(U32, position));
    let quirks = &config.quirks;
    if quirks.speed_unit.is_none() {
        dictionary.insert(0x60A9, 0, Entry::read_write(U32, velocity));
    }
    if quirks.acceleration_unit.is_none() {
        dictionary.insert(
            0x60AA,
            0,
            Entry::read_write(U32, position | PER_SECOND_SQUARED),
        );
    }
    insert_unit_objects(dictionary, &config.quirks.unit_objects);
}

/// What the drive says of its units of speed and acceleration.
fn insert_unit_objects(dictionary: &mut Dictionary, named: &UnitObjects) {
    use Kind::{I8, U8, U32};
    let objects = [
        (0x60A9, U32, named.si_velocity.map(i64::from)),
        (0x60AA, U32, named.si_acceleration.map(i64::from)),
        (0x608B, I8, named.velocity_notation.map(i64::from)),
        (0x608C, U8, named.velocity_dimension.map(i64::from)),
        (0x608D, I8, named.acceleration_notation.map(i64::from)),
        (0x608E, U8, named.acceleration_dimension.map(i64::from)),
    ];
    for (index, kind, value) in objects {
        if let Some(value) = value {
            dictionary.insert(index, 0, Entry::read_write(kind, value));
        }
    }
    if let Some(factor) = named.velocity_factor {
        let parts = factor.map(|part| Entry::read_write(U32, i64::from(part)));
        dictionary.insert_array(0x6096, parts.to_vec());
    }
}

/// 0x60A8 and 0x60A9 (CiA 303-2: prefix, numerator, denominator, 0): metre 0x01, second 0x03.
fn units(resolution_nm: f64) -> (i64, i64) {
    const METRE: i64 = 0x0001_0000;
    let exponent = log10(resolution_nm * 1e-9);
    let rounded = exponent.round();
    if (exponent - rounded).abs() > 1e-9 {
        return (UNIT_INCREMENTS, UNIT_INCREMENTS | PER_SECOND);
    }
    let prefix = i64::from((rounded as i8).cast_unsigned()) << 24;
    (prefix | METRE, prefix | METRE | PER_SECOND)
}

/// Where positions wrap; at power-on they count on.
fn insert_range(dictionary: &mut Dictionary, config: &Cia402DriveConfig) {
    if config.rotary.is_some() {
        let limit = || Entry::read_write(Kind::I32, 0);
        dictionary.insert_array(0x607B, vec![limit(), limit()]);
    }
}

fn insert_probe(dictionary: &mut Dictionary, config: &Cia402DriveConfig) {
    use Kind::{I16, I32, U16};
    let Some(probe) = config.touch_probe else {
        return;
    };
    let function = Entry::read_write(U16, 0).mapped(Mapping::Receive);
    dictionary.insert(0x60B8, 0, function);
    dictionary.insert(0x60B9, 0, transmit(U16));
    for index in 0x60BA..=0x60BD {
        dictionary.insert(index, 0, transmit(I32));
    }
    let source = |input| Entry::read_write(I16, input).bounded(Bounds::OneOf(&[1, 2]));
    dictionary.insert_array(0x60D0, vec![source(1), source(2)]);
    if probe.edge_counters {
        for index in 0x60D5..=0x60D8 {
            dictionary.insert(index, 0, transmit(U16));
        }
    }
}

fn insert_motor(dictionary: &mut Dictionary) {
    dictionary.insert(0x6403, 0, Entry::text("mock linear motor LM-60, ironless"));
    dictionary.insert(0x6404, 0, Entry::text("truestage"));
    dictionary.insert(0x6505, 0, Entry::text("https://example.invalid/mock-servo"));
}

/// Objects of more than a few bytes, for segmented and block transfers.
fn insert_manufacturer(dictionary: &mut Dictionary) {
    let log = (0..LOG_BYTES).map(|place| (place * 7 + place / 256) as u8);
    let log = Entry::octets(Access::ReadOnly, LOG_BYTES, log.collect());
    dictionary.insert(0x2000, 0, log);
    let notebook = Entry::octets(Access::ReadWrite, NOTEBOOK_BYTES, b"notebook".to_vec());
    dictionary.insert(0x2001, 0, notebook);
    // As many drives have them: numbers that mean nothing to it, and that it forgets without power.
    let variable = || Entry::read_write(Kind::U32, 0);
    dictionary.insert_array(0x2F00, vec![variable(), variable()]);
}

/// Communication objects; the default PDOs are those of EPOS4, so that a driver must remap.
pub(super) fn description(config: &Cia402DriveConfig, node: NodeId) -> Description {
    const OFF: u32 = 1 << 31;
    const NO_REMOTE: u32 = 1 << 30;
    let second = [(0x6060, 8), (0x607A, 32), (0x60FF, 32)];
    let receive = [Function::Rpdo2, Function::Rpdo3, Function::Rpdo4];
    let mut first = pdo(node, Function::Rpdo1, 0, 0, 0x6040, None);
    first.event_timer_ms = config.quirks.rpdo_deadline_ms;
    let mut rpdos = vec![first];
    for (function, extra) in receive.into_iter().zip(second) {
        rpdos.push(pdo(node, function, OFF, 0, 0x6040, Some(extra)));
    }
    let speed_bits = if config.quirks.speeds_of_16_bits {
        16
    } else {
        32
    };
    let second = [(0x6061, 8), (0x6064, 32), (0x606C, speed_bits)];
    let transmit = [Function::Tpdo2, Function::Tpdo3, Function::Tpdo4];
    let mut tpdos = vec![pdo(node, Function::Tpdo1, NO_REMOTE, 10, 0x6041, None)];
    for (function, extra) in transmit.into_iter().zip(second) {
        tpdos.push(pdo(node, function, NO_REMOTE, 10, 0x6041, Some(extra)));
    }
    Description {
        device_type: DEVICE_TYPE,
        device_name: config.device_name.clone(),
        hardware_version: config.hardware_version.clone(),
        software_version: config.software_version.clone(),
        identity: config.identity,
        heartbeat_ms: config.heartbeat_ms,
        rpdos,
        tpdos,
    }
}

fn pdo(
    node: NodeId,
    function: Function,
    flags: u32,
    inhibit_100us: u16,
    word: u16,
    extra: Option<(u16, u8)>,
) -> PdoDefault {
    let mut mapping = vec![MappedObject::new(word, 0, 16)];
    mapping.extend(extra.map(|(index, bits)| MappedObject::new(index, 0, bits)));
    PdoDefault {
        cob_id: flags | u32::from(node.cob_id(function)),
        transmission: 255,
        inhibit_100us,
        event_timer_ms: 0,
        mapping,
    }
}
