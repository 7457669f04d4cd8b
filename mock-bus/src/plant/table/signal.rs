//! What a photodiode behind a slit gives while the plate's lines pass: a voltage.

use units::portable::exp;
use units::{Radians, Time};

use super::Table;
use super::config::SignalConfig;

/// Width at half of the height, of a standard deviation: 2√(2 ln 2).
const WIDTHS_PER_SIGMA: f64 = 2.354_820_045_030_949_4;
/// Beyond so many standard deviations nothing is left of a line.
const REACH: f64 = 8.0;
/// A scratch lies so many widths behind its line: for a wide slit both are one pulse.
const SCRATCH_WIDTHS: f64 = 1.0;

#[derive(Clone, Debug)]
pub(super) struct Photodiode {
    dark_v: f64,
    height_v: f64,
    sigma: f64,
    latency_s: f64,
}

impl Photodiode {
    pub(super) fn new(config: &SignalConfig) -> Self {
        Self {
            dark_v: config.dark_v,
            height_v: config.height_v,
            sigma: Radians::from_arcsec(config.width_arcsec).value() / WIDTHS_PER_SIGMA,
            latency_s: config.latency_us * 1e-6,
        }
    }
}

impl Table {
    /// The voltage of the photodiode that looks at the lines in the detector's place, without noise.
    pub(in crate::plant) fn line_volts(&self, now: Time) -> f64 {
        let diode = &self.photodiode;
        let mass = &self.train.mass;
        let reading = mass.position_at(now) - mass.speed_at(now) * diode.latency_s;
        let angle = self.true_angle(reading);
        let behind = SCRATCH_WIDTHS * WIDTHS_PER_SIGMA * diode.sigma;
        let reach = REACH * diode.sigma;
        let lines = self.plate.candidates(angle - reach - behind, angle + reach);
        let pulse = |place: f64| {
            let z = (angle - place) / diode.sigma;
            exp(-z * z / 2.0)
        };
        let seen = lines.filter_map(|number| {
            let line = self.plate.visible(number)?;
            let place = self.plate.angle(number) + self.detector.shift_of(line);
            let scratched = self.detector.is_scratched(line);
            let scratch = if scratched {
                pulse(place + behind)
            } else {
                0.0
            };
            Some(pulse(place) + scratch)
        });
        let light: f64 = seen.sum();
        if self.detector.is_dead() {
            return diode.dark_v;
        }
        diode.dark_v + diode.height_v * light
    }
}
