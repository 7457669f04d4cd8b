//! CAN over a serial line, as Lawicel's CAN232 and CANUSB speak it.
//!
//! Source: Lawicel AB, CAN232 manual version 3; the state and error reports (`s…`, `e…`) are
//! those that the Linux kernel's slcan driver understands (`drivers/net/can/slcan`).
//! A command ends with CR; the adapter answers CR (done) or BEL (refused).

use super::can::{CanFrame, CanId};
use bitflags::bitflags;

/// Ends every command and every answer but the refusal.
pub const CR: u8 = b'\r';
/// The adapter's refusal.
pub const BEL: u8 = 0x07;
/// Time stamps run from 0 to this, in milliseconds, and start again.
pub const TIMESTAMP_PERIOD_MS: u16 = 60_000;
/// The longest line: `T`, 8 digits, length, 16 digits, 4 digits of time stamp.
const LINE_MAX: usize = 30;

/// The bit rates that an adapter knows by a digit.
///
/// # Example
///
/// ```
/// use wire::slcan::{BitrateCode, Command};
///
/// let code = BitrateCode::new(125_000).expect("one of nine");
/// assert_eq!(Command::Bitrate(code).emit(), b"S4\r");
/// assert_eq!(BitrateCode::new(123_456), None);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct BitrateCode(u8);

impl BitrateCode {
    const BITRATES: [u32; 9] = [
        10_000, 20_000, 50_000, 100_000, 125_000, 250_000, 500_000, 800_000, 1_000_000,
    ];

    /// The code for `bitrate` in bit/s, `None` when the adapter has none.
    pub fn new(bitrate: u32) -> Option<Self> {
        let code = Self::BITRATES.iter().position(|known| *known == bitrate)?;
        Some(Self(code as u8))
    }

    /// The bit rate in bit/s.
    pub fn bitrate(self) -> u32 {
        Self::BITRATES[usize::from(self.0)]
    }
}

bitflags! {
    /// The answer to `F`.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
    pub struct StatusFlags: u8 {
        /// Receive queue full.
        const RX_FULL = 1 << 0;
        /// Transmit queue full.
        const TX_FULL = 1 << 1;
        /// Error warning.
        const WARNING = 1 << 2;
        /// Data overrun.
        const OVERRUN = 1 << 3;
        /// Error passive.
        const PASSIVE = 1 << 5;
        /// Arbitration lost.
        const ARBITRATION_LOST = 1 << 6;
        /// Bus error.
        const BUS_ERROR = 1 << 7;
        const _ = !0;
    }
}

/// What the host sends.
///
/// # Example
///
/// ```
/// use wire::can::CanFrame;
/// use wire::slcan::Command;
///
/// let frame = CanFrame::standard(0x100, &[0x11, 0x33]);
/// assert_eq!(Command::Transmit(frame).emit(), b"t10021133\r");
/// assert_eq!(Command::parse(b"t10021133"), Some(Command::Transmit(frame)));
/// assert_eq!(Command::parse(b"t1002113"), Some(Command::Unknown(b't')), "half a byte");
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Command {
    /// `Sn`: set the bit rate; only while closed.
    Bitrate(BitrateCode),
    /// `O`: open the channel.
    Open,
    /// `L`: open the channel, never transmit.
    OpenListenOnly,
    /// `C`: close the channel.
    Close,
    /// `t`, `T`, `r`, `R`: transmit.
    Transmit(CanFrame),
    /// `Zn`: time stamps on or off; only while closed.
    Timestamps(bool),
    /// `F`: read and clear the status flags.
    ReadStatus,
    /// `V`: read the version.
    ReadVersion,
    /// `N`: read the serial number.
    ReadSerial,
    /// A command that is not understood.
    Unknown(u8),
}

