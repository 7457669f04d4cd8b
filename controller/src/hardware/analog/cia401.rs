//! Analog modules of CiA 401.

use drivers::device::AnalogInput;
use drivers::device::cia401::{ChannelSettings, Cia401Analog, Cia401Settings};
use machine::Patience;
use schemars::JsonSchema;
use serde::Deserialize;
use units::Volts;

use super::{AnalogConfig, Family};
use crate::config::judge::Judge;
use crate::hardware::CHECKED;
use crate::hardware::bus::Wiring;
use crate::hardware::node::NodeConfig;

/// What a CiA 401 module has.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
pub struct Cia401Config {
    /// Where it is.
    #[serde(flatten)]
    pub node: NodeConfig,
}

impl Cia401Config {
    /// What its driver is told; the configuration has been checked.
    ///
    /// # Panics
    /// With more channels than a process data object has.
    pub fn settings(
        &self,
        inputs: &AnalogConfig,
        wiring: Wiring<'_>,
        patience: Patience,
    ) -> Cia401Settings {
        let common = self.node.settings(wiring.can, patience);
        let channels: Vec<_> = inputs
            .channels
            .iter()
            .zip(&inputs.full_scale_v)
            .map(|(channel, volts)| ChannelSettings {
                input: channel + 1,
                full_scale: Volts(*volts),
            })
            .collect();
        Cia401Settings::new(common, &channels).expect(CHECKED)
    }
}

impl Family for Cia401Config {
    fn port(&self) -> &str {
        &self.node.bus
    }

    fn node(&self) -> Option<&NodeConfig> {
        Some(&self.node)
    }

    fn every_syncs(&self) -> Option<u8> {
        Some(1)
    }

    fn check(&self, judge: &mut Judge<'_>, inputs: &AnalogConfig, wiring: Wiring<'_>) {
        self.node.check(judge, wiring.can);
        if inputs.channels.iter().any(|channel| *channel >= 4) {
            judge.say(
                "channels",
                "one process data object carries channels 0 to 3",
                "use those",
            );
        }
        for value in &inputs.full_scale_v {
            judge.within("full_scale_v", *value, 1e-3, 1e3);
        }
    }

    fn driver(
        &self,
        inputs: &AnalogConfig,
        wiring: Wiring<'_>,
        patience: Patience,
    ) -> Box<dyn AnalogInput> {
        Box::new(Cia401Analog::new(self.settings(inputs, wiring, patience)))
    }
}
