//! The line format of the µMD1 and µMD2 laser interferometer interfaces.
//!
//! Source: J. Beck and S. M. Goldwasser, µMD2 manual v1.41 and InterferometerGUI
//! (`MainForm.vb`). One line per sample, integers separated by blanks, LF; eight fields for
//! one axis: reference count, measurement count, distance, velocity, phase, sequence,
//! low-speed code, low-speed data. Lines that start with `!` are debug text. Three-axis
//! lines have sixteen fields; the first axis and the common fields are read from them.

use bitflags::bitflags;

/// The vacuum wavelength the firmware's users work with, in metres.
pub const VACUUM_WAVELENGTH_M: f64 = 632.991_372e-9;
/// Samples per second at the default setting.
pub const DEFAULT_SAMPLE_RATE_HZ: f64 = 610.35;
/// The phase field divides half a wavelength, which is one unit of the distance field, into so many steps.
pub const PHASE_STEPS: f64 = 256.0;
const SEQUENCE_LIMIT: u64 = 1 << 32;

bitflags! {
    /// The phase field's flags that say the phase is not valid.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
    pub struct PhaseFlags: u16 {
        /// All the flags that invalidate the phase.
        const INVALID = 0x7E00;
        const _ = !0;
    }
}

/// One sample of the stream.
///
/// # Example
///
/// ```
/// use wire::umd2::{Line, LowSpeed};
///
/// let Ok(Line::Sample(sample)) = Line::parse("2456 2455 -12 3 64 1001 3 2150") else {
///     unreachable!("eight fields are a sample");
/// };
/// assert_eq!(sample.low_speed, LowSpeed::Temperature1(2150), "21.5 °C");
/// assert_eq!(sample.half_wavelengths(), -12.25);
/// assert_eq!(sample.lost_since(998), 2, "999 and 1000");
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sample {
    /// Reference frequency in counts per sample; 0 means no laser head.
    pub reference_count: u32,
    /// Measurement frequency in counts per sample; 0 means no beam.
    pub measurement_count: u32,
    /// Displacement in half wavelengths.
    pub distance: i64,
    /// Displacement per sample.
    pub velocity: i64,
    /// Fraction of a half wavelength in 1/256, with validity flags.
    pub phase: u16,
    /// Counts up by one each sample.
    pub sequence: u32,
    /// Slow data that travel along.
    pub low_speed: LowSpeed,
}

/// The multiplexed slow channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LowSpeed {
    /// Code 0: nothing.
    None,
    /// Code 1: laser power.
    LaserPower(i32),
    /// Code 2: signal strength.
    SignalStrength(i32),
    /// Code 3: temperature 1 in 0.01 °C.
    Temperature1(i32),
    /// Code 4: temperature 2 in 0.01 °C.
    Temperature2(i32),
    /// Code 5: pressure in 0.01 mbar.
    Pressure(i32),
    /// Code 6: relative humidity in 0.1 %.
    Humidity(i32),
    /// Code 8: sample rate in 0.01 Hz.
    SampleRate(i32),
    /// Code 10: firmware version.
    Firmware(i32),
    /// Any other code.
    Unknown {
        /// The code.
        code: u16,
        /// Its data.
        data: i32,
    },
}

impl LowSpeed {
    const fn from_raw(code: u16, data: i32) -> Self {
        match code {
            0 => Self::None,
            1 => Self::LaserPower(data),
            2 => Self::SignalStrength(data),
            3 => Self::Temperature1(data),
            4 => Self::Temperature2(data),
            5 => Self::Pressure(data),
            6 => Self::Humidity(data),
            8 => Self::SampleRate(data),
            10 => Self::Firmware(data),
            _ => Self::Unknown { code, data },
        }
    }

    const fn raw(self) -> (u16, i32) {
        match self {
            Self::None => (0, 0),
            Self::LaserPower(data) => (1, data),
            Self::SignalStrength(data) => (2, data),
            Self::Temperature1(data) => (3, data),
            Self::Temperature2(data) => (4, data),
            Self::Pressure(data) => (5, data),
            Self::Humidity(data) => (6, data),
            Self::SampleRate(data) => (8, data),
            Self::Firmware(data) => (10, data),
            Self::Unknown { code, data } => (code, data),
        }
    }
}

/// Why a line is no sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Umd2Error {
    /// Not 8 or 16 fields.
    #[error("interferometer line has {seen} fields, expected 8 or 16")]
    FieldCount {
        /// How many there were.
        seen: usize,
    },
    /// A field is not an integer of its range.
    #[error("interferometer line: field {field} is not an integer in range")]
    Field {
        /// Counted from 1.
        field: usize,
    },
}

/// A line of the stream.
///
/// # Example
///
/// ```
/// use wire::umd2::{Line, Umd2Error};
///
/// assert_eq!(Line::parse("! boot"), Ok(Line::Debug));
/// assert_eq!(Line::parse("2456 2455 -12 3"), Err(Umd2Error::FieldCount { seen: 4 }));
/// assert_eq!(Line::parse("1 2 x 4 5 6 0 0"), Err(Umd2Error::Field { field: 3 }));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Line {
    /// A sample.
    Sample(Sample),
    /// Debug text of the firmware.
    Debug,
}

impl Line {
    /// From a line without its LF.
    ///
    /// # Errors
    /// When it is neither debug text nor a whole sample.
    pub fn parse(line: &str) -> Result<Self, Umd2Error> {
        let line = line.trim_end_matches('\r');
        if line.starts_with('!') {
            return Ok(Self::Debug);
        }
        let mut fields = [0_i64; 16];
        let mut count = 0;
        for text in line.split_ascii_whitespace() {
            let slot = fields
                .get_mut(count)
                .ok_or(Umd2Error::FieldCount { seen: count + 1 })?;
            count += 1;
            *slot = parse_field(text).ok_or(Umd2Error::Field { field: count })?;
        }
        if count != 8 && count != 16 {
            return Err(Umd2Error::FieldCount { seen: count });
        }
        Sample::from_fields(&fields).map(Self::Sample)
    }
}

