//! What is read from and written to a drive at the start, as SDO steps.

use core::time::Duration;
use units::Coordinate;
use wire::canopen::Object;
use wire::canopen::pdo::{MappedObject, Transmission};
use wire::cia402::OperationMode;

use super::convert::{acceleration_counts, counts_i32, distance_counts, velocity_counts};
use super::settings::{Cia402Settings, PositionRange};
use super::{drive_units, latch};
use crate::device::canopen_node::millis;
use crate::device::{DeviceError, ReferenceProof};
use crate::protocol::pdo_setup::{Pdo, PdoDirection, PdoTooLong};
use crate::protocol::script::{Script, Step};

pub(super) const CONTROLWORD: MappedObject = MappedObject::new(0x6040, 0, 16);
pub(super) const STATUSWORD: MappedObject = MappedObject::new(0x6041, 0, 16);
pub(super) const MODE_DISPLAY: MappedObject = MappedObject::new(0x6061, 0, 8);
pub(super) const POSITION_ACTUAL: MappedObject = MappedObject::new(0x6064, 0, 32);
pub(super) const TARGET_POSITION: MappedObject = MappedObject::new(0x607A, 0, 32);
pub(super) const FOLLOWING_ERROR_ACTUAL: MappedObject = MappedObject::new(0x60F4, 0, 32);

pub(super) const MODE: Object = Object::new(0x6060, 0);
pub(super) const PROFILE_VELOCITY: Object = Object::new(0x6081, 0);
pub(super) const PROFILE_ACCELERATION: Object = Object::new(0x6083, 0);
pub(super) const PROFILE_DECELERATION: Object = Object::new(0x6084, 0);
pub(super) const HOME_OFFSET: Object = Object::new(0x607C, 0);
pub(super) const HOMING_METHOD: Object = Object::new(0x6098, 0);
pub(super) const HOMING_SPEED_SEARCH: Object = Object::new(0x6099, 1);
pub(super) const HOMING_SPEED_ZERO: Object = Object::new(0x6099, 2);
pub(super) const HOMING_ACCELERATION: Object = Object::new(0x609A, 0);

const SUPPORTED_MODES: Object = Object::new(0x6502, 0);
const ENCODER_INCREMENTS: Object = Object::new(0x608F, 1);
const ENCODER_REVOLUTIONS: Object = Object::new(0x608F, 2);
const GEAR_MOTOR: Object = Object::new(0x6091, 1);
const GEAR_SHAFT: Object = Object::new(0x6091, 2);
const FEED: Object = Object::new(0x6092, 1);
const FEED_REVOLUTIONS: Object = Object::new(0x6092, 2);

/// What is asked besides the identity.
pub(super) fn description<Q: Coordinate>(settings: &Cia402Settings<Q>) -> Vec<Step> {
    const FACTORS: &str = "reading its factors";
    let mut steps = vec![Step::read(SUPPORTED_MODES, "reading the modes it supports").optional()];
    let factors = [
        ENCODER_INCREMENTS,
        ENCODER_REVOLUTIONS,
        GEAR_MOTOR,
        GEAR_SHAFT,
        FEED,
        FEED_REVOLUTIONS,
    ];
    steps.extend(factors.map(|object| Step::read(object, FACTORS).optional()));
    steps.extend(drive_units::description());
    steps.extend(latch::description(settings));
    steps
}

/// The modes the drive supports (0x6502), where it says so.
pub(super) fn supported_modes(script: &Script) -> Option<u32> {
    script.value(SUPPORTED_MODES)
}

/// Encoder increments of a turn (0x608F), where the drive says so.
pub(super) fn increments_per_turn(script: &Script) -> Option<f64> {
    let (increments, turns) = (
        script.value(ENCODER_INCREMENTS)?,
        script.value(ENCODER_REVOLUTIONS)?,
    );
    (turns != 0).then(|| f64::from(increments) / f64::from(turns))
}

/// Whether the drive can do what is asked of it, in the units of the configuration.
pub(super) fn check_description<Q: Coordinate>(
    settings: &Cia402Settings<Q>,
    script: &Script,
) -> Result<(), DeviceError> {
    let node = settings.common.node;
    if let Some(modes) = script.value(SUPPORTED_MODES) {
        // Bit n - 1 stands for mode n: profile position 1, homing 6.
        const NEEDED: u32 = 1 << 0 | 1 << 5;
        if modes & NEEDED != NEEDED {
            return Err(DeviceError::WrongIdentity {
                node,
                what: "supported modes (0x6502; profile position and homing are needed)",
                expected: modes | NEEDED,
                seen: modes,
            });
        }
    }
    drive_units::check(node, script)?;
    let Some(increment) = settings.increment else {
        return Ok(());
    };
    let expected = increment / settings.scale.resolution().abs();
    let seen = units_per_increment(script);
    // Factors are ratios of integers: anything but rounding is another scale.
    if (seen / expected - 1.0).abs() < 1e-9 {
        Ok(())
    } else {
        Err(DeviceError::WrongScale {
            node,
            object: FEED,
            expected,
            seen,
        })
    }
}