/// What the adapter sends.
///
/// # Example
///
/// ```
/// use wire::can::CanFrame;
/// use wire::slcan::Reply;
///
/// let reply = Reply::parse(b"t100211331234");
/// let frame = CanFrame::standard(0x100, &[0x11, 0x33]);
/// assert_eq!(reply, Reply::Received { frame, timestamp_ms: Some(0x1234) });
/// assert_eq!(Reply::parse(b""), Reply::Done, "a CR alone");
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reply {
    /// CR alone: done.
    Done,
    /// BEL: refused.
    Refused,
    /// `z` or `Z`: a standard or extended frame was queued for transmission.
    Queued,
    /// A frame from the bus, with the adapter's millisecond clock where it is on.
    Received {
        /// The frame.
        frame: CanFrame,
        /// Milliseconds, 0 to 59 999.
        timestamp_ms: Option<u16>,
    },
    /// `Fxx`.
    Status(StatusFlags),
    /// `Vhhss`: hardware and software version.
    Version([u8; 4]),
    /// `Nxxxx`.
    Serial([u8; 4]),
    /// `s[a|w|p|b|f]`: the controller's state changed.
    BusState(BusState),
    /// A line that is not understood.
    Unknown(u8),
}

/// The controller's state as some adapters report it unasked.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum BusState {
    /// Error active.
    Active,
    /// Error warning.
    Warning,
    /// Error passive.
    Passive,
    /// Off the bus.
    Off,
    /// Stopped.
    Stopped,
}

/// Collects the bytes of a stream into lines.
///
/// # Example
///
/// ```
/// use wire::slcan::{BEL, LineBuffer};
///
/// let mut buffer = LineBuffer::default();
/// let lines: Vec<_> = b"z\rt1\x07".iter().filter_map(|byte| buffer.push(*byte)).collect();
/// assert_eq!(lines, [b"z".to_vec(), vec![BEL]], "a refusal cuts the line");
/// ```
#[derive(Clone, Debug, Default)]
pub struct LineBuffer {
    line: Vec<u8>,
    overlong: bool,
    discarded: u64,
}

impl LineBuffer {
    /// How many over-long lines (garbage, a wrong baud rate) were thrown away.
    pub const fn discarded(&self) -> u64 {
        self.discarded
    }

    /// Takes one byte; returns a whole line (without its CR), or `[BEL]`, when it ends one.
    pub fn push(&mut self, byte: u8) -> Option<Vec<u8>> {
        match byte {
            CR => {
                let line = core::mem::take(&mut self.line);
                if core::mem::take(&mut self.overlong) {
                    self.discarded += 1;
                    return None;
                }
                Some(line)
            }
            BEL => {
                self.line.clear();
                self.overlong = false;
                Some(vec![BEL])
            }
            // Some adapters' monitors add line feeds; no command has one.
            b'\n' => None,
            _ if self.line.len() >= LINE_MAX => {
                self.overlong = true;
                None
            }
            _ => {
                self.line.push(byte);
                None
            }
        }
    }
}

impl Command {
    /// The bytes on the line, CR included.
    pub fn emit(&self) -> Vec<u8> {
        let mut line = match *self {
            Self::Bitrate(code) => vec![b'S', b'0' + code.0],
            Self::Open => vec![b'O'],
            Self::OpenListenOnly => vec![b'L'],
            Self::Close => vec![b'C'],
            Self::Transmit(ref frame) => emit_frame(frame),
            Self::Timestamps(on) => vec![b'Z', b'0' + u8::from(on)],
            Self::ReadStatus => vec![b'F'],
            Self::ReadVersion => vec![b'V'],
            Self::ReadSerial => vec![b'N'],
            Self::Unknown(byte) => vec![byte],
        };
        line.push(CR);
        line
    }

    /// From a line without its CR; `None` for an empty one (a host's way to clear the line).
    pub fn parse(line: &[u8]) -> Option<Self> {
        let (&head, rest) = line.split_first()?;
        Some(match (head, rest) {
            (b'S', [code @ b'0'..=b'8']) => Self::Bitrate(BitrateCode(code - b'0')),
            (b'O', []) => Self::Open,
            (b'L', []) => Self::OpenListenOnly,
            (b'C', []) => Self::Close,
            (b'Z', [b'0']) => Self::Timestamps(false),
            (b'Z', [b'1']) => Self::Timestamps(true),
            (b'F', []) => Self::ReadStatus,
            (b'V', []) => Self::ReadVersion,
            (b'N', []) => Self::ReadSerial,
            (b't' | b'T' | b'r' | b'R', _) => match parse_frame(line) {
                Some((frame, [])) => Self::Transmit(frame),
                _ => Self::Unknown(head),
            },
            _ => Self::Unknown(head),
        })
    }
}

