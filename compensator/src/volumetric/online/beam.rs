//! The position of a beam on a four-channel detector, or why it cannot be determined.
//!
//! Source: CN1214003A uses a beam splitter and a two-dimensional CCD ([`SpotCamera`](super::SpotCamera)); a detector
//! with four analog channels says the same through the ratio of its currents. For a lateral-effect
//! detector the ratio (a − b)/(a + b) of two opposite electrodes is proportional to the place,
//! for four quadrants the ratio of the halves is a monotone function of it (textbooks on
//! position sensitive detectors); a measured curve from ratio to place covers both.
//!
//! Absent: more than one beam on a detector, the shape of the spot.

use core::num::NonZeroU32;
use core::time::Duration;

use units::{Metres, MetresPerSecond, Quantity, Time, Volts};

use super::{JumpWatch, StuckWatch, Trouble};
use crate::volumetric::function::{FunctionError, Pieces, Shape};

/// How the four channels belong to the two directions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layout {
    /// Quadrants (+, +), (−, +), (−, −), (+, −) of (first, second) direction.
    Quadrants,
    /// Electrodes first +, first −, second +, second −.
    Lateral,
}

/// The calibrated curve from a ratio of channels to a place.
#[derive(Clone, Debug)]
pub struct RatioCurve {
    pieces: Pieces,
}

impl RatioCurve {
    /// Through measured (ratio, place) pairs with increasing ratios: monotone cubics.
    ///
    /// # Errors
    /// When there are fewer than two, ratios do not increase, or a value is not finite.
    pub fn new(ratios: &[f64], places: &[Metres]) -> Result<Self, FunctionError> {
        let places: Vec<f64> = places.iter().map(|it| it.value()).collect();
        Pieces::new(ratios, &places, Shape::MonotoneCubic).map(|pieces| Self { pieces })
    }

    /// A straight line through zero: `per_one` is the place at ratio 1, used up to `ratio_max`.
    ///
    /// # Errors
    /// When a value is not finite or `ratio_max` is not positive.
    pub fn straight(per_one: Metres, ratio_max: f64) -> Result<Self, FunctionError> {
        Self::new(
            &[-ratio_max, 0.0, ratio_max],
            &[per_one * -ratio_max, Metres::ZERO, per_one * ratio_max],
        )
    }

    /// The lowest and the highest place on it: monotone cubics stay between their points.
    pub fn field(&self) -> (Metres, Metres) {
        let (first, last) = self.pieces.range();
        let starts = self.pieces.segments().iter().map(|it| it.start);
        let places = starts.chain([last]).map(|ratio| self.pieces.at(ratio));
        let one = self.pieces.at(first);
        let (low, high) = places.fold((one, one), |(low, high), it| (low.min(it), high.max(it)));
        (Metres(low), Metres(high))
    }
}

/// What is known of a detector.
#[derive(Clone, Debug)]
pub struct BeamDetectorSettings {
    /// How its channels belong to the directions.
    pub layout: Layout,
    /// What each channel gives in the dark.
    pub dark: [Volts; 4],
    /// What each channel is multiplied with, so that all are equally sensitive.
    pub gain: [f64; 4],
    /// A channel at or above this is saturated.
    pub saturation: Volts,
    /// The sum of all channels below which the beam counts as blocked.
    pub intensity_min: Volts,
    /// The sum above which the light is not the beam's alone.
    pub intensity_max: Volts,
    /// A sample older than this says nothing about now.
    pub age_max: Duration,
    /// How fast a place can change.
    pub speed_max: MetresPerSecond,
    /// How far apart two samples of the same place can be, by noise.
    pub noise_max: Metres,
    /// So many samples of a channel that are equal to the last bit make it stuck; `None` where its
    /// noise is below the converter's step.
    pub stuck_samples: Option<NonZeroU32>,
    /// From ratio to place, for both directions; the sign of the curve is the sign of the place.
    pub curves: [RatioCurve; 2],
}

/// Settings of a detector that make no sense.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum SettingsError {
    /// Limits of the intensity that leave nothing between them.
    #[error("beam detector: an intensity from {} to {} leaves no range", low, high)]
    Intensity {
        /// Lower limit.
        low: Volts,
        /// Upper limit.
        high: Volts,
    },
    /// A field that is none.
    #[error(
        "beam detector: a field from {} to {} leaves nothing to see",
        low,
        high
    )]
    Field {
        /// Its lower end.
        low: Metres,
        /// Its upper end.
        high: Metres,
    },
    /// A gain, a speed or a noise that is not positive, or a value that is no number.
    #[error("beam detector: gains, speed and noise must be positive numbers, dark values finite")]
    NotPositive,
}

/// Four voltages taken together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// In the order of the [`Layout`].
    pub channels: [Volts; 4],
    /// When.
    pub at: Time,
}

/// What four voltages show, whatever is wrong with them: for whoever adjusts the beam.
#[derive(Clone, Debug, PartialEq)]
pub struct BeamLook {
    /// The sum of the channels, without what they give in the dark.
    pub light: Volts,
    /// The place, or why there is none.
    pub place: Result<[Metres; 2], Trouble>,
    /// The place, or that of the field's end which the beam is beside; `None` in the dark.
    pub nearest: Option<[Metres; 2]>,
}

/// A detector: samples in, places out.
#[derive(Clone, Debug)]
pub struct BeamDetector {
    settings: BeamDetectorSettings,
    jump: JumpWatch<Metres, 2>,
    stuck: StuckWatch<4>,
}