/// Position units per encoder increment (CiA 402, 8.3.2): feed constant over encoder
/// resolution times gear ratio; 1 for a drive without these objects.
fn units_per_increment(script: &Script) -> f64 {
    let ratio = |above, below| match (script.value(above), script.value(below)) {
        (Some(above), Some(below)) if below != 0 => Some(f64::from(above) / f64::from(below)),
        _ => None,
    };
    let feed = ratio(FEED, FEED_REVOLUTIONS);
    let resolution = ratio(ENCODER_INCREMENTS, ENCODER_REVOLUTIONS);
    let gear = ratio(GEAR_MOTOR, GEAR_SHAFT).unwrap_or(1.0);
    match (feed, resolution) {
        (Some(feed), Some(resolution)) => feed / (resolution * gear),
        _ => 1.0,
    }
}

/// Limits, windows, options, PDOs, and profile position as the mode to begin with.
/// `counts_edges`: the drive counts the edges of its touch probe.
pub(super) fn configuration<Q: Coordinate>(
    settings: &Cia402Settings<Q>,
    counts_edges: bool,
) -> Result<Vec<Step>, DeviceError> {
    let mut steps =
        pdo_steps(settings, counts_edges).expect("the mappings below hold at most 8 bytes");
    steps.extend(range_steps(settings));
    steps.extend(latch::configuration(settings));
    steps.extend(limit_steps(settings)?);
    steps.extend(option_steps(settings));
    steps.push(Step::write(
        MODE,
        OperationMode::ProfilePosition.raw(),
        "choosing profile position",
    ));
    Ok(steps)
}

fn pdo_steps<Q: Coordinate>(
    settings: &Cia402Settings<Q>,
    counts_edges: bool,
) -> Result<Vec<Step>, PdoTooLong> {
    const SYNC: Transmission = Transmission::Synchronous(1);
    let node = settings.common.node;
    let pdo = |direction, number| Pdo::new(direction, number).expect("1 to 4");
    let receive = |number| pdo(PdoDirection::Receive, number);
    let transmit = |number| pdo(PdoDirection::Transmit, number);
    let sample = [STATUSWORD, POSITION_ACTUAL, MODE_DISPLAY];
    let mut steps = transmit(1).configure(node, &sample, SYNC)?;
    // Controlword and target in one frame: no bus can part the new target from its edge.
    let command = [CONTROLWORD, TARGET_POSITION];
    let taken_over = if settings.synchronous_start {
        SYNC
    } else {
        Transmission::Event
    };
    steps.extend(receive(1).configure(node, &command, taken_over)?);
    if settings.map_following_error {
        steps.extend(transmit(2).configure(node, &[FOLLOWING_ERROR_ACTUAL], SYNC)?);
    } else {
        steps.extend(transmit(2).disable(node));
    }
    for unused in [receive(2), receive(3), receive(4)] {
        steps.extend(unused.disable(node));
    }
    match latch::mapping(settings, counts_edges) {
        Some(latched) => steps.extend(transmit(3).configure(node, &latched, SYNC)?),
        None => steps.extend(transmit(3).disable(node)),
    }
    steps.extend(transmit(4).disable(node));
    Ok(steps)
}

/// Where the position of an endless axis wraps, and that targets are taken the shortest way.
fn range_steps<Q: Coordinate>(settings: &Cia402Settings<Q>) -> Vec<Step> {
    const TEXT: &str = "setting the position range of a turn";
    /// 0x60F2: bits 6 and 7 both set, the shortest way.
    const SHORTEST_WAY: u16 = 0x00C0;
    let Some(turn) = settings.turn else {
        return Vec::new();
    };
    let (minimum, maximum) = (Object::new(0x607B, 1), Object::new(0x607B, 2));
    let upper = match turn.range {
        // A drive without the object does what is wanted.
        PositionRange::CountsOn => {
            return vec![
                Step::check(minimum, 0_i32, TEXT).optional(),
                Step::check(maximum, 0_i32, TEXT).optional(),
            ];
        }
        PositionRange::ToLastCount => turn.counts - 1,
        PositionRange::ToFirstCount => turn.counts,
    };
    vec![
        Step::check(minimum, 0_i32, TEXT),
        Step::check(maximum, upper, TEXT),
        Step::check(
            Object::new(0x60F2, 0),
            SHORTEST_WAY,
            "choosing the shortest way",
        ),
    ]
}

