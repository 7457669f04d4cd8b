//! The ASCII interface of Copley Controls servo amplifiers, over RS-232.
//!
//! Source: Copley Controls, ASCII Programmer's Guide, 16-01196 rev. 01 ("the guide"; pages are
//! its), and for parameters that it leaves out the Parameter Dictionary, 16-01091.
//!
//! A command is a line that ends in a carriage return, a reply likewise; there is no checksum
//! and no number that says which command a reply answers. An amplifier speaks only when it is
//! spoken to. The amplifier at the cable has no address; it hands lines that begin with a CAN
//! node number on to the others (p. 9, 63), and their replies come without that number.
//!
//! | line | meaning |
//! |---|---|
//! | `3.b s r0xca 40000` | node 3, axis B: set position command in RAM |
//! | `g r0xa0` | get the event status |
//! | `t 1` | begin the move; `t 0` aborts, `t 2` homes |
//! | `r` | reset; not answered |
//! | `ok`, `v 1200`, `r 15`, `e 33` | done, a value, a program register, an error |
//!
//! Absent: copying to and from flash (`c`), program registers (`i`), encoder commands, and
//! the moves of several axes by one command (`t 0x3001`).

mod error_code;
mod parameter;
mod status;
#[cfg(test)]
mod tests;

use core::fmt;

pub use error_code::ErrorCode;
pub use parameter::{Bank, DesiredState, HomingMethod, Parameter};
pub use status::{EventStatus, Faults, TrajectoryStatus};

/// Ends every line.
pub const CR: u8 = b'\r';
/// No line is longer: a filter's coefficients take about a hundred characters (p. 45).
pub const LINE_MAX: usize = 160;
/// Bits per second after power-on, reset and BREAK (p. 7).
pub const BAUD_AT_RESET: u32 = 9_600;

/// Which amplifier a line is for: that at the cable, or a node behind it; and which of its
/// axes, where it has several.
///
/// # Example
///
/// ```
/// use wire::copley::Address;
///
/// let behind = Address::node(3).and_then(|node| node.axis('b'));
/// assert_eq!(behind.map(|it| it.to_string()), Some("3.b".into()));
/// assert_eq!(Address::GATEWAY.node_number(), 0);
/// assert_eq!(Address::node(128), None);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Address {
    node: u8,
    letter: Option<char>,
}

impl Address {
    /// The amplifier at the cable.
    pub const GATEWAY: Self = Self {
        node: 0,
        letter: None,
    };

    /// Node 0 is the amplifier at the cable, 1 to 127 one behind it; `None` for others.
    pub const fn node(node: u8) -> Option<Self> {
        if node <= 127 {
            Some(Self { node, letter: None })
        } else {
            None
        }
    }

    /// One axis of a drive with several: `a` to `d`; `None` for other letters.
    #[must_use]
    pub const fn axis(self, letter: char) -> Option<Self> {
        if matches!(letter, 'a'..='d') {
            Some(Self {
                node: self.node,
                letter: Some(letter),
            })
        } else {
            None
        }
    }

    /// The node number; 0 is the amplifier at the cable.
    pub const fn node_number(self) -> u8 {
        self.node
    }

    /// The axis's letter, where one is given.
    pub const fn letter(self) -> Option<char> {
        self.letter
    }
}

impl fmt::Display for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.node)?;
        match self.letter {
            Some(letter) => write!(f, ".{letter}"),
            None => Ok(()),
        }
    }
}

/// Trajectory sub-commands (p. 14).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Trajectory {
    /// `t 0`.
    Abort,
    /// `t 1`: begin, or take over what was loaded.
    Move,
    /// `t 2`.
    Home,
}

/// What the host asks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Command {
    /// `s`: sets a parameter to a number.
    Set {
        /// Which bank.
        bank: Bank,
        /// Which parameter.
        parameter: Parameter,
        /// The new value.
        value: i64,
    },
    /// `g`: gets a parameter.
    Get {
        /// Which bank.
        bank: Bank,
        /// Which parameter.
        parameter: Parameter,
    },
    /// `t`.
    Trajectory(Trajectory),
    /// `r`: restarts the amplifier; the only command without a reply.
    Reset,
}

