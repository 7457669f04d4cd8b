//! When which fault is there, and what it does to frames and bytes.

use core::time::Duration;
use units::Time;
use wire::can::CanFrame;

use super::{Fault, FaultConfig, FaultId};
use crate::random::Stream;
use crate::span::seconds;

/// What becomes of one frame on its way to its receivers.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct FrameFate {
    pub(crate) copies: u32,
    pub(crate) frame: CanFrame,
    pub(crate) delay: Duration,
    pub(crate) held_back: bool,
}

/// What becomes of one run of bytes on its way to the host.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct BytesFate {
    pub(crate) runs: Vec<(Duration, Vec<u8>)>,
    pub(crate) kept_for_later: Vec<u8>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    Waiting,
    Active,
    Over,
}

/// A fault begins or ends, or a stranger wants to send.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Edge {
    Begins(Fault),
    Ends(Fault),
    Sends(String, CanFrame),
}

#[derive(Clone, Debug)]
struct Planned {
    config: FaultConfig,
    from: Time,
    until: Time,
    phase: Phase,
    next_frame: Time,
    delivered: u64,
    /// What a device that repeats itself says, per identifier.
    last_words: Vec<CanFrame>,
    stream: Stream,
}

impl Planned {
    /// Whether it strikes this time.
    fn strikes(&mut self) -> bool {
        let left = self
            .config
            .count_max
            .is_none_or(|most| self.delivered < most);
        let hit =
            self.phase == Phase::Active && left && self.stream.chance(self.config.probability);
        self.delivered += u64::from(hit);
        hit
    }

    const fn next_edge(&self) -> Time {
        match self.phase {
            Phase::Waiting => self.from,
            Phase::Active if self.next_frame.0 < self.until.0 => self.next_frame,
            Phase::Active => self.until,
            Phase::Over => Time::NEVER,
        }
    }
}

/// All faults of a run.
#[derive(Clone, Debug)]
pub(crate) struct Plan {
    seed: u64,
    faults: Vec<Planned>,
    next_edge: Time,
}

impl Plan {
    pub(crate) const fn new(seed: u64) -> Self {
        Self {
            seed,
            faults: Vec::new(),
            next_edge: Time::NEVER,
        }
    }

    /// `now` is the fault's time 0.
    pub(crate) fn add(&mut self, now: Time, config: FaultConfig) -> FaultId {
        let id = FaultId(self.faults.len());
        let from = now + seconds(config.from_s);
        let until = config
            .duration_s
            .map_or(Time::NEVER, |span| from + seconds(span));
        self.faults.push(Planned {
            from,
            until,
            phase: Phase::Waiting,
            next_frame: Time::NEVER,
            delivered: 0,
            last_words: Vec::new(),
            stream: Stream::new(self.seed, &format!("fault {}", id.0)),
            config,
        });
        self.find_next_edge();
        id
    }

    /// Ends a fault at `now`.
    pub(crate) fn end(&mut self, now: Time, id: FaultId) {
        if let Some(fault) = self.faults.get_mut(id.0) {
            fault.until = fault.until.min(now);
            fault.next_frame = Time::NEVER;
            if fault.phase == Phase::Waiting {
                fault.phase = Phase::Over;
            }
        }
        self.find_next_edge();
    }

    pub(crate) fn delivered(&self, id: FaultId) -> u64 {
        self.faults.get(id.0).map_or(0, |fault| fault.delivered)
    }

    pub(crate) const fn next_edge(&self) -> Time {
        self.next_edge
    }

    fn find_next_edge(&mut self) {
        let edges = self.faults.iter().map(Planned::next_edge);
        self.next_edge = edges.min().unwrap_or(Time::NEVER);
    }

    /// The next thing that happens by itself until `now`.
    pub(crate) fn poll_edge(&mut self, now: Time) -> Option<Edge> {
        if self.next_edge > now {
            return None;
        }
        let fault = self
            .faults
            .iter_mut()
            .find(|fault| fault.next_edge() <= now)?;
        let edge = match fault.phase {
            Phase::Waiting => fault.begin(),
            Phase::Active if fault.next_frame <= now && fault.next_frame < fault.until => {
                fault.send_again(now)
            }
            Phase::Active | Phase::Over => {
                fault.phase = Phase::Over;
                Edge::Ends(fault.config.fault.clone())
            }
        };
        self.find_next_edge();
        Some(edge)
    }

    /// What the faults make of a frame on `port` that `node` sent (`None`: not a device).
    pub(crate) fn frame_fate(
        &mut self,
        port: &str,
        node: Option<&str>,
        frame: CanFrame,
    ) -> FrameFate {
        let mut fate = FrameFate {
            copies: 1,
            frame,
            delay: Duration::ZERO,
            held_back: false,
        };
        for fault in &mut self.faults {
            if fault.phase == Phase::Active && concerns(&fault.config.fault, port, node, &frame) {
                fault.tamper(&mut fate);
            }
        }
        fate
    }

    /// What the faults make of bytes that `node` sends to the host on `port`.
    pub(crate) fn bytes_fate(
        &mut self,
        port: &str,
        node: Option<&str>,
        bytes: Vec<u8>,
    ) -> BytesFate {
        let mut fate = BytesFate {
            runs: vec![(Duration::ZERO, bytes)],
            kept_for_later: Vec::new(),
        };
        for fault in &mut self.faults {
            if fault.phase == Phase::Active && speaks_of(&fault.config.fault, port, node) {
                fault.garble(&mut fate);
            }
        }
        fate
    }

