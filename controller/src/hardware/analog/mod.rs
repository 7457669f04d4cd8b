//! Analog modules: `[analog.NAME]`.

pub(crate) mod cia401;
pub(crate) mod cia404;
pub(crate) mod dcon;

use core::time::Duration;
use std::collections::BTreeMap;

use drivers::device::AnalogInput;
use machine::Patience;
use schemars::JsonSchema;
use serde::Deserialize;

use super::bus::Wiring;
use super::node::NodeConfig;
use crate::config::judge::Judge;
pub(crate) use cia401::Cia401Config;
pub(crate) use cia404::Cia404Config;
pub(crate) use dcon::DconConfig;

/// Whether there is an analog module of that name, and whether it reads that `channel`.
pub(crate) fn check_input(
    judge: &mut Judge<'_>,
    modules: &BTreeMap<String, AnalogConfig>,
    (module, channel): (&str, u8),
) {
    judge.known("analog", module, modules, "analog");
    if let Some(analog) = modules.get(module)
        && !analog.channels.contains(&channel)
    {
        judge.say(
            "channel",
            format!("`{module}` does not read channel {channel}"),
            format!("known: {}", channels_of(analog)),
        );
    }
}

/// Those that a module reads, for a person.
pub(crate) fn channels_of(module: &AnalogConfig) -> String {
    let channels: Vec<_> = module.channels.iter().map(u8::to_string).collect();
    channels.join(", ")
}

/// An analog module, by what `device` calls it.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(tag = "device", rename_all = "lowercase")]
pub enum ModuleConfig {
    /// A CiA 401 module on CAN.
    Cia401(Cia401Config),
    /// A CiA 404 measuring module on CAN (voltages and temperatures).
    Cia404(Cia404Config),
    /// An ADAM/I-7000 module on a serial line (DCON).
    Dcon(DconConfig),
}

impl ModuleConfig {
    /// The device profile of its modules; `None` for those that are not on CAN.
    pub(crate) const fn profile(&self) -> Option<u32> {
        match self {
            Self::Cia401(_) => Some(401),
            Self::Cia404(_) => Some(404),
            Self::Dcon(_) => None,
        }
    }
}

/// What a family of analog modules is to a machine.
pub(crate) trait Family {
    /// The bus or line that it is on.
    fn port(&self) -> &str;

    /// Where it is on CAN, if it is.
    fn node(&self) -> Option<&NodeConfig> {
        None
    }

    /// Its address on a serial line.
    fn address(&self) -> Option<u8> {
        None
    }

    /// Its inputs that measure temperatures.
    fn temperature_channels(&self) -> &[u8] {
        &[]
    }

    /// At every how many SYNCs it samples; `None` for one that does not hear them.
    fn every_syncs(&self) -> Option<u8> {
        None
    }

    /// From one sample to the next of one that is asked for them; nothing for one that hears SYNCs.
    fn poll_period(&self) -> Duration {
        Duration::ZERO
    }

    /// Judges what its keys must keep to together.
    fn check(&self, judge: &mut Judge<'_>, inputs: &AnalogConfig, wiring: Wiring<'_>);

    /// Its driver; the configuration has been checked.
    fn driver(
        &self,
        inputs: &AnalogConfig,
        wiring: Wiring<'_>,
        patience: Patience,
    ) -> Box<dyn AnalogInput>;
}

impl ModuleConfig {
    fn family(&self) -> &dyn Family {
        match self {
            Self::Cia401(family) => family,
            Self::Cia404(family) => family,
            Self::Dcon(family) => family,
        }
    }
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
    #[schemars(extend("minimum" = 0, "maximum" = 7, "x-range" = "each once; 0 to 3 for `cia401`"))]
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
    pub fn node(&self) -> Option<&NodeConfig> {
        self.module.family().node()
    }

    /// The bus or line that it is on.
    pub fn port(&self) -> &str {
        self.module.family().port()
    }

    /// Its address on a serial line.
    pub fn address(&self) -> Option<u8> {
        self.module.family().address()
    }

    /// Its inputs that measure temperatures.
    pub fn temperature_channels(&self) -> &[u8] {
        self.module.family().temperature_channels()
    }

    /// At every how many SYNCs it samples; `None` for one that does not hear them.
    pub fn every_syncs(&self) -> Option<u8> {
        self.module.family().every_syncs()
    }

    /// From one sample to the next of one that is asked for them; nothing for one that hears SYNCs.
    pub(crate) fn poll_period(&self) -> Duration {
        self.module.family().poll_period()
    }

    /// Its driver; the configuration has been checked.
    pub(crate) fn driver(&self, wiring: Wiring<'_>, patience: Patience) -> Box<dyn AnalogInput> {
        self.module.family().driver(self, wiring, patience)
    }

    /// Judges what its keys must keep to together.
    pub(crate) fn check(&self, judge: &mut Judge<'_>, wiring: Wiring<'_>) {
        let warmth = self.temperature_channels();
        let both = warmth.iter().find(|it| self.channels.contains(it));
        if let Some(both) = both {
            judge.say(
                "temperature_channels",
                format!("channel {both} stands in `channels`, too, and measures one quantity"),
                "list each channel in one of both",
            );
        }
        let is_empty = self.channels.is_empty() && warmth.is_empty();
        for (key, channels) in [
            ("channels", &*self.channels),
            ("temperature_channels", warmth),
        ] {
            let mut seen = channels.to_vec();
            seen.sort_unstable();
            seen.dedup();
            if seen.len() != channels.len() || is_empty && key == "channels" {
                judge.say(
                    key,
                    "is empty or names a channel twice",
                    "list each used channel once",
                );
            }
        }
        if self.full_scale_v.len() != self.channels.len() {
            judge.say(
                "full_scale_v",
                "must have one value per channel",
                "list as many as `channels`",
            );
        }
        self.module.family().check(judge, self, wiring);
    }
}

#[cfg(test)]
mod tests {
    use crate::config::validate::told;

    const VOLUMETRIC: &str = include_str!("../../../../configs/machines/volumetric.toml");

    /// The finding at `key` after `from`, once, has become `to`.
    #[track_caller]
    fn check(from: &str, to: &str, key: &str, says: &str) {
        told::check(VOLUMETRIC, from, to, key, says);
    }

    #[test]
    fn what_no_measuring_module_can_be_is_found_where_it_stands() {
        let (from, key) = ("every_syncs = 10\n", "analog.beams_x");
        check(from, "", key, "missing `every_syncs`");
        let every = format!("{key}.every_syncs");
        check(from, "every_syncs = 0\n", &every, "0 is impossible");
        check(from, "every_syncs = 241\n", &every, "241 is impossible");
        let to = "every_syncs = 10\npoll_period_ms = 5.0\n";
        let stranger = format!("{key}.poll_period_ms");
        check(from, to, &stranger, "`device = \"cia404\"` has no such key");
        let (from, to) = ("channels = [0, 1, 2, 3, 4, 5, 6, 7]", "channels = [8]");
        let channels = format!("{key}.channels");
        check(from, to, &channels, "8 is impossible");
        let (from, to) = ("full_scale_v = [3.2,", "full_scale_v = [40.0,");
        let range = format!("{key}.full_scale_v");
        check(from, to, &range, "40 V does not fit");
        let (from, to) = ("temperature_channels = [2,", "temperature_channels = [1,");
        let both = "analog.roll_and_heat.temperature_channels";
        check(from, to, both, "channel 1 stands in `channels`");
        check(from, "temperature_channels = [2, 2,", both, "twice");
    }
}
