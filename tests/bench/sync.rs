//! How late SYNCs leave: our SYNC thread beside a tokio interval.
//!
//! `sync SENDER SINK PERIOD_US COUNT` sends COUNT SYNCs and prints how late they were as one
//! JSON object. SENDER is `ours` or `tokio`; SINK is a CAN interface, where the kernel's
//! receive stamps of a second socket tell when a frame left, or `pipe`, where the sender
//! notes the time just before it writes.
//!
//! Deadlines are absolute: a whole number of periods apart. Where the grid begins, our thread
//! does not tell; so for both senders the earliest SYNC of the run counts as punctual, and
//! `earliest_us` says how late that one was: exactly for tokio, at most for ours.

use core::time::Duration;
use std::io::{IoSliceMut, PipeWriter, Write as _};
use std::os::fd::AsRawFd as _;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex};

use drivers::transport::Transport as _;
use drivers::transport::clock::Clock;
use drivers::transport::live::Live;
use drivers::transport::sync_thread::{Scheduling, SyncSink, SyncStatistics, SyncThread};
use nix::errno::Errno;
use nix::sys::socket::{ControlMessageOwned, MsgFlags, recvmsg, setsockopt, sockopt};
use nix::sys::time::TimeSpec;
use nix::time::{ClockId, clock_gettime};
use serde_json::{Value, json};
use socketcan::{CanFilter, CanSocket, Socket as _, SocketOptions as _};
use wire::Port;

const PORT: Port = Port(0);
const SYNC: u32 = 0x80;
const STANDARD_ONLY: u32 = 0xC000_07FF;
const BUFFER_BYTES: usize = 4 << 20;
/// A SYNC this share of a period before the usual moment is taken for an early one, any other
/// for a late one: our thread sends nothing that is more than half a period late.
const EARLIER_SHARE: f64 = 0.1;
/// A frame's worth of bytes, for who has no CAN.
const FRAME: [u8; 16] = [0x80, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0];

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    let [sender, sink, period_us, count] = words[..] else {
        eprintln!("sync: run by tests/bench/run");
        return;
    };
    let order = Order {
        period: Duration::from_micros(period_us.parse().unwrap()),
        count: count.parse().unwrap(),
    };
    let run = match (sender, sink) {
        ("ours", "pipe") => ours_to_pipe(order),
        ("tokio", "pipe") => tokio_to_pipe(order),
        ("ours", interface) => ours_to_can(order, interface),
        ("tokio", interface) => tokio_to_can(order, interface),
        (other, _) => panic!("sender {other}: known are ours and tokio"),
    };
    println!("{}", run.judge(order));
}

#[derive(Clone, Copy)]
struct Order {
    period: Duration,
    count: usize,
}

/// When frames left, on CLOCK_MONOTONIC.
struct Run {
    sent: Vec<Duration>,
    /// The first deadline, or no later than it.
    first: Duration,
    /// Of our thread only.
    statistics: Option<SyncStatistics>,
}

fn now(clock: ClockId) -> Duration {
    clock_gettime(clock).unwrap().into()
}

fn monotonic() -> Duration {
    now(ClockId::CLOCK_MONOTONIC)
}

/// A sink without CAN.
struct Pipe {
    writer: PipeWriter,
    sent: Mutex<Vec<Duration>>,
    wanted: usize,
    done: Sender<()>,
}

impl SyncSink for Pipe {
    fn send_sync(&self) -> Result<(), Errno> {
        let at = monotonic();
        let written = (&self.writer).write_all(&FRAME);
        written.map_err(|error| Errno::from_raw(error.raw_os_error().unwrap_or(0)))?;
        let mut sent = self.sent.lock().unwrap();
        if sent.len() < self.wanted {
            sent.push(at);
        }
        if sent.len() == self.wanted {
            // Whoever waited may be gone.
            let _ = self.done.send(());
        }
        Ok(())
    }
}

impl Pipe {
    /// With its other end, which must stay open, and what tells that enough was sent.
    fn new(wanted: usize) -> (Arc<Self>, std::io::PipeReader, Receiver<()>) {
        let (reader, writer) = std::io::pipe().unwrap();
        let (done, waits) = channel();
        let sent = Mutex::new(Vec::with_capacity(wanted));
        (
            Arc::new(Self {
                writer,
                sent,
                wanted,
                done,
            }),
            reader,
            waits,
        )
    }
}

fn ours_to_pipe(order: Order) -> Run {
    let (pipe, _reader, done) = Pipe::new(order.count);
    let first = monotonic() + order.period;
    let thread = SyncThread::start(Arc::clone(&pipe) as Arc<dyn SyncSink>, order.period).unwrap();
    done.recv().unwrap();
    let statistics = Some(thread.statistics());
    let sent = pipe.sent.lock().unwrap().clone();
    Run {
        sent,
        first,
        statistics,
    }
}

fn tokio_to_pipe(order: Order) -> Run {
    let (pipe, _reader, _done) = Pipe::new(order.count);
    let first = tokio_interval(order, || pipe.send_sync().unwrap());
    let sent = pipe.sent.lock().unwrap().clone();
    Run {
        sent,
        first,
        statistics: None,
    }
}

