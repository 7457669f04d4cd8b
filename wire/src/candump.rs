//! The log format of `candump -L`: `(seconds.micros) interface identifier#data [R|T]`.
//!
//! Source: can-utils, `candump -L` and, for the direction letter, `candump -L -x`.

use super::can::{BusError, CanFrame, CanId};
use units::Time;

/// In an identifier of eight digits: this is an error frame.
const ERROR_FLAG: u32 = 0x2000_0000;

/// What was on the bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Content {
    /// A data or remote frame.
    Frame(CanFrame),
    /// An error frame.
    Error(BusError),
}

/// From whose point of view a frame was seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// From somebody else (`R`).
    Received,
    /// By the host that wrote the log (`T`).
    Transmitted,
}

/// One line of a log.
///
/// # Example
///
/// ```
/// use wire::candump::{Content, Direction, Record};
///
/// let line = "(0000000012.000000) can0 705#7F T";
/// let record = Record::parse(line).expect("a line of candump");
/// assert_eq!((record.at.seconds(), record.direction), (12.0, Some(Direction::Transmitted)));
/// assert!(matches!(record.content, Content::Frame(frame) if frame.data() == [0x7F]));
/// assert_eq!(record.emit(), line);
/// assert_eq!(Record::parse("can0 705#7F"), None, "no time");
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Record {
    /// When, to the microsecond.
    pub at: Time,
    /// The interface's name.
    pub interface: String,
    /// What.
    pub content: Content,
    /// `None` where the log does not say.
    pub direction: Option<Direction>,
}

impl Record {
    /// The line without its end.
    pub fn emit(&self) -> String {
        let micros = self.at.nanos() / 1_000;
        let body = match self.content {
            Content::Frame(frame) => frame.to_string(),
            Content::Error(error) => emit_error(&error),
        };
        let direction = match self.direction {
            None => "",
            Some(Direction::Received) => " R",
            Some(Direction::Transmitted) => " T",
        };
        let (seconds, rest) = (micros / 1_000_000, micros % 1_000_000);
        format!(
            "({seconds:010}.{rest:06}) {} {body}{direction}",
            self.interface
        )
    }

    /// From a line without its end; `None` when it is not of the format.
    pub fn parse(line: &str) -> Option<Self> {
        let mut words = line.split_ascii_whitespace();
        let stamp = words.next()?.strip_prefix('(')?.strip_suffix(')')?;
        let (seconds, micros) = stamp.split_once('.')?;
        if micros.len() != 6 {
            return None;
        }
        let micros: u64 = micros.parse().ok()?;
        let nanos = seconds.parse::<u64>().ok()?.checked_mul(1_000_000_000)?;
        let at = Time(nanos.checked_add(micros * 1_000)?);
        let interface = words.next()?.to_owned();
        let content = parse_content(words.next()?)?;
        let direction = match words.next() {
            None => None,
            Some("R") => Some(Direction::Received),
            Some("T") => Some(Direction::Transmitted),
            Some(_) => return None,
        };
        Some(Self {
            at,
            interface,
            content,
            direction,
        })
    }
}

fn emit_error(error: &BusError) -> String {
    let (class, data) = error.emit();
    let frame = CanFrame::new(CanId::Extended(class), &data).expect("8 bytes fit a frame");
    let text = frame.to_string();
    let (_, data) = text.split_once('#').expect("a frame's text has a #");
    format!("{:08X}#{data}", class | ERROR_FLAG)
}

fn parse_content(text: &str) -> Option<Content> {
    let (id, body) = text.split_once('#')?;
    let raw = u32::from_str_radix(id, 16).ok()?;
    let id = match id.len() {
        3 => CanId::standard(u16::try_from(raw).ok()?)?,
        8 => CanId::Extended(raw & CanId::EXTENDED_MAX),
        _ => return None,
    };
    if let Some(length) = body.strip_prefix('R') {
        let length = if length.is_empty() {
            0
        } else {
            length.parse().ok()?
        };
        return Some(Content::Frame(CanFrame::remote(id, length)?));
    }
    let mut data = [0; 8];
    let length = body.len() / 2;
    if !body.is_ascii() || !body.len().is_multiple_of(2) || length > 8 {
        return None;
    }
    for (at, byte) in data.iter_mut().enumerate().take(length) {
        *byte = u8::from_str_radix(&body[at * 2..at * 2 + 2], 16).ok()?;
    }
    let payload = &data[..length];
    if raw & ERROR_FLAG != 0 && matches!(id, CanId::Extended(_)) {
        return Some(Content::Error(BusError::parse(raw & !ERROR_FLAG, payload)));
    }
    Some(Content::Frame(CanFrame::new(id, payload)?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(line: &str) -> Record {
        let record = Record::parse(line).expect(line);
        assert_eq!(record.emit(), line);
        record
    }

    #[test]
    fn lines_of_candump_read_both_ways() {
        let record = check("(1436509052.249713) vcan0 044#2A366C2BBA");
        assert_eq!(record.at, Time(1_436_509_052_249_713_000));
        check("(0000000000.000001) can0 181#");
        check("(0000000012.000000) can0 12345678#R4");
        check("(0000000012.000000) can0 705#7F T");
        check("(0000000012.500000) can0 20000204#0030000000000000 R");
    }

    #[test]
    fn damaged_lines_are_refused() {
        for line in [
            "(1.5) can0 1#",
            "(1.000000) can0 123#1",
            "can0 123#11",
            "(1.000000) can0 123#11 X",
        ] {
            assert_eq!(Record::parse(line), None, "{line}");
        }
    }
}
