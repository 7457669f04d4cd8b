//! Writes down everything that passes a transport, as `candump -L` text.
//!
//! CAN frames and error frames are lines that can-utils read, with a direction letter.
//! What candump has no words for stands in comment lines of the same time stamps:
//!
//! ```text
//! # truestage recording 1
//! # port 0 can0
//! (0000000000.001000) can0 601#4000100000000000 T
//! # (0000000000.002000) laser R 323435360A
//! # (0000000000.002500) amps baud 115200
//! # (0000000000.002600) amps break on
//! # (0000000000.003000) can0 lost 3
//! # (0000000000.004000) can0 link down
//! # (0000000000.005000) can0 sync 2000000
//! ```
//!
//! Stamps have microseconds, as candump's; so that a replay tells the same story as the
//! recording, the recorded machine is told the same times: rounded up to microseconds.
//! SYNCs of the SYNC thread do not pass the transport; only its period is noted (in ns).

use core::time::Duration;
use std::collections::BTreeMap;
use std::io;
use units::Time;
use wire::LineControl;
use wire::candump::{Content, Direction, Record};
use wire::{Arrival, Input, LinkState, Payload, Port, Ports};

use super::{SendError, SyncStatistics, Transport};

/// The first line of a recording.
pub(super) const HEADER: &str = "# truestage recording 1";

/// The moment as a recording has it. Rounded up: what came after a moment comes after it still.
pub(super) const fn rounded(at: Time) -> Time {
    const MICROSECOND: u64 = 1_000;
    match at.nanos().checked_next_multiple_of(MICROSECOND) {
        Some(nanos) => Time(nanos),
        None => Time::NEVER,
    }
}

/// A transport that writes down what passes.
///
/// # Example
///
/// ```
/// use drivers::transport::{Transport, record::Recorder, replay::Replay};
/// use wire::{Payload, Port};
///
/// let (nothing, names) = (Replay::parse("", &[])?, [(Port(3), "laser")]);
/// let mut recorder = Recorder::new(nothing, Vec::new(), &names)?;
/// recorder.send(Port(3), &Payload::Bytes(b"#01\r".to_vec()))?;
/// let (_, text) = recorder.finish()?;
/// let text = String::from_utf8(text)?;
/// let bytes = "# (0000000000.000000) laser T 2330310D";
/// assert_eq!(text.lines().collect::<Vec<_>>(), ["# truestage recording 1", "# port 3 laser", bytes]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct Recorder<T, W> {
    inner: T,
    writer: W,
    names: BTreeMap<Port, String>,
    failure: Option<io::Error>,
}

impl<T: Transport, W: io::Write> Recorder<T, W> {
    /// Records `inner` to `writer` (buffer it), `names` being how the ports are called.
    ///
    /// # Errors
    /// When the head of the recording cannot be written.
    pub fn new(inner: T, mut writer: W, names: &[(Port, &str)]) -> io::Result<Self> {
        writeln!(writer, "{HEADER}")?;
        for (port, name) in names {
            writeln!(writer, "# port {} {name}", port.0)?;
        }
        let names = names
            .iter()
            .map(|(port, name)| (*port, (*name).to_owned()))
            .collect();
        Ok(Self {
            inner,
            writer,
            names,
            failure: None,
        })
    }

    /// The transport.
    pub const fn inner(&self) -> &T {
        &self.inner
    }

    /// The transport, to do what the trait cannot.
    pub const fn inner_mut(&mut self) -> &mut T {
        &mut self.inner
    }

    /// Why the recording has stopped, if it has; the transport itself goes on.
    pub const fn failure(&self) -> Option<&io::Error> {
        self.failure.as_ref()
    }

    /// Ends the recording.
    ///
    /// # Errors
    /// When a line could not be written.
    pub fn finish(mut self) -> io::Result<(T, W)> {
        match self.failure {
            Some(failure) => Err(failure),
            None => {
                self.writer.flush()?;
                Ok((self.inner, self.writer))
            }
        }
    }

