//! Live ports on a clock that both ends share: time passes only when neither has anything
//! left to do.
//!
//! Whatever is sent passes the kernel as ever. Instead of waiting on the ports, the thread
//! says what it has sent and until when it would wait, and is told how many frames or bytes
//! have come, where, and in which order; it then reads exactly these. So each arrival has its
//! stamp and its place in the order, however busy the computer is.

use core::time::Duration;
use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

use nix::poll::{PollFd, PollFlags, ppoll};
use units::Time;
use wire::lockstep::{Entry, Passed};
use wire::{Payload, Port, Ports};

use super::super::lockstep::{LockstepError, Participant};
use super::super::one_core::OneCore;
use super::super::sync_grid::SyncGrid;
use super::super::{Arrival, SendError};
use super::{Clock, Live, WAITED_MAX};

/// A port that asks to be looked at more often at one moment is wrong; time goes on then.
const LOOKS_MAX: usize = 1_000;

pub(super) struct InLockstep {
    participant: Arc<Participant>,
    syncs: SyncGrid,
    /// What was sent since the other end was told, in order.
    sent: Vec<Entry>,
    /// For each port how much of what it sent is in `sent`, or was.
    noted: Vec<u64>,
    arrivals: VecDeque<Arrival>,
    /// The SYNCs that have left already and count as sent at their own time only.
    ahead: BTreeMap<Port, Time>,
    core: OneCore,
}

impl InLockstep {
    pub(super) fn new(participant: Arc<Participant>) -> Self {
        Self {
            participant,
            syncs: SyncGrid::new(),
            sent: Vec::new(),
            noted: Vec::new(),
            arrivals: VecDeque::new(),
            ahead: BTreeMap::new(),
            core: OneCore::new(),
        }
    }
}

impl Live {
    pub(super) fn without_ports(clock: Clock) -> Self {
        Self {
            known: core::cell::Cell::new(clock.now()),
            lockstep: clock.participant().cloned().map(InLockstep::new),
            clock,
            ports: Vec::new(),
            index: std::collections::BTreeMap::new(),
        }
    }

    /// Whether time is shared: no longer once the other end has gone.
    pub(super) fn keeps_step(&self) -> bool {
        let lockstep = self.lockstep.as_ref();
        lockstep.is_some_and(|it| !it.participant.is_lost())
    }

    /// Tells the other end of a port that was opened last.
    pub(super) fn attach(&mut self, port: Port, endpoint: &str) -> Result<(), LockstepError> {
        let Some(lockstep) = &mut self.lockstep else {
            return Ok(());
        };
        lockstep.noted.push(0);
        lockstep.participant.attach(port, endpoint)
    }

    /// Starts or stops SYNC on the shared clock's grid; `false` where there is none.
    pub(super) fn set_sync_in_lockstep(
        &mut self,
        now: Time,
        port: Port,
        period: Option<Duration>,
    ) -> bool {
        let Some(lockstep) = &mut self.lockstep else {
            return false;
        };
        lockstep.syncs.set(now, port, period);
        if lockstep.ahead.remove(&port).is_some_and(|at| at > now) {
            let passed = Passed::Recall;
            lockstep.sent.push(Entry { port, passed });
        }
        true
    }

    /// Notes what was sent on `port`, in its place among everything else.
    pub(super) fn note_sent(
        &mut self,
        port: Port,
        payload: &Payload,
        result: Result<(), SendError>,
    ) -> Result<(), SendError> {
        if self.lockstep.is_none() {
            return result;
        }
        let at = self.index.get(&port).copied();
        at.into_iter().for_each(|at| self.note_units(at));
        if let (Some(lockstep), Payload::Control(control), Ok(())) =
            (&mut self.lockstep, payload, result)
        {
            let passed = Passed::Control(*control);
            lockstep.sent.push(Entry { port, passed });
        }
        result
    }

    fn note_units(&mut self, at: usize) {
        self.note_as(at, Passed::Units);
    }

    fn note_as(&mut self, at: usize, passed: impl FnOnce(usize) -> Passed) {
        let Some(lockstep) = &mut self.lockstep else {
            return;
        };
        let slot = &self.ports[at];
        let total = slot.live.units_sent();
        let before = core::mem::replace(&mut lockstep.noted[at], total);
        if total > before {
            lockstep.sent.push(Entry {
                port: slot.port,
                passed: passed((total - before) as usize),
            });
        }
    }

    /// As [`super::Transport::receive_unhurried`].
    pub(super) fn receive_in_lockstep(&mut self, until: Time, unhurried: Ports) -> Option<Arrival> {
        loop {
            self.look_at_due_ports();
            let is_over = self.clock.now() >= until;
            let arrivals = &mut self.lockstep.as_mut()?.arrivals;
            if is_over || arrivals.iter().any(|it| !it.can_wait(unhurried)) {
                return arrivals.pop_front();
            }
            self.step(until, unhurried);
            if !self.keeps_step() {
                return None;
            }
        }
    }

