//! The serial interface of the position display HEIDENHAIN ND 287.
//!
//! Source: HEIDENHAIN, ND 287 user's manual, part II-5 "Data interface" (control characters, p. 102; commands
//! and their answers, p. 108) and II-6 "Measured value output" (p. 115). Everything is ASCII; lines end with
//! CR and LF. A measured value has no checksum, and nothing in it says which request it answers.
//!
//! Absent: keys (`T…`), functions (`F…`), status bar and indicators, lists of parameters.

/// Ends a line.
pub const LF: u8 = b'\n';
/// Asks for a measured value (Ctrl B); also begins each answer to a [`Command`].
pub const STX: u8 = 0x02;
/// Answers a command that is not known.
pub const NAK: u8 = 0x15;
/// Begins a command.
const ESC: char = '\x1b';
/// Characters of a measured value before its end of line.
pub const VALUE_CHARACTERS: usize = 15;
/// Characters of the number in it, with its point.
const NUMBER_CHARACTERS: usize = 10;
/// Characters of each line of an identification.
const IDENTIFICATION_CHARACTERS: usize = 10;

/// What the host can ask besides a measured value.
///
/// # Example
///
/// ```
/// use wire::nd287::Command;
///
/// assert_eq!(Command::Identification.emit(), b"\x1bA0000\r");
/// assert_eq!(Command::parse("A0301"), Some(Command::ErrorText));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Command {
    /// Name, software and version: an [`Identification`].
    Identification,
    /// The error that is shown.
    ErrorText,
}

impl Command {
    /// The whole command.
    pub fn emit(self) -> Vec<u8> {
        format!("{ESC}{}\r", self.word()).into_bytes()
    }

    /// From what stands between ESC and CR; `None` where a display answers [`NAK`].
    pub fn parse(word: &str) -> Option<Self> {
        let all = [Self::Identification, Self::ErrorText];
        all.into_iter().find(|it| it.word() == word)
    }

    const fn word(self) -> &'static str {
        match self {
            Self::Identification => "A0000",
            Self::ErrorText => "A0301",
        }
    }
}

/// In which unit a value is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unit {
    /// Millimetres.
    Millimetre,
    /// Inches.
    Inch,
    /// An angle, a speed or a rate, by its letter.
    Other(u8),
    /// The encoder's signals are faulty: the number means nothing.
    Fault,
}

impl Unit {
    const fn of(letter: u8) -> Option<Self> {
        Some(match letter {
            b' ' => Self::Millimetre,
            b'"' => Self::Inch,
            b'?' => Self::Fault,
            b'G' | b'M' | b'R' | b'm' | b'i' | b'U' => Self::Other(letter),
            _ => return None,
        })
    }

    const fn letter(self) -> u8 {
        match self {
            Self::Millimetre => b' ',
            Self::Inch => b'"',
            Self::Fault => b'?',
            Self::Other(letter) => letter,
        }
    }
}

/// Why a line is not what it was read as.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("position display: the line is not of the form {expected}")]
pub struct Nd287Error {
    /// The form that was expected.
    pub expected: &'static str,
}

/// A measured value.
///
/// # Example
///
/// ```
/// use wire::nd287::{MeasuredValue, Unit};
///
/// let value = MeasuredValue::parse(b"-      5.23  =A")?;
/// assert_eq!((value.value, value.decimals, value.unit), (-5.23, 2, Unit::Millimetre));
/// assert_eq!(value.emit(), b"-      5.23  =A\r\n");
/// let faulty = MeasuredValue::parse(b"+   12.3456 ?  ")?;
/// assert_eq!(faulty.unit, Unit::Fault, "its number means nothing");
/// # Ok::<(), wire::nd287::Nd287Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeasuredValue {
    /// The number, in `unit`.
    pub value: f64,
    /// How many digits follow the point.
    pub decimals: usize,
    /// Its unit.
    pub unit: Unit,
    /// Where it is between sorting limits: `<`, `=`, `>` or, without limits, a blank.
    pub sorted: u8,
    /// Of which series or input it is: a blank for the only input, `1` and `2` for X1 and X2, `S`, `A`, `G`,
    /// `D`, `F` for extremes, sums and differences.
    pub shown: u8,
}

impl MeasuredValue {
    const FORM: Nd287Error = Nd287Error {
        expected: "sign, ten characters of a number, blank, unit, sorting, series",
    };

    /// The line with its end. A number that does not fit its ten characters is cut off on the left, as on
    /// the display.
    pub fn emit(&self) -> Vec<u8> {
        let sign = if self.value < 0.0 { '-' } else { '+' };
        let number = format!("{:10.*}", self.decimals, self.value.abs());
        let number = &number[number.len() - NUMBER_CHARACTERS..];
        let [unit, sorted, shown] = [self.unit.letter(), self.sorted, self.shown].map(char::from);
        format!("{sign}{number} {unit}{sorted}{shown}\r\n").into_bytes()
    }

    /// From a line without its end.
    ///
    /// # Errors
    /// When the line has another form.
    pub fn parse(line: &[u8]) -> Result<Self, Nd287Error> {
        if line.len() != VALUE_CHARACTERS {
            return Err(Self::FORM);
        }
        let (number, rest) = line[1..].split_at(NUMBER_CHARACTERS);
        let sign = match line[0] {
            b'+' => 1.0,
            b'-' => -1.0,
            _ => return Err(Self::FORM),
        };
        let (size, decimals) = parse_number(number).ok_or(Self::FORM)?;
        let [b' ', unit, sorted, shown] = *rest else {
            return Err(Self::FORM);
        };
        let is_known = b" <=>?".contains(&sorted) && b" 12ASGDF".contains(&shown);
        match Unit::of(unit) {
            Some(unit) if is_known => Ok(Self {
                value: sign * size,
                decimals,
                unit,
                sorted,
                shown,
            }),
            _ => Err(Self::FORM),
        }
    }
}

