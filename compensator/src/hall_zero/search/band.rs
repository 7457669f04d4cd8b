//! Standing in a voltage band: the n samples that steps 2, 3 and 4 ask for.

use units::{Metres, Volts};

use super::{Held, Sample};
use crate::hall_zero::Sensor;

/// Samples of one band, taken standing still.
#[derive(Clone, Debug, Default)]
pub(super) struct Hold {
    pub(super) wished: bool,
    pub(super) count: usize,
    pub(super) position: f64,
    pub(super) peak: f64,
    pub(super) slope: f64,
    pub(super) restarts: u32,
}

impl Hold {
    pub(super) fn add(&mut self, sample: &Sample) {
        self.count += 1;
        self.position += sample.position.value();
        self.peak += sample.peak.value();
        self.slope += sample.slope.value();
    }

    pub(super) fn start_over(&mut self) {
        *self = Self {
            restarts: self.restarts + u32::from(self.wished),
            ..Self::default()
        };
    }

    pub(super) fn mean(&self) -> Held {
        let n = self.count as f64;
        Held {
            position: Metres(self.position / n),
            peak: Volts(self.peak / n),
            slope: Volts(self.slope / n),
        }
    }
}

/// A voltage band and which way lies which side of it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Band {
    pub(super) sensor: Sensor,
    pub(super) wanted: Volts,
    pub(super) tolerance: Volts,
    /// Whether the voltage rises with +x there.
    pub(super) rising: bool,
}

impl Band {
    /// Step 4: V2 around the middle of its voltages at G1 and G2.
    pub(super) fn centre(g1: &Held, g2: &Held, tolerance: Volts) -> Self {
        let wanted = (g1.slope + g2.slope) / 2.0;
        Self {
            sensor: Sensor::Slope,
            wanted,
            tolerance,
            rising: g2.slope > g1.slope,
        }
    }

    /// V1 around a voltage; `rising` on the left flank.
    pub(super) fn peak(wanted: Volts, tolerance: Volts, rising: bool) -> Self {
        Self {
            sensor: Sensor::Peak,
            wanted,
            tolerance,
            rising,
        }
    }

    pub(super) fn voltage(&self, sample: &Sample) -> Volts {
        match self.sensor {
            Sensor::Peak => sample.peak,
            Sensor::Slope => sample.slope,
        }
    }
}
