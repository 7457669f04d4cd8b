//! Plays a recording back in virtual time, and checks that the host says what it said.
//!
//! Arrivals come at their recorded moments. What is sent is compared, port by port and in
//! order, with the recorded `T` lines; the format is that of [`super::record`], and plain
//! candump logs are read as well (there nothing is known to have been sent).

use core::fmt;
use core::time::Duration;
use std::collections::{BTreeMap, VecDeque};
use units::Time;
use wire::LineControl;
use wire::candump::{Content, Direction, Record};
use wire::{Arrival, Input, LinkState, Payload, Port};

use super::record::rounded;
use super::{SendError, Transport};

/// How many recorded sendings a single one may leave out and still be recognised.
const LOOK_AHEAD: usize = 32;
/// Mismatches beyond this are counted, not kept.
const KEPT_MAX: usize = 1_000;

/// A line of a recording that cannot be read.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("recording, line {line}: {cause}")]
pub struct ReplayError {
    /// Counted from 1.
    pub line: usize,
    /// What is wrong with it.
    pub cause: ReplayCause,
}

/// What is wrong with a line of a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReplayCause {
    /// Neither candump's format nor a known comment.
    Syntax,
    /// Earlier than the line before it.
    OutOfOrder,
    /// More than 256 port names.
    TooManyPorts,
    /// The recording is of a newer format.
    Version,
}

impl fmt::Display for ReplayCause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Syntax => "is neither a line of candump -L nor a known comment",
            Self::OutOfOrder => "is earlier than the one before",
            Self::TooManyPorts => "names more than 256 ports",
            Self::Version => "is in a format newer than this program",
        })
    }
}

/// Something sent otherwise than recorded.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Mismatch {
    /// When it was sent; for what was left out, when the next thing was sent instead.
    pub at: Time,
    /// Where.
    pub port: Port,
    /// What the recording has there, `None` for nothing.
    pub recorded: Option<Payload>,
    /// What was sent, `None` for nothing.
    pub sent: Option<Payload>,
}

/// How far what was sent agrees with the recording.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ReplayReport {
    /// Sent as recorded.
    pub matched: u64,
    /// Sent otherwise, or left out.
    pub mismatched: u64,
    /// The first of the mismatches.
    pub mismatches: Vec<Mismatch>,
    /// Recorded, but not (yet) sent.
    pub missing: usize,
}

/// A recording as a transport.
///
/// # Example
///
/// ```
/// use drivers::transport::{Transport, replay::Replay};
/// use units::Time;
/// use wire::{Payload, Port, can::CanFrame};
///
/// let log = "(0000000010.000000) can0 705#00 R\n(0000000010.000100) can0 000#0105 T\n";
/// let mut replay = Replay::parse(log, &[(Port(4), "can0")])?;
/// let boot_up = replay.receive(Time::NEVER).expect("one frame arrived");
/// assert_eq!((boot_up.port, boot_up.at), (Port(4), Time::from_seconds(10.0)));
/// replay.send(Port(4), &Payload::Frame(CanFrame::standard(0, &[0x81, 5])))?;
/// let report = replay.report();
/// assert_eq!((report.matched, report.mismatched), (0, 1), "a reset instead of a start");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Replay {
    now: Time,
    ports: BTreeMap<String, Port>,
    arrivals: VecDeque<Arrival>,
    expected: BTreeMap<Port, VecDeque<Payload>>,
    report: ReplayReport,
}

impl Replay {
    /// Reads a recording. `ports` says which interface is which port; those that it does not
    /// name are as the recording's head says, or numbered in the order of appearance.
    ///
    /// # Errors
    /// The first line that cannot be read.
    pub fn parse(text: &str, ports: &[(Port, &str)]) -> Result<Self, ReplayError> {
        let mut reader = Reader::new(ports);
        for (at, line) in text.lines().enumerate() {
            reader.line(line).map_err(|cause| ReplayError {
                line: at + 1,
                cause,
            })?;
        }
        Ok(reader.replay)
    }

    /// The port of an interface name.
    pub fn port(&self, name: &str) -> Option<Port> {
        self.ports.get(name).copied()
    }

    /// Whether everything that arrived has been played.
    pub fn is_over(&self) -> bool {
        self.arrivals.is_empty()
    }

    /// How far what was sent agrees with the recording.
    pub fn report(&self) -> ReplayReport {
        let missing = self.expected.values().map(VecDeque::len).sum();
        ReplayReport {
            missing,
            ..self.report.clone()
        }
    }

    fn mismatch(&mut self, port: Port, recorded: Option<Payload>, sent: Option<Payload>) {
        self.report.mismatched += 1;
        if self.report.mismatches.len() < KEPT_MAX {
            let at = self.now;
            self.report.mismatches.push(Mismatch {
                at,
                port,
                recorded,
                sent,
            });
        }
    }
}

impl Transport for Replay {
    fn now(&self) -> Time {
        self.now
    }

