//! Measuring modules of CiA 404: which inputs carry what, and how finely they are read.

use drivers::device::AnalogInput;
use drivers::device::cia404::{Cia404Analog, Cia404Settings, InputSettings, Quantity};
use machine::Patience;
use schemars::JsonSchema;
use serde::Deserialize;
use units::portable::powi;

use super::{AnalogConfig, Family};
use crate::config::judge::Judge;
use crate::hardware::CHECKED;
use crate::hardware::bus::Wiring;
use crate::hardware::node::NodeConfig;

/// Inputs of a module that the driver knows.
const INPUTS: u8 = 8;
/// What 16 bits reach in volts when a count is a millivolt.
const REACH_V: f64 = 32.767;
/// The finest resolution asked for: a microvolt.
const DIGITS_MAX: u8 = 3;

/// The digits behind the point of a millivolt with which `full_scale_v` can still be told: as many
/// as fit. `None` when not even whole millivolts reach that far.
fn voltage_digits(full_scale_v: f64) -> Option<u8> {
    let fits = |digits: &u8| full_scale_v * powi(10.0, i32::from(*digits)) <= REACH_V;
    (0..=DIGITS_MAX).rev().find(fits)
}

/// What only a measuring module has.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
pub struct Cia404Config {
    /// Where it is.
    #[serde(flatten)]
    pub node: NodeConfig,
    /// Inputs with a resistance thermometer Pt100, read in hundredths of degrees. Runs of rotary tables and
    /// platforms write down what they show.
    #[schemars(inner(range(min = 0, max = 7)), extend("x-range" = "none of `channels`"))]
    #[serde(default)]
    pub temperature_channels: Vec<u8>,
    /// The module samples and sends at every so many SYNCs; it counts in the bus load with that
    /// part. Its frames yield to set-points and drives.
    #[schemars(range(min = 1, max = 240))]
    pub every_syncs: u8,
}

impl Cia404Config {
    /// What its driver is told; the configuration has been checked.
    ///
    /// # Panics
    /// With inputs that no module has.
    pub fn settings(
        &self,
        inputs: &AnalogConfig,
        wiring: Wiring<'_>,
        patience: Patience,
    ) -> Cia404Settings {
        let common = self.node.settings(wiring.can, patience);
        let voltages = inputs.channels.iter().zip(&inputs.full_scale_v);
        let voltages = voltages.map(|(channel, full_scale_v)| InputSettings {
            input: channel + 1,
            quantity: Quantity::Voltage,
            decimal_digits: voltage_digits(*full_scale_v).expect(CHECKED),
        });
        let sensors = self.temperature_channels.iter();
        let sensors = sensors.map(|channel| InputSettings::pt100(channel + 1));
        let all: Vec<_> = voltages.chain(sensors).collect();
        Cia404Settings::new(common, &all, self.every_syncs).expect(CHECKED)
    }
}

impl Family for Cia404Config {
    fn port(&self) -> &str {
        &self.node.bus
    }

    fn node(&self) -> Option<&NodeConfig> {
        Some(&self.node)
    }

    fn temperature_channels(&self) -> &[u8] {
        &self.temperature_channels
    }

    fn every_syncs(&self) -> Option<u8> {
        Some(self.every_syncs)
    }

    fn check(&self, judge: &mut Judge<'_>, inputs: &AnalogConfig, wiring: Wiring<'_>) {
        self.node.check(judge, wiring.can);
        for (key, channels) in [
            ("channels", &inputs.channels),
            ("temperature_channels", &self.temperature_channels),
        ] {
            if channels.iter().any(|channel| *channel >= INPUTS) {
                judge.say(key, "a cia404 module has channels 0 to 7", "use those");
            }
        }
        for value in &inputs.full_scale_v {
            let fits = *value > 0.0 && voltage_digits(*value).is_some();
            if !fits {
                judge.say(
                    "full_scale_v",
                    format!("{value} V does not fit 16 bits of millivolts"),
                    "give more than 0, and 32.767 at most",
                );
            }
        }
    }

    fn driver(
        &self,
        inputs: &AnalogConfig,
        wiring: Wiring<'_>,
        patience: Patience,
    ) -> Box<dyn AnalogInput> {
        Box::new(Cia404Analog::new(self.settings(inputs, wiring, patience)))
    }
}

#[cfg(test)]
mod tests {
    use super::voltage_digits;

    /// 3.2767 V in tenths of millivolts, 0.32767 V in hundredths, 32.767 V in whole ones.
    #[test]
    fn a_voltage_is_read_as_finely_as_its_range_lets() {
        for (full_scale_v, digits) in [
            (3.2, Some(1)),
            (3.3, Some(0)),
            (0.3, Some(2)),
            (0.001, Some(3)),
            (32.0, Some(0)),
            (33.0, None),
        ] {
            assert_eq!(voltage_digits(full_scale_v), digits, "{full_scale_v} V");
        }
    }
}
