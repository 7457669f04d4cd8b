//! The constants of a search, and what they must fulfil.

use core::time::Duration;

use units::{Metres, MetresPerSecond, Volts};

/// A band narrower than this many noise standard deviations cannot hold n samples.
const BAND_PER_NOISE: f64 = 3.0;

/// The patent's constants, the bounds of the search and what is known of the sensors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Vc: how far below the peak G1 and G2 lie; best on the steep flanks.
    pub vc: Volts,
    /// Vc0: how far V1 must fall on the + side before the search turns.
    pub vc0: Volts,
    /// δ1: half width of the band of G1, and of the peak when it is crossed.
    pub delta1: Volts,
    /// δ2: half width of the band of G2 around the voltage of G1.
    pub delta2: Volts,
    /// δ3: half width of the band of P0 around the mid voltage.
    pub delta3: Volts,
    /// δ4: how far V1 at P0 may be from the peak.
    pub delta4: Volts,
    /// n: samples taken standing still at G1, G2 and P0.
    pub samples: usize,
    /// Search speed.
    pub speed: MetresPerSecond,
    /// Speed of the way back into a band that the stop overshot.
    pub creep_speed: MetresPerSecond,
    /// Largest distance from the nominal zero, on each side.
    pub search_limit: Metres,
    /// Longest time of the whole search.
    pub time_limit: Duration,
    /// Longest time without motion where motion is wanted.
    pub stall_limit: Duration,
    /// An axis this far on the wrong side of where a move began moves the wrong way.
    pub wrong_way: Metres,
    /// How often the samples of one band may be started over.
    pub restarts_max: u32,
    /// Lower soft limit of the axis.
    pub soft_min: Metres,
    /// Upper soft limit of the axis.
    pub soft_max: Metres,
    /// How close to a position counts as arrived.
    pub arrival: Metres,
    /// At or below this voltage a sensor or its ADC is saturated.
    pub rail_low: Volts,
    /// At or above this voltage a sensor or its ADC is saturated.
    pub rail_high: Volts,
    /// Noise of a single sample (rms); zero when unknown.
    pub noise: Volts,
    /// This many bit-identical samples in a row are a stuck ADC (where noise is not zero).
    pub stuck_samples: usize,
    /// Whether V2 rises with +x; the other sign is reported as inverted.
    pub slope_rising: bool,
}

impl Default for Settings {
    /// For curves of about 1 V/mm on the flanks, 0.2 mV noise, a sample every few milliseconds;
    /// ±2 mm of search within soft limits of ±10 mm, rails at 0.05 V and 4.95 V.
    fn default() -> Self {
        Self {
            vc: Volts(0.5),
            vc0: Volts(0.05),
            delta1: Volts(0.004),
            delta2: Volts(0.002),
            delta3: Volts(0.002),
            delta4: Volts(0.02),
            samples: 20,
            speed: MetresPerSecond(0.5e-3),
            creep_speed: MetresPerSecond(0.05e-3),
            search_limit: Metres(2e-3),
            time_limit: Duration::from_secs(60),
            stall_limit: Duration::from_secs(2),
            wrong_way: Metres(100e-6),
            restarts_max: 50,
            soft_min: Metres(-10e-3),
            soft_max: Metres(10e-3),
            arrival: Metres(2e-6),
            rail_low: Volts(0.05),
            rail_high: Volts(4.95),
            noise: Volts(0.2e-3),
            stuck_samples: 200,
            slope_rising: true,
        }
    }
}

/// A setting that cannot work.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum SettingsError {
    /// Not a positive finite number.
    #[error("hall zero: {setting} is {seen}; it must be a positive number",
        seen = units::Short(*seen))]
    NotPositive {
        /// Which setting.
        setting: &'static str,
        /// Its value in SI units.
        seen: f64,
    },
    /// One that must be smaller than another.
    #[error("hall zero: {small} ({small_value}) must be below {large} ({large_value})",
        small_value = units::Short(*small_value), large_value = units::Short(*large_value))]
    Order {
        /// The one that must be smaller.
        small: &'static str,
        /// Its value in SI units.
        small_value: f64,
        /// The one that must be larger.
        large: &'static str,
        /// Its value in SI units.
        large_value: f64,
    },
    /// A band that noise alone leaves.
    #[error(
        "hall zero: {band} of {seen} is narrower than 3 times the noise of {noise}; \
             no {samples} samples in a row would stay inside"
    )]
    BandTooNarrow {
        /// Which band.
        band: &'static str,
        /// Its half width.
        seen: Volts,
        /// The noise of one sample.
        noise: Volts,
        /// Samples wanted.
        samples: usize,
    },
    /// The nominal zero is not inside the soft limits.
    #[error("hall zero: the nominal zero at {} mm is outside the soft limits {} to {} mm",
        units::Short(nominal.mm()), units::Short(soft_min.mm()), units::Short(soft_max.mm()))]
    NominalOutside {
        /// The nominal zero.
        nominal: Metres,
        /// Lower soft limit.
        soft_min: Metres,
        /// Upper soft limit.
        soft_max: Metres,
    },
}

