//! The ASCII protocol of ADAM-4000 and I-7000 analog input modules ("DCON").
//!
//! Source: Advantech ADAM-4000 series manual, chapter 4 and appendix on checksums. A module
//! answers nothing at all to a syntax error, a wrong address or a wrong checksum. This codec
//! covers analog input in engineering units: `+1.2345`, sign always given.

/// Ends every line.
pub const CR: u8 = b'\r';
/// Seven characters for each channel: sign, digits and point.
pub const CHANNEL_CHARACTERS: usize = 7;

/// What the host asks.
///
/// # Example
///
/// ```
/// use wire::dcon::Command;
///
/// assert_eq!(Command::ReadAll { address: 0x1F }.emit(), "#1F");
/// assert_eq!(Command::parse("#013"), Some(Command::ReadChannel { address: 1, channel: 3 }));
/// assert_eq!(Command::parse("#018"), None, "a module has eight channels");
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Command {
    /// `#AA`: all channels.
    ReadAll {
        /// Module address.
        address: u8,
    },
    /// `#AAN`: one channel.
    ReadChannel {
        /// Module address.
        address: u8,
        /// 0 to 7.
        channel: u8,
    },
    /// `$AAM`: the module's name.
    ReadName {
        /// Module address.
        address: u8,
    },
    /// `$AAF`: the firmware version.
    ReadFirmware {
        /// Module address.
        address: u8,
    },
    /// `$AA2`: the configuration.
    ReadConfiguration {
        /// Module address.
        address: u8,
    },
    /// `#**`: all modules sample now; nobody answers.
    SampleAll,
    /// `$AA4`: what was sampled at `#**`.
    ReadSampled {
        /// Module address.
        address: u8,
    },
}

/// Why a line is not what it was read as.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum DconError {
    /// The line does not have the form of the message.
    #[error("analog module: line is not of the form {expected}")]
    Syntax {
        /// The form that was expected.
        expected: &'static str,
    },
    /// The two checksum digits do not match.
    #[error("analog module: checksum {seen:#04X}, expected {expected:#04X}")]
    Checksum {
        /// Computed over the line.
        expected: u8,
        /// Read from the line.
        seen: u8,
    },
    /// The module refused the command (`?AA`).
    #[error("analog module {address:#04X} refused the command")]
    Refused {
        /// Module address.
        address: u8,
    },
    /// Over-range or open input, shown as a value of all nines.
    #[error("analog module: channel {channel} is out of its range")]
    OutOfRange {
        /// 0 to 7.
        channel: usize,
    },
}

impl Command {
    /// The line without checksum and CR.
    pub fn emit(&self) -> String {
        match *self {
            Self::ReadAll { address } => format!("#{address:02X}"),
            Self::ReadChannel { address, channel } => format!("#{address:02X}{channel}"),
            Self::ReadName { address } => format!("${address:02X}M"),
            Self::ReadFirmware { address } => format!("${address:02X}F"),
            Self::ReadConfiguration { address } => format!("${address:02X}2"),
            Self::SampleAll => "#**".to_owned(),
            Self::ReadSampled { address } => format!("${address:02X}4"),
        }
    }

    /// From a line without checksum and CR; `None` where a module would stay silent.
    pub fn parse(line: &str) -> Option<Self> {
        if line == "#**" {
            return Some(Self::SampleAll);
        }
        let address = u8::from_str_radix(line.get(1..3)?, 16).ok()?;
        match (line.get(..1)?, line.get(3..)?) {
            ("#", "") => Some(Self::ReadAll { address }),
            ("#", channel) => {
                let channel = channel.parse().ok().filter(|channel| *channel < 8)?;
                Some(Self::ReadChannel { address, channel })
            }
            ("$", "M") => Some(Self::ReadName { address }),
            ("$", "F") => Some(Self::ReadFirmware { address }),
            ("$", "2") => Some(Self::ReadConfiguration { address }),
            ("$", "4") => Some(Self::ReadSampled { address }),
            _ => None,
        }
    }
}

/// How a module is set: its answer `!AATTCCFF` to `$AA2`.
///
/// # Example
///
/// ```
/// use wire::dcon::Configuration;
///
/// let configuration = Configuration::parse("!01050600")?;
/// assert_eq!((configuration.range, configuration.baud), (0x05, 0x06), "±2.5 V, 9600 baud");
/// assert!(configuration.is_engineering() && !configuration.has_checksum());
/// assert_eq!(configuration.emit(), "!01050600");
/// # Ok::<(), wire::dcon::DconError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Configuration {
    /// Module address.
    pub address: u8,
    /// Input range code: 0x08 is ±10 V, 0x09 ±5 V, 0x0A ±1 V, 0x0B ±500 mV, 0x0C ±150 mV.
    pub range: u8,
    /// Baud rate code: 0x06 is 9600.
    pub baud: u8,
    /// Data format (bits 0 and 1), checksum (bit 6), integration time (bit 7).
    pub format: u8,
}

impl Configuration {
    const CHECKSUM: u8 = 0x40;
    const DATA_FORMAT: u8 = 0x03;