    /// Never fails: a recording has no say in what fits on its ports.
    fn send(&mut self, port: Port, payload: &Payload) -> Result<(), SendError> {
        let expected = self.expected.entry(port).or_default();
        let found = expected
            .iter()
            .take(LOOK_AHEAD)
            .position(|recorded| recorded == payload);
        match found {
            Some(at) => {
                let left_out: Vec<_> = expected.drain(..=at).take(at).collect();
                for recorded in left_out {
                    self.mismatch(port, Some(recorded), None);
                }
                self.report.matched += 1;
            }
            None => {
                let recorded = expected.front().cloned();
                self.mismatch(port, recorded, Some(payload.clone()));
            }
        }
        Ok(())
    }

    fn receive(&mut self, until: Time) -> Option<Arrival> {
        let until = rounded(until);
        match self.arrivals.front() {
            Some(next) if next.at <= until.max(self.now) => {
                self.now = self.now.max(next.at);
                self.arrivals.pop_front()
            }
            _ => {
                self.now = self.now.max(until);
                None
            }
        }
    }

    fn sleep_until(&mut self, until: Time) {
        self.now = self.now.max(rounded(until));
    }

    fn set_sync(&mut self, _port: Port, _period: Option<Duration>) -> Result<(), SendError> {
        Ok(())
    }
}

struct Reader {
    replay: Replay,
    latest: Time,
}

impl Reader {
    fn new(ports: &[(Port, &str)]) -> Self {
        let ports = ports
            .iter()
            .map(|(port, name)| ((*name).to_owned(), *port))
            .collect();
        let replay = Replay {
            now: Time::ZERO,
            ports,
            arrivals: VecDeque::new(),
            expected: BTreeMap::new(),
            report: ReplayReport::default(),
        };
        Self {
            replay,
            latest: Time::ZERO,
        }
    }

    fn line(&mut self, line: &str) -> Result<(), ReplayCause> {
        let line = line.trim();
        if line.is_empty() {
            return Ok(());
        }
        let Some(comment) = line.strip_prefix('#') else {
            let record = Record::parse(line).ok_or(ReplayCause::Syntax)?;
            return self.record(record);
        };
        let comment = comment.trim_start();
        if comment.starts_with('(') {
            return self.event(comment);
        }
        match comment.split_ascii_whitespace().collect::<Vec<_>>()[..] {
            ["truestage", "recording", version] if version != "1" => Err(ReplayCause::Version),
            ["port", number, name] => {
                let number = number.parse().map_err(|_| ReplayCause::Syntax)?;
                let ports = &mut self.replay.ports;
                ports.entry(name.to_owned()).or_insert(Port(number));
                Ok(())
            }
            _ => Ok(()),
        }
    }

    fn record(&mut self, record: Record) -> Result<(), ReplayCause> {
        let port = self.port(&record.interface)?;
        match (record.content, record.direction) {
            (Content::Frame(frame), Some(Direction::Transmitted)) => {
                self.sent(record.at, port, Payload::Frame(frame))
            }
            (Content::Frame(frame), _) => {
                self.arrived(record.at, port, Input::Payload(Payload::Frame(frame)))
            }
            (Content::Error(error), _) => self.arrived(record.at, port, Input::BusError(error)),
        }
    }

    /// A comment with a time stamp: what candump has no words for.
    fn event(&mut self, comment: &str) -> Result<(), ReplayCause> {
        let syntax = ReplayCause::Syntax;
        let (stamp, rest) = comment.split_once(' ').ok_or(syntax)?;
        // The codec knows the stamps of frames only.
        let stamp = Record::parse(&format!("{stamp} x 000#")).ok_or(syntax)?.at;
        let (name, rest) = rest.split_once(' ').ok_or(syntax)?;
        let port = self.port(name)?;
        let (word, rest) = rest.split_once(' ').ok_or(syntax)?;
        match word {
            "R" => {
                let bytes = unhex(rest).ok_or(syntax)?;
                self.arrived(stamp, port, Input::Payload(Payload::Bytes(bytes)))
            }
            "T" => {
                let bytes = unhex(rest).ok_or(syntax)?;
                self.sent(stamp, port, Payload::Bytes(bytes))
            }
            "lost" => {
                let count = rest.parse().map_err(|_| syntax)?;
                self.arrived(stamp, port, Input::Lost(count))
            }
            "link" => {
                let state = parse_link(rest).ok_or(syntax)?;
                self.arrived(stamp, port, Input::Link(state))
            }
            "baud" | "break" => {
                let control = parse_control(word, rest).ok_or(syntax)?;
                self.sent(stamp, port, Payload::Control(control))
            }
            "sync" | "refused" => Ok(()),
            _ => Err(syntax),
        }
    }

