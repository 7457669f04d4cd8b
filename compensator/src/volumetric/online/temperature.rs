//! A temperature channel: is what it says believable?
//!
//! Source: none. What temperatures do to the machine is in [`crate::volumetric::model`].

use core::num::NonZeroU32;
use core::time::Duration;

use units::{Celsius, Time};

use super::{JumpWatch, StuckWatch, Trouble};

/// What a temperature can be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TemperatureSettings {
    /// The lowest possible.
    pub low: Celsius,
    /// The highest possible.
    pub high: Celsius,
    /// How fast it can change, in kelvin per second.
    pub rate_max: f64,
    /// How far apart two samples of the same temperature can be, in kelvin.
    pub noise_max: f64,
    /// A sample older than this says nothing about now.
    pub age_max: Duration,
    /// So many samples in a row that are equal to the last bit make it stuck; `None` where noise
    /// does not reach the converter's next step.
    pub stuck_samples: Option<NonZeroU32>,
}

/// One temperature sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TemperatureChannel {
    settings: TemperatureSettings,
    jump: JumpWatch<Celsius, 1>,
    stuck: StuckWatch<1>,
}

impl TemperatureChannel {
    /// A channel that has seen nothing yet.
    pub fn new(settings: TemperatureSettings) -> Self {
        Self {
            settings,
            jump: JumpWatch::new(settings.rate_max, Celsius(settings.noise_max)),
            stuck: StuckWatch::new(settings.stuck_samples),
        }
    }

    /// The temperature by the newest sample (its moment and value), at `now`.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn read(&mut self, now: Time, newest: Option<(Time, Celsius)>) -> Result<Celsius, Trouble> {
        let own = self.settings;
        let limit = own.age_max;
        let seen = newest.map_or(Duration::MAX, |(at, _)| now.since(at));
        let Some((at, value)) = newest.filter(|_| seen <= limit) else {
            return Err(Trouble::Stale { seen, limit });
        };
        let stuck = self.stuck.check(at, [value.value()]);
        if !(value >= own.low && value <= own.high) {
            return Err(Trouble::Implausible {
                seen: value.value(),
                low: own.low.value(),
                high: own.high.value(),
            });
        }
        stuck?;
        self.jump.check(at, [value])?;
        Ok(value)
    }
}