impl Reply {
    /// The bytes on the line, CR included.
    pub fn emit(&self) -> Vec<u8> {
        let mut line = match *self {
            Self::Refused => return vec![BEL],
            Self::Done => Vec::new(),
            Self::Queued => vec![b'z'],
            Self::Received {
                ref frame,
                timestamp_ms,
            } => {
                let mut line = emit_frame(frame);
                if let Some(ms) = timestamp_ms {
                    line.extend_from_slice(format!("{ms:04X}").as_bytes());
                }
                line
            }
            Self::Status(flags) => format!("F{:02X}", flags.bits()).into_bytes(),
            Self::Version([a, b, c, d]) => vec![b'V', a, b, c, d],
            Self::Serial([a, b, c, d]) => vec![b'N', a, b, c, d],
            Self::BusState(state) => vec![b's', state.letter(), b'0', b'0', b'0', b'0', b'0', b'0'],
            Self::Unknown(byte) => vec![byte],
        };
        line.push(CR);
        line
    }

    /// From a line without its CR, or `[BEL]`.
    pub fn parse(line: &[u8]) -> Self {
        let Some((&head, rest)) = line.split_first() else {
            return Self::Done;
        };
        match (head, rest) {
            (BEL, _) => Self::Refused,
            (b'z' | b'Z', []) => Self::Queued,
            (b'V', &[a, b, c, d]) => Self::Version([a, b, c, d]),
            (b'N', &[a, b, c, d]) => Self::Serial([a, b, c, d]),
            (b'F', digits) => match hex(digits).and_then(|raw| u8::try_from(raw).ok()) {
                Some(raw) => Self::Status(StatusFlags::from_bits_retain(raw)),
                None => Self::Unknown(head),
            },
            (b's', &[letter, ..]) => {
                BusState::from_letter(letter).map_or(Self::Unknown(head), Self::BusState)
            }
            (b't' | b'T' | b'r' | b'R', _) => Self::parse_received(line),
            _ => Self::Unknown(head),
        }
    }

    fn parse_received(line: &[u8]) -> Self {
        let unknown = Self::Unknown(line[0]);
        let Some((frame, rest)) = parse_frame(line) else {
            return unknown;
        };
        if rest.is_empty() {
            return Self::Received {
                frame,
                timestamp_ms: None,
            };
        }
        match hex(rest) {
            Some(ms) if rest.len() == 4 => Self::Received {
                frame,
                timestamp_ms: Some(ms as u16),
            },
            _ => unknown,
        }
    }
}

impl BusState {
    const fn letter(self) -> u8 {
        match self {
            Self::Active => b'a',
            Self::Warning => b'w',
            Self::Passive => b'p',
            Self::Off => b'b',
            Self::Stopped => b'f',
        }
    }

    const fn from_letter(letter: u8) -> Option<Self> {
        Some(match letter {
            b'a' => Self::Active,
            b'w' => Self::Warning,
            b'p' => Self::Passive,
            b'b' => Self::Off,
            b'f' => Self::Stopped,
            _ => return None,
        })
    }
}

fn emit_frame(frame: &CanFrame) -> Vec<u8> {
    let text = match (frame.id(), frame.is_remote()) {
        (CanId::Standard(id), false) => format!("t{id:03X}"),
        (CanId::Standard(id), true) => format!("r{id:03X}"),
        (CanId::Extended(id), false) => format!("T{id:08X}"),
        (CanId::Extended(id), true) => format!("R{id:08X}"),
    };
    let mut line = text.into_bytes();
    line.push(b'0' + frame.len() as u8);
    for byte in frame.data() {
        line.push(hex_digit(byte >> 4));
        line.push(hex_digit(byte & 0x0F));
    }
    line
}

const fn hex_digit(nibble: u8) -> u8 {
    if nibble < 10 {
        b'0' + nibble
    } else {
        b'A' + nibble - 10
    }
}

