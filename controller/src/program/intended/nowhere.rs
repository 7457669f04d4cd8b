//! A machine that is connected to nothing, to be asked what it would refuse.

use drivers::transport::SendError;
use drivers::transport::in_process::{InProcess, World};
use units::Time;
use wire::{Arrival, Payload, Port};

use crate::Machine;
use crate::config::Loaded;

/// Nothing is at any port: what is asked of this machine must not need an answer.
struct Nowhere;

impl World for Nowhere {
    fn next_event(&self) -> Time {
        Time::NEVER
    }

    fn advance(&mut self, _: Time) {}

    fn deliver(&mut self, _: Time, port: Port, _: &Payload) -> Result<(), SendError> {
        Err(SendError::QueueFull { port })
    }

    fn collect(&mut self) -> Option<Arrival> {
        None
    }
}

/// The machine of `loaded`, without its devices.
pub(crate) fn machine(loaded: &Loaded) -> Machine {
    Machine::new(loaded, Box::new(InProcess::new(Nowhere)))
}
