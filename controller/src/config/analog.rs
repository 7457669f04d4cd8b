//! Analog modules in the configuration file.

use schemars::JsonSchema;
use serde::Deserialize;

use super::drive::IdentityConfig;

/// An analog module, by what `device` calls it.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(tag = "device", rename_all = "lowercase")]
pub enum ModuleConfig {
    /// A CiA 401 module on CAN.
    Cia401(NodeConfig),
    /// A CiA 404 measuring module on CAN (voltages and temperatures).
    Cia404(Cia404Config),
    /// An ADAM/I-7000 module on a serial line (DCON).
    Dcon(DconConfig),
}

/// What every module on CAN has.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
pub struct NodeConfig {
    /// The bus that the module is on.
    #[schemars(extend("x-range" = "a `[can.NAME]`"))]
    pub bus: String,
    /// Its number there.
    #[schemars(range(min = 1, max = 127))]
    pub node_id: u8,
    /// Period of the module's heartbeat (0x1017).
    #[schemars(range(min = 5, max = 10000))]
    pub heartbeat_producer_ms: u16,
    /// Without a heartbeat for this long the module counts as lost.
    #[schemars(extend("x-range" = "at least 2 × `heartbeat_producer_ms`"))]
    pub heartbeat_consumer_ms: u16,
    /// Without the controller's heartbeat for this long the module knows (0x1016).
    #[schemars(extend("x-range" = "at least 2 × `master_heartbeat_ms`"))]
    pub watch_master_ms: u16,
    /// Who the module must be.
    pub identity: IdentityConfig,
}

/// What only a measuring module has.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
pub struct Cia404Config {
    /// Where it is.
    #[serde(flatten)]
    pub node: NodeConfig,
    /// Inputs with a resistance thermometer Pt100, read in hundredths of degrees.
    #[schemars(inner(range(min = 0, max = 7)), extend("x-range" = "none of `channels`"))]
    #[serde(default)]
    pub temperature_channels: Vec<u8>,
    /// The module samples and sends at every so many SYNCs; it counts in the bus load with that
    /// part. Its frames yield to set-points and drives.
    #[schemars(range(min = 1, max = 240))]
    pub every_syncs: u8,
}

/// What only a module on a serial line has.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
pub struct DconConfig {
    /// The line that the module is on.
    #[schemars(extend("x-range" = "a `[serial.NAME]`"))]
    pub line: String,
    /// The module's address.
    #[schemars(range(min = 0, max = 255))]
    pub address: u8,
    /// From one reading to the next; without a reading for 1 s an alarm is raised.
    #[schemars(range(min = 1.0, max = 60000.0))]
    pub poll_period_ms: f64,
    /// Whether lines carry a checksum; the module must be set the same way.
    #[serde(default)]
    pub checksum: bool,
}

/// An analog module.
///
/// A `dcon` module must be set to the input range that `full_scale_v` names and to engineering
/// units; the start checks both. It samples when it is asked and not at a SYNC, up to 0.1 s late:
/// good for watching voltages, too slow for the Hall search, which then ends with a reason and no
/// zero.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[schemars(extend("unevaluatedProperties" = false))]
pub struct AnalogConfig {
    /// What it is.
    #[serde(flatten)]
    pub module: ModuleConfig,
    /// Converter channels, in the order their readings are used; zeroing takes two: peak, slope.
    #[schemars(extend("x-range" = "each once; 0 to 3 for `cia401`, 0 to 7 for the others"))]
    #[serde(default)]
    pub channels: Vec<u8>,
    /// `cia401`: voltage of the largest reading (1e-3 to 1e3). `cia404`: largest voltage to be told
    /// apart (above 0 to 32.767); the finest resolution that reaches it is set, 0.1 mV up to 3.2767
    /// V and 1 mV above. `dcon`: the input range that the module is set to (10, 5, 1, 0.5 or 0.15),
    /// the same for each channel.
    #[schemars(extend("x-range" = "one for each of `channels`"))]
    #[serde(default)]
    pub full_scale_v: Vec<f64>,
}

impl AnalogConfig {
    /// Where it is on CAN, if it is.
    pub const fn node(&self) -> Option<&NodeConfig> {
        match &self.module {
            ModuleConfig::Cia401(node) => Some(node),
            ModuleConfig::Cia404(module) => Some(&module.node),
            ModuleConfig::Dcon(_) => None,
        }
    }

    /// What it has on a serial line, if it is on one.
    pub const fn dcon(&self) -> Option<&DconConfig> {
        match &self.module {
            ModuleConfig::Dcon(module) => Some(module),
            ModuleConfig::Cia401(_) | ModuleConfig::Cia404(_) => None,
        }
    }

    /// What `device` calls it.
    pub const fn device(&self) -> &'static str {
        match &self.module {
            ModuleConfig::Cia401(_) => "cia401",
            ModuleConfig::Cia404(_) => "cia404",
            ModuleConfig::Dcon(_) => "dcon",
        }
    }

    /// The bus or line that it is on.
    pub fn port(&self) -> &str {
        match &self.module {
            ModuleConfig::Cia401(node) => &node.bus,
            ModuleConfig::Cia404(module) => &module.node.bus,
            ModuleConfig::Dcon(module) => &module.line,
        }
    }

    /// Its inputs that measure temperatures.
    pub fn temperature_channels(&self) -> &[u8] {
        match &self.module {
            ModuleConfig::Cia404(module) => &module.temperature_channels,
            ModuleConfig::Cia401(_) | ModuleConfig::Dcon(_) => &[],
        }
    }

    /// At every how many SYNCs it samples; `None` for one that does not hear them.
    pub const fn every_syncs(&self) -> Option<u8> {
        match &self.module {
            ModuleConfig::Cia401(_) => Some(1),
            ModuleConfig::Cia404(module) => Some(module.every_syncs),
            ModuleConfig::Dcon(_) => None,
        }
    }
}