    /// The line without checksum and CR.
    pub fn emit(&self) -> String {
        let Self {
            address,
            range,
            baud,
            format,
        } = self;
        format!("!{address:02X}{range:02X}{baud:02X}{format:02X}")
    }

    /// From a line without checksum and CR.
    ///
    /// # Errors
    /// When the line has another form.
    pub fn parse(line: &str) -> Result<Self, DconError> {
        const FORM: DconError = DconError::Syntax {
            expected: "!AATTCCFF",
        };
        let digits = line.strip_prefix('!').ok_or(FORM)?;
        if digits.len() != 8 || !digits.bytes().all(|byte| byte.is_ascii_hexdigit()) {
            return Err(FORM);
        }
        let raw = u32::from_str_radix(digits, 16).map_err(|_| FORM)?;
        let [address, range, baud, format] = raw.to_be_bytes();
        Ok(Self {
            address,
            range,
            baud,
            format,
        })
    }

    /// Whether values come in engineering units (not in percent or hexadecimal).
    pub const fn is_engineering(&self) -> bool {
        self.format & Self::DATA_FORMAT == 0
    }

    /// Whether lines end in a checksum.
    pub const fn has_checksum(&self) -> bool {
        self.format & Self::CHECKSUM != 0
    }
}

/// The text of an answer `!AA…` of the module with this address, such as its name.
///
/// # Errors
/// When the line has another form, another address or refuses (`?AA`).
///
/// # Example
///
/// ```
/// use wire::dcon::{DconError, parse_text};
///
/// assert_eq!(parse_text("!014117", 1), Ok("4117"));
/// assert_eq!(parse_text("?01", 1), Err(DconError::Refused { address: 1 }));
/// assert!(parse_text("!024117", 1).is_err(), "another module's");
/// ```
pub fn parse_text(line: &str, address: u8) -> Result<&str, DconError> {
    const FORM: DconError = DconError::Syntax { expected: "!AA…" };
    if line == format!("?{address:02X}") {
        return Err(DconError::Refused { address });
    }
    line.strip_prefix(&format!("!{address:02X}")).ok_or(FORM)
}

/// The checksum digits of a line: the sum of its characters modulo 256.
pub fn checksum(line: &str) -> u8 {
    line.bytes().fold(0, u8::wrapping_add)
}

/// The bytes on the wire: the line, its checksum where in use, CR.
///
/// # Example
///
/// ```
/// use wire::dcon::frame;
///
/// assert_eq!(frame("$012", true), b"$012B7\r");
/// assert_eq!(frame("$012", false), b"$012\r");
/// ```
pub fn frame(line: &str, with_checksum: bool) -> Vec<u8> {
    let digits = if with_checksum {
        format!("{:02X}", checksum(line))
    } else {
        String::new()
    };
    [line.as_bytes(), digits.as_bytes(), &[CR]].concat()
}

/// Checks and removes the checksum of a line (CR already removed).
///
/// # Errors
/// When the line is not ASCII, too short or its checksum differs.
///
/// # Example
///
/// ```
/// use wire::dcon::{DconError, unframe};
///
/// assert_eq!(unframe(b"$012B7", true), Ok("$012"));
/// let wrong = DconError::Checksum { expected: 0xB7, seen: 0xB8 };
/// assert_eq!(unframe(b"$012B8", true), Err(wrong));
/// ```
pub fn unframe(line: &[u8], with_checksum: bool) -> Result<&str, DconError> {
    let form = DconError::Syntax {
        expected: "printable ASCII with two checksum digits",
    };
    let text = core::str::from_utf8(line).map_err(|_| form)?;
    if !text.is_ascii() {
        return Err(form);
    }
    if !with_checksum {
        return Ok(text);
    }
    let (body, digits) = text
        .split_at_checked(text.len().saturating_sub(2))
        .ok_or(form)?;
    let seen = u8::from_str_radix(digits, 16).map_err(|_| form)?;
    let expected = checksum(body);
    if seen == expected {
        Ok(body)
    } else {
        Err(DconError::Checksum { expected, seen })
    }
}

/// One channel in volts as a module prints it for the ±10 V range: `+01.234` or, with
/// `decimals` 4 (±1 V and ±5 V ranges), `+1.2345`.
///
/// # Example
///
/// ```
/// use wire::dcon::format_volts;
///
/// assert_eq!(format_volts(-1.5, 4), "-1.5000");
/// assert_eq!(format_volts(2.5, 3), "+02.500");
/// assert_eq!(format_volts(12.0, 4), "+9.9999", "out of range");
/// ```
pub fn format_volts(volts: f64, decimals: usize) -> String {
    let limit = if decimals >= 4 { 9.9999 } else { 99.999 };
    let shown = volts.clamp(-limit, limit);
    format!("{shown:+0width$.decimals$}", width = CHANNEL_CHARACTERS)
}