/// A command for one amplifier.
///
/// # Example
///
/// ```
/// use wire::copley::{Address, Bank, Command, ErrorCode, Parameter, Request};
///
/// let (bank, parameter) = (Bank::Ram, Parameter::POSITION_COMMAND);
/// let command = Command::Set { bank, parameter, value: 40_000 };
/// let request = Request { address: Address::GATEWAY, command };
/// assert_eq!(request.emit(), b"s r0xca 40000\r");
/// assert_eq!(Request::parse(b"s r0xca 40000"), Ok(request));
/// let refused = Request::parse(b"s r0xca").map_err(|it| it.code);
/// assert_eq!(refused, Err(ErrorCode::TooLittleData));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Request {
    /// Who.
    pub address: Address,
    /// What.
    pub command: Command,
}

/// Why a line is not a command: the number of the error that answers it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("not a command: {code}")]
pub struct Refused {
    /// Whom the line is for, as far as that could be read.
    pub address: Address,
    /// What is wrong with it.
    pub code: ErrorCode,
}

impl Request {
    /// The line, its end included.
    pub fn emit(&self) -> Vec<u8> {
        let prefix = match (self.address.node, self.address.letter) {
            (0, None) => String::new(),
            (0, Some(letter)) => format!(".{letter} "),
            (_, _) => format!("{} ", self.address),
        };
        let bank = |bank| match bank {
            Bank::Ram => 'r',
            Bank::Flash => 'f',
        };
        let command = match self.command {
            Command::Set {
                bank: of,
                parameter,
                value,
            } => format!("s {}{parameter} {value}", bank(of)),
            Command::Get {
                bank: of,
                parameter,
            } => format!("g {}{parameter}", bank(of)),
            Command::Trajectory(trajectory) => format!("t {}", trajectory as u8),
            Command::Reset => "r".to_owned(),
        };
        format!("{prefix}{command}\r").into_bytes()
    }

    /// From a line without its end.
    ///
    /// # Errors
    /// What an amplifier answers to what it does not understand.
    pub fn parse(line: &[u8]) -> Result<Self, Refused> {
        let mut address = Address::GATEWAY;
        parse_request(line, &mut address)
            .map(|command| Self { address, command })
            .map_err(|code| Refused { address, code })
    }
}

fn parse_request(line: &[u8], address: &mut Address) -> Result<Command, ErrorCode> {
    let text = core::str::from_utf8(line).map_err(|_| ErrorCode::Syntax)?;
    let mut words = text.split(' ').filter(|word| !word.is_empty()).peekable();
    if let Some(word) = words.peek()
        && word.starts_with(|first: char| first.is_ascii_digit() || first == '.')
    {
        *address = parse_address(word)?;
        words.next();
    }
    let letter = words.next().ok_or(ErrorCode::Syntax)?;
    let words: Vec<&str> = words.collect();
    match (letter, &words[..]) {
        ("s" | "S", [place, values @ ..]) => {
            let (bank, parameter) = parse_place(place)?;
            let [value] = values else {
                return Err(if values.is_empty() {
                    ErrorCode::TooLittleData
                } else {
                    ErrorCode::SurplusData
                });
            };
            let value = parse_number(value).ok_or(ErrorCode::Syntax)?;
            Ok(Command::Set {
                bank,
                parameter,
                value,
            })
        }
        ("g" | "G", [place]) => {
            let (bank, parameter) = parse_place(place)?;
            Ok(Command::Get { bank, parameter })
        }
        ("t" | "T", [code]) => match parse_number(code) {
            Some(0) => Ok(Command::Trajectory(Trajectory::Abort)),
            Some(1) => Ok(Command::Trajectory(Trajectory::Move)),
            Some(2) => Ok(Command::Trajectory(Trajectory::Home)),
            Some(_) => Err(ErrorCode::OutOfRange),
            None => Err(ErrorCode::Syntax),
        },
        ("r" | "R", []) => Ok(Command::Reset),
        ("s" | "S" | "g" | "G" | "t" | "T", []) => Err(ErrorCode::TooLittleData),
        (letter, _) if letter.len() > 1 => Err(ErrorCode::Syntax),
        ("g" | "G" | "t" | "T" | "r" | "R", _) => Err(ErrorCode::Syntax),
        (_, _) => Err(ErrorCode::UnknownCommand),
    }
}