    /// Whether the line sends the host's own bytes back.
    pub(crate) fn echoes(&mut self, port: &str) -> bool {
        self.faults.iter_mut().any(|fault| {
            matches!(&fault.config.fault, Fault::Echo { port: of } if of == port) && fault.strikes()
        })
    }
}

impl Planned {
    fn begin(&mut self) -> Edge {
        self.phase = Phase::Active;
        let fault = self.config.fault.clone();
        if let Some((frame, period)) = fault.strangers_frame() {
            self.next_frame = period.map_or(Time::NEVER, |period| self.from + period);
            self.delivered += 1;
            let port = fault.port().map_or("", |(port, _)| port);
            return Edge::Sends(port.to_owned(), frame);
        }
        if fault.is_level() {
            self.delivered += 1;
        }
        Edge::Begins(fault)
    }

    fn send_again(&mut self, now: Time) -> Edge {
        let fault = &self.config.fault;
        let Some((frame, period)) = fault.strangers_frame() else {
            self.next_frame = Time::NEVER;
            return Edge::Begins(fault.clone());
        };
        let left = self
            .config
            .count_max
            .is_none_or(|most| self.delivered + 1 < most);
        self.next_frame = match period {
            Some(period) if left => now + period,
            _ => Time::NEVER,
        };
        self.delivered += 1;
        let port = fault.port().map_or("", |(port, _)| port);
        Edge::Sends(port.to_owned(), frame)
    }

    /// The first frame of each identifier passes; after it every one is the same.
    fn repeat(&mut self, fate: &mut FrameFate) {
        let known = self.last_words.iter();
        let known = known.copied().find(|known| known.id() == fate.frame.id());
        match known {
            Some(known) if self.strikes() => fate.frame = known,
            Some(_) => {}
            None => self.last_words.push(fate.frame),
        }
    }

    fn tamper(&mut self, fate: &mut FrameFate) {
        if let Fault::StaleData { .. } = self.config.fault {
            return self.repeat(fate);
        }
        if !self.strikes() {
            return;
        }
        match &self.config.fault {
            Fault::Drop { .. }
            | Fault::Mute { .. }
            | Fault::StopHeartbeat { .. }
            | Fault::StopPdos { .. } => fate.copies = 0,
            Fault::Duplicate { .. } => fate.copies += 1,
            Fault::Reorder { .. } => fate.held_back = true,
            Fault::Delay { delay_ms, .. } => fate.delay += seconds(delay_ms * 1e-3),
            _ => fate.frame = corrupted(&fate.frame, &mut self.stream),
        }
    }

    fn garble(&mut self, fate: &mut BytesFate) {
        if !self.strikes() {
            return;
        }
        match &self.config.fault {
            Fault::Garbage { .. } => {
                let noise: Vec<u8> = (0..1 + self.stream.below(12))
                    .map(|_| self.stream.bits() as u8)
                    .collect();
                fate.runs.insert(0, (Duration::ZERO, noise));
            }
            Fault::Split { .. } => split(fate, &mut self.stream),
            Fault::Merge { .. } => {
                fate.kept_for_later = fate.runs.drain(..).flat_map(|(_, run)| run).collect();
            }
            Fault::LateAnswer { delay_ms, .. } => {
                let late = seconds(delay_ms * 1e-3);
                fate.runs.iter_mut().for_each(|(delay, _)| *delay += late);
            }
            _ => fate.runs.clear(),
        }
    }
}

/// Cuts the last run in two, the second half 5 ms later.
fn split(fate: &mut BytesFate, stream: &mut Stream) {
    const PAUSE: Duration = Duration::from_millis(5);
    if let Some((delay, run)) = fate.runs.pop() {
        let at = 1 + stream.below(run.len().saturating_sub(1).max(1));
        let (head, tail) = run.split_at(at.min(run.len()));
        fate.runs.push((delay, head.to_vec()));
        fate.runs.push((delay + PAUSE, tail.to_vec()));
    }
}

/// Some bits of one byte are wrong; an empty or remote frame stays as it is.
fn corrupted(frame: &CanFrame, stream: &mut Stream) -> CanFrame {
    let mut data = frame.data().to_vec();
    if data.is_empty() {
        return *frame;
    }
    let at = stream.below(data.len());
    data[at] ^= 1 + stream.below(255) as u8;
    CanFrame::new(frame.id(), &data).unwrap_or(*frame)
}

fn concerns(fault: &Fault, port: &str, node: Option<&str>, frame: &CanFrame) -> bool {
    let id = frame.standard_id();
    match fault {
        Fault::Drop { port: of, cob_id }
        | Fault::Duplicate { port: of, cob_id }
        | Fault::Reorder { port: of, cob_id }
        | Fault::Corrupt { port: of, cob_id }
        | Fault::Delay {
            port: of, cob_id, ..
        } => of == port && (cob_id.is_none() || *cob_id == id),
        Fault::Mute { node: of } => Some(of.as_str()) == node,
        Fault::StopHeartbeat { node: of } => {
            Some(of.as_str()) == node && id.is_some_and(|id| (0x701..=0x77F).contains(&id))
        }
        Fault::StopPdos { node: of } | Fault::StaleData { node: of } => {
            Some(of.as_str()) == node && id.is_some_and(|id| (0x181..=0x57F).contains(&id))
        }
        _ => false,
    }
}

fn speaks_of(fault: &Fault, port: &str, node: Option<&str>) -> bool {
    match fault {
        Fault::Garbage { port: of }
        | Fault::Split { port: of }
        | Fault::Merge { port: of }
        | Fault::LateAnswer { port: of, .. }
        | Fault::Silence { port: of } => of == port,
        Fault::Mute { node: of } => Some(of.as_str()) == node,
        _ => false,
    }
}
