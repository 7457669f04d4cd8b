//! What a full transmit queue did not take yet.
//!
//! A queue that is full for a moment is ordinary; nothing is dropped and the order stays. A
//! queue that stays full means that the bus or the adapter has stopped taking frames, and then
//! the machine must stop too.

use core::time::Duration;
use std::collections::VecDeque;

use drivers::transport::{SendError, Transport};
use units::Time;
use wire::{Payload, Port};

use crate::patience::Patience;

/// How long a transmit queue may stay full.
const FULL_LIMIT: Duration = Duration::from_millis(15);
/// How soon the queue is tried again.
const AGAIN: Duration = Duration::from_millis(1);

/// Who has something to send; named only when it cannot be sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Sender {
    /// The controller itself, as a node of the bus.
    Heartbeat,
    /// A device by its number.
    Device(usize),
}

struct Waiting {
    port: Port,
    payload: Payload,
    sender: Sender,
    since: Time,
}

/// Payloads in the order they must leave.
#[derive(Default)]
pub(crate) struct Outbox {
    waiting: VecDeque<Waiting>,
}

impl Outbox {
    /// Sends `payload` after everything that waits.
    ///
    /// # Errors
    /// When the port cannot carry it at all; whoever wanted to send is named.
    pub(crate) fn send(
        &mut self,
        transport: &mut dyn Transport,
        port: Port,
        payload: Payload,
        sender: Sender,
    ) -> Result<(), (Sender, SendError)> {
        if self.waiting.is_empty() {
            match transport.send(port, &payload) {
                Ok(()) => return Ok(()),
                Err(SendError::QueueFull { .. }) => {}
                Err(error) => return Err((sender, error)),
            }
        }
        self.waiting.push_back(Waiting {
            port,
            payload,
            sender,
            since: transport.now(),
        });
        Ok(())
    }

    /// Sends what waits, as far as the queues take it.
    ///
    /// # Errors
    /// When a queue has been full for too long (15 ms and what `patience` adds), or a port failed.
    pub(crate) fn flush(
        &mut self,
        transport: &mut dyn Transport,
        patience: Patience,
    ) -> Result<(), (Sender, SendError)> {
        while let Some(first) = self.waiting.front() {
            match transport.send(first.port, &first.payload) {
                Ok(()) => {}
                Err(SendError::QueueFull { .. })
                    if transport.now().since(first.since) <= patience.of(FULL_LIMIT) =>
                {
                    return Ok(());
                }
                Err(error) => {
                    let sender = first.sender;
                    self.waiting.clear();
                    return Err((sender, error));
                }
            }
            self.waiting.pop_front();
        }
        Ok(())
    }

    /// Forgets what waits: a stop is first in line, and old set-points are never sent late.
    pub(crate) fn clear(&mut self) {
        self.waiting.clear();
    }

    /// When to flush again.
    pub(crate) fn poll_timeout(&self, now: Time) -> Time {
        if self.waiting.is_empty() {
            Time::NEVER
        } else {
            now + AGAIN
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use wire::Arrival;

    /// Takes `room` payloads, then is full; its clock is set by the test.
    struct Narrow {
        now: Time,
        room: usize,
        taken: Vec<Payload>,
    }

    impl Transport for Narrow {
        fn now(&self) -> Time {
            self.now
        }

        fn send(&mut self, port: Port, payload: &Payload) -> Result<(), SendError> {
            if self.taken.len() >= self.room {
                return Err(SendError::QueueFull { port });
            }
            self.taken.push(payload.clone());
            Ok(())
        }

        fn receive(&mut self, _until: Time) -> Option<Arrival> {
            None
        }

        fn sleep_until(&mut self, until: Time) {
            self.now = until;
        }

        fn set_sync(&mut self, _port: Port, _period: Option<Duration>) -> Result<(), SendError> {
            Ok(())
        }
    }

    fn payload(byte: u8) -> Payload {
        Payload::Bytes(vec![byte])
    }

    fn full_after(room: usize) -> (Outbox, Narrow) {
        let mut outbox = Outbox::default();
        let mut narrow = Narrow {
            now: Time::ZERO,
            room,
            taken: Vec::new(),
        };
        for byte in 0..3 {
            outbox
                .send(&mut narrow, Port(0), payload(byte), Sender::Device(1))
                .unwrap();
        }
        (outbox, narrow)
    }

    #[test]
    fn a_queue_that_was_full_for_a_moment_gets_everything_in_order() {
        let (mut outbox, mut narrow) = full_after(1);
        narrow.now = Time::ZERO + Duration::from_millis(5);
        outbox.flush(&mut narrow, Patience::NONE).unwrap();
        narrow.room = 9;
        outbox.flush(&mut narrow, Patience::NONE).unwrap();
        assert_eq!(narrow.taken, [payload(0), payload(1), payload(2)]);
        assert_eq!(outbox.poll_timeout(narrow.now), Time::NEVER);
    }

    #[test]
    fn a_queue_that_stays_full_is_an_error_that_names_the_device() {
        let (mut outbox, mut narrow) = full_after(1);
        narrow.now = Time::ZERO + Duration::from_millis(21);
        let (sender, error) = outbox.flush(&mut narrow, Patience::NONE).unwrap_err();
        assert_eq!(sender, Sender::Device(1));
        assert_eq!(error, SendError::QueueFull { port: Port(0) });
    }

    #[test]
    fn a_stop_overtakes_what_waits() {
        let (mut outbox, mut narrow) = full_after(0);
        outbox.clear();
        narrow.room = 1;
        outbox
            .send(&mut narrow, Port(0), payload(9), Sender::Device(1))
            .unwrap();
        assert_eq!(narrow.taken, [payload(9)]);
    }
}