    fn name(&mut self, port: Port) -> String {
        if let Some(name) = self.names.get(&port) {
            return name.clone();
        }
        let name = format!("port{}", port.0);
        self.line(&format!("# port {} {name}", port.0));
        self.names.insert(port, name.clone());
        name
    }

    /// After the first failure nothing more is written: a recording has no holes.
    fn line(&mut self, line: &str) {
        if self.failure.is_none() {
            self.failure = writeln!(self.writer, "{line}").err();
        }
    }

    fn comment(&mut self, at: Time, port: Port, what: &str) {
        let name = self.name(port);
        self.line(&format!("# {} {name} {what}", stamp(at)));
    }

    fn content(&mut self, at: Time, port: Port, content: Content, direction: Direction) {
        let record = Record {
            at,
            interface: self.name(port),
            content,
            direction: Some(direction),
        };
        self.line(&record.emit());
    }

    fn payload(&mut self, at: Time, port: Port, payload: &Payload, direction: Direction) {
        match payload {
            Payload::Frame(frame) => self.content(at, port, Content::Frame(*frame), direction),
            Payload::Bytes(bytes) => {
                let letter = match direction {
                    Direction::Received => 'R',
                    Direction::Transmitted => 'T',
                };
                self.comment(at, port, &format!("{letter} {}", hex(bytes)));
            }
            Payload::Control(control) => self.comment(at, port, &control_words(*control)),
        }
    }

    fn arrival(&mut self, arrival: &Arrival) {
        let Arrival { port, at, input } = arrival;
        let (port, at) = (*port, *at);
        match input {
            Input::Payload(payload) => self.payload(at, port, payload, Direction::Received),
            Input::BusError(error) => {
                self.content(at, port, Content::Error(*error), Direction::Received);
            }
            Input::Lost(count) => self.comment(at, port, &format!("lost {count}")),
            Input::Link(state) => {
                self.comment(at, port, &format!("link {}", link_word(*state)));
            }
        }
    }
}

impl<T: Transport, W: io::Write> Transport for Recorder<T, W> {
    fn now(&self) -> Time {
        rounded(self.inner.now())
    }

    fn send(&mut self, port: Port, payload: &Payload) -> Result<(), SendError> {
        let at = self.now();
        let result = self.inner.send(port, payload);
        match &result {
            Ok(()) => self.payload(at, port, payload, Direction::Transmitted),
            Err(error) => self.comment(at, port, &format!("refused {error}")),
        }
        result
    }

    fn receive(&mut self, until: Time) -> Option<Arrival> {
        self.receive_unhurried(until, Ports::NONE)
    }

    fn receive_unhurried(&mut self, until: Time, unhurried: Ports) -> Option<Arrival> {
        let mut arrival = self.inner.receive_unhurried(rounded(until), unhurried)?;
        arrival.at = rounded(arrival.at);
        self.arrival(&arrival);
        Some(arrival)
    }

    fn sleep_until(&mut self, until: Time) {
        self.inner.sleep_until(rounded(until));
    }

    fn sync_statistics(&self, port: Port) -> Option<SyncStatistics> {
        self.inner.sync_statistics(port)
    }

    fn set_sync(&mut self, port: Port, period: Option<Duration>) -> Result<(), SendError> {
        let at = self.now();
        let result = self.inner.set_sync(port, period);
        if result.is_ok() {
            let nanos = period.map_or(0, |period| period.as_nanos());
            self.comment(at, port, &format!("sync {nanos}"));
        }
        result
    }
}

/// As candump writes it.
fn stamp(at: Time) -> String {
    let micros = at.nanos() / 1_000;
    format!("({:010}.{:06})", micros / 1_000_000, micros % 1_000_000)
}

