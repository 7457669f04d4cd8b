//! What thermal coefficients have in common with the errors that were found with them.
//!
//! Lines that are read cold and warm tell both: an error at the references that comes out too large leaves a coefficient
//! that is too small, so that between both temperatures the tool is known better than by errors and coefficients that
//! each were uncertain by themselves (GUM 5.2.2). The signs are below zero for the most part.

use crate::volumetric::Axis;

/// The tool's deviation d along x, y and z, then its turn Ω about them.
pub(super) const COMPONENTS: usize = 6;

/// How many coefficients there can be: an expansion along each axis, and a bend of each guide towards every direction across.
pub(super) const COEFFICIENTS_MAX: usize = 9;

/// What rounding makes of two errors that are one and the same.
const ROUNDING: f64 = 1e-6;

/// A thermal coefficient that was found together with the errors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coefficient {
    /// The expansion of the scale of an axis.
    Expansion(Axis),
    /// How the guide of an axis bends towards a direction.
    Bend(Axis, Axis),
}

/// How sure thermal coefficients are with each other and with the errors, each in units of its own standard uncertainty.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CoefficientCovariance {
    /// Which coefficients, each once.
    pub coefficients: Vec<Coefficient>,
    /// Their correlations, row by row.
    pub correlations: Vec<f64>,
    /// For each place of the errors' covariance, in its order: by coefficient, the covariance with d_x, d_y, d_z (metres)
    /// and Ω_x, Ω_y, Ω_z (radians).
    pub with_errors: Vec<Vec<[f64; COMPONENTS]>>,
}

impl CoefficientCovariance {
    /// Whether it is of so many places, and of coefficients that depend on each other as such can.
    pub(super) fn fits(&self, places: usize) -> bool {
        let count = self.coefficients.len();
        let is_once = |it: &Coefficient| self.coefficients.iter().filter(|own| *own == it).count();
        let each_once = self.coefficients.iter().all(|it| is_once(it) == 1);
        let fits = count <= COEFFICIENTS_MAX
            && self.correlations.len() == count * count
            && self.with_errors.len() == places;
        let are_correlations = || {
            let mut pairs = (0..count).flat_map(|i| (0..count).map(move |k| (i, k)));
            pairs.all(|(i, k)| {
                let (it, turned) = (self.correlation(i, k), self.correlation(k, i));
                let most = if i == k {
                    (it - 1.0).abs()
                } else {
                    it.abs() - 1.0
                };
                it == turned && most <= ROUNDING
            })
        };
        each_once && fits && are_correlations()
    }

    /// The first place where it cannot be so, of errors with these variances at each place.
    pub(super) fn wrong_place(
        &self,
        variances: impl Iterator<Item = [f64; COMPONENTS]>,
    ) -> Option<usize> {
        let count = self.coefficients.len();
        let is_sound = |own: &Vec<[f64; COMPONENTS]>, variances: [f64; COMPONENTS]| {
            let mut pairs = own.iter().flat_map(|it| it.iter().zip(variances));
            own.len() == count && pairs.all(|(it, v)| it * it <= v * (1.0 + ROUNDING))
        };
        let mut places = self.with_errors.iter().zip(variances);
        places.position(|(own, variances)| !is_sound(own, variances))
    }

    /// Of the coefficients of these numbers.
    pub(super) fn correlation(&self, i: usize, k: usize) -> f64 {
        self.correlations[i * self.coefficients.len() + k]
    }
}
