//! Frames on their way out: at once, or held back until their time has come.

use std::collections::VecDeque;

use units::Time;
use wire::can::CanFrame;

#[derive(Clone, Debug, Default)]
pub(super) struct Outbox {
    ready: VecDeque<CanFrame>,
    /// In the order of their times; equal times in the order of their arrival.
    held: VecDeque<(Time, CanFrame)>,
}

impl Outbox {
    pub(super) fn send(&mut self, frame: CanFrame) {
        self.ready.push_back(frame);
    }

    pub(super) fn send_at(&mut self, now: Time, due: Time, frame: CanFrame) {
        if due <= now {
            return self.send(frame);
        }
        let place = self.held.partition_point(|(other, _)| *other <= due);
        self.held.insert(place, (due, frame));
    }

    pub(super) fn release(&mut self, now: Time) {
        while self.held.front().is_some_and(|(due, _)| *due <= now) {
            let due = self.held.pop_front();
            self.ready.extend(due.map(|(_, frame)| frame));
        }
    }

    pub(super) fn next_event(&self) -> Time {
        self.held.front().map_or(Time::NEVER, |(due, _)| *due)
    }

    pub(super) fn poll(&mut self) -> Option<CanFrame> {
        self.ready.pop_front()
    }

    pub(super) fn clear(&mut self) {
        *self = Self::default();
    }
}
