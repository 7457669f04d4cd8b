//! Which position and which voltages belong together.

use core::time::Duration;

use compensator::hall_zero::Sample;

use crate::config::{AxisConfig, MachineConfig};
use crate::failure::Failure;
use crate::linear::ZeroConfig;
use crate::linear::stage::LinearStage;
use crate::pairing::Pairing;

/// How often a position of `axis` and voltages that belong to it are read for its `zero`.
pub(super) fn sampling_of(
    config: &MachineConfig,
    axis: &AxisConfig,
    zero: &ZeroConfig,
) -> Duration {
    let node = axis.node();
    let bus = &node.expect("the check asks for a drive on CAN").bus;
    let sync_s = config.can[bus].sync_period_ms * 1e-3;
    let poll_s = config.analog[&zero.analog].poll_period().as_secs_f64();
    Duration::from_secs_f64(sync_s.max(poll_s))
}

impl LinearStage<'_> {
    /// How often a position and voltages that belong to it are read.
    pub(super) fn sampling(&self, config: &ZeroConfig) -> Duration {
        sampling_of(self.core.config, self.config, config)
    }

    /// How much older than the position the voltages may be: nothing where both are sampled at one SYNC.
    pub(super) fn age_of_voltages(&self, config: &ZeroConfig) -> Duration {
        let polled = self.core.config.analog[&config.analog].poll_period();
        match polled.is_zero() {
            true => Duration::ZERO,
            false => Pairing::window_of(self.sampling(config)),
        }
    }

    pub(super) fn pairing(&self, config: &ZeroConfig) -> Pairing {
        Pairing::of(self.sampling(config))
    }

    /// The newest position and voltages that belong together and were not used before.
    pub(super) fn paired_sample(
        &self,
        config: &ZeroConfig,
        pairing: &mut Pairing,
    ) -> Result<Option<Sample>, Failure> {
        let analog = self.core.devices().analog(&config.analog)?;
        let (Some(position), Some(voltages)) = (self.core.reading(self.axis)?, analog.reading())
        else {
            return Ok(None);
        };
        if !pairing.is_pair(position.at, voltages.at) {
            return Ok(None);
        }
        Ok(Some(Sample {
            at: position.at.max(voltages.at),
            position: position.position,
            peak: voltages.volts[0],
            slope: voltages.volts[1],
            standing: position.standing,
        }))
    }
}
