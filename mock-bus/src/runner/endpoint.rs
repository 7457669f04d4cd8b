//! One port of the machine in the real world.

use std::io;
use std::os::fd::BorrowedFd;
use std::path::{Path, PathBuf};

use units::Time;
use wire::can::CanFrame;
use wire::lockstep::Passed;
use wire::{LineControl, Payload, Port};

use super::pty::Pty;
use super::slcan_adapter::{Action, SlcanAdapter};
use super::vcan::Vcan;
use crate::config::PortConfig;
use crate::simulation::{Event, Link, Simulation};

/// Reads of one wake-up: a client that never stops must not stop the clock.
const READS_MAX: usize = 64;

pub(super) struct Endpoint {
    port: Port,
    link: Option<PathBuf>,
    kind: Kind,
}

/// What an adapter answers to what it was told.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Answered {
    /// Bytes.
    pub(super) units: usize,
    /// Somebody waits for it: it is not just that a frame was taken.
    pub(super) is_awaited: bool,
}

impl Answered {
    fn note(&mut self, reply: &[u8]) {
        self.units += reply.len();
        self.is_awaited |= !matches!(reply, b"z\r" | b"Z\r");
    }

    fn add(&mut self, more: Self) {
        self.units += more.units;
        self.is_awaited |= more.is_awaited;
    }
}

enum Kind {
    /// A serial device, and the rate at which the client sends.
    Serial(Option<Pty>, u32),
    /// A CAN bus behind an adapter on a serial line.
    Slcan(Option<Pty>, SlcanAdapter),
    /// A CAN interface of the kernel.
    Vcan(Vcan),
}

impl Endpoint {
    /// A pseudo-terminal for any port, or an interface for a CAN port.
    pub(super) fn open(
        place: usize,
        config: &PortConfig,
        interface: Option<&str>,
        link: Option<&Path>,
    ) -> io::Result<Self> {
        let kind = match (config, interface) {
            (PortConfig::Can(_), Some(interface)) => Kind::Vcan(Vcan::open(interface)?),
            (PortConfig::Can(can), None) => {
                let adapter = SlcanAdapter::new(can.bitrate_kbit_per_s * 1000);
                Kind::Slcan(Some(Pty::open(link)?), adapter)
            }
            (PortConfig::Serial(line), _) => {
                let rate = line.baud_bit_per_s.unwrap_or_default();
                Kind::Serial(Some(Pty::open(link)?), rate)
            }
        };
        Ok(Self {
            port: Port(place as u8),
            link: link.map(Path::to_owned),
            kind,
        })
    }

    /// Where a client finds it: a terminal's path; nothing for an interface.
    pub(super) fn path(&self) -> Option<&Path> {
        match &self.kind {
            Kind::Serial(pty, _) | Kind::Slcan(pty, _) => pty.as_ref().map(Pty::path),
            Kind::Vcan(_) => None,
        }
    }

    /// What to wait for, and whether there is something to send.
    pub(super) fn fd(&self) -> Option<(BorrowedFd<'_>, bool)> {
        match &self.kind {
            Kind::Serial(pty, _) | Kind::Slcan(pty, _) => {
                pty.as_ref().map(|pty| (pty.fd(), pty.has_unsent()))
            }
            Kind::Vcan(vcan) => vcan.fd().map(|fd| (fd, false)),
        }
    }

