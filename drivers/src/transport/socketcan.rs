//! A CAN interface of the Linux kernel (`can0`, `vcan0`, `slcan0`).
//!
//! Source: Linux `Documentation/networking/can.rst`. The socket hears all error frames,
//! counts what its receive queue dropped (`SO_RXQ_OVFL`) and gets the kernel's receive
//! times. A SYNC thread sends on the same socket: a frame of another socket of this process
//! would come back here and look like a second master's SYNC.

use nix::errno::Errno;
use nix::net::if_::InterfaceFlags;
use nix::sys::socket::{ControlMessageOwned, MsgFlags, recvmsg, send, setsockopt, sockopt};
use nix::sys::time::TimeSpec;
use socketcan::{CanSocket, Socket as _, SocketOptions as _};
use std::collections::VecDeque;
use std::io::IoSliceMut;
use std::os::fd::{AsFd, AsRawFd, BorrowedFd};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, PoisonError, RwLock};
use units::Time;
use wire::can::{BusError, CanFrame, CanId};
use wire::canopen::sync::emit_sync;
use wire::{Input, LinkState, Payload, Port};

use super::SendError;
use super::clock::Clock;
use super::live_port::{LivePort, awaited, system};
use super::open_error::OpenError;
use super::serial::BackOff;
use super::stamps::KernelStamps;
use super::sync_thread::SyncSink;

/// `struct can_frame`: identifier with flags, length, 3 bytes of padding, 8 of data.
const FRAME_BYTES: usize = 16;
const EXTENDED_FLAG: u32 = 0x8000_0000;
const REMOTE_FLAG: u32 = 0x4000_0000;
const ERROR_FLAG: u32 = 0x2000_0000;
/// About 4000 frames: half a second of a full bus at 1 Mbit/s.
const RECEIVE_BUFFER: usize = 1 << 20;

/// Explains why an interface cannot be opened.
pub(super) fn open_error(interface: String, source: std::io::Error) -> OpenError {
    match source.raw_os_error().map(Errno::from_raw) {
        Some(Errno::ENODEV | Errno::ENXIO) => OpenError::NoInterface { interface },
        Some(Errno::EAFNOSUPPORT | Errno::EPROTONOSUPPORT) => OpenError::NoCan { interface },
        _ if source.kind() == std::io::ErrorKind::NotFound => OpenError::NoInterface { interface },
        _ => OpenError::Can { interface, source },
    }
}

/// A CAN interface.
pub(super) struct CanPort {
    port: Port,
    clock: Clock,
    interface: String,
    /// Shared with the SYNC thread, which must follow when the interface is opened anew.
    socket: Arc<SharedSocket>,
    open: Option<Arc<CanSocket>>,
    state: LinkState,
    back_off: BackOff,
    queued: VecDeque<(Time, Input)>,
    stamps: KernelStamps,
    control: Vec<u8>,
    /// The kernel's count of dropped frames when last seen.
    dropped: u32,
    counts: Counts,
}

#[derive(Debug, Default)]
struct Counts {
    received: u64,
    sent: u64,
    lost: u64,
    refused: u64,
    error_frames: u64,
    reopened: u64,
}

#[derive(Default)]
struct SharedSocket {
    socket: RwLock<Option<Arc<CanSocket>>>,
    /// Frames that the kernel took.
    sent: AtomicU64,
}

impl SharedSocket {
    fn set(&self, socket: Option<Arc<CanSocket>>) {
        *self.socket.write().unwrap_or_else(PoisonError::into_inner) = socket;
    }

    fn send(&self, frame: &CanFrame) -> Result<(), Errno> {
        let socket = self.socket.read().unwrap_or_else(PoisonError::into_inner);
        write(socket.as_ref().ok_or(Errno::ENODEV)?, frame)?;
        self.sent.fetch_add(1, Ordering::Relaxed);
        Ok(())
    }
}

impl SyncSink for SharedSocket {
    fn send_sync(&self) -> Result<(), Errno> {
        self.send(&emit_sync(None))
    }
}

fn open_socket(interface: &str) -> std::io::Result<CanSocket> {
    let socket = CanSocket::open(interface)?;
    socket.set_error_filter_accept_all()?;
    setsockopt(&socket, sockopt::RxqOvfl, &1)?;
    setsockopt(&socket, sockopt::ReceiveTimestampns, &true)?;
    // Without CAP_NET_ADMIN the kernel cuts it to net.core.rmem_max.
    if setsockopt(&socket, sockopt::RcvBufForce, &RECEIVE_BUFFER).is_err() {
        setsockopt(&socket, sockopt::RcvBuf, &RECEIVE_BUFFER)?;
    }
    Ok(socket)
}

fn write(socket: &CanSocket, frame: &CanFrame) -> Result<(), Errno> {
    let bytes = emit(frame);
    send(socket.as_raw_fd(), &bytes, MsgFlags::MSG_DONTWAIT).map(drop)
}