/// The frame at the start of `line`, and what follows it.
fn parse_frame(line: &[u8]) -> Option<(CanFrame, &[u8])> {
    let (&head, rest) = line.split_first()?;
    let id_digits = if head.is_ascii_uppercase() { 8 } else { 3 };
    let (id, rest) = rest.split_at_checked(id_digits)?;
    let id = hex(id)?;
    let id = match head {
        b't' | b'r' => CanId::standard(u16::try_from(id).ok()?)?,
        _ => CanId::extended(id)?,
    };
    let (&length, rest) = rest.split_first()?;
    let length = length.checked_sub(b'0').filter(|length| *length <= 8)?;
    if matches!(head, b'r' | b'R') {
        return Some((CanFrame::remote(id, length)?, rest));
    }
    let (digits, rest) = rest.split_at_checked(usize::from(length) * 2)?;
    let mut data = [0; 8];
    for (byte, pair) in data.iter_mut().zip(digits.chunks_exact(2)) {
        *byte = hex(pair)? as u8;
    }
    Some((CanFrame::new(id, &data[..usize::from(length)])?, rest))
}

/// Up to 8 hexadecimal digits.
fn hex(digits: &[u8]) -> Option<u32> {
    if digits.is_empty() || digits.len() > 8 {
        return None;
    }
    digits.iter().try_fold(0, |value, digit| {
        Some(value << 4 | char::from(*digit).to_digit(16)?)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn frame(text: &[u8]) -> Option<CanFrame> {
        match Command::parse(text) {
            Some(Command::Transmit(frame)) => Some(frame),
            _ => None,
        }
    }

    /// The examples of the CAN232 manual, version 3.
    #[test]
    fn the_manuals_examples_are_understood() {
        assert_eq!(frame(b"t10021133").unwrap().to_string(), "100#1133");
        assert_eq!(
            frame(b"T0000010021133").unwrap().to_string(),
            "00000100#1133"
        );
        assert_eq!(frame(b"r1002").unwrap().to_string(), "100#R2");
        assert_eq!(
            Command::Bitrate(BitrateCode::new(125_000).unwrap()).emit(),
            b"S4\r"
        );
    }

    #[test]
    fn a_time_stamp_follows_the_data() {
        let reply = Reply::parse(b"t100211331234");
        let Reply::Received {
            frame,
            timestamp_ms,
        } = reply
        else {
            panic!("{reply:?}")
        };
        assert_eq!(frame.to_string(), "100#1133");
        assert_eq!(timestamp_ms, Some(0x1234));
        assert_eq!(reply.emit(), b"t100211331234\r");
    }

    #[test]
    fn damaged_frames_are_unknown_never_guessed() {
        for line in [
            &b"t1002113"[..],
            b"t10091133",
            b"t8002113",
            b"tXYZ0",
            b"t100211331",
        ] {
            assert!(frame(line).is_none(), "{line:?}");
        }
        assert_eq!(Reply::parse(b"t1002113312"), Reply::Unknown(b't'));
    }

    #[test]
    fn a_refusal_cuts_the_line_and_garbage_is_skipped_to_the_next_cr() {
        let mut buffer = LineBuffer::default();
        let lines: Vec<_> = b"z\rt1\x07\r"
            .iter()
            .filter_map(|b| buffer.push(*b))
            .collect();
        assert_eq!(lines, [b"z".to_vec(), vec![BEL], Vec::new()]);
        let garbage = [[b'x'; 90].as_slice(), b"\rF08\r"].concat();
        let lines: Vec<_> = garbage.iter().filter_map(|b| buffer.push(*b)).collect();
        assert_eq!(lines, [b"F08".to_vec()]);
        assert_eq!(buffer.discarded(), 1);
    }

    proptest! {
        #[test]
        fn frames_survive_the_line(id in 0u16..0x800, data in prop::collection::vec(any::<u8>(), 0..=8)) {
            let sent = CanFrame::standard(id, &data);
            let line = Command::Transmit(sent).emit();
            prop_assert_eq!(frame(&line[..line.len() - 1]), Some(sent));
        }

        #[test]
        fn no_line_makes_the_parser_panic(line in prop::collection::vec(any::<u8>(), 0..40)) {
            let _ = Command::parse(&line);
            let _ = Reply::parse(&line);
        }
    }
}