    fn port(&mut self, name: &str) -> Result<Port, ReplayCause> {
        let ports = &mut self.replay.ports;
        if let Some(port) = ports.get(name) {
            return Ok(*port);
        }
        let free = (0..=u8::MAX).find(|number| ports.values().all(|port| port.0 != *number));
        let port = Port(free.ok_or(ReplayCause::TooManyPorts)?);
        ports.insert(name.to_owned(), port);
        Ok(port)
    }

    /// A sending may be noted slightly before an arrival that the kernel stamped earlier.
    fn arrived(&mut self, at: Time, port: Port, input: Input) -> Result<(), ReplayCause> {
        const DISORDER_MAX: Duration = Duration::from_secs(2);
        if at + DISORDER_MAX < self.latest {
            return Err(ReplayCause::OutOfOrder);
        }
        self.latest = self.latest.max(at);
        self.replay.arrivals.push_back(Arrival { port, at, input });
        Ok(())
    }

    #[expect(clippy::unnecessary_wraps, reason = "as its sister `arrived`")]
    fn sent(&mut self, at: Time, port: Port, payload: Payload) -> Result<(), ReplayCause> {
        self.latest = self.latest.max(at);
        let expected = self.replay.expected.entry(port).or_default();
        expected.push_back(payload);
        Ok(())
    }
}

fn parse_link(word: &str) -> Option<LinkState> {
    [LinkState::Up, LinkState::Down, LinkState::Gone]
        .into_iter()
        .find(|state| super::record::link_word(*state) == word)
}

fn parse_control(word: &str, rest: &str) -> Option<LineControl> {
    match (word, rest) {
        ("baud", rate) => rate.parse().ok().map(LineControl::Baud),
        ("break", "on") => Some(LineControl::Break(true)),
        ("break", "off") => Some(LineControl::Break(false)),
        _ => None,
    }
}

fn unhex(text: &str) -> Option<Vec<u8>> {
    if !text.len().is_multiple_of(2) || !text.bytes().all(|byte| byte.is_ascii_hexdigit()) {
        return None;
    }
    (0..text.len() / 2)
        .map(|at| u8::from_str_radix(&text[at * 2..at * 2 + 2], 16).ok())
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use wire::can::CanFrame;

    const LOG: &str = "\
(0000000010.000000) vcan0 705#00
(0000000010.000100) vcan0 000#0105 T
(0000000010.000200) vcan0 000#8105 T
(0000000010.000300) vcan0 705#7F R
";

    fn frame(id: u16, data: &[u8]) -> Payload {
        Payload::Frame(CanFrame::standard(id, data))
    }

    #[test]
    fn arrivals_come_at_their_recorded_moments() {
        let mut replay = Replay::parse(LOG, &[(Port(4), "vcan0")]).unwrap();
        assert_eq!(replay.receive(Time::from_seconds(9.0)), None);
        assert_eq!(replay.now(), Time::from_seconds(9.0));
        let first = replay.receive(Time::NEVER).unwrap();
        assert_eq!((first.port, first.at), (Port(4), Time::from_seconds(10.0)));
        assert_eq!(first.input, Input::Payload(frame(0x705, &[0])));
        assert!(replay.receive(Time::NEVER).is_some());
        assert!(replay.is_over());
    }

    #[test]
    fn what_is_sent_otherwise_is_reported() {
        let mut replay = Replay::parse(LOG, &[]).unwrap();
        let port = replay.port("vcan0").unwrap();
        replay.send(port, &frame(0x000, &[2, 5])).unwrap();
        replay.send(port, &frame(0x000, &[0x81, 5])).unwrap();
        let report = replay.report();
        assert_eq!(
            (report.matched, report.mismatched, report.missing),
            (1, 2, 0)
        );
        assert_eq!(report.mismatches[0].sent, Some(frame(0, &[2, 5])));
        assert_eq!(report.mismatches[1].recorded, Some(frame(0, &[1, 5])));
        assert_eq!(report.mismatches[1].sent, None);
    }

    #[test]
    fn what_was_not_sent_at_all_is_missing() {
        let replay = Replay::parse(LOG, &[]).unwrap();
        assert_eq!(replay.report().missing, 2);
    }

    #[track_caller]
    fn check(line: &str, cause: ReplayCause) {
        let text = format!("{LOG}{line}\n");
        let error = Replay::parse(&text, &[]).unwrap_err();
        assert_eq!(error, ReplayError { line: 5, cause });
    }

    #[test]
    fn damaged_lines_are_named() {
        check("(1.0) vcan0 705#00", ReplayCause::Syntax);
        check("(0000000001.000000) vcan0 705#00", ReplayCause::OutOfOrder);
        check("# (0000000011.000000) laser R 2A3", ReplayCause::Syntax);
        check(
            "# (0000000011.000000) vcan0 link sideways",
            ReplayCause::Syntax,
        );
        check("# truestage recording 2", ReplayCause::Version);
    }

    #[test]
    fn other_comments_are_passed_over() {
        let text = format!("# measured on a Monday\n\n{LOG}");
        assert!(Replay::parse(&text, &[]).is_ok());
    }
}
