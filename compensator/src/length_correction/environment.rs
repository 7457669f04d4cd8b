//! The environment's sensors: refused when out of range, frozen or silent, never replaced.

use core::time::Duration;

use units::{Celsius, Pascals, RelativeHumidity, Time};

use crate::air;

/// Air and part as their sensors see them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Environment {
    /// Air temperature along the beam.
    pub air_temperature: Celsius,
    /// Air pressure.
    pub pressure: Pascals,
    /// Relative humidity.
    pub humidity: RelativeHumidity,
    /// Temperature of the part or scale that expands.
    pub material_temperature: Celsius,
}

/// The sensors of an [`Environment`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Channel {
    /// [`Environment::air_temperature`].
    AirTemperature,
    /// [`Environment::pressure`].
    Pressure,
    /// [`Environment::humidity`].
    Humidity,
    /// [`Environment::material_temperature`].
    MaterialTemperature,
}

impl Channel {
    const ALL: [Self; 4] = [
        Self::AirTemperature,
        Self::Pressure,
        Self::Humidity,
        Self::MaterialTemperature,
    ];

    fn read(self, environment: &Environment) -> f64 {
        match self {
            Self::AirTemperature => environment.air_temperature.value(),
            Self::Pressure => environment.pressure.value(),
            Self::Humidity => environment.humidity.value(),
            Self::MaterialTemperature => environment.material_temperature.value(),
        }
    }

    /// What a machine hall, or a machine in the open, can have; a sensor beyond it is broken or in another unit.
    fn range(self) -> (f64, f64, &'static str) {
        match self {
            Self::AirTemperature | Self::MaterialTemperature => (-40.0, 40.0, "°C"),
            Self::Pressure => (60e3, 120e3, "Pa"),
            Self::Humidity => (0.0, 1.0, "(fraction)"),
        }
    }
}

impl core::fmt::Display for Channel {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::AirTemperature => "air temperature",
            Self::Pressure => "air pressure",
            Self::Humidity => "relative humidity",
            Self::MaterialTemperature => "material temperature",
        })
    }
}

/// Why there is no corrected length. No value is ever replaced by 20 °C.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum EnvironmentError {
    /// A sensor outside what a machine hall can have.
    #[error(
        "environment: {channel} is {seen} {unit}, outside {low} to {high}; sensor broken, \
         disconnected or in another unit?",
        seen = units::Short(*seen), low = units::Short(*low), high = units::Short(*high)
    )]
    OutOfRange {
        /// Which sensor.
        channel: Channel,
        /// Its value.
        seen: f64,
        /// Lowest value believed.
        low: f64,
        /// Highest value believed.
        high: f64,
        /// Unit of the three numbers.
        unit: &'static str,
    },
    /// A sensor that has not changed by one bit for too long.
    #[error("environment: {channel} has been exactly {} for {} s (limit {} s); sensor frozen?",
        units::Short(*seen), since.as_secs(), limit.as_secs())]
    Frozen {
        /// Which sensor.
        channel: Channel,
        /// Its value.
        seen: f64,
        /// For how long.
        since: Duration,
        /// How long it may be.
        limit: Duration,
    },
    /// No reading for too long.
    #[error("environment: the last reading is {:.1} s old (limit {:.1} s)",
        age.as_secs_f64(), limit.as_secs_f64())]
    Stale {
        /// Age of the last reading; the longest possible when there was none.
        age: Duration,
        /// How old it may be.
        limit: Duration,
    },
    /// The index of air refused its inputs.
    #[error(transparent)]
    Air(#[from] air::OutOfRange),
    /// A setting that is not finite or of impossible size.
    #[error("length correction: {setting} is {seen}, which is not possible",
        seen = units::Short(*seen))]
    Setting {
        /// Which setting.
        setting: &'static str,
        /// Its value in SI units.
        seen: f64,
    },
}