/// What a program without a thread of its own would do; returns the first deadline.
fn tokio_interval(order: Order, mut send: impl FnMut()) -> Duration {
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()
        .unwrap();
    runtime.block_on(async {
        let first = monotonic() + order.period;
        let start = tokio::time::Instant::now() + order.period;
        let mut interval = tokio::time::interval_at(start, order.period);
        for _ in 0..order.count {
            interval.tick().await;
            send();
        }
        first
    })
}

fn ours_to_can(order: Order, interface: &str) -> Run {
    let mut live = Live::builder(Clock::real())
        .socketcan(PORT, interface)
        .build()
        .unwrap();
    let listener = Listener::open(interface);
    let first = monotonic() + order.period;
    live.set_sync(PORT, Some(order.period)).unwrap();
    let wanted = order.count as u64;
    while live
        .sync_statistics(PORT)
        .is_some_and(|so_far| so_far.sent < wanted)
    {
        let until = live.now() + order.period * 10;
        live.receive(until);
    }
    let statistics = live.sync_statistics(PORT);
    live.set_sync(PORT, None).unwrap();
    Run {
        sent: listener.stamps(order.count),
        first,
        statistics,
    }
}

fn tokio_to_can(order: Order, interface: &str) -> Run {
    let socket = CanSocket::open(interface).unwrap();
    let listener = Listener::open(interface);
    let mut frame = FRAME;
    frame[..4].copy_from_slice(&SYNC.to_ne_bytes());
    let first = tokio_interval(order, || {
        assert_eq!(nix::unistd::write(&socket, &frame), Ok(frame.len()));
    });
    Run {
        sent: listener.stamps(order.count),
        first,
        statistics: None,
    }
}

/// Keeps the frames, and the kernel's stamps with them, until the run is over: a listener
/// that woke up for each would compete with the sender for the processor.
struct Listener {
    socket: CanSocket,
}

impl Listener {
    fn open(interface: &str) -> Self {
        let socket = CanSocket::open(interface).unwrap();
        socket
            .set_filters(&[CanFilter::new(SYNC, STANDARD_ONLY)])
            .unwrap();
        setsockopt(&socket, sockopt::ReceiveTimestampns, &true).unwrap();
        // Without the right to force it, the system's largest buffer must do.
        if setsockopt(&socket, sockopt::RcvBufForce, &BUFFER_BYTES).is_err() {
            setsockopt(&socket, sockopt::RcvBuf, &BUFFER_BYTES).unwrap();
        }
        Self { socket }
    }

    fn stamps(&self, count: usize) -> Vec<Duration> {
        let before_epoch = now(ClockId::CLOCK_REALTIME) - monotonic();
        (0..count).map(|_| self.stamp() - before_epoch).collect()
    }

    /// Panics when a frame was lost.
    fn stamp(&self) -> Duration {
        let mut bytes = [0; 16];
        let mut slices = [IoSliceMut::new(&mut bytes)];
        let mut control = nix::cmsg_space!(TimeSpec);
        let flags = MsgFlags::MSG_DONTWAIT;
        let message = recvmsg::<()>(
            self.socket.as_raw_fd(),
            &mut slices,
            Some(&mut control),
            flags,
        );
        let message = message.expect("every SYNC reaches the listener");
        let stamp = message.cmsgs().unwrap().find_map(|control| match control {
            ControlMessageOwned::ScmTimestampns(time) => Some(time),
            _ => None,
        });
        stamp.expect("the kernel stamps every frame").into()
    }
}

impl Run {
    fn judge(&self, order: Order) -> Value {
        let late = self.lateness(order.period);
        let earliest = late.iter().copied().fold(f64::INFINITY, f64::min);
        let mut jitter: Vec<f64> = late.iter().map(|late| late - earliest).collect();
        jitter.sort_by(f64::total_cmp);
        let rank = |share: f64| jitter[((jitter.len() - 1) as f64 * share).round() as usize];
        json!({
            "p50_us": rank(0.5),
            "p99_us": rank(0.99),
            "max_us": rank(1.0),
            "earliest_us": earliest,
            "skipped": self.statistics.as_ref().map_or(0, |it| it.skipped),
            "real_time": self.statistics.as_ref().map(|it| it.scheduling == Scheduling::RealTime),
        })
    }

    /// Microseconds after the deadline. Tokio sends every one, however late, so that counting
    /// them tells which deadline was meant; our thread leaves SYNCs out.
    fn lateness(&self, period: Duration) -> Vec<f64> {
        let period_us = period.as_secs_f64() * 1e6;
        let sent_us = self
            .sent
            .iter()
            .map(|at| (at.as_secs_f64() - self.first.as_secs_f64()) * 1e6);
        if self.statistics.is_none() {
            let late = |(index, at): (usize, f64)| at - index as f64 * period_us;
            return sent_us.enumerate().map(late).collect();
        }
        let sent_us: Vec<f64> = sent_us.collect();
        let typical_us = median(sent_us.iter().map(|at| at.rem_euclid(period_us)).collect());
        let periods = |at: f64| ((at - typical_us) / period_us + EARLIER_SHARE).floor();
        sent_us
            .iter()
            .map(|at| at - periods(*at) * period_us)
            .collect()
    }
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}
