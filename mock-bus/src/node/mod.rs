//! Each emulated device's bus face.
//!
//! A node is sans-io: payloads, time and the plant come in, payloads go out.

pub mod analog_module;
pub mod canopen_server;
pub mod cia401_analog;
pub mod cia402_drive;
pub mod cia404_analog;
pub mod copley_amp;
pub mod dcon_module;
pub mod in_sight_controller;
pub mod profile;
pub mod umd2_interferometer;

use core::any::Any;

use units::Time;
use wire::Payload;

use crate::plant::Plant;

/// One emulated device.
///
/// It is [`Any`], so that a test can reach a device's own faults through the simulation.
pub trait Node: Any {
    /// Whether what was sent on the node's port means anything to it; what does not changes nothing
    /// about the node, and is not handed to it.
    fn concerns(&self, _payload: &Payload) -> bool {
        true
    }

    /// Takes what was sent on the node's port; CAN nodes see every frame of their bus that concerns
    /// them.
    fn handle(&mut self, now: Time, payload: &Payload, plant: &mut Plant);

    /// Lets time pass up to `now`; called at least at every [`Node::next_event`].
    fn advance(&mut self, now: Time, plant: &mut Plant);

    /// When the node wants to be advanced next; [`Time::NEVER`] for never.
    fn next_event(&self) -> Time;

    /// The next payload the node sends.
    fn poll_transmit(&mut self) -> Option<Payload>;

    /// The mains goes off (everything volatile is lost, the node falls silent).
    fn power_off(&mut self, now: Time, plant: &mut Plant);

    /// The mains comes back: the node boots.
    fn power_on(&mut self, now: Time, plant: &mut Plant);
}