/// Digits with an optional minus sign: `str::parse` would also take a plus sign, and these are
/// thousands of numbers a second.
fn parse_field(text: &str) -> Option<i64> {
    let (digits, sign) = match text.strip_prefix('-') {
        Some(digits) => (digits, -1),
        None => (text, 1),
    };
    if digits.is_empty() {
        return None;
    }
    digits.bytes().try_fold(0_i64, |value, byte| {
        let digit = byte.is_ascii_digit().then(|| i64::from(byte - b'0'))?;
        value.checked_mul(10)?.checked_add(sign * digit)
    })
}

/// Appends an integer as decimal digits; formatting would cost more than all the rest of a sample.
fn push_decimal(line: &mut Vec<u8>, value: i64) {
    const LONGEST: usize = 20;
    let mut digits = [0; LONGEST];
    let (mut rest, mut begin) = (value.unsigned_abs(), LONGEST);
    loop {
        begin -= 1;
        digits[begin] = b'0' + (rest % 10) as u8;
        rest /= 10;
        if rest == 0 {
            break;
        }
    }
    if value < 0 {
        line.push(b'-');
    }
    line.extend_from_slice(&digits[begin..]);
}

impl Sample {
    fn from_fields(fields: &[i64; 16]) -> Result<Self, Umd2Error> {
        fn narrow<T: TryFrom<i64>>(fields: &[i64; 16], at: usize) -> Result<T, Umd2Error> {
            T::try_from(fields[at]).map_err(|_| Umd2Error::Field { field: at + 1 })
        }
        let code = narrow(fields, 6)?;
        Ok(Self {
            reference_count: narrow(fields, 0)?,
            measurement_count: narrow(fields, 1)?,
            distance: fields[2],
            velocity: fields[3],
            phase: narrow(fields, 4)?,
            sequence: narrow(fields, 5)?,
            low_speed: LowSpeed::from_raw(code, narrow(fields, 7)?),
        })
    }

    /// The line on the wire, LF included.
    pub fn emit(&self) -> String {
        let mut line = Vec::new();
        self.emit_into(&mut line);
        String::from_utf8(line).expect("digits, signs and blanks are ASCII")
    }

    /// Appends the line on the wire, LF included.
    pub fn emit_into(&self, line: &mut Vec<u8>) {
        let (code, data) = self.low_speed.raw();
        let fields = [
            self.reference_count.into(),
            self.measurement_count.into(),
            self.distance,
            self.velocity,
            self.phase.into(),
            self.sequence.into(),
            code.into(),
            data.into(),
        ];
        for field in fields {
            push_decimal(line, field);
            line.push(b' ');
        }
        line.pop();
        line.push(b'\n');
    }

    /// Whether the phase may be used.
    pub const fn phase_is_valid(&self) -> bool {
        self.phase & PhaseFlags::INVALID.bits() == 0
    }

    /// Displacement in half wavelengths, the phase subtracted (`MainForm.vb`).
    pub fn half_wavelengths(&self) -> f64 {
        let phase = f64::from(self.phase & !PhaseFlags::INVALID.bits());
        self.distance as f64 - phase / PHASE_STEPS
    }

    /// How many samples were lost between `previous` and this one.
    pub const fn lost_since(&self, previous: u32) -> u64 {
        let step = (self.sequence as u64 + SEQUENCE_LIMIT - previous as u64) % SEQUENCE_LIMIT;
        (step + SEQUENCE_LIMIT - 1) % SEQUENCE_LIMIT
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LINE: &str = "2456 2455 -12 3 64 1001 3 2150";

    #[test]
    fn a_sample_reads_both_ways() {
        let Ok(Line::Sample(sample)) = Line::parse(LINE) else {
            panic!()
        };
        assert_eq!(sample.low_speed, LowSpeed::Temperature1(2150));
        assert!((sample.half_wavelengths() + 12.25).abs() < 1e-12);
        assert!(sample.phase_is_valid());
        assert_eq!(sample.emit(), format!("{LINE}\n"));
    }

    #[test]
    fn sixteen_fields_give_the_first_axis() {
        let line = "1 2 3 4 5 6 0 0 9 9 9 9 9 9 9 9";
        let Ok(Line::Sample(sample)) = Line::parse(line) else {
            panic!()
        };
        assert_eq!((sample.distance, sample.sequence), (3, 6));
    }

    #[test]
    fn split_merged_and_damaged_lines_are_refused() {
        for line in [
            "2456 2455 -12 3",
            "1 2 3 4 5 6 0 0 1",
            "1 2 x 4 5 6 0 0",
            "",
            "1 2 3 4 5 6 0 +1",
        ] {
            assert!(Line::parse(line).is_err(), "{line}");
        }
        assert_eq!(Line::parse("! boot"), Ok(Line::Debug));
    }

    #[test]
    fn gaps_are_counted_across_the_wrap() {
        let Ok(Line::Sample(mut sample)) = Line::parse(LINE) else {
            panic!()
        };
        assert_eq!(sample.lost_since(1000), 0);
        assert_eq!(sample.lost_since(998), 2);
        sample.sequence = 0;
        assert_eq!(sample.lost_since(u32::MAX), 0);
    }

    #[test]
    fn an_invalid_phase_is_flagged() {
        let Ok(Line::Sample(sample)) = Line::parse("1 2 3 4 512 6 0 0") else {
            panic!()
        };
        assert!(!sample.phase_is_valid());
    }
}