/// The kernel's `struct can_frame`, in the machine's byte order.
fn emit(frame: &CanFrame) -> [u8; FRAME_BYTES] {
    let extended = match frame.id() {
        CanId::Standard(_) => 0,
        CanId::Extended(_) => EXTENDED_FLAG,
    };
    let remote = if frame.is_remote() { REMOTE_FLAG } else { 0 };
    let mut bytes = [0; FRAME_BYTES];
    bytes[..4].copy_from_slice(&(frame.id().raw() | extended | remote).to_ne_bytes());
    bytes[4] = frame.len() as u8;
    bytes[8..8 + frame.data().len()].copy_from_slice(frame.data());
    bytes
}

/// `None` for what no classic CAN socket gives.
fn parse(bytes: &[u8; FRAME_BYTES]) -> Option<Input> {
    let (id, rest) = bytes.split_first_chunk::<4>()?;
    let id = u32::from_ne_bytes(*id);
    let length = usize::from(rest[0]);
    let data = rest.get(4..4 + length)?;
    if id & ERROR_FLAG != 0 {
        return Some(Input::BusError(BusError::parse(id & !ERROR_FLAG, data)));
    }
    let number = if id & EXTENDED_FLAG == 0 {
        CanId::Standard(id as u16 & CanId::STANDARD_MAX)
    } else {
        CanId::Extended(id & CanId::EXTENDED_MAX)
    };
    let frame = if id & REMOTE_FLAG == 0 {
        CanFrame::new(number, data)?
    } else {
        CanFrame::remote(number, rest[0])?
    };
    Some(Input::Payload(Payload::Frame(frame)))
}

/// One message of the socket and what the kernel said about it.
struct Message {
    bytes: [u8; FRAME_BYTES],
    stamp: Option<TimeSpec>,
    dropped: Option<u32>,
}

fn read(socket: &CanSocket, control: &mut [u8]) -> Result<Message, Errno> {
    let mut bytes = [0; FRAME_BYTES];
    let mut slices = [IoSliceMut::new(&mut bytes)];
    let flags = MsgFlags::MSG_DONTWAIT;
    let message = recvmsg::<()>(socket.as_raw_fd(), &mut slices, Some(control), flags)?;
    let (mut stamp, mut dropped) = (None, None);
    for control in message.cmsgs()? {
        match control {
            ControlMessageOwned::ScmTimestampns(time) => stamp = Some(time),
            ControlMessageOwned::RxqOvfl(count) => dropped = Some(count),
            _ => {}
        }
    }
    Ok(Message {
        bytes,
        stamp,
        dropped,
    })
}

/// Whether the interface exists and is up, as `ip link` shows it.
fn is_up(interface: &str) -> bool {
    nix::ifaddrs::getifaddrs().is_ok_and(|mut all| {
        all.any(|one| one.interface_name == interface && one.flags.contains(InterfaceFlags::IFF_UP))
    })
}

impl CanPort {
    pub(super) fn open(clock: Clock, port: Port, interface: &str) -> std::io::Result<Self> {
        let mut can = Self {
            port,
            back_off: BackOff::new(clock.clone()),
            stamps: KernelStamps::new(clock.clone()),
            clock,
            interface: interface.to_owned(),
            socket: Arc::default(),
            open: None,
            state: LinkState::Up,
            queued: VecDeque::new(),
            control: nix::cmsg_space!(TimeSpec, u32),
            dropped: 0,
            counts: Counts::default(),
        };
        can.connect()?;
        Ok(can)
    }

    fn connect(&mut self) -> std::io::Result<()> {
        let socket = Arc::new(open_socket(&self.interface)?);
        self.socket.set(Some(Arc::clone(&socket)));
        self.open = Some(socket);
        self.dropped = 0;
        Ok(())
    }

    /// Reports a change of state, once.
    fn enter(&mut self, now: Time, state: LinkState) {
        if core::mem::replace(&mut self.state, state) == state {
            return;
        }
        if state == LinkState::Gone {
            self.open = None;
            self.socket.set(None);
        }
        self.back_off.begin(now);
        self.queued.push_back((now, Input::Link(state)));
    }

    /// What an error number says about the interface; `None` when nothing.
    const fn state_after(errno: Errno) -> Option<LinkState> {
        match errno {
            Errno::ENETDOWN => Some(LinkState::Down),
            Errno::ENODEV | Errno::ENXIO | Errno::EBADF => Some(LinkState::Gone),
            _ => None,
        }
    }

    /// Whether there was a frame.
    fn read(&mut self) -> bool {
        let Some(socket) = &self.open else {
            return false;
        };
        match read(socket, &mut self.control) {
            Ok(message) => {
                self.take(&message);
                true
            }
            Err(errno) => {
                if let Some(state) = Self::state_after(errno) {
                    self.enter(self.clock.now(), state);
                }
                false
            }
        }
    }

    fn take(&mut self, message: &Message) {
        let at = self.stamps.arrival(message.stamp);
        if let Some(dropped) = message.dropped {
            let lost = dropped.wrapping_sub(core::mem::replace(&mut self.dropped, dropped));
            if lost > 0 {
                self.counts.lost += u64::from(lost);
                self.queued.push_back((at, Input::Lost(lost)));
            }
        }
        self.enter(at, LinkState::Up);
        if let Some(input) = parse(&message.bytes) {
            match input {
                Input::BusError(_) => self.counts.error_frames += 1,
                _ => self.counts.received += 1,
            }
            self.queued.push_back((at, input));
        }
    }

