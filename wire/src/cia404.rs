//! What the numbers of a CiA 404 measuring device mean: sensor types, units, status.
//!
//! Source: CiA 404 (analogue input function block) and CiA 303-2 (units: a power of ten, a unit
//! in the numerator, one in the denominator), as the EDS and manuals of such modules show them:
//! SYS TEC IO-X7 (thermocouples, 0x7130, 0x6126, 0x6131), esd CAN-CBX-Pt100 and -THERMO (0x6110,
//! 0x6131, 0x6150). Objects 0x6nnn hold REAL32, 0x7nnn INTEGER16 and 0x9nnn INTEGER32 of the same
//! value.
use units::portable::powi;

/// The profile number in 0x1000.
pub const PROFILE: u16 = 404;
/// 0x1000 of a device with analog inputs: bit 17 says which function block it has.
pub const DEVICE_TYPE_ANALOG_INPUT: u32 = 1 << 17 | PROFILE as u32;

/// AI sensor type, 0x6110.
pub const SENSOR_TYPE: u16 = 0x6110;
/// AI operation mode, 0x6112: 0 off, 1 normal.
pub const OPERATION_MODE: u16 = 0x6112;
/// AI scaling factor, 0x6126, REAL32.
pub const SCALING_FACTOR: u16 = 0x6126;
/// AI scaling offset, 0x6127, REAL32.
pub const SCALING_OFFSET: u16 = 0x6127;
/// AI physical unit of the process value, 0x6131.
pub const PHYSICAL_UNIT: u16 = 0x6131;
/// AI decimal digits of the process value, 0x6132: how many stand behind the point.
pub const DECIMAL_DIGITS: u16 = 0x6132;
/// AI status, 0x6150.
pub const STATUS: u16 = 0x6150;
/// AI input, field value as INTEGER16, 0x7100.
pub const FIELD_VALUE: u16 = 0x7100;
/// AI input, process value as INTEGER16, 0x7130.
pub const PROCESS_VALUE: u16 = 0x7130;
/// AI interrupt delta of the process value as INTEGER16, 0x7133.
pub const INTERRUPT_DELTA: u16 = 0x7133;

/// "Normal operation" in [`OPERATION_MODE`].
pub const MODE_NORMAL: u8 = 1;

/// What is wired to an input (0x6110).
///
/// # Example
///
/// ```
/// use wire::cia404::SensorType;
///
/// assert_eq!(SensorType::from_raw(30), SensorType::Pt100);
/// assert_eq!(SensorType::Voltage.raw(), 0x28);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum SensorType {
    /// Nothing yet.
    Unset,
    /// A platinum resistor of 100 Ω at 0 °C.
    Pt100,
    /// A voltage.
    Voltage,
    /// Another one.
    Unknown(u16),
}

impl SensorType {
    /// From the object's value.
    pub const fn from_raw(raw: u16) -> Self {
        match raw {
            0 => Self::Unset,
            30 => Self::Pt100,
            40 => Self::Voltage,
            other => Self::Unknown(other),
        }
    }

    /// The object's value.
    pub const fn raw(self) -> u16 {
        match self {
            Self::Unset => 0,
            Self::Pt100 => 30,
            Self::Voltage => 40,
            Self::Unknown(raw) => raw,
        }
    }
}

/// A unit of CiA 303-2.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Unit {
    /// V.
    Volt,
    /// °C.
    Celsius,
    /// Another one.
    Unknown(u8),
}

impl Unit {
    const fn from_raw(raw: u8) -> Self {
        match raw {
            0x26 => Self::Volt,
            0x2D => Self::Celsius,
            other => Self::Unknown(other),
        }
    }

    const fn raw(self) -> u8 {
        match self {
            Self::Volt => 0x26,
            Self::Celsius => 0x2D,
            Self::Unknown(raw) => raw,
        }
    }
}

/// A unit with its prefix (0x6131).
///
/// # Example
///
/// ```
/// use wire::cia404::{PhysicalUnit, Unit};
///
/// let microvolt = PhysicalUnit::from_raw(0xFA26_0000);
/// assert_eq!(microvolt, PhysicalUnit::of(-6, Unit::Volt));
/// assert_eq!(PhysicalUnit::MILLIVOLT.raw(), 0xFD26_0000);
/// let volts_per_count = PhysicalUnit::MILLIVOLT.per_count(1);
/// assert!((volts_per_count - 1e-4).abs() < 1e-16);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct PhysicalUnit {
    /// The power of ten that the prefix stands for.
    pub exponent: i8,
    /// What is counted.
    pub unit: Unit,
    /// What it is per, as its code; 0 for nothing.
    pub per: u8,
}

