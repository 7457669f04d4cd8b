//! Which position and which voltages belong together.

use core::time::Duration;

use compensator::hall_zero::Sample;
use units::Time;

use crate::config::{AxisConfig, MachineConfig};
use crate::failure::Failure;
use crate::linear::ZeroConfig;
use crate::linear::stage::LinearStage;

/// Which samples were used already.
pub(super) struct Pairing {
    window: Duration,
    used_axis: Time,
    used_analog: Time,
}

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

    pub(super) fn pairing(&self, config: &ZeroConfig) -> Pairing {
        Pairing {
            window: self.sampling(config).mul_f64(0.6),
            used_axis: Time::ZERO,
            used_analog: Time::ZERO,
        }
    }

    /// The newest position and voltages that belong together and were not used before.
    ///
    /// On CAN both are sampled at one SYNC and arrive together; members of different SYNC
    /// periods lie further apart than the window and are never paired.
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
        if position.at <= pairing.used_axis || voltages.at <= pairing.used_analog {
            return Ok(None);
        }
        let apart = position
            .at
            .since(voltages.at)
            .max(voltages.at.since(position.at));
        if apart > pairing.window {
            return Ok(None);
        }
        pairing.used_axis = position.at;
        pairing.used_analog = voltages.at;
        Ok(Some(Sample {
            at: position.at.max(voltages.at),
            position: position.position,
            peak: voltages.volts[0],
            slope: voltages.volts[1],
            standing: position.standing,
        }))
    }
}