/// Blanks for leading zeros, digits, one point at most, not without digits.
fn parse_number(characters: &[u8]) -> Option<(f64, usize)> {
    let text = core::str::from_utf8(characters).ok()?;
    let digits = text.trim_start_matches(' ');
    let (whole, fraction) = digits.split_once('.').unwrap_or((digits, ""));
    let all_digits = |it: &str| it.bytes().all(|byte| byte.is_ascii_digit());
    let is_number = !whole.is_empty() && all_digits(whole) && all_digits(fraction);
    Some((digits.parse().ok().filter(|_| is_number)?, fraction.len()))
}

/// Who a display is: three lines of ten characters, the first behind [`STX`].
///
/// # Example
///
/// ```
/// use wire::nd287::Identification;
///
/// let answer = b"\x02ND-287    \r\n646118-01 \r\nV1-01     \r\n";
/// assert_eq!(Identification::parse_line(&answer[1..11]), Ok("ND-287"));
/// let own = Identification {
///     name: "ND-287".into(),
///     software: "646118-01".into(),
///     version: "V1-01".into(),
/// };
/// assert_eq!(own.emit(), answer);
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Identification {
    /// What it is called, `ND-287`.
    pub name: String,
    /// The number of its software.
    pub software: String,
    /// That software's version.
    pub version: String,
}

impl Identification {
    /// The whole answer.
    pub fn emit(&self) -> Vec<u8> {
        let mut answer = vec![STX];
        for part in [&self.name, &self.software, &self.version] {
            answer.extend_from_slice(
                format!("{part:<IDENTIFICATION_CHARACTERS$.IDENTIFICATION_CHARACTERS$}\r\n")
                    .as_bytes(),
            );
        }
        answer
    }

    /// One of its lines, without end and [`STX`], without the blanks that fill it up.
    ///
    /// # Errors
    /// When it is no line of ten printable characters.
    pub fn parse_line(line: &[u8]) -> Result<&str, Nd287Error> {
        const FORM: Nd287Error = Nd287Error {
            expected: "ten characters of an identification",
        };
        let is_text = line.iter().all(|byte| (b' '..=b'~').contains(byte));
        let text = core::str::from_utf8(line).map_err(|_| FORM)?;
        if line.len() == IDENTIFICATION_CHARACTERS && is_text {
            Ok(text.trim_end())
        } else {
            Err(FORM)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The manual's example (p. 115): -5.23 mm, within its sorting limits, current value of a series.
    const EXAMPLE: &[u8] = b"-      5.23  =A";

    #[test]
    fn the_manuals_measured_value_is_read_and_written() {
        let value = MeasuredValue::parse(EXAMPLE).unwrap();
        let expected = MeasuredValue {
            value: -5.23,
            decimals: 2,
            unit: Unit::Millimetre,
            sorted: b'=',
            shown: b'A',
        };
        assert_eq!(value, expected);
        assert_eq!(value.emit(), [EXAMPLE, b"\r\n"].concat());
    }

    #[test]
    fn a_fault_is_no_unit() {
        let value = MeasuredValue::parse(b"+   12.3456 ?  ").unwrap();
        assert_eq!(value.unit, Unit::Fault);
    }

    #[test]
    fn what_is_no_measured_value_is_refused() {
        for line in [
            &b""[..],
            b"-      5.23  =",
            b"-      5.23  =A ",
            b"       5.23  =A",
            b"-     5. 23  =A",
            b"-    5.2.3   =A",
            b"-            =A ",
            b"-          .  =A",
            b"-      5.23 x=A",
            b"-      5.23  #A",
            b"-      5.23  =Q",
            b"-      5.23x =A",
            b"-      5,23  =A",
            b"\xff      5.23  =A",
        ] {
            assert!(MeasuredValue::parse(line).is_err(), "{line:?}");
        }
    }

    #[test]
    fn the_manuals_identification_is_written_and_read() {
        let own = Identification {
            name: "ND-287".into(),
            software: "646118-01".into(),
            version: "V1-01".into(),
        };
        let answer = own.emit();
        assert_eq!(answer, b"\x02ND-287    \r\n646118-01 \r\nV1-01     \r\n");
        assert_eq!(Identification::parse_line(&answer[1..11]), Ok("ND-287"));
        assert!(Identification::parse_line(&answer[..11]).is_err());
    }

    #[test]
    fn commands_are_those_of_the_manual() {
        assert_eq!(Command::Identification.emit(), b"\x1bA0000\r");
        assert_eq!(Command::parse("A0301"), Some(Command::ErrorText));
        assert_eq!(Command::parse("A9999"), None);
    }

    proptest! {
        #[test]
        fn what_is_written_is_read(
            units in -99_999_999_i64..=99_999_999, decimals in 0_usize..=6, fault: bool,
        ) {
            let value = MeasuredValue {
                value: units as f64 / 10_f64.powi(decimals as i32),
                decimals,
                unit: if fault { Unit::Fault } else { Unit::Millimetre },
                sorted: b' ',
                shown: b' ',
            };
            let line = value.emit();
            prop_assert_eq!(line.len(), VALUE_CHARACTERS + 2);
            let read = MeasuredValue::parse(&line[..VALUE_CHARACTERS]).unwrap();
            prop_assert_eq!(read, value);
        }

        #[test]
        fn no_bytes_make_it_panic(line in prop::collection::vec(any::<u8>(), 0..40)) {
            let _ = MeasuredValue::parse(&line);
            let _ = Identification::parse_line(&line);
        }
    }
}