    /// Looks whether a downed interface is up, or a vanished one is back.
    fn look(&mut self, now: Time) {
        let back = match self.state {
            LinkState::Up => return,
            LinkState::Down => is_up(&self.interface),
            LinkState::Gone => is_up(&self.interface) && self.connect().is_ok(),
        };
        if back {
            self.counts.reopened += 1;
            self.enter(now, LinkState::Up);
        } else {
            self.back_off.again(now);
        }
    }

    /// A downed interface costs little to look at, so it is noticed soon.
    fn next_look(&self) -> Time {
        match self.state {
            LinkState::Up => Time::NEVER,
            LinkState::Down | LinkState::Gone => self.back_off.at(),
        }
    }
}

impl LivePort for CanPort {
    fn descriptor(&self) -> Option<BorrowedFd<'_>> {
        self.open.as_ref().map(|socket| socket.as_fd())
    }

    fn next_event(&self) -> Time {
        if self.queued.is_empty() {
            self.next_look()
        } else {
            Time::ZERO
        }
    }

    fn poll(&mut self, known: Time, ready: bool) -> Option<(Time, Input)> {
        if self.queued.is_empty() {
            if ready {
                self.read();
            } else if self.next_look() <= known {
                self.look(known);
            }
        }
        self.queued.pop_front()
    }

    fn send(&mut self, payload: &Payload) -> Result<(), SendError> {
        let port = self.port;
        let Payload::Frame(frame) = payload else {
            return Err(SendError::WrongKind { port });
        };
        match self.socket.send(frame) {
            Ok(()) => {
                self.counts.sent += 1;
                Ok(())
            }
            Err(errno) => {
                self.counts.refused += 1;
                let Some(state) = Self::state_after(errno) else {
                    return Err(system(port, errno));
                };
                self.enter(self.clock.now(), state);
                Err(SendError::Unusable { port, state })
            }
        }
    }

    fn units_sent(&self) -> u64 {
        self.socket.sent.load(Ordering::Relaxed)
    }

    fn take_in(&mut self, _now: Time, units: usize) {
        for _ in 0..units {
            while !self.read() {
                let Some(socket) = &self.open else { return };
                if !awaited(socket.as_fd()) {
                    return;
                }
            }
        }
    }

    fn sync_sink(&self) -> Option<Arc<dyn SyncSink>> {
        Some(Arc::clone(&self.socket) as Arc<dyn SyncSink>)
    }

    fn counters(&self) -> Vec<(&'static str, u64)> {
        vec![
            ("received", self.counts.received),
            ("sent", self.counts.sent),
            ("lost", self.counts.lost),
            ("refused", self.counts.refused),
            ("error_frames", self.counts.error_frames),
            ("reopened", self.counts.reopened),
            ("distrusted_stamps", self.stamps.distrusted()),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn round_trip(frame: CanFrame) {
        let parsed = parse(&emit(&frame));
        assert_eq!(parsed, Some(Input::Payload(Payload::Frame(frame))));
    }

    #[test]
    fn frames_have_the_kernels_layout() {
        let bytes = emit(&CanFrame::standard(0x181, &[0x27, 0x02]));
        assert_eq!(bytes[..4], 0x181_u32.to_ne_bytes());
        assert_eq!(bytes[4..], [2, 0, 0, 0, 0x27, 0x02, 0, 0, 0, 0, 0, 0]);
        round_trip(CanFrame::standard(0x7FF, &[1, 2, 3, 4, 5, 6, 7, 8]));
        round_trip(CanFrame::new(CanId::Extended(0x1234_5678), &[9]).unwrap());
        round_trip(CanFrame::remote(CanId::Standard(0x705), 1).unwrap());
    }

    #[test]
    fn a_bus_off_error_frame_is_a_bus_error() {
        let mut bytes = [0; FRAME_BYTES];
        bytes[..4].copy_from_slice(&0x2000_0040_u32.to_ne_bytes());
        bytes[4] = 8;
        let Some(Input::BusError(error)) = parse(&bytes) else {
            panic!("no bus error")
        };
        assert_eq!(error.class, wire::can::BusErrorClass::BUS_OFF);
    }

    #[test]
    fn a_length_beyond_8_is_refused() {
        let mut bytes = [0; FRAME_BYTES];
        bytes[4] = 9;
        assert_eq!(parse(&bytes), None);
    }

    #[test]
    fn a_missing_interface_is_named_with_what_to_do() {
        let error = open_error("vcan7".to_owned(), Errno::ENODEV.into());
        let text = error.to_string();
        assert!(
            text.contains("vcan7") && text.contains("ip link add"),
            "{text}"
        );
        let error = open_error("can0".to_owned(), Errno::EAFNOSUPPORT.into());
        assert!(error.to_string().contains("no CAN"), "{error}");
    }
}