impl Settings {
    /// Checks that the settings can work.
    ///
    /// # Errors
    /// The first setting that cannot, with its value and why.
    ///
    /// # Example
    ///
    /// ```
    /// use compensator::hall_zero::Settings;
    /// use units::Volts;
    ///
    /// let sound = Settings::default();
    /// assert_eq!(sound.validate(), Ok(()));
    /// let narrow = Settings { delta3: Volts(0.5e-3), ..sound };
    /// let error = narrow.validate().expect_err("0.2 mV of noise leave it");
    /// assert!(error.to_string().contains("delta3 of 0.0005 V is narrower than 3 times the noise"));
    /// ```
    pub fn validate(&self) -> Result<(), SettingsError> {
        let positive = [
            ("vc", self.vc.value()),
            ("vc0", self.vc0.value()),
            ("delta1", self.delta1.value()),
            ("delta2", self.delta2.value()),
            ("delta3", self.delta3.value()),
            ("delta4", self.delta4.value()),
            ("samples", self.samples as f64),
            ("speed", self.speed.value()),
            ("creep speed", self.creep_speed.value()),
            ("search limit", self.search_limit.value()),
            ("arrival", self.arrival.value()),
            ("time limit", self.time_limit.as_secs_f64()),
            ("stall limit", self.stall_limit.as_secs_f64()),
            ("wrong way", self.wrong_way.value()),
            ("stuck samples", self.stuck_samples as f64),
        ];
        for (setting, seen) in positive {
            if !(seen > 0.0 && seen.is_finite()) {
                return Err(SettingsError::NotPositive { setting, seen });
            }
        }
        let span = self.rail_high.value() - self.rail_low.value();
        let ordered = [
            ("delta1", self.delta1.value(), "vc", self.vc.value()),
            // Or step 1 would take the + side, where V1 has fallen by vc0, for the left flank.
            (
                "vc0 + 2 delta1",
                (self.vc0 + self.delta1 * 2.0).value(),
                "vc",
                self.vc.value(),
            ),
            ("vc", self.vc.value(), "the span between the rails", span),
            (
                "soft_min",
                self.soft_min.value(),
                "soft_max",
                self.soft_max.value(),
            ),
            (
                "arrival",
                self.arrival.value(),
                "search limit",
                self.search_limit.value(),
            ),
        ];
        for (small, small_value, large, large_value) in ordered {
            // A NaN on either side is not in order, either.
            let in_order = small_value < large_value;
            if !in_order {
                return Err(SettingsError::Order {
                    small,
                    small_value,
                    large,
                    large_value,
                });
            }
        }
        let creep = (self.creep_speed.value(), self.speed.value());
        if creep.0 > creep.1 {
            let (small, large) = ("creep speed", "speed");
            let (small_value, large_value) = creep;
            return Err(SettingsError::Order {
                small,
                small_value,
                large,
                large_value,
            });
        }
        self.check_bands()
    }

    fn check_bands(&self) -> Result<(), SettingsError> {
        let noise = self.noise;
        if !(noise >= Volts::ZERO && noise.is_finite()) {
            return Err(SettingsError::NotPositive {
                setting: "noise",
                seen: noise.value(),
            });
        }
        for (band, seen) in [
            ("delta1", self.delta1),
            ("delta2", self.delta2),
            ("delta3", self.delta3),
            ("delta4", self.delta4),
        ] {
            if seen < noise * BAND_PER_NOISE {
                let samples = self.samples;
                return Err(SettingsError::BandTooNarrow {
                    band,
                    seen,
                    noise,
                    samples,
                });
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check_refused(settings: Settings, says: &str) {
        let error = settings.validate().unwrap_err().to_string();
        assert!(error.contains(says), "{error}");
    }

    #[test]
    fn the_default_settings_are_sound() {
        assert_eq!(Settings::default().validate(), Ok(()));
    }

    #[test]
    fn settings_that_cannot_work_are_refused_with_the_reason() {
        let ok = Settings::default();
        check_refused(Settings { samples: 0, ..ok }, "samples is 0");
        check_refused(
            Settings {
                vc: Volts(f64::NAN),
                ..ok
            },
            "vc is NaN",
        );
        check_refused(
            Settings {
                vc0: Volts(0.6),
                ..ok
            },
            "vc0 + 2 delta1 (0.608) must be below vc (0.5)",
        );
        check_refused(
            Settings {
                vc: Volts(5.0),
                ..ok
            },
            "span between the rails",
        );
        check_refused(
            Settings {
                soft_min: Metres(1.0),
                ..ok
            },
            "soft_min",
        );
        check_refused(
            Settings {
                delta3: Volts(0.5e-3),
                ..ok
            },
            "delta3 of 0.0005 V is narrower",
        );
        check_refused(
            Settings {
                creep_speed: MetresPerSecond(1.0),
                ..ok
            },
            "creep speed (1)",
        );
    }
}