fn limit_steps<Q: Coordinate>(settings: &Cia402Settings<Q>) -> Result<Vec<Step>, DeviceError> {
    let mut steps = Vec::new();
    if let Some((low, high)) = settings.soft_limits {
        const TEXT: &str = "setting the soft limits";
        let (minimum, maximum) = (Object::new(0x607D, 1), Object::new(0x607D, 2));
        let first = counts_i32(settings, minimum, "soft limit", low)?;
        let second = counts_i32(settings, maximum, "soft limit", high)?;
        // A negative scale turns the lower end into the higher count.
        steps.push(Step::check(minimum, first.min(second), TEXT));
        steps.push(Step::check(maximum, first.max(second), TEXT));
    }
    let window = |object, what, distance| distance_counts(settings, object, what, distance);
    if let Some((distance, time)) = settings.following_error {
        const TEXT: &str = "setting the following error window";
        let object = Object::new(0x6065, 0);
        let counts = window(object, "following error window", distance)?;
        steps.push(Step::check(object, counts, TEXT));
        steps.push(time_step(0x6066, time, TEXT));
    }
    let object = Object::new(0x6067, 0);
    let counts = window(object, "position window", settings.position_window)?;
    steps.push(Step::check(object, counts, "setting the position window"));
    steps.push(time_step(
        0x6068,
        settings.position_window_time,
        "setting the position window time",
    ));
    if let Some(deceleration) = settings.quick_stop_deceleration {
        let object = Object::new(0x6085, 0);
        let counts = acceleration_counts(settings, object, deceleration)?;
        steps.push(Step::check(
            object,
            counts,
            "setting the quick stop deceleration",
        ));
    }
    Ok(steps)
}

fn time_step(index: u16, time: Duration, text: &'static str) -> Step {
    Step::check(Object::new(index, 0), millis(time), text)
}

fn option_steps<Q: Coordinate>(settings: &Cia402Settings<Q>) -> Vec<Step> {
    let options = &settings.options;
    let codes = [
        (0x605A, options.quick_stop, "setting the quick stop option"),
        (0x605B, options.shutdown, "setting the shutdown option"),
        (0x605C, options.disable, "setting the disable option"),
        (0x605D, options.halt, "setting the halt option"),
        (0x605E, options.fault_reaction, "setting the fault reaction"),
        (
            0x6007,
            options.abort_connection,
            "setting the reaction to a lost master",
        ),
    ];
    codes
        .into_iter()
        .filter_map(|(index, code, text)| {
            code.map(|code| Step::check(Object::new(index, 0), code, text))
        })
        .collect()
}

/// The velocity, acceleration and deceleration of the moves to come.
pub(super) fn profile_steps(velocity: u32, acceleration: u32) -> Vec<Step> {
    const TEXT: &str = "setting velocity and acceleration";
    vec![
        Step::check(PROFILE_VELOCITY, velocity, TEXT),
        Step::check(PROFILE_ACCELERATION, acceleration, TEXT),
        Step::check(PROFILE_DECELERATION, acceleration, TEXT),
    ]
}

fn unmark<Q: Coordinate>(settings: &Cia402Settings<Q>) -> Option<Step> {
    let Some(ReferenceProof::Mark(object)) = settings.reference_proof else {
        return None;
    };
    let text = "clearing the mark of its zero before homing";
    Some(Step::check(object, 0_u32, text))
}

/// How fast a home is searched, in counts per second and per second squared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Search {
    pub(super) speed: u32,
    /// Of the search for the zero behind a switch.
    pub(super) zero_speed: u32,
    pub(super) acceleration: u32,
}

impl Search {
    pub(super) fn new<Q: Coordinate>(
        settings: &Cia402Settings<Q>,
        method: i8,
        speed: Q::Speed,
    ) -> Result<Self, DeviceError> {
        let speed = velocity_counts(settings, HOMING_SPEED_SEARCH, speed)?;
        let acceleration = settings.homing_acceleration;
        let acceleration = acceleration_counts(settings, HOMING_ACCELERATION, acceleration)?;
        // The search of a switch is followed by a slow one; that of an index pulse is the only one.
        let zero_speed = match method {
            33 | 34 => speed,
            _ => (speed / 5).max(1),
        };
        Ok(Self {
            speed,
            zero_speed,
            acceleration,
        })
    }
}

/// Homing parameters, then the mode.
pub(super) fn homing_steps<Q: Coordinate>(
    settings: &Cia402Settings<Q>,
    method: i8,
    offset: i32,
    search: Option<Search>,
) -> Vec<Step> {
    const TEXT: &str = "setting the homing parameters";
    // First of all: a homing that ends half-way must leave no mark of the zero before.
    let mut steps: Vec<Step> = unmark(settings).into_iter().collect();
    steps.extend([
        Step::check(HOME_OFFSET, offset, TEXT),
        Step::check(HOMING_METHOD, method, TEXT),
    ]);
    if let Some(search) = search {
        steps.push(Step::check(HOMING_SPEED_SEARCH, search.speed, TEXT));
        steps.push(Step::check(HOMING_SPEED_ZERO, search.zero_speed, TEXT));
        steps.push(Step::check(HOMING_ACCELERATION, search.acceleration, TEXT));
    }
    steps.push(Step::write(
        MODE,
        OperationMode::Homing.raw(),
        "choosing the homing mode",
    ));
    steps
}
