//! What an emulated machine is made of: TOML, every key ending in its unit, unknown keys refused.

mod checks;

use core::time::Duration;
use serde::Deserialize;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use crate::fault::FaultConfig;
use crate::node::Node;
use crate::node::cia401_analog::{Cia401AnalogConfig, Cia401AnalogNode};
use crate::node::cia402_drive::{Cia402DriveConfig, Cia402DriveNode};
use crate::node::cia404_analog::{Cia404AnalogConfig, Cia404AnalogNode};
use crate::node::copley_amp::{CopleyAmpsConfig, CopleyAmpsNode};
use crate::node::dcon_module::{DconModuleConfig, DconModuleNode};
use crate::node::in_sight_controller::{InSightControllerConfig, InSightControllerNode};
use crate::node::umd2_interferometer::{Umd2InterferometerConfig, Umd2InterferometerNode};
use crate::plant::config::PlantConfig;

/// One emulated machine.
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

/// Which device, and how it is set.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum DeviceConfig {
    /// CiA 402 servo drive, on a CAN bus.
    Cia402Drive(Cia402DriveConfig),
    /// CiA 401 analog inputs, on a CAN bus.
    Cia401Analog(Cia401AnalogConfig),
    /// CiA 404 measuring module, on a CAN bus.
    Cia404Analog(Cia404AnalogConfig),
    /// µMD2 laser interferometer, on a serial line.
    Umd2Interferometer(Umd2InterferometerConfig),
    /// ADAM or I-7000 analog module, on a serial line.
    DconModule(DconModuleConfig),
    /// In-Sight vision system, on a serial line.
    InSightController(InSightControllerConfig),
    /// Copley Controls servo amplifiers, on one serial line.
    CopleyAmps(CopleyAmpsConfig),
}

impl DeviceConfig {
    /// The device, without power yet.
    pub(crate) fn build(&self, seed: u64, name: &str) -> Box<dyn Node> {
        match self {
            Self::Cia402Drive(config) => Box::new(Cia402DriveNode::new(config.clone())),
            Self::Cia401Analog(config) => Box::new(Cia401AnalogNode::new(config.clone())),
            Self::Cia404Analog(config) => Box::new(Cia404AnalogNode::new(config.clone())),
            Self::Umd2Interferometer(config) => Box::new(Umd2InterferometerNode::new(config)),
            Self::DconModule(config) => Box::new(DconModuleNode::new(config, seed, name)),
            Self::InSightController(config) => {
                Box::new(InSightControllerNode::new(config, seed, name))
            }
            Self::CopleyAmps(config) => Box::new(CopleyAmpsNode::new(config, seed, name)),
        }
    }

    const fn wants_can(&self) -> bool {
        match self {
            Self::Cia402Drive(_) | Self::Cia401Analog(_) | Self::Cia404Analog(_) => true,
            Self::Umd2Interferometer(_)
            | Self::DconModule(_)
            | Self::InSightController(_)
            | Self::CopleyAmps(_) => false,
        }
    }
}

/// Why a configuration is no machine.
#[derive(Debug, thiserror::Error)]
pub enum ConfigError {
    /// The file cannot be read.
    #[error("{}: {source}", path.display())]
    Read {
        /// Which file.
        path: PathBuf,
        /// What the operating system says.
        source: std::io::Error,
    },
    /// The file is not TOML of this form.
    #[error("{0}")]
    Syntax(#[from] toml::de::Error),
    /// Two ports or two nodes have the same name.
    #[error("the name \"{name}\" is given twice")]
    NameTwice {
        /// Which name.
        name: String,
    },
    /// A port is named that is not there.
    #[error("{user} is on port \"{port}\", which is not among the ports")]
    NoPort {
        /// Who names it.
        user: String,
        /// What it names.
        port: String,
    },
    /// A node is named that is not there.
    #[error("a fault names node \"{node}\", which is not among the nodes")]
    NoNode {
        /// What it names.
        node: String,
    },
    /// A CAN device on a serial line, or the reverse.
    #[error("{user} does not fit port \"{port}\": one is CAN, the other serial")]
    WrongKind {
        /// Which node or fault.
        user: String,
        /// Which port.
        port: String,
    },
    /// A number that cannot be.
    #[error("{key} = {seen}, expected {expected}")]
    Value {
        /// Which key.
        key: &'static str,
        /// What it was.
        seen: f64,
        /// What it may be.
        expected: &'static str,
    },
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
            self.check_port(&node.name, &node.port, node.device.wants_can())?;
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
