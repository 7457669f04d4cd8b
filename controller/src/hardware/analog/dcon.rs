//! Analog modules of the ADAM-4000 and I-7000 families, on a serial line (DCON).

use core::time::Duration;

use drivers::device::AnalogInput;
use drivers::device::dcon::{Dcon, DconSettings, InputRange};
use machine::Patience;
use schemars::JsonSchema;
use serde::Deserialize;
use units::Volts;

use super::{AnalogConfig, Family};
use crate::config::judge::Judge;
use crate::hardware::CHECKED;
use crate::hardware::bus::Wiring;

/// What a DCON module has.
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

/// The one input range that all channels of a module have.
fn input_range(full_scale_v: &[f64]) -> Option<InputRange> {
    let (first, rest) = full_scale_v.split_first()?;
    let all_same = rest.iter().all(|volts| volts == first);
    InputRange::ending_at(Volts(*first)).filter(|_| all_same)
}

impl DconConfig {
    /// What its driver is told; the configuration has been checked.
    ///
    /// # Panics
    /// When its channels have different ranges.
    pub fn settings(&self, inputs: &AnalogConfig, patience: Patience) -> DconSettings {
        let range = input_range(&inputs.full_scale_v).expect(CHECKED);
        let usual = DconSettings::new(self.address, range, inputs.channels.clone());
        DconSettings {
            checksum: self.checksum,
            period: self.poll_period(),
            answer_timeout: patience.of(usual.answer_timeout),
            stale_after: patience.of(usual.stale_after),
            ..usual
        }
    }
}

impl Family for DconConfig {
    fn port(&self) -> &str {
        &self.line
    }

    fn address(&self) -> Option<u8> {
        Some(self.address)
    }

    fn poll_period(&self) -> Duration {
        Duration::from_secs_f64(self.poll_period_ms * 1e-3)
    }

    fn check(&self, judge: &mut Judge<'_>, inputs: &AnalogConfig, wiring: Wiring<'_>) {
        judge.known("line", &self.line, wiring.serial, "serial");
        if inputs.channels.iter().any(|channel| *channel >= 8) {
            judge.say("channels", "a dcon module has channels 0 to 7", "use those");
        }
        if input_range(&inputs.full_scale_v).is_none() {
            judge.say(
                "full_scale_v",
                "a dcon module has one input range for all channels",
                "give each channel the same: 10.0, 5.0, 1.0, 0.5 or 0.15",
            );
        }
    }

    fn driver(
        &self,
        inputs: &AnalogConfig,
        _: Wiring<'_>,
        patience: Patience,
    ) -> Box<dyn AnalogInput> {
        Box::new(Dcon::new(self.settings(inputs, patience)))
    }
}
