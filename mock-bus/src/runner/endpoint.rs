//! One port of the machine in the real world.

use std::io;
use std::os::fd::BorrowedFd;
use std::path::{Path, PathBuf};

use drivers::wire::can::CanFrame;
use drivers::wire::{LineControl, Payload, Port};
use units::Time;

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
            (PortConfig::Serial(_), _) => Kind::Serial(Some(Pty::open(link)?), 0),
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
                for byte in pty.receive()? {
                    if let Some(reply) = answer(adapter, byte, now, port, machine) {
                        pty.send(&reply)?;
                    }
                }
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

    /// Hands what the machine sends to the client.
    pub(super) fn send(&mut self, at: Time, event: Event) -> io::Result<()> {
        match event {
            Event::Link(Link::Gone) => self.unplug(),
            Event::Link(Link::Up) => self.plug_in()?,
            Event::Link(Link::Down) | Event::Payload(Payload::Control(_)) => {}
            Event::Payload(Payload::Bytes(bytes)) => {
                if let Kind::Serial(Some(pty), _) = &mut self.kind {
                    pty.send(&bytes)?;
                }
            }
            Event::Payload(Payload::Frame(frame)) => self.send_frame(at, frame)?,
            Event::BusError(error) => match &mut self.kind {
                Kind::Slcan(Some(pty), adapter) => pty.send(&adapter.bus_error(error))?,
                Kind::Vcan(vcan) => vcan.send_error(error)?,
                Kind::Serial(..) | Kind::Slcan(None, _) => {}
            },
        }
        Ok(())
    }

    fn send_frame(&mut self, at: Time, frame: CanFrame) -> io::Result<()> {
        match &mut self.kind {
            Kind::Slcan(Some(pty), adapter) => match adapter.received(at, frame) {
                line if line.is_empty() => Ok(()),
                line => pty.send(&line),
            },
            Kind::Vcan(vcan) => vcan.send(&frame),
            Kind::Serial(..) | Kind::Slcan(None, _) => Ok(()),
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

/// What the adapter says to one byte of the host.
fn answer(
    adapter: &mut SlcanAdapter,
    byte: u8,
    now: Time,
    port: Port,
    machine: &mut Simulation,
) -> Option<Vec<u8>> {
    match adapter.take(byte)? {
        Action::Reply(reply) => Some(reply),
        Action::Transmit(frame) => {
            let taken =
                !adapter.in_tune() || machine.deliver(now, port, &Payload::Frame(frame)).is_ok();
            Some(adapter.transmitted(&frame, taken))
        }
    }
}
