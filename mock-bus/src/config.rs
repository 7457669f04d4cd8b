//! What an emulated machine is made of: TOML, every key ending in its unit, unknown keys refused.

mod checks;
pub(crate) mod error;

use core::time::Duration;
use serde::Deserialize;
use std::collections::BTreeSet;
use std::path::Path;

pub use error::ConfigError;

use crate::fault::FaultConfig;
pub use crate::node::DeviceConfig;
use crate::plant::config::PlantConfig;

/// One emulated machine.
///
/// # Example
///
/// ```
/// use mock_bus::config::MachineConfig;
///
/// let machine = |key: &str| {
///     let port = "[[ports]]\nkind = \"serial\"\nname = \"adc\"\n";
///     let device = format!("device = {{ kind = \"dcon_module\", {key} }}\n");
///     let node = format!("[[nodes]]\nname = \"adc\"\nport = \"adc\"\n{device}");
///     MachineConfig::parse(&format!("name = \"bench\"\n{port}{node}"))
/// };
/// assert_eq!(machine("channels = 4")?.node("adc"), Some(0));
/// let error = machine("chanels = 4").expect_err("a misprint");
/// assert!(error.to_string().contains("unknown field `chanels`"));
/// # Ok::<(), mock_bus::config::ConfigError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MachineConfig {
    /// Its name, for people.
    pub name: String,
    /// How long the mains stays off in a power cycle.
    #[serde(default = "default_power_off_ms")]
    pub power_off_ms: f64,
    /// The physics.
    #[serde(default)]
    pub plant: PlantConfig,
    /// Buses and serial lines; their places in this list are their port numbers.
    pub ports: Vec<PortConfig>,
    /// The devices on them.
    pub nodes: Vec<NodeConfig>,
    /// What goes wrong, and when.
    #[serde(default)]
    pub faults: Vec<FaultConfig>,
}

const fn default_power_off_ms() -> f64 {
    500.0
}

/// A bus or a line.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum PortConfig {
    /// A CAN bus.
    Can(CanConfig),
    /// A serial line.
    Serial(SerialConfig),
}

impl PortConfig {
    /// What the machine calls it.
    pub fn name(&self) -> &str {
        match self {
            Self::Can(can) => &can.name,
            Self::Serial(serial) => &serial.name,
        }
    }

    /// Whether it carries frames.
    pub const fn is_can(&self) -> bool {
        matches!(self, Self::Can(_))
    }
}

/// A CAN bus.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CanConfig {
    /// What the machine calls it.
    pub name: String,
    /// Bit rate in kbit/s.
    pub bitrate_kbit_per_s: u32,
    /// How late the host's adapter hands over a frame.
    #[serde(default)]
    pub latency_us: f64,
    /// It hands over at whole multiples of this only, all that it has by then: 1000 for an adapter
    /// on full-speed USB, whose host asks once in each frame of 1 ms. With 0 at any time.
    #[serde(default)]
    pub hands_over_every_us: f64,
    /// How many frames the host's interface takes before it says "full".
    #[serde(default = "default_transmit_queue")]
    pub transmit_queue_frames: usize,
}

const fn default_transmit_queue() -> usize {
    128
}

/// A serial line.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SerialConfig {
    /// What the machine calls it.
    pub name: String,
    /// Ten bits for each byte; absent for a USB device, whose rate means nothing.
    #[serde(default)]
    pub baud_bit_per_s: Option<u32>,
    /// How late the host's adapter hands over bytes.
    #[serde(default)]
    pub latency_us: f64,
    /// As for [`CanConfig::hands_over_every_us`].
    #[serde(default)]
    pub hands_over_every_us: f64,
}

/// A device on a port.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NodeConfig {
    /// What the machine calls it; faults name it so.
    pub name: String,
    /// The port it is on.
    pub port: String,
    /// Not on the machine's mains: a power cycle of the machine leaves it running.
    #[serde(default)]
    pub own_mains: bool,
    /// Brought along for a calibration: it has no power, from its own mains, until somebody sets
    /// a line up with it.
    #[serde(default)]
    pub brought_along: bool,
    /// What it is.
    pub device: DeviceConfig,
}

impl MachineConfig {
    /// From a file.
    ///
    /// # Errors
    /// When the file cannot be read or does not describe a machine.
    pub fn load(path: &Path) -> Result<Self, ConfigError> {
        let text = std::fs::read_to_string(path).map_err(|source| ConfigError::Read {
            path: path.to_owned(),
            source,
        })?;
        Self::parse(&text)
    }

    /// From TOML text.
    ///
    /// # Errors
    /// When the text does not describe a machine.
    pub fn parse(text: &str) -> Result<Self, ConfigError> {
        let config: Self = toml::from_str(text)?;
        config.check()?;
        Ok(config)
    }

    /// The port number of the port called `name`.
    pub fn port(&self, name: &str) -> Option<usize> {
        self.ports.iter().position(|port| port.name() == name)
    }

    /// The place of the node called `name`.
    pub fn node(&self, name: &str) -> Option<usize> {
        self.nodes.iter().position(|node| node.name == name)
    }

    /// How long the mains stays off in a power cycle.
    pub fn power_off(&self) -> Duration {
        Duration::from_secs_f64(self.power_off_ms * 1e-3)
    }

    fn check(&self) -> Result<(), ConfigError> {
        unique(self.ports.iter().map(PortConfig::name))?;
        unique(self.nodes.iter().map(|node| node.name.as_str()))?;
        for node in &self.nodes {
            self.check_port(&node.name, &node.port, node.device.is_on_can())?;
        }
        for fault in &self.faults {
            self.check_fault(fault, |node| self.node(node).is_some())?;
        }
        self.check_numbers()
    }

    /// Whether a fault names ports and nodes that are there, of the right kind.
    pub(crate) fn check_fault(
        &self,
        fault: &FaultConfig,
        is_node: impl Fn(&str) -> bool,
    ) -> Result<(), ConfigError> {
        if let Some((port, wants_can)) = fault.fault.port() {
            match wants_can {
                Some(can) => self.check_port("a fault", port, can)?,
                None if self.port(port).is_some() => {}
                None => return Err(no_port("a fault", port)),
            }
        }
        match fault.fault.node() {
            Some(node) if !is_node(node) => Err(ConfigError::NoNode {
                node: node.to_owned(),
            }),
            _ => Ok(()),
        }
    }

    fn check_port(&self, user: &str, port: &str, can: bool) -> Result<(), ConfigError> {
        let place = self.port(port).ok_or_else(|| no_port(user, port))?;
        if self.ports[place].is_can() == can {
            Ok(())
        } else {
            Err(ConfigError::WrongKind {
                user: user.to_owned(),
                port: port.to_owned(),
            })
        }
    }
}

fn no_port(user: &str, port: &str) -> ConfigError {
    ConfigError::NoPort {
        user: user.to_owned(),
        port: port.to_owned(),
    }
}

fn unique<'a>(names: impl Iterator<Item = &'a str>) -> Result<(), ConfigError> {
    let mut seen = BTreeSet::new();
    for name in names {
        if !seen.insert(name) {
            return Err(ConfigError::NameTwice {
                name: name.to_owned(),
            });
        }
    }
    Ok(())
}