    /// Where somebody may speak without being known.
    pub(super) fn terminal_fd(&self) -> Option<BorrowedFd<'_>> {
        self.fd().filter(|_| !self.is_shared()).map(|(fd, _)| fd)
    }

    /// Hands what the client has sent to the machine.
    pub(super) fn receive(&mut self, now: Time, machine: &mut Simulation) -> io::Result<()> {
        let port = self.port;
        match &mut self.kind {
            Kind::Serial(Some(pty), rate) => {
                pty.flush()?;
                let bytes = pty.receive()?;
                if !bytes.is_empty() {
                    if let Some(seen) = pty.client_rate().filter(|seen| seen != rate) {
                        *rate = seen;
                        let control = Payload::Control(LineControl::Baud(seen));
                        let _ = machine.deliver(now, port, &control);
                    }
                    // A line that is down swallows what is said into it.
                    let _ = machine.deliver(now, port, &Payload::Bytes(bytes));
                }
            }
            Kind::Slcan(Some(pty), adapter) => {
                pty.flush()?;
                let bytes = pty.receive()?;
                say((pty, adapter), &bytes, |frame| {
                    machine.deliver(now, port, &Payload::Frame(frame)).is_ok()
                })?;
            }
            Kind::Vcan(vcan) => {
                for _ in 0..READS_MAX {
                    let Some(frame) = vcan.receive()? else { break };
                    let _ = machine.deliver(now, port, &Payload::Frame(frame));
                }
            }
            Kind::Serial(None, _) | Kind::Slcan(None, _) => {}
        }
        Ok(())
    }

    /// Whether a participant that has opened `endpoint` means this port.
    pub(super) fn is_called(&self, endpoint: &str) -> bool {
        match &self.kind {
            Kind::Vcan(vcan) => vcan.interface() == endpoint,
            _ => self.path() == Some(Path::new(endpoint)),
        }
    }

    /// What a person finds it by.
    pub(super) fn name(&self) -> String {
        match &self.kind {
            Kind::Vcan(vcan) => vcan.interface().to_owned(),
            _ => self.path().map_or_else(
                || "an unplugged terminal".to_owned(),
                |path| path.display().to_string(),
            ),
        }
    }

    /// Whether several programs can have it open at once.
    pub(super) const fn is_shared(&self) -> bool {
        matches!(self.kind, Kind::Vcan(_))
    }

    /// Whether it is an adapter's line: a stream of bytes in which pieces mean nothing.
    pub(super) const fn is_adapter(&self) -> bool {
        matches!(self.kind, Kind::Slcan(..))
    }

    /// A participant has opened it, or has closed it.
    pub(super) fn attend(&mut self, is_there: bool) -> io::Result<()> {
        match &mut self.kind {
            Kind::Serial(Some(pty), _) | Kind::Slcan(Some(pty), _) => pty.attend(is_there),
            _ => Ok(()),
        }
    }

    /// The rate at which a participant has opened the line, where it is not the line's own.
    pub(super) fn opened(&mut self, now: Time, machine: &mut Simulation) {
        if let Kind::Serial(Some(pty), rate) = &mut self.kind
            && let Some(seen) = pty.client_rate().filter(|seen| seen != rate)
        {
            *rate = seen;
            let control = Payload::Control(LineControl::Baud(seen));
            let _ = machine.deliver(now, self.port, &control);
        }
    }

    /// Reads exactly what a participant says that it has sent; less, when it is not there any more and was killed
    /// before it had sent it.
    ///
    /// # Errors
    /// When it does not come, or the port fails.
    pub(super) fn read(
        &mut self,
        units: usize,
        is_there: impl Fn() -> bool,
    ) -> io::Result<Vec<Payload>> {
        match &mut self.kind {
            Kind::Serial(Some(pty), _) | Kind::Slcan(Some(pty), _) => {
                Ok(vec![Payload::Bytes(pty.receive_exactly(units, is_there)?)])
            }
            Kind::Vcan(vcan) => {
                let mut frames = Vec::new();
                for _ in 0..units {
                    frames.extend(vcan.receive_one(&is_there)?.map(Payload::Frame));
                }
                Ok(frames)
            }
            Kind::Serial(None, _) | Kind::Slcan(None, _) => Ok(Vec::new()),
        }
    }

    /// What was done to the line reaches the machine at `now`.
    pub(super) fn control(&mut self, control: LineControl, now: Time, machine: &mut Simulation) {
        if let Kind::Serial(Some(pty), rate) = &mut self.kind {
            if let LineControl::Baud(said) = control {
                *rate = pty.client_rate().unwrap_or(said);
            }
            let _ = machine.deliver(now, self.port, &Payload::Control(control));
        }
    }

    /// What was read reaches the machine at `now`; what an adapter says to that.
    ///
    /// # Errors
    /// When the port fails.
    pub(super) fn take_in(
        &mut self,
        sent: &[Payload],
        now: Time,
        machine: &mut Simulation,
    ) -> io::Result<Answered> {
        let port = self.port;
        match &mut self.kind {
            Kind::Slcan(pty, adapter) => say_all((pty, adapter), sent, |frame| {
                machine.deliver(now, port, &Payload::Frame(frame)).is_ok()
            }),
            Kind::Serial(..) | Kind::Vcan(_) => {
                for payload in sent {
                    // A line that is down swallows what is said into it.
                    let _ = machine.deliver(now, port, payload);
                }
                Ok(Answered::default())
            }
        }
    }

    /// What was read is not sent after all: the machine never hears of it, but an adapter answers as if it had.
    ///
    /// # Errors
    /// When the port fails.
    pub(super) fn take_back(&mut self, sent: &[Payload]) -> io::Result<Answered> {
        match &mut self.kind {
            Kind::Slcan(pty, adapter) => say_all((pty, adapter), sent, |_| true),
            Kind::Serial(..) | Kind::Vcan(_) => Ok(Answered::default()),
        }
    }

    /// Takes no notice of what was said into a terminal; how many bytes that was.
    pub(super) fn drop_heard(&mut self) -> io::Result<usize> {
        match &mut self.kind {
            Kind::Serial(Some(pty), _) | Kind::Slcan(Some(pty), _) => pty.drop_heard(),
            Kind::Serial(None, _) | Kind::Slcan(None, _) | Kind::Vcan(_) => Ok(0),
        }
    }

    /// A frame on an interface that nobody who shares the clock has sent.
    pub(super) fn strange_frame(&mut self) -> io::Result<Option<CanFrame>> {
        match &mut self.kind {
            Kind::Vcan(vcan) => vcan.receive(),
            Kind::Serial(..) | Kind::Slcan(..) => Ok(None),
        }
    }

    /// Sends what a slow client has left waiting.
    pub(super) fn flush(&mut self) -> io::Result<()> {
        match &mut self.kind {
            Kind::Serial(Some(pty), _) | Kind::Slcan(Some(pty), _) => pty.flush(),
            _ => Ok(()),
        }
    }

    /// Hands what the machine sends to the client; says what has passed, if the client was there.
    pub(super) fn send(&mut self, at: Time, event: Event) -> io::Result<Option<Passed>> {
        match event {
            Event::Link(Link::Gone) => {
                self.flush()?;
                self.unplug();
                Ok(Some(Passed::Look))
            }
            Event::Link(Link::Up) => self.plug_in().map(|()| None),
            Event::Link(Link::Down) | Event::Payload(Payload::Control(_)) => Ok(None),
            Event::Payload(Payload::Bytes(bytes)) => match &mut self.kind {
                Kind::Serial(Some(pty), _) => passed(pty, &bytes),
                _ => Ok(None),
            },
            Event::Payload(Payload::Frame(frame)) => self.send_frame(at, frame),
            Event::BusError(error) => match &mut self.kind {
                Kind::Slcan(Some(pty), adapter) => passed(pty, &adapter.bus_error(error)),
                Kind::Vcan(vcan) => Ok(vcan.send_error(error)?.then_some(Passed::Units(1))),
                Kind::Serial(..) | Kind::Slcan(None, _) => Ok(None),
            },
        }
    }

    fn send_frame(&mut self, at: Time, frame: CanFrame) -> io::Result<Option<Passed>> {
        match &mut self.kind {
            Kind::Slcan(Some(pty), adapter) => passed(pty, &adapter.received(at, frame)),
            Kind::Vcan(vcan) => Ok(vcan.send(&frame)?.then_some(Passed::Units(1))),
            Kind::Serial(..) | Kind::Slcan(None, _) => Ok(None),
        }
    }

    /// The client's end hangs up.
    fn unplug(&mut self) {
        match &mut self.kind {
            Kind::Serial(pty, _) | Kind::Slcan(pty, _) => *pty = None,
            Kind::Vcan(_) => {}
        }
    }

    /// It comes back as another terminal; the link, where there is one, shows which.
    fn plug_in(&mut self) -> io::Result<()> {
        match &mut self.kind {
            Kind::Serial(pty @ None, _) | Kind::Slcan(pty @ None, _) => {
                *pty = Some(Pty::open(self.link.as_deref())?);
            }
            Kind::Serial(..) | Kind::Slcan(..) | Kind::Vcan(_) => {}
        }
        Ok(())
    }
}