/// The volts of each channel in a reply `>+1.2345-0.0012…`.
///
/// # Errors
/// When the line has another form, or a channel shows the all-nines of an over-range input.
///
/// # Example
///
/// ```
/// use wire::dcon::{DconError, parse_volts};
///
/// assert_eq!(parse_volts(">+1.4567-0.0012"), Ok(vec![1.4567, -0.0012]));
/// assert_eq!(parse_volts(">+9.9999"), Err(DconError::OutOfRange { channel: 0 }));
/// ```
pub fn parse_volts(line: &str) -> Result<Vec<f64>, DconError> {
    const FORM: DconError = DconError::Syntax {
        expected: ">±n.nnnn for each channel",
    };
    if let Some(address) = line.strip_prefix('?') {
        let address = u8::from_str_radix(address, 16).map_err(|_| FORM)?;
        return Err(DconError::Refused { address });
    }
    let body = line.strip_prefix('>').ok_or(FORM)?;
    if body.is_empty() || !body.len().is_multiple_of(CHANNEL_CHARACTERS) {
        return Err(FORM);
    }
    (0..body.len() / CHANNEL_CHARACTERS)
        .map(|channel| {
            let start = channel * CHANNEL_CHARACTERS;
            let text = body.get(start..start + CHANNEL_CHARACTERS).ok_or(FORM)?;
            parse_channel(text, channel).ok_or(FORM)?
        })
        .collect()
}

/// `None` for a wrong form, an inner error for over-range.
fn parse_channel(text: &str, channel: usize) -> Option<Result<f64, DconError>> {
    let digits = text.strip_prefix(['+', '-'])?;
    let plain = digits
        .bytes()
        .all(|byte| byte.is_ascii_digit() || byte == b'.');
    let points = digits.bytes().filter(|byte| *byte == b'.').count();
    if !plain || points != 1 {
        return None;
    }
    if digits.bytes().all(|byte| byte == b'9' || byte == b'.') {
        return Some(Err(DconError::OutOfRange { channel }));
    }
    Some(Ok(text.parse().ok()?))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Advantech ADAM-4000 manual, the chapter on the checksum: the sum of the characters' codes, modulo 256, in two
    /// hexadecimal digits.
    #[test]
    fn the_checksum_is_the_sum_of_the_characters() {
        assert_eq!(checksum("$012"), 0xB7);
        assert_eq!(frame("$012", true), b"$012B7\r");
        assert_eq!(unframe(b"$012B7", true), Ok("$012"));
        assert!(matches!(
            unframe(b"$012B8", true),
            Err(DconError::Checksum { .. })
        ));
    }

    #[test]
    fn commands_read_both_ways() {
        for (command, line) in [
            (Command::ReadAll { address: 0x1F }, "#1F"),
            (
                Command::ReadChannel {
                    address: 1,
                    channel: 3,
                },
                "#013",
            ),
            (Command::ReadName { address: 1 }, "$01M"),
            (Command::ReadSampled { address: 2 }, "$024"),
            (Command::SampleAll, "#**"),
        ] {
            assert_eq!(command.emit(), line);
            assert_eq!(Command::parse(line), Some(command));
        }
        assert_eq!(Command::parse("#018"), None);
        assert_eq!(Command::parse("#G1"), None);
    }

    /// Advantech ADAM-4000 manual: `!01050600`, ±2.5 V, 9600 baud, engineering units.
    #[test]
    fn the_configuration_reads_both_ways() {
        let configuration = Configuration::parse("!01050600").unwrap();
        assert_eq!((configuration.range, configuration.baud), (0x05, 0x06));
        assert!(configuration.is_engineering() && !configuration.has_checksum());
        assert_eq!(configuration.emit(), "!01050600");
        let other = Configuration::parse("!1F0906C2").unwrap();
        assert!(other.has_checksum() && !other.is_engineering());
        for line in [
            "!0105060",
            "!01050G00",
            ">01050600",
            "!01+50600",
            "!0105060é",
        ] {
            assert!(Configuration::parse(line).is_err(), "{line}");
        }
    }

    #[test]
    fn an_answers_text_is_taken_from_the_asked_module_only() {
        assert_eq!(parse_text("!014117", 1), Ok("4117"));
        assert!(parse_text("!024117", 1).is_err());
        assert_eq!(parse_text("?01", 1), Err(DconError::Refused { address: 1 }));
    }

    #[test]
    fn channels_are_seven_characters_each() {
        assert_eq!(parse_volts(">+1.4567-0.0012"), Ok(vec![1.4567, -0.0012]));
        assert_eq!(parse_volts(">+01.234"), Ok(vec![1.234]));
        assert_eq!(format_volts(-1.5, 4), "-1.5000");
        assert_eq!(format_volts(2.5, 3), "+02.500");
    }

    #[test]
    fn what_is_not_a_plain_number_is_refused() {
        for line in [
            ">+1,4567", ">+1.456", "+1.4567", ">+inf   ", ">1.45678", ">", ">+1.45.7",
        ] {
            assert!(
                matches!(parse_volts(line), Err(DconError::Syntax { .. })),
                "{line}"
            );
        }
        assert_eq!(
            parse_volts(">+9.9999"),
            Err(DconError::OutOfRange { channel: 0 })
        );
        assert_eq!(parse_volts("?01"), Err(DconError::Refused { address: 1 }));
    }
}
