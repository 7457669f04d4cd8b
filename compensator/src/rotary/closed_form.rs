//! The least squares of complete readings, in closed form for each harmonic.
//!
//! Readings less their placement's mean c_j and less the mean M over placements of each line have
//! lost the plate. Added up by table position they are the right side T of the normal equations
//! of the table error, whose matrix is circulant: Ĝ(k) = T̂(k) / Σ_j |w_j − w̄|². This is
//! Σ_j conj(w_j − w̄) V̂_j / Σ_j |w_j − w̄|² with one transform instead of P.

use std::sync::Arc;

use realfft::num_complex::Complex;
use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};

use super::design::{Design, INFORMATION_MIN};
use super::lanes::sum;

/// The transforms and weights of one design.
pub(super) struct ClosedForm {
    lines: usize,
    offsets: Vec<usize>,
    forward: Arc<dyn RealToComplex<f64>>,
    inverse: Arc<dyn ComplexToReal<f64>>,
    /// 1/(N Σ_j |w_j − w̄|²), with the 1/N of the inverse transform; 0 for k = 0, and for what
    /// cannot be seen, which is left with the plate.
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
        let weight = |it: &f64| match *it {
            seen if seen > INFORMATION_MIN => 1.0 / (seen * lines as f64),
            _ => 0.0,
        };
        let weights = design.information().iter().map(weight).collect();
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
        let (lines, share) = (self.lines, 1.0 / self.offsets.len() as f64);
        let placements = || readings.chunks_exact(lines);
        let constants: Vec<f64> = placements().map(|it| sum(it) / lines as f64).collect();
        let mut mean = vec![0.0; lines];
        for (placement, constant) in placements().zip(&constants) {
            for (sum, reading) in mean.iter_mut().zip(placement) {
                *sum += reading - constant;
            }
        }
        mean.iter_mut().for_each(|it| *it *= share);
        let mut by_position = vec![0.0; lines];
        for ((placement, constant), &offset) in placements().zip(&constants).zip(&self.offsets) {
            // Line n is read at position n + offset: the last lines come round to position 0.
            let turned = lines - offset;
            add_less(
                &mut by_position[offset..],
                &placement[..turned],
                &mean,
                *constant,
            );
            let (placement, mean) = (&placement[turned..], &mean[turned..]);
            add_less(&mut by_position[..offset], placement, mean, *constant);
        }
        let table = self.filtered(&mut by_position);
        let mut plate = mean;
        for &offset in &self.offsets {
            let (before, after) = plate.split_at_mut(lines - offset);
            for (line, error) in before.iter_mut().zip(&table[offset..]) {
                *line -= error * share;
            }
            for (line, error) in after.iter_mut().zip(&table) {
                *line -= error * share;
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

    /// reading − model for every line of one placement, in the place of what `row` held.
    pub(super) fn residuals_of(
        &self,
        placement: usize,
        readings: &[f64],
        estimate: &Estimate,
        row: &mut Vec<f64>,
    ) {
        let (table, plate) = (&estimate.table, &estimate.plate);
        let (offset, constant) = (self.offsets[placement], estimate.constants[placement]);
        let readings = &readings[placement * self.lines..(placement + 1) * self.lines];
        let (before, after) = readings.split_at(self.lines - offset);
        let left =
            |(reading, (table, plate)): (&f64, (&f64, &f64))| reading - constant - table - plate;
        row.clear();
        row.extend(
            before
                .iter()
                .zip(table[offset..].iter().zip(plate))
                .map(left),
        );
        let plate = &plate[before.len()..];
        row.extend(after.iter().zip(table.iter().zip(plate)).map(left));
    }

    /// The same for all placements, one after the other.
    pub(super) fn residuals(&self, readings: &[f64], estimate: &Estimate) -> Vec<f64> {
        let mut residuals = Vec::with_capacity(readings.len());
        let mut row = Vec::with_capacity(self.lines);
        for placement in 0..self.offsets.len() {
            self.residuals_of(placement, readings, estimate, &mut row);
            residuals.extend_from_slice(&row);
        }
        residuals
    }
}

fn add_less(sums: &mut [f64], readings: &[f64], means: &[f64], constant: f64) {
    for (sum, (reading, mean)) in sums.iter_mut().zip(readings.iter().zip(means)) {
        *sum += reading - constant - mean;
    }
}