fn parse_address(word: &str) -> Result<Address, ErrorCode> {
    let (node, letter) = match word.split_once('.') {
        None => (word, None),
        Some((node, letter)) => (node, Some(letter)),
    };
    let number = match node {
        "" => 0,
        digits => digits.parse().map_err(|_| ErrorCode::Syntax)?,
    };
    let address = Address::node(number).ok_or(ErrorCode::ForwardingNode)?;
    let Some(letter) = letter else {
        return Ok(address);
    };
    let letter = letter.to_ascii_lowercase();
    let mut letters = letter.chars();
    match (letters.next(), letters.next()) {
        (Some(letter), None) => address.axis(letter).ok_or(ErrorCode::AxisLetter),
        _ => Err(ErrorCode::AxisLetter),
    }
}

/// `r0xca`, `f128`.
fn parse_place(word: &str) -> Result<(Bank, Parameter), ErrorCode> {
    let bank = match word.bytes().next() {
        Some(b'r' | b'R') => Bank::Ram,
        Some(b'f' | b'F') => Bank::Flash,
        _ => return Err(ErrorCode::Syntax),
    };
    let number = parse_number(&word[1..]).ok_or(ErrorCode::Syntax)?;
    let number = u16::try_from(number).map_err(|_| ErrorCode::UnknownParameter)?;
    Ok((bank, Parameter(number)))
}

/// Decimal, or hexadecimal after `0x`.
fn parse_number(word: &str) -> Option<i64> {
    let (sign, digits) = match word.strip_prefix('-') {
        Some(digits) => (-1, digits),
        None => (1, word),
    };
    let hex = digits
        .strip_prefix("0x")
        .or_else(|| digits.strip_prefix("0X"));
    let (digits, radix) = hex.map_or((digits, 10), |hex| (hex, 16));
    // `from_str_radix` takes a sign of its own.
    if !digits.bytes().all(|byte| byte.is_ascii_hexdigit()) {
        return None;
    }
    Some(sign * i64::from_str_radix(digits, radix).ok()?)
}

/// What an amplifier answers.
///
/// # Example
///
/// ```
/// use wire::copley::{ErrorCode, NotAReply, Reply};
///
/// assert_eq!(Reply::parse(b"ok"), Ok(Reply::Ok));
/// assert_eq!(Reply::parse(b"v 0x1f").map(|it| it.number()), Ok(Some(31)));
/// assert_eq!(Reply::parse(b"e 33"), Ok(Reply::Error(ErrorCode::Syntax)));
/// assert_eq!(Reply::parse(b"okk"), Err(NotAReply));
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Reply {
    /// `ok`: the command was taken. Not that it has been done.
    Ok,
    /// `v`: a parameter's value: numbers or a text.
    Value(String),
    /// `r`: the value of a program register.
    Register(String),
    /// `e`.
    Error(ErrorCode),
}

/// Why a line is no reply.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("amplifier: line is not one of `ok`, `v ...`, `r ...`, `e ...`")]
pub struct NotAReply;

impl Reply {
    /// From a line without its end.
    ///
    /// # Errors
    /// When it has none of the four forms.
    pub fn parse(line: &[u8]) -> Result<Self, NotAReply> {
        let printable = line.iter().all(|byte| (0x20..0x7F).contains(byte));
        let text = core::str::from_utf8(line).map_err(|_| NotAReply)?;
        let text = text.trim_end();
        match (printable, text.split_once(' ')) {
            (true, None) if text == "ok" => Ok(Self::Ok),
            (true, Some(("v" | "V", value))) => Ok(Self::Value(value.trim().to_owned())),
            (true, Some(("r", value))) => Ok(Self::Register(value.trim().to_owned())),
            (true, Some(("e", code))) => match code.trim().parse() {
                Ok(code) => Ok(Self::Error(ErrorCode::from_raw(code))),
                Err(_) => Err(NotAReply),
            },
            (_, _) => Err(NotAReply),
        }
    }

    /// The line, its end included.
    pub fn emit(&self) -> Vec<u8> {
        let text = match self {
            Self::Ok => "ok\r".to_owned(),
            Self::Value(value) => format!("v {value}\r"),
            Self::Register(value) => format!("r {value}\r"),
            Self::Error(code) => format!("e {}\r", code.raw()),
        };
        text.into_bytes()
    }

    /// The value, when it is one number: decimal or hexadecimal.
    pub fn number(&self) -> Option<i64> {
        match self {
            Self::Value(value) => parse_number(value),
            Self::Ok | Self::Register(_) | Self::Error(_) => None,
        }
    }
}