    /// Lets time pass until something happens, at most to `until`: what comes is kept. Bytes on `unhurried`
    /// ports are nothing that happens.
    pub(super) fn step(&mut self, until: Time, unhurried: Ports) {
        // What a port says by itself, an adapter's start for one.
        (0..self.ports.len()).for_each(|at| self.note_units(at));
        let events = self.ports.iter().map(|slot| slot.live.next_event());
        let until = events.fold(until, Time::min);
        self.send_sync_ahead(until);
        let Some(lockstep) = &mut self.lockstep else {
            return;
        };
        let next = until.min(lockstep.syncs.next());
        let sent = core::mem::take(&mut lockstep.sent);
        let participant = Arc::clone(&lockstep.participant);
        if let Some(cpu) = lockstep.core.changed() {
            participant.on(cpu);
        }
        let gone = participant.idle(next, unhurried, sent).and_then(|()| {
            self.flush_until_answered(&participant);
            participant.go()
        });
        // The other end has ended: time goes on by the wall's clock, and the ports show why.
        let Ok(passed) = gone else { return };
        self.known.set(self.clock.now());
        // SYNC first, as on the in-process bus: it is sent at its moment, whatever came then.
        self.send_due_syncs();
        for entry in passed {
            self.take_in(entry);
        }
        self.look_at_due_ports();
    }

    /// The other end reads only once it was told how much there is: what a line did not take
    /// at once goes on now.
    fn flush_until_answered(&mut self, participant: &Participant) {
        while self.ports.iter().any(|slot| slot.live.wants_write()) {
            let waiting = self.ports.iter().filter(|slot| slot.live.wants_write());
            let lines = waiting.filter_map(|slot| slot.live.descriptor());
            let answered = participant.with_descriptor(|answer| {
                let mut all = vec![PollFd::new(answer, PollFlags::POLLIN)];
                let lines = lines.map(|line| PollFd::new(line, PollFlags::POLLOUT));
                all.extend(lines.take(WAITED_MAX));
                // A signal only makes the next look come sooner.
                let _ = ppoll(&mut all, None, None);
                all[0].any() == Some(true)
            });
            self.ports.iter_mut().for_each(|slot| slot.live.flush());
            if answered {
                return;
            }
        }
    }

    fn take_in(&mut self, entry: Entry) {
        let now = self.known.get();
        let Some(at) = self.index.get(&entry.port).copied() else {
            return;
        };
        let live = &mut self.ports[at].live;
        match entry.passed {
            Passed::Units(units) => live.take_in(now, units),
            Passed::At { units, at } => live.take_in(at, units),
            Passed::Look | Passed::Control(_) | Passed::Recall => {
                let seen = live.poll(now, true);
                self.keep(at, seen);
            }
        }
        self.look_at(at);
    }

    fn keep(&mut self, at: usize, seen: Option<(Time, super::Input)>) -> bool {
        let any = seen.is_some();
        let port = self.ports[at].port;
        if let (Some((at, input)), Some(lockstep)) = (seen, &mut self.lockstep) {
            lockstep.arrivals.push_back(Arrival { port, at, input });
        }
        any
    }

    /// Keeps what a port has, and lets it do what is due.
    fn look_at(&mut self, at: usize) {
        let now = self.known.get();
        for _ in 0..LOOKS_MAX {
            if self.ports[at].live.next_event() > now {
                break;
            }
            let seen = self.ports[at].live.poll(now, false);
            self.keep(at, seen);
        }
        self.note_units(at);
    }

    fn look_at_due_ports(&mut self) {
        for at in 0..self.ports.len() {
            self.look_at(at);
        }
    }

    /// A SYNC that comes before anything else of ours leaves now, with the time at which it counts as sent: nobody
    /// needs to wake then only to send it.
    fn send_sync_ahead(&mut self, until: Time) {
        let now = self.known.get();
        let Some(lockstep) = &mut self.lockstep else {
            return;
        };
        let is_under_way = lockstep.ahead.values().any(|at| *at > now);
        let next = lockstep.syncs.next();
        if is_under_way || next <= now || next > until {
            return;
        }
        let due = lockstep.syncs.take(next);
        lockstep.ahead = due.iter().map(|port| (*port, next)).collect();
        for port in due {
            self.send_sync(port, |units| Passed::At { units, at: next });
        }
    }

    fn send_due_syncs(&mut self) {
        let Some(lockstep) = &mut self.lockstep else {
            return;
        };
        let mut due = Vec::new();
        let now = self.known.get();
        lockstep.syncs.send_due(now, |port, _| due.push(port));
        for port in due {
            self.send_sync(port, Passed::Units);
        }
    }

    fn send_sync(&mut self, port: Port, passed: impl FnOnce(usize) -> Passed) {
        let Some(at) = self.index.get(&port).copied() else {
            return;
        };
        self.note_units(at);
        if let Some(sink) = self.ports[at].live.sync_sink() {
            // A SYNC that the port cannot take is lost, as on a real bus.
            let _ = sink.send_sync();
        }
        self.note_as(at, passed);
    }
}

impl Drop for Live {
    /// What was sent last is still heard; then the ports are the other end's again.
    fn drop(&mut self) {
        if !self.keeps_step() {
            return;
        }
        let now = self.clock.now();
        if let Some(lockstep) = &self.lockstep
            && !lockstep.sent.is_empty()
        {
            self.step(now, Ports::NONE);
        }
        if let Some(lockstep) = &self.lockstep {
            for slot in &self.ports {
                lockstep.participant.detach(slot.port);
            }
        }
    }
}
