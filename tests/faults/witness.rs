//! A witness of the truth: what the controller sent and where the stage really was, at every
//! moment, and what is done to the machine at set moments behind the controller's back.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::rc::Rc;
use std::time::Duration;

use drivers::transport::in_process::InProcess;
use drivers::transport::{SendError, Transport};
use truestage::emulated::Emulated;
use units::Time;
use wire::can::CanFrame;
use wire::{Arrival, Input, Payload, Port};

/// Something done to the machine.
pub type Deed = Box<dyn FnOnce(&Emulated)>;

/// What was seen.
#[derive(Default)]
pub struct Testimony {
    /// Where the stage truly was, in metres.
    pub path: Vec<(Time, f64)>,
    /// The frames that the controller sent.
    pub sent: Vec<(Time, CanFrame)>,
    /// How many of them the port did not take.
    pub refused: u32,
    deeds: Vec<(Time, Deed)>,
    stall: Option<(Time, Duration)>,
    full: Option<(Time, u16)>,
    /// The frames that a slow computer had no room for.
    pub lost: u32,
    slow: Option<(Time, Slow)>,
}

/// A computer that takes frames more slowly than they come.
#[derive(Clone, Copy)]
pub struct Slow {
    /// What it needs for each.
    pub cost: Duration,
    /// How many wait for it at most; what else comes is lost.
    pub room: usize,
}

impl Testimony {
    /// Does `deed` at `at`.
    pub fn plan(&mut self, at: Time, deed: Deed) {
        self.deeds.push((at, deed));
    }

    /// The controller is held up for so long right after its first SYNC from `at` on.
    pub const fn stall(&mut self, at: Time, span: Duration) {
        self.stall = Some((at, span));
    }

    /// From `at` on the port has no room for frames with this identifier.
    pub const fn fill(&mut self, at: Time, cob_id: u16) {
        self.full = Some((at, cob_id));
    }

    /// From `at` on the computer is slow.
    pub const fn slow_down(&mut self, at: Time, slow: Slow) {
        self.slow = Some((at, slow));
    }

    /// Whether a stall that was ordered has come.
    pub const fn has_stalled(&self) -> bool {
        self.stall.is_none()
    }

    /// Whatever was ordered to go wrong has gone wrong.
    #[track_caller]
    pub fn everything_was_done(&self) {
        assert!(self.has_stalled(), "the controller was never held up");
        let left: Vec<Time> = self.deeds.iter().map(|(at, _)| *at).collect();
        assert!(left.is_empty(), "never done, due at {left:?}");
        let full = self.full.is_some();
        assert!(!full || self.refused > 0, "no frame met the full port");
        let slow = self.slow.is_some();
        assert!(!slow || self.lost > 0, "the slow computer lost no frame");
    }

    /// The longest time that the controller did not look, from `since` on.
    pub fn unseen_since(&self, since: Time) -> Duration {
        let looks = self.path.windows(2).filter(|pair| pair[0].0 >= since);
        let gaps = looks.map(|pair| pair[1].0 - pair[0].0);
        gaps.max().unwrap_or_default()
    }

    /// The controlwords of RPDO 1 of node 1, with their times.
    pub fn controlwords(&self) -> impl Iterator<Item = (Time, u16)> {
        self.sent
            .iter()
            .filter(|(_, frame)| frame.standard_id() == Some(0x201))
            .map(|(at, frame)| (*at, u16::from_le_bytes([frame.data()[0], frame.data()[1]])))
    }

    /// When the stage moved last after `since`; `None` when it never did.
    pub fn moved_last(&self, since: Time) -> Option<Time> {
        // Faster than noise and creep, slower than any motion that was ordered.
        const MOVING_M_PER_S: f64 = 50e-6;
        // While nobody looked, nobody knows.
        const GAP: Duration = Duration::from_millis(100);
        let steps = self
            .path
            .windows(2)
            .filter(|step| step[1].0 > since && step[1].0 - step[0].0 < GAP);
        steps
            .filter(|step| {
                let span = (step[1].0 - step[0].0).as_secs_f64().max(1e-4);
                (step[1].1 - step[0].1).abs() / span > MOVING_M_PER_S
            })
            .map(|step| step[1].0)
            .next_back()
    }
}

/// A transport that a witness looks over.
pub struct Witnessed {
    inner: InProcess<Emulated>,
    seen: Rc<RefCell<Testimony>>,
    /// What waits for a slow computer, and how many frames were lost right before each.
    waiting: VecDeque<(Arrival, u32)>,
    /// The frames lost since the last one that found room.
    lost: u32,
}

