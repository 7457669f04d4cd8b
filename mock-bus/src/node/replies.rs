//! What a device on a serial line answers, some time after it was asked, and from when on it listens.

use core::time::Duration;
use std::collections::VecDeque;

use units::Time;
use wire::Payload;

/// Answers that wait for their time, and those that are on their way.
#[derive(Clone, Debug)]
pub(super) struct Replies {
    listens_from: Time,
    waiting: VecDeque<(Time, Vec<u8>)>,
    outbox: VecDeque<Payload>,
}

impl Replies {
    /// Of a device without power.
    pub(super) const fn new() -> Self {
        Self {
            listens_from: Time::NEVER,
            waiting: VecDeque::new(),
            outbox: VecDeque::new(),
        }
    }

    /// The bytes that the device hears; none while it does not listen.
    pub(super) fn heard<'p>(&self, now: Time, payload: &'p Payload) -> &'p [u8] {
        match payload {
            Payload::Bytes(bytes) if now >= self.listens_from => bytes,
            _ => &[],
        }
    }

    /// `reply` leaves at `at`.
    pub(super) fn push(&mut self, at: Time, reply: Vec<u8>) {
        self.waiting.push_back((at, reply));
    }

    /// The same, but not before the answers to what was asked earlier.
    pub(super) fn push_in_order(&mut self, at: Time, reply: Vec<u8>) {
        let last = self.waiting.back().map_or(at, |(last, _)| *last);
        self.push(at.max(last), reply);
    }

    pub(super) fn advance(&mut self, now: Time) {
        while self.next_event() <= now {
            let reply = self.waiting.pop_front().map(|(_, reply)| reply);
            self.outbox.extend(reply.map(Payload::Bytes));
        }
    }

    pub(super) fn next_event(&self) -> Time {
        self.waiting.front().map_or(Time::NEVER, |(at, _)| *at)
    }

    pub(super) fn poll_transmit(&mut self) -> Option<Payload> {
        self.outbox.pop_front()
    }

    /// Nothing is heard or said any more.
    pub(super) fn power_off(&mut self) {
        *self = Self::new();
    }

    /// The device listens when it has booted.
    pub(super) fn power_on(&mut self, now: Time, boot_ms: f64) {
        *self = Self::new();
        self.listens_from = now + Duration::from_secs_f64(boot_ms * 1e-3);
    }
}