/// Refuses readings that no place of a machine can have.
///
/// # Errors
/// The first channel outside −40 to 40 °C, 60–120 kPa or 0–1 humidity, or NaN.
///
/// # Example
///
/// ```
/// use compensator::length_correction::{Environment, check_environment};
/// use units::{Celsius, Pascals, RelativeHumidity};
///
/// let in_hectopascals = Environment {
///     air_temperature: Celsius(20.0),
///     pressure: Pascals(1013.0),
///     humidity: RelativeHumidity(0.5),
///     material_temperature: Celsius(20.0),
/// };
/// let error = check_environment(&in_hectopascals).expect_err("no hall has so little");
/// assert!(error.to_string().contains("air pressure is 1013 Pa, outside 60000 to 120000"));
/// ```
pub fn check_environment(environment: &Environment) -> Result<(), EnvironmentError> {
    check_channels(&Channel::ALL, environment)
}

/// Likewise of some channels only: of those that a correction uses.
pub(super) fn check_channels(
    channels: &[Channel],
    environment: &Environment,
) -> Result<(), EnvironmentError> {
    for channel in channels.iter().copied() {
        let (seen, (low, high, unit)) = (channel.read(environment), channel.range());
        if !(seen >= low && seen <= high) {
            return Err(EnvironmentError::OutOfRange {
                channel,
                seen,
                low,
                high,
                unit,
            });
        }
    }
    Ok(())
}

/// Watches environment readings for sensors that freeze, fall silent or leave their range.
///
/// # Example
///
/// ```
/// use compensator::length_correction::{Environment, EnvironmentError, EnvironmentWatch};
/// use std::time::Duration;
/// use units::{Celsius, Pascals, RelativeHumidity, Time};
///
/// let reading = Environment {
///     air_temperature: Celsius(20.1),
///     pressure: Pascals(101_300.0),
///     humidity: RelativeHumidity(0.45),
///     material_temperature: Celsius(20.3),
/// };
/// let (frozen_after, stale_after) = (Duration::from_secs(600), Duration::from_secs(10));
/// let mut watch = EnvironmentWatch::new(frozen_after, stale_after);
/// watch.observe(Time::from_seconds(1.0), reading)?;
/// assert_eq!(watch.current(Time::from_seconds(5.0)), Ok(reading));
/// let later = watch.current(Time::from_seconds(30.0));
/// assert!(matches!(later, Err(EnvironmentError::Stale { .. })));
/// # Ok::<(), EnvironmentError>(())
/// ```
#[derive(Clone, Debug)]
pub struct EnvironmentWatch {
    frozen_after: Duration,
    stale_after: Duration,
    last: Option<(Time, Environment)>,
    changed: [Time; 4],
}

impl EnvironmentWatch {
    /// A sensor is frozen when it does not change by one bit for `frozen_after`, and stale when
    /// no reading came for `stale_after`.
    pub fn new(frozen_after: Duration, stale_after: Duration) -> Self {
        Self {
            frozen_after,
            stale_after,
            last: None,
            changed: [Time::ZERO; 4],
        }
    }

    /// Takes a reading.
    ///
    /// # Errors
    /// When a channel is out of range (the reading is then not kept) or frozen.
    pub fn observe(&mut self, now: Time, reading: Environment) -> Result<(), EnvironmentError> {
        check_environment(&reading)?;
        for (changed, channel) in self.changed.iter_mut().zip(Channel::ALL) {
            let before = self.last.map(|(_, last)| channel.read(&last));
            if before != Some(channel.read(&reading)) {
                *changed = now;
            }
        }
        self.last = Some((now, reading));
        self.current(now).map(|_| ())
    }

    /// The last reading, if it can be believed at `now`.
    ///
    /// # Errors
    /// When it is too old or a channel has been frozen for too long.
    pub fn current(&self, now: Time) -> Result<Environment, EnvironmentError> {
        let limit = self.stale_after;
        let Some((at, reading)) = self.last else {
            return Err(EnvironmentError::Stale {
                age: Duration::MAX,
                limit,
            });
        };
        if now.since(at) > limit {
            return Err(EnvironmentError::Stale {
                age: now.since(at),
                limit,
            });
        }
        for (changed, channel) in self.changed.iter().zip(Channel::ALL) {
            let (since, limit) = (now.since(*changed), self.frozen_after);
            if since > limit {
                let seen = channel.read(&reading);
                return Err(EnvironmentError::Frozen {
                    channel,
                    seen,
                    since,
                    limit,
                });
            }
        }
        Ok(reading)
    }
}
