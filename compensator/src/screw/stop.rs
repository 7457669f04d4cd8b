//! How much a single row scatters about the model, and a single stop.
//!
//! The variance of one row is that of the stroke's own error, of its side and of the repetition together (see
//! `strata`). Each by itself may come out below zero by chance. Were it taken for zero there, while the others are
//! taken as they are, their sum would be too large in the mean: by half where an instrument sees much less than
//! it scatters itself. Their sum is a mixture of mean squares, none of them with a negative weight, and has
//! degrees of freedom of its own by Welch and Satterthwaite (GUM G.4). It is widened for these like the model's
//! covariance.
//!
//! Repetitions also show what the instrument does not repeat, which is nothing that a stop does: where that is known
//! it is taken off, of the sum. So is what the model has followed of the errors that neighbouring strokes share (see
//! `neighbours`).

use super::stratum::{Stratum, widening};

/// The variance of a single row about the model, m², by the mean squares that it is a mixture of.
#[derive(Clone, Debug, Default)]
pub(super) struct Single {
    /// What each adds, and its degrees of freedom.
    shares: Vec<(f64, usize)>,
}

impl Single {
    /// With `weight` times the mean of these squares besides.
    pub(super) fn with(mut self, weight: f64, squares: Stratum) -> Self {
        if squares.freedom > 0 && weight > 0.0 {
            self.shares.push((weight * squares.mean(), squares.freedom));
        }
        self
    }

    /// As it is, m².
    pub(super) fn variance(&self) -> f64 {
        self.shares.iter().map(|(share, _)| share).sum()
    }

    /// Of where a single stop ends, widened, m²; `no_stop` is the variance that no stop has of it.
    pub(super) fn of_stop(&self, no_stop: f64) -> f64 {
        let variance = self.variance();
        (variance * widening(self.freedom_of(variance)) - no_stop).max(0.0)
    }

    /// Degrees of freedom of what is left without `no_stop`, at least one.
    pub(super) fn freedom_of_stop(&self, no_stop: f64) -> usize {
        self.freedom_of((self.variance() - no_stop).max(0.0))
    }

    /// Those of `variance`, which these shares come to, or do without something known; cut off to a whole number (GUM G.4.1).
    fn freedom_of(&self, variance: f64) -> usize {
        let each = self.shares.iter();
        let squares: f64 = each.map(|(it, freedom)| it * it / *freedom as f64).sum();
        let freedom = variance * variance / squares;
        if freedom > 1.0 { freedom as usize } else { 1 }
    }
}