impl BeamDetector {
    /// A detector that has seen nothing yet.
    ///
    /// # Errors
    /// When the settings contradict themselves.
    pub fn new(settings: BeamDetectorSettings) -> Result<Self, SettingsError> {
        let (low, high) = (settings.intensity_min, settings.intensity_max);
        if !(low > Volts::ZERO && high > low && high.is_finite()) {
            return Err(SettingsError::Intensity { low, high });
        }
        let positive = [settings.speed_max.value(), settings.noise_max.value()]
            .into_iter()
            .chain(settings.gain)
            .chain([settings.saturation.value()])
            .all(|it| it > 0.0 && it.is_finite());
        if !(positive && settings.dark.iter().all(|it| it.is_finite())) {
            return Err(SettingsError::NotPositive);
        }
        Ok(Self {
            stuck: StuckWatch::new(settings.stuck_samples),
            jump: JumpWatch::new(settings.speed_max.value(), settings.noise_max),
            settings,
        })
    }

    /// What is known of it.
    pub fn settings(&self) -> BeamDetectorSettings {
        self.settings.clone()
    }

    /// The lowest and the highest place that it can show, in both directions.
    pub fn field(&self) -> [(Metres, Metres); 2] {
        let [first, second] = &self.settings.curves;
        [first.field(), second.field()]
    }

    /// The place of the beam by the newest sample, at `now`.
    ///
    /// # Errors
    /// What is wrong: nothing may then be concluded from the sample.
    pub fn read(&mut self, now: Time, newest: Option<&Sample>) -> Result<[Metres; 2], Trouble> {
        let limit = self.settings.age_max;
        let seen = newest.map_or(Duration::MAX, |it| now.since(it.at));
        let Some(sample) = newest.filter(|_| seen <= limit) else {
            return Err(Trouble::Stale { seen, limit });
        };
        let volts = sample.channels.map(Quantity::value);
        let stuck = self.stuck.check(sample.at, volts);
        // Rails and darkness stand still as well, and say more.
        let place = self.place(&sample.channels)?;
        stuck?;
        self.jump.check(sample.at, place)?;
        Ok(place)
    }

    /// What four voltages say by themselves.
    fn place(&self, channels: &[Volts; 4]) -> Result<[Metres; 2], Trouble> {
        let own = &self.settings;
        for (index, seen) in channels.iter().enumerate() {
            if !seen.is_finite() {
                let (low, high) = (own.dark[index].value(), own.saturation.value());
                let seen = seen.value();
                return Err(Trouble::Implausible { seen, low, high });
            }
            if *seen >= own.saturation {
                let limit = own.saturation;
                return Err(Trouble::Saturated { seen: *seen, limit });
            }
        }
        let ratios = self.ratios(self.light(channels))?;
        let mut place = [Metres::ZERO; 2];
        for ((place, curve), seen) in place.iter_mut().zip(&own.curves).zip(ratios) {
            let (low, high) = curve.pieces.range();
            if !(seen >= low && seen <= high) {
                return Err(Trouble::Beside { seen, low, high });
            }
            *place = Metres(curve.pieces.at(seen));
        }
        Ok(place)
    }

    /// What four voltages show by themselves. Allocates nothing.
    pub fn look(&self, channels: &[Volts; 4]) -> BeamLook {
        let light = self.light(channels);
        let place = self.place(channels);
        let is_dark = matches!(place, Err(Trouble::Blocked { .. }));
        let ratios = self.bare_ratios(light);
        let is_seen = !is_dark && ratios.iter().all(|it| it.is_finite());
        let nearest = |k: usize| {
            let pieces = &self.settings.curves[k].pieces;
            let (low, high) = pieces.range();
            Metres(pieces.at(ratios[k].clamp(low, high)))
        };
        BeamLook {
            light: Volts(light.iter().sum()),
            place,
            nearest: is_seen.then(|| [nearest(0), nearest(1)]),
        }
    }

    /// The place of a beam that lights all of the detector alike.
    pub fn middle(&self) -> [Metres; 2] {
        let curves = &self.settings.curves;
        core::array::from_fn(|k| Metres(curves[k].pieces.at(0.0)))
    }

    /// The channels without what they give in the dark, all equally sensitive.
    fn light(&self, channels: &[Volts; 4]) -> [f64; 4] {
        let own = &self.settings;
        core::array::from_fn(|i| (channels[i] - own.dark[i]).value() * own.gain[i])
    }

    /// What the channels are to each other, by the layout.
    fn bare_ratios(&self, [a, b, c, d]: [f64; 4]) -> [f64; 2] {
        let sum = a + b + c + d;
        match self.settings.layout {
            Layout::Quadrants => [(a + d - b - c) / sum, (a + b - c - d) / sum],
            Layout::Lateral => [(a - b) / (a + b), (c - d) / (c + d)],
        }
    }

    fn ratios(&self, light: [f64; 4]) -> Result<[f64; 2], Trouble> {
        let [a, b, c, d] = light;
        let sum = a + b + c + d;
        let (low, high) = (self.settings.intensity_min, self.settings.intensity_max);
        // Both pairs of a lateral detector see all the light, half of the sum each.
        let (weakest, part) = match self.settings.layout {
            Layout::Quadrants => (sum, 1.0),
            Layout::Lateral => ((a + b).min(c + d), 0.5),
        };
        if weakest < low.value() * part {
            let (seen, limit) = (Volts(weakest), low * part);
            return Err(Trouble::Blocked { seen, limit });
        }
        if sum > high.value() {
            let (seen, limit) = (Volts(sum), high);
            return Err(Trouble::Saturated { seen, limit });
        }
        Ok(self.bare_ratios(light))
    }
}
