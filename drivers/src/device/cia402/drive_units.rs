//! Units of speed and acceleration, as a drive states them.
//!
//! Source: CiA 402-2 (0x60A8 to 0x60AA), CiA DSP 402 V2.0 (0x608C, 0x6094 to 0x6097), codes of
//! units by CiA 303-2. Speeds are written in position units per second, so a drive that counts
//! otherwise is refused: its speeds and ramps would be wrong by a factor.
//!
//! A drive that states nothing counts as one in position units until its first motion, which is
//! measured (`trial`). Absent: conversions.

use wire::canopen::{NodeId, Object};
use wire::cia402::UnitCode;

use super::settings::StatedUnits;
use crate::device::DeviceError;
use crate::protocol::script::{Script, Step};

const SI_POSITION: Object = Object::new(0x60A8, 0);
const SI_VELOCITY: Object = Object::new(0x60A9, 0);
const SI_ACCELERATION: Object = Object::new(0x60AA, 0);
const VELOCITY_DIMENSION: Object = Object::new(0x608C, 0);

/// Prefix and numerator of a unit.
const WHAT: u32 = 0xFFFF_0000;
/// The denominator.
const PER: u32 = 0x0000_FF00;
const PER_SECOND: u32 = 0x0000_0300;
const PER_MINUTE: u32 = 0x0000_4700;
const INCREMENTS: u32 = 0x00B5_0000;

/// Dimensions of 0x608C that are no position units per second: turns and metres.
const OTHER_DIMENSIONS: [u32; 3] = [0xA3, 0xA4, 0xA6];

/// Ratios that turn units of the user into those of the drive, and what they are for.
const FACTORS: [(u16, &str); 4] = [
    (0x6094, "speed"),
    (0x6095, "speed"),
    (0x6096, "speed"),
    (0x6097, "acceleration"),
];

/// Reads what the drive states.
pub(super) fn description() -> impl Iterator<Item = Step> {
    const READING: &str = "reading its units";
    let named = [
        SI_POSITION,
        SI_VELOCITY,
        SI_ACCELERATION,
        VELOCITY_DIMENSION,
    ];
    let factors = FACTORS.into_iter();
    let factors = factors.flat_map(|(index, _)| [Object::new(index, 1), Object::new(index, 2)]);
    let objects = named.into_iter().chain(factors);
    objects.map(|object| Step::read(object, READING).informative())
}

/// Which units the drive states.
pub(super) fn stated(script: &Script) -> StatedUnits {
    let is_stated = |object| script.value(object).is_some_and(|raw| raw != 0);
    let has_factor = |wanted| {
        let mut factors = FACTORS.into_iter();
        factors.any(|(index, what)| what == wanted && is_stated(Object::new(index, 1)))
    };
    let speeds = is_stated(SI_VELOCITY) || is_stated(VELOCITY_DIMENSION);
    StatedUnits {
        speed: speeds || has_factor("speed"),
        acceleration: is_stated(SI_ACCELERATION) || has_factor("acceleration"),
    }
}

/// The unit that a drive counts in when it is `factor` times as fast as asked; `per_turn` are the
/// increments of a turn.
pub(super) fn fitting_unit(factor: f64, per_turn: Option<f64>) -> &'static str {
    let per_turn = per_turn.filter(|counts| *counts > 1.0);
    let turns = per_turn.map_or(f64::NAN, |counts| counts);
    let units = [
        (0.1, "a tenth of a count"),
        (10.0, "ten counts"),
        (1000.0, "counts and milliseconds"),
        (turns / 60.0, "turns and minutes"),
        (turns, "turns"),
    ];
    let fits = |unit: f64| (factor / unit - 1.0).abs() < 0.2;
    let unit = units.into_iter().find(|(unit, _)| fits(*unit));
    unit.map_or("a unit that is not known here", |(_, name)| name)
}

/// Whether speeds and accelerations in position units are what the drive takes.
pub(super) fn check(node: NodeId, script: &Script) -> Result<(), DeviceError> {
    let stated = |object| script.value(object).filter(|raw| *raw != 0);
    let refuse = |object, what, seen| {
        Err(DeviceError::WrongUnit {
            node,
            object,
            what,
            seen: UnitCode(seen),
        })
    };
    let position = stated(SI_POSITION).map_or(INCREMENTS, |raw| raw & WHAT);
    if let Some(velocity) = stated(SI_VELOCITY)
        && (velocity & WHAT != position || velocity & PER != PER_SECOND)
    {
        return refuse(SI_VELOCITY, "speed", velocity);
    }
    if let Some(acceleration) = stated(SI_ACCELERATION)
        && (acceleration & WHAT != position || acceleration & PER == PER_MINUTE)
    {
        return refuse(SI_ACCELERATION, "acceleration", acceleration);
    }
    if let Some(dimension) = stated(VELOCITY_DIMENSION)
        && OTHER_DIMENSIONS.contains(&dimension)
    {
        return refuse(VELOCITY_DIMENSION, "speed", dimension);
    }
    for (index, what) in FACTORS {
        let parts = [1, 2].map(|sub| stated(Object::new(index, sub)));
        if let [Some(above), Some(below)] = parts
            && above != below
        {
            let object = Object::new(index, 1);
            return Err(DeviceError::WrongFactor {
                node,
                object,
                what,
                above,
                below,
            });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::super::tests::{Rig, settings};
    use crate::device::DeviceError;

    /// How the start of a drive with these objects ends.
    fn checked(objects: &[(u16, u8, u32)]) -> Result<(), DeviceError> {
        let mut rig = Rig::with(settings());
        for (index, sub, value) in objects {
            rig.fake.node.set_u32(*index, *sub, *value);
        }
        rig.start()
    }

    #[track_caller]
    fn check_refused(objects: &[(u16, u8, u32)], part: &str) {
        let error = checked(objects).expect_err("another unit").to_string();
        assert!(error.contains(part), "{error}");
    }

    #[test]
    fn position_units_per_second_are_taken() {
        assert_eq!(checked(&[]), Ok(()), "nothing is stated");
        let micrometres = [
            (0x60A8, 0, 0xFA01_0000),
            (0x60A9, 0, 0xFA01_0300),
            (0x60AA, 0, 0xFA01_5700),
        ];
        assert_eq!(checked(&micrometres), Ok(()));
        assert_eq!(checked(&[(0x60A9, 0, 0x00B5_0300)]), Ok(()));
        let ones = [(0x6096, 1, 1), (0x6096, 2, 1), (0x608C, 0, 0xAC)];
        assert_eq!(checked(&ones), Ok(()));
    }

    /// EPOS4 Firmware Specification: 0x60A9 is 0x00B44700 and 0x60AA 0x00C00300 as delivered.
    #[test]
    fn a_drive_that_counts_turns_is_refused() {
        let increments = (0x60A8, 0, 0x00B5_0000);
        check_refused(
            &[increments, (0x60A9, 0, 0x00B4_4700)],
            "speed in another unit (turns/min, 0x00B44700)",
        );
        check_refused(
            &[increments, (0x60AA, 0, 0x00C0_0300)],
            "acceleration in another unit",
        );
        check_refused(&[(0x608C, 0, 0xA4)], "0x608C");
        // The same length, another power of ten.
        check_refused(
            &[(0x60A8, 0, 0xFA01_0000), (0x60A9, 0, 0xFD01_0300)],
            "1e-3 m/s",
        );
    }

    #[test]
    fn a_factor_is_refused() {
        check_refused(
            &[(0x6097, 1, 1 << 31), (0x6097, 2, 30_000_000)],
            "multiplies acceleration by 2147483648/30000000",
        );
    }
}
