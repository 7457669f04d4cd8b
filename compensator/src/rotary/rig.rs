//! What the tests of this method share: noise of their own, and readings of a known table.

use units::Radians;

pub(super) use crate::noise::Noise;
use crate::rotary::{Placement, RotarySeries};

/// Values less their mean.
pub(super) fn centred(values: Vec<f64>) -> Vec<f64> {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    values.iter().map(|it| it - mean).collect()
}

/// A table and a plate with known errors, arcseconds.
pub(super) struct Truth {
    pub(super) table: Vec<f64>,
    pub(super) plate: Vec<f64>,
}

impl Truth {
    /// ±10″ of table error, of the first, the second and the encoder's harmonics, and ±30″ of
    /// plate error.
    pub(super) fn new(lines: usize, noise: &mut Noise) -> Self {
        let harmonics = [
            (1, 5.5),
            (2, 2.0),
            (4, 1.0),
            (lines / 10, 0.8),
            (lines / 5, 0.5),
        ];
        let mut table = vec![0.0; lines];
        for (harmonic, amplitude) in harmonics {
            let phase = noise.uniform();
            for (line, error) in table.iter_mut().enumerate() {
                let turns = harmonic as f64 * line as f64 / lines as f64 + phase;
                *error += amplitude * (core::f64::consts::TAU * turns).cos();
            }
        }
        let plate = (0..lines).map(|_| 60.0 * noise.uniform() - 30.0).collect();
        Self {
            table: centred(table),
            plate: centred(plate),
        }
    }

    /// What is read of line `line` at `offset`, but for the placement's constant and noise.
    pub(super) fn reading(&self, offset: usize, line: usize) -> f64 {
        self.table[(line + offset) % self.table.len()] + self.plate[line]
    }

    /// Readings with noise of `sigma`, and of `change` what is left.
    pub(super) fn series(
        &self,
        offsets: &[usize],
        sigma: f64,
        noise: &mut Noise,
        mut change: impl FnMut(usize, usize, f64) -> Option<f64>,
    ) -> RotarySeries {
        let lines = self.table.len();
        let mut placements = Vec::new();
        for (at, &offset) in offsets.iter().enumerate() {
            let constant = 200.0 * noise.uniform() - 100.0;
            let mut read = |line| {
                let reading = constant + self.reading(offset, line) + sigma * noise.normal();
                change(at, line, reading).map(Radians::from_arcsec)
            };
            let readings = (0..lines).map(&mut read).collect();
            placements.push(Placement { offset, readings });
        }
        RotarySeries::new(lines, placements).unwrap()
    }
}
