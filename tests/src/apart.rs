//! What a loop needs by itself, apart from the emulated machine that shares its thread.

use core::time::Duration;
use std::cell::Cell;
use std::rc::Rc;

use drivers::transport::{SendError, Transport};
use machine::engine::{Cause, Engine};
use truestage::{Failure, Machine};
use units::Time;
use wire::{Arrival, Payload, Port};

use crate::stream::Writer;

/// Something that only grows: time that has passed, memory that was asked for.
pub type Meter = fn() -> u64;

/// A transport that notes how much of something was used inside it.
pub struct Apart {
    inner: Box<dyn Transport>,
    meter: Meter,
    inside: Rc<Cell<u64>>,
}

impl Apart {
    /// Around `inner`; the cell holds what was used inside.
    pub fn new(inner: Box<dyn Transport>, meter: Meter) -> (Self, Rc<Cell<u64>>) {
        let inside = Rc::new(Cell::new(0));
        let apart = Self {
            inner,
            meter,
            inside: Rc::clone(&inside),
        };
        (apart, inside)
    }

    fn noted<R>(&mut self, work: impl FnOnce(&mut dyn Transport) -> R) -> R {
        let before = (self.meter)();
        let result = work(&mut *self.inner);
        self.inside.set(self.inside.get() + (self.meter)() - before);
        result
    }
}

impl Transport for Apart {
    fn now(&self) -> Time {
        self.inner.now()
    }

    fn send(&mut self, port: Port, payload: &Payload) -> Result<(), SendError> {
        self.noted(|inner| inner.send(port, payload))
    }

    fn receive(&mut self, until: Time) -> Option<Arrival> {
        self.noted(|inner| inner.receive(until))
    }

    fn sleep_until(&mut self, until: Time) {
        self.noted(|inner| inner.sleep_until(until));
    }

    fn set_sync(&mut self, port: Port, period: Option<Duration>) -> Result<(), SendError> {
        self.noted(|inner| inner.set_sync(port, period))
    }
}

/// What the loop itself used from its period `from` on, and in how many periods. The path is
/// stopped in its period `stop`.
///
/// # Errors
/// As [`Machine::follow`](machine::Machine::follow).
pub fn used_by_the_loop(
    machine: &mut Machine,
    engine: &mut Engine,
    mut writer: Writer,
    (meter, inside): (Meter, &Cell<u64>),
    (from, stop): (u64, u64),
) -> Result<(Cause, u64, u64), Failure> {
    let (mut periods, mut by_host, mut first, mut last) = (0, 0, 0, 0);
    let cause = machine.follow_with(engine, &mut || {
        let entered = meter();
        periods += 1;
        last = entered - inside.get() - by_host;
        if periods == from {
            first = last;
        }
        if periods == stop {
            writer.desk().stop().expect("it listens");
        }
        writer.serve();
        by_host += meter() - entered;
    })?;
    Ok((cause, last - first, periods - from))
}
