//! What the table's reading is wrong by: harmonics of the turn, and a bearing that does not
//! repeat.

use core::f64::consts::TAU;

use units::Radians;
use units::portable::sin;

use crate::random::Stream;

use super::config::{BearingConfig, TableEncoderConfig};

/// Steps in which the largest error is looked for.
const SEARCH_STEPS: u32 = 7200;
/// A cage of balls turns at about 0.4 of the shaft's speed, so its pattern comes back after many
/// turns only (T. A. Harris, Rolling Bearing Analysis, 1966: the orders depend on the geometry).
const CAGE_ORDERS: [f64; 2] = [0.43, 3.87];

#[derive(Clone, Copy, Debug)]
struct Harmonic {
    order: f64,
    amplitude: f64,
    phase: f64,
}

impl Harmonic {
    fn at(self, angle: f64) -> f64 {
        self.amplitude * sin(self.order * angle + self.phase)
    }
}

/// Reading minus true angle, as a function of the reading.
#[derive(Clone, Debug)]
pub(super) struct EncoderError {
    harmonics: Vec<Harmonic>,
    asynchronous: Vec<Harmonic>,
}

impl EncoderError {
    pub(super) fn new(config: &TableEncoderConfig, bearing: &BearingConfig, seed: u64) -> Self {
        let mut phases = Stream::new(seed, "table error");
        let mut harmonics: Vec<Harmonic> = config
            .harmonics
            .iter()
            .map(|harmonic| Harmonic {
                order: f64::from(harmonic.order),
                amplitude: harmonic.amplitude_arcsec,
                phase: phases.between(0.0, TAU),
            })
            .collect();
        let peak = (0..SEARCH_STEPS)
            .map(|step| sum(&harmonics, TAU * f64::from(step) / f64::from(SEARCH_STEPS)).abs())
            .fold(0.0, f64::max);
        let wanted = Radians::from_arcsec(config.error_peak_arcsec).value();
        for harmonic in &mut harmonics {
            harmonic.amplitude *= if peak > 0.0 { wanted / peak } else { 0.0 };
        }
        let mut phases = Stream::new(seed, "table bearing");
        let share =
            Radians::from_arcsec(bearing.asynchronous_arcsec).value() / CAGE_ORDERS.len() as f64;
        let asynchronous = CAGE_ORDERS
            .iter()
            .map(|order| Harmonic {
                order: *order,
                amplitude: share,
                phase: phases.between(0.0, TAU),
            })
            .collect();
        Self {
            harmonics,
            asynchronous,
        }
    }

    /// The part that is the same after each turn.
    pub(super) fn systematic(&self, reading: f64) -> f64 {
        sum(&self.harmonics, reading)
    }

    pub(super) fn at(&self, reading: f64) -> f64 {
        self.systematic(reading) + sum(&self.asynchronous, reading)
    }
}

fn sum(harmonics: &[Harmonic], angle: f64) -> f64 {
    harmonics.iter().map(|harmonic| harmonic.at(angle)).sum()
}