impl Witnessed {
    /// Looks over `inner`.
    pub const fn new(inner: InProcess<Emulated>, seen: Rc<RefCell<Testimony>>) -> Self {
        Self {
            inner,
            seen,
            waiting: VecDeque::new(),
            lost: 0,
        }
    }

    /// As a socket does: what comes waits, frames that find no room are lost, and the next one that
    /// finds room says how many.
    fn next_arrival(&mut self, until: Time) -> Option<Arrival> {
        let now = self.inner.now();
        let slow = self.seen.borrow().slow.filter(|(at, _)| now >= *at);
        let Some((_, slow)) = slow else {
            return self.inner.receive(until);
        };
        let taken = now + slow.cost;
        self.inner.world().simulation_mut().advance(taken);
        while let Some(arrival) = self.inner.receive(taken) {
            let is_frame = matches!(arrival.input, Input::Payload(Payload::Frame(_)));
            if is_frame && self.waiting.len() >= slow.room {
                self.lost += 1;
                self.seen.borrow_mut().lost += 1;
            } else {
                let lost = if is_frame {
                    core::mem::take(&mut self.lost)
                } else {
                    0
                };
                self.waiting.push_back((arrival, lost));
            }
        }
        match self.waiting.pop_front() {
            None => self.inner.receive(until.max(taken)),
            Some((arrival, 0)) => Some(arrival),
            Some((arrival, lost)) => {
                let told = Arrival {
                    input: Input::Lost(lost),
                    ..arrival.clone()
                };
                self.waiting.push_front((arrival, 0));
                Some(told)
            }
        }
    }

    fn look(&self) {
        let simulation = self.inner.world().simulation();
        let here = (
            simulation.now(),
            simulation.truth().scale_position().value(),
        );
        self.seen.borrow_mut().path.push(here);
    }

    fn is_full_for(&self, frame: &CanFrame) -> bool {
        let full = self.seen.borrow().full;
        full.is_some_and(|(at, id)| self.inner.now() >= at && frame.standard_id() == Some(id))
    }

    fn stall_after(&self, frame: &CanFrame) {
        const SYNC: u16 = 0x080;
        let now = self.inner.now();
        let mut seen = self.seen.borrow_mut();
        let due = seen.stall.filter(|(at, _)| now >= *at);
        if let Some((_, span)) = due.filter(|_| frame.standard_id() == Some(SYNC)) {
            seen.stall = None;
            drop(seen);
            self.inner.world().simulation_mut().advance(now + span);
        }
    }

    fn next_deed(&self) -> Time {
        let deeds = &self.seen.borrow().deeds;
        deeds.iter().map(|(at, _)| *at).min().unwrap_or(Time::NEVER)
    }

    fn do_what_is_due(&self) {
        let now = self.inner.now();
        loop {
            let mut seen = self.seen.borrow_mut();
            let Some(due) = seen.deeds.iter().position(|(at, _)| *at <= now) else {
                return;
            };
            let (_, deed) = seen.deeds.remove(due);
            drop(seen);
            deed(self.inner.world());
        }
    }
}

impl Transport for Witnessed {
    fn now(&self) -> Time {
        self.inner.now()
    }

    fn send(&mut self, port: Port, payload: &Payload) -> Result<(), SendError> {
        let Payload::Frame(frame) = payload else {
            return self.inner.send(port, payload);
        };
        if self.is_full_for(frame) {
            self.seen.borrow_mut().refused += 1;
            return Err(SendError::QueueFull { port });
        }
        let now = self.inner.now();
        self.seen.borrow_mut().sent.push((now, *frame));
        self.inner.send(port, payload)?;
        self.stall_after(frame);
        Ok(())
    }

    fn receive(&mut self, until: Time) -> Option<Arrival> {
        loop {
            let stop = until.min(self.next_deed());
            let arrival = self.next_arrival(stop);
            self.look();
            self.do_what_is_due();
            if arrival.is_some() || stop >= until {
                return arrival;
            }
        }
    }

    fn sleep_until(&mut self, until: Time) {
        while self.next_deed() < until {
            let deed = self.next_deed();
            self.inner.sleep_until(deed);
            self.do_what_is_due();
        }
        self.inner.sleep_until(until);
        self.look();
        self.do_what_is_due();
    }

    fn set_sync(&mut self, port: Port, period: Option<Duration>) -> Result<(), SendError> {
        self.inner.set_sync(port, period)
    }
}