/// Sends bytes, and says whether they have passed.
fn passed(pty: &mut Pty, bytes: &[u8]) -> io::Result<Option<Passed>> {
    let taken = !bytes.is_empty() && pty.send(bytes)?;
    Ok(taken.then_some(Passed::Units(bytes.len())))
}

/// The host says all this to an adapter, where there is one.
fn say_all(
    (pty, adapter): (&mut Option<Pty>, &mut SlcanAdapter),
    sent: &[Payload],
    mut transmit: impl FnMut(CanFrame) -> bool,
) -> io::Result<Answered> {
    let mut answered = Answered::default();
    for payload in sent {
        if let (Some(pty), Payload::Bytes(bytes)) = (&mut *pty, payload) {
            answered.add(say((pty, adapter), bytes, &mut transmit)?);
        }
    }
    Ok(answered)
}

/// The host says `bytes` to the adapter, which has `transmit` send its frames; its answers go to `pty`.
fn say(
    (pty, adapter): (&mut Pty, &mut SlcanAdapter),
    bytes: &[u8],
    mut transmit: impl FnMut(CanFrame) -> bool,
) -> io::Result<Answered> {
    let mut answered = Answered::default();
    for byte in bytes {
        let reply = match adapter.take(*byte) {
            None => continue,
            Some(Action::Reply(reply)) => reply,
            Some(Action::Transmit(frame)) => {
                let is_sent = !adapter.in_tune() || transmit(frame);
                adapter.transmitted(&frame, is_sent)
            }
        };
        answered.note(&reply);
        pty.send(&reply)?;
    }
    Ok(answered)
}
