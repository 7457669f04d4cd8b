//! The least squares of complete readings, in closed form for each harmonic.
//!
//! Readings less their placement's mean c_j and less the mean M over placements of each line have
//! lost the plate. Added up by table position they are the right side T of the normal equations
//! of the table error, whose matrix is circulant: Ĝ(k) = T̂(k) / Σ_j |w_j − w̄|². This is
//! Σ_j conj(w_j − w̄) V̂_j / Σ_j |w_j − w̄|² with one transform instead of P.

use std::sync::Arc;

use realfft::num_complex::Complex;
use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};

use super::design::Design;

/// The transforms and weights of one design.
pub(super) struct ClosedForm {
    lines: usize,
    offsets: Vec<usize>,
    forward: Arc<dyn RealToComplex<f64>>,
    inverse: Arc<dyn ComplexToReal<f64>>,
    /// 1/(N Σ_j |w_j − w̄|²), 0 for k = 0: with the 1/N of the inverse transform.
    weights: Vec<f64>,
}

/// What the readings say, in the unit of the readings.
pub(super) struct Estimate {
    /// G[p].
    pub(super) table: Vec<f64>,
    /// A[n].
    pub(super) plate: Vec<f64>,
    /// c_j.
    pub(super) constants: Vec<f64>,
}

impl ClosedForm {
    pub(super) fn new(design: &Design) -> Self {
        let lines = design.lines();
        let mut planner = RealFftPlanner::new();
        let inverse_of = |it: &f64| 1.0 / (it * lines as f64);
        let mut weights: Vec<f64> = design.information().iter().map(inverse_of).collect();
        weights[0] = 0.0;
        Self {
            lines,
            offsets: design.offsets().to_vec(),
            forward: planner.plan_fft_forward(lines),
            inverse: planner.plan_fft_inverse(lines),
            weights,
        }
    }

    /// `readings` has a value for every line of every placement, placement by placement.
    pub(super) fn estimate(&self, readings: &[f64]) -> Estimate {
        let (lines, count) = (self.lines, self.offsets.len() as f64);
        let constants: Vec<f64> = readings
            .chunks_exact(lines)
            .map(|placement| placement.iter().sum::<f64>() / lines as f64)
            .collect();
        let mut mean = vec![0.0; lines];
        for (placement, constant) in readings.chunks_exact(lines).zip(&constants) {
            for (sum, reading) in mean.iter_mut().zip(placement) {
                *sum += reading - constant;
            }
        }
        mean.iter_mut().for_each(|it| *it /= count);
        let mut by_position = vec![0.0; lines];
        let placements = readings.chunks_exact(lines).zip(&constants);
        for ((placement, constant), &offset) in placements.zip(&self.offsets) {
            let deviations = placement.iter().zip(&mean);
            // Line n is read at position n + offset: the last lines come round to position 0.
            let (round, straight) = by_position.split_at_mut(offset);
            let positions = straight.iter_mut().chain(round);
            for (sum, (reading, mean)) in positions.zip(deviations) {
                *sum += reading - constant - mean;
            }
        }
        let table = self.filtered(&mut by_position);
        let mut plate = mean;
        for &offset in &self.offsets {
            let (round, straight) = table.split_at(offset);
            for (line, error) in plate.iter_mut().zip(straight.iter().chain(round)) {
                *line -= error / count;
            }
        }
        Estimate {
            table,
            plate,
            constants,
        }
    }

    fn filtered(&self, input: &mut [f64]) -> Vec<f64> {
        let mut spectrum = self.forward.make_output_vec();
        let transformed = self.forward.process(input, &mut spectrum);
        transformed.expect("the lengths are the planner's");
        for (value, weight) in spectrum.iter_mut().zip(&self.weights) {
            *value *= weight;
        }
        self.backward(&mut spectrum)
    }

    fn backward(&self, spectrum: &mut [Complex<f64>]) -> Vec<f64> {
        let mut output = self.inverse.make_output_vec();
        let transformed = self.inverse.process(spectrum, &mut output);
        transformed.expect("a real signal has real ends of its spectrum");
        output
    }

    /// The covariance of G[p] and G[p + d] for d = 0 … N − 1, in units of a reading's variance.
    pub(super) fn covariance(&self) -> Vec<f64> {
        let real = |weight: &f64| Complex::new(*weight, 0.0);
        let mut spectrum: Vec<_> = self.weights.iter().map(real).collect();
        self.backward(&mut spectrum)
    }

    /// reading − model for every line of every placement.
    pub(super) fn residuals(&self, readings: &[f64], estimate: &Estimate) -> Vec<f64> {
        let mut residuals = Vec::with_capacity(readings.len());
        let placements = readings.chunks_exact(self.lines).zip(&estimate.constants);
        for ((placement, constant), &offset) in placements.zip(&self.offsets) {
            let (round, straight) = estimate.table.split_at(offset);
            let errors = straight.iter().chain(round).zip(&estimate.plate);
            let model = errors.map(|(table, plate)| table + plate + constant);
            residuals.extend(
                placement
                    .iter()
                    .zip(model)
                    .map(|(seen, model)| seen - model),
            );
        }
        residuals
    }
}