impl PhysicalUnit {
    /// mV.
    pub const MILLIVOLT: Self = Self::of(-3, Unit::Volt);
    /// °C.
    pub const CELSIUS: Self = Self::of(0, Unit::Celsius);

    /// A unit that is per nothing.
    pub const fn of(exponent: i8, unit: Unit) -> Self {
        Self {
            exponent,
            unit,
            per: 0,
        }
    }

    /// From the object's value; its lowest byte is reserved.
    pub const fn from_raw(raw: u32) -> Self {
        let [_, per, unit, exponent] = raw.to_le_bytes();
        Self {
            exponent: exponent.cast_signed(),
            unit: Unit::from_raw(unit),
            per,
        }
    }

    /// The object's value.
    pub const fn raw(self) -> u32 {
        u32::from_le_bytes([0, self.per, self.unit.raw(), self.exponent.cast_unsigned()])
    }

    /// How much of the unit, without its prefix, one count of a value with so many decimal
    /// digits is.
    pub fn per_count(self, decimal_digits: u8) -> f64 {
        powi(10.0, i32::from(self.exponent) - i32::from(decimal_digits))
    }
}

/// What is wrong with an input (0x6150).
///
/// # Example
///
/// ```
/// use wire::cia404::InputStatus;
///
/// let status = InputStatus(3);
/// assert_eq!(status, InputStatus::NOT_VALID.and(InputStatus::POSITIVE_OVERLOAD));
/// assert!(!status.contains(InputStatus::NEGATIVE_OVERLOAD));
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct InputStatus(pub u8);

impl InputStatus {
    /// The value means nothing: no sensor, or what an overload has left.
    pub const NOT_VALID: Self = Self(1 << 0);
    /// More than can be measured.
    pub const POSITIVE_OVERLOAD: Self = Self(1 << 1);
    /// Less than can be measured.
    pub const NEGATIVE_OVERLOAD: Self = Self(1 << 2);

    /// Both.
    #[must_use]
    pub const fn and(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// Whether all of `other` is there.
    pub const fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// esd CAN-CBX-THERMO's defaults: µV of a voltage (sensor type 0x28), °C; SYS TEC IO-X7's.
    #[test]
    fn units_are_those_of_the_manuals() {
        let microvolt = PhysicalUnit::from_raw(0xFA26_0000);
        assert_eq!(microvolt, PhysicalUnit::of(-6, Unit::Volt));
        assert_eq!(PhysicalUnit::from_raw(0x002D_0000), PhysicalUnit::CELSIUS);
        assert_eq!(PhysicalUnit::MILLIVOLT.raw(), 0xFD26_0000);
        assert_eq!(SensorType::Voltage.raw(), 0x28);
        assert_eq!(DEVICE_TYPE_ANALOG_INPUT, 0x0002_0194);
    }

    #[test]
    fn every_number_keeps_its_bits() {
        for raw in 0..=u16::MAX {
            assert_eq!(SensorType::from_raw(raw).raw(), raw);
            let unit = u32::from(raw) << 16 | 0x0300;
            assert_eq!(PhysicalUnit::from_raw(unit).raw(), unit);
        }
    }

    #[test]
    fn a_count_is_the_last_decimal_digit() {
        let close = |a: f64, b: f64| (a / b - 1.0).abs() < 1e-12;
        assert!(close(PhysicalUnit::MILLIVOLT.per_count(1), 1e-4));
        assert!(close(PhysicalUnit::CELSIUS.per_count(2), 1e-2));
    }

    #[test]
    fn a_status_names_what_is_wrong() {
        let none = InputStatus::default();
        let over = InputStatus::NOT_VALID.and(InputStatus::POSITIVE_OVERLOAD);
        assert_eq!(over.0, 3);
        assert!(over.contains(InputStatus::POSITIVE_OVERLOAD) && over.contains(none));
        assert!(!over.contains(InputStatus::NEGATIVE_OVERLOAD));
    }
}
