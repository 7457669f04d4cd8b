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
pub mod nd287_display;
pub mod profile;
mod replies;
pub mod umd2_interferometer;

use core::any::Any;

use serde::Deserialize;
use units::Time;
use wire::Payload;

use crate::config::error::ConfigError;
use crate::plant::Plant;
use crate::plant::config::PlantConfig;
use cia401_analog::Cia401AnalogConfig;
use cia402_drive::Cia402DriveConfig;
use cia404_analog::Cia404AnalogConfig;
use copley_amp::CopleyAmpsConfig;
use dcon_module::DconModuleConfig;
use in_sight_controller::InSightControllerConfig;
use nd287_display::Nd287DisplayConfig;
use umd2_interferometer::Umd2InterferometerConfig;

/// Which device, and how it is set.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum DeviceConfig {
    /// CiA 402 servo drive, on a CAN bus.
    Cia402Drive(Box<Cia402DriveConfig>),
    /// CiA 401 analog inputs, on a CAN bus.
    Cia401Analog(Cia401AnalogConfig),
    /// CiA 404 measuring module, on a CAN bus.
    Cia404Analog(Cia404AnalogConfig),
    /// µMD2 laser interferometer, on a serial line.
    Umd2Interferometer(Umd2InterferometerConfig),
    /// ADAM or I-7000 analog module, on a serial line.
    DconModule(DconModuleConfig),
    /// HEIDENHAIN ND 287 position display, on a serial line.
    Nd287Display(Nd287DisplayConfig),
    /// In-Sight vision system, on a serial line.
    InSightController(InSightControllerConfig),
    /// Copley Controls servo amplifiers, on one serial line.
    CopleyAmps(CopleyAmpsConfig),
}

/// What the section of a device is to a machine.
pub(crate) trait Section {
    /// Whether it is on a CAN bus; otherwise it is on a serial line.
    fn is_on_can(&self) -> bool {
        false
    }

    /// Refuses numbers that make no device of this plant.
    fn check(&self, plant: &PlantConfig) -> Result<(), ConfigError>;

    /// The device, without power yet; `seed` and `name` choose what is by chance.
    fn build(&self, seed: u64, name: &str) -> Box<dyn Node>;
}

impl DeviceConfig {
    fn section(&self) -> &dyn Section {
        match self {
            Self::Cia402Drive(section) => &**section,
            Self::Cia401Analog(section) => section,
            Self::Cia404Analog(section) => section,
            Self::Umd2Interferometer(section) => section,
            Self::DconModule(section) => section,
            Self::Nd287Display(section) => section,
            Self::InSightController(section) => section,
            Self::CopleyAmps(section) => section,
        }
    }

    pub(crate) fn is_on_can(&self) -> bool {
        self.section().is_on_can()
    }

    pub(crate) fn check(&self, plant: &PlantConfig) -> Result<(), ConfigError> {
        self.section().check(plant)
    }

    /// The device, without power yet.
    pub(crate) fn build(&self, seed: u64, name: &str) -> Box<dyn Node> {
        self.section().build(seed, name)
    }
}

/// One emulated device.
///
/// It is [`Any`], so that a test can reach a device's own faults through the simulation.
///
/// # Example
///
/// Whoever runs a node hands it what was sent, advances it when it wants to be, and takes what it sends.
///
/// ```
/// use mock_bus::node::Node;
/// use mock_bus::node::dcon_module::{DconModuleConfig, DconModuleNode};
/// use mock_bus::plant::Plant;
/// use units::Time;
/// use wire::Payload;
///
/// let config = DconModuleConfig { checksum: false, boot_ms: 0.0, ..DconModuleConfig::default() };
/// let (mut module, mut plant) = (DconModuleNode::new(&config, 1, "adc"), Plant::default());
/// module.power_on(Time::ZERO, &mut plant);
/// module.handle(Time::ZERO, &Payload::Bytes(b"$01M\r".to_vec()), &mut plant);
/// assert_eq!(module.poll_transmit(), None, "not yet");
/// module.advance(module.next_event(), &mut plant);
/// assert_eq!(module.poll_transmit(), Some(Payload::Bytes(b"!014117\r".to_vec())));
/// ```
pub trait Node: Any + Send {
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
