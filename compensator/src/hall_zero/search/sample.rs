//! What a search is fed with, and the means it works on.

use units::{Metres, Time, Volts};

use crate::hall_zero::HallPoint;

/// One sample of both sensors and the encoder.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// When it was taken.
    pub at: Time,
    /// Raw encoder position.
    pub position: Metres,
    /// V1: sensor 1, even.
    pub peak: Volts,
    /// V2: sensor 2, odd.
    pub slope: Volts,
    /// Whether the axis stood still.
    pub standing: bool,
}

impl Sample {
    /// Position and voltages alone.
    pub fn point(&self) -> HallPoint {
        HallPoint {
            position: self.position,
            peak: self.peak,
            slope: self.slope,
        }
    }
}

/// Means of the n samples taken standing still.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Held {
    /// Mean position.
    pub position: Metres,
    /// Mean V1.
    pub peak: Volts,
    /// Mean V2.
    pub slope: Volts,
}