pub(super) const fn link_word(state: LinkState) -> &'static str {
    match state {
        LinkState::Up => "up",
        LinkState::Down => "down",
        LinkState::Gone => "gone",
    }
}

/// Only the host does such things: they need no direction letter.
pub(super) fn control_words(control: LineControl) -> String {
    match control {
        LineControl::Baud(baud) => format!("baud {baud}"),
        LineControl::Break(true) => "break on".to_owned(),
        LineControl::Break(false) => "break off".to_owned(),
    }
}

fn hex(bytes: &[u8]) -> String {
    use core::fmt::Write as _;
    bytes.iter().fold(String::new(), |mut text, byte| {
        write!(text, "{byte:02X}").expect("writing to a string does not fail");
        text
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::transport::replay::Replay;
    use wire::can::{BusError, CanFrame};

    const LOG: &str = "\
# truestage recording 1
# port 0 can0
# port 3 laser
(0000000000.001000) can0 601#4000100000000000 T
(0000000000.001500) can0 581#4300100092010200 R
# (0000000000.002000) laser R 313233
# (0000000000.002000) laser T 2330310D
# (0000000000.002000) laser baud 115200
# (0000000000.002000) laser break on
# (0000000000.002000) laser break off
(0000000000.002500) can0 20000040#0000000000000000 R
# (0000000000.003000) can0 lost 3
# (0000000000.004000) can0 link down
";

    /// Plays `LOG` to a recorder and does what the log says was done.
    fn copy(writer: &mut Vec<u8>) -> io::Result<()> {
        let replay = Replay::parse(LOG, &[]).unwrap();
        let names = [(Port(0), "can0"), (Port(3), "laser")];
        let mut recorder = Recorder::new(replay, writer, &names)?;
        assert_eq!(recorder.receive(Time(1_000_000)), None);
        let request = CanFrame::standard(0x601, &[0x40, 0, 0x10, 0, 0, 0, 0, 0]);
        recorder.send(Port(0), &Payload::Frame(request)).unwrap();
        assert!(recorder.receive(Time::NEVER).is_some());
        assert!(recorder.receive(Time::NEVER).is_some());
        let poll = Payload::Bytes(b"#01\r".to_vec());
        recorder.send(Port(3), &poll).unwrap();
        for control in [
            LineControl::Baud(115_200),
            LineControl::Break(true),
            LineControl::Break(false),
        ] {
            recorder.send(Port(3), &Payload::Control(control)).unwrap();
        }
        while recorder.receive(Time(5_000_000)).is_some() {}
        let (replay, _) = recorder.finish()?;
        assert_eq!(replay.report().matched, 5);
        Ok(())
    }

    #[test]
    fn a_recording_of_a_replay_is_the_recording() {
        let mut text = Vec::new();
        copy(&mut text).unwrap();
        assert_eq!(String::from_utf8(text).unwrap(), LOG);
    }

    #[test]
    fn can_lines_are_candumps() {
        let error = BusError::parse(0x40, &[0; 8]);
        let records: Vec<_> = LOG.lines().filter_map(Record::parse).collect();
        assert_eq!(records.len(), 3);
        assert_eq!(records[2].content, Content::Error(error));
    }

    /// A disk that is full after some bytes.
    struct Full(usize);

    impl io::Write for Full {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            let taken = bytes.len().min(self.0);
            self.0 -= taken;
            if taken == 0 {
                return Err(io::ErrorKind::StorageFull.into());
            }
            Ok(taken)
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn a_full_disk_ends_the_recording_but_not_the_machine() {
        let replay = Replay::parse(LOG, &[]).unwrap();
        let mut recorder = Recorder::new(replay, Full(60), &[(Port(0), "can0")]).unwrap();
        let arrivals = core::iter::from_fn(|| recorder.receive(Time::NEVER)).count();
        assert_eq!(arrivals, 5);
        assert!(recorder.failure().is_some());
        assert!(recorder.finish().is_err());
    }
}
