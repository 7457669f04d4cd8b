//! Sums of squares, and by how much these are widened where they have few degrees of freedom (see `strata`).

use crate::significance::student_limit;

/// A normal distribution exceeds twice its standard deviation with this probability.
const BEYOND_TWICE: f64 = 0.0455;

/// Squares and their degrees of freedom.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Stratum {
    /// m².
    pub(super) squares: f64,
    pub(super) freedom: usize,
}

impl Stratum {
    pub(super) const NONE: Self = Self {
        squares: 0.0,
        freedom: 0,
    };

    pub(super) fn mean(&self) -> f64 {
        self.squares / self.freedom.max(1) as f64
    }

    pub(super) fn with(self, other: Self) -> Self {
        Self {
            squares: self.squares + other.squares,
            freedom: self.freedom + other.freedom,
        }
    }

    /// As if its freedom had no end.
    pub(super) fn widened(self) -> Self {
        Self {
            squares: self.squares * widening(self.freedom),
            freedom: self.freedom,
        }
    }
}

/// By how much a variance of so many degrees of freedom is widened, as if they had no end.
pub(super) fn widening(freedom: usize) -> f64 {
    let factor = student_limit(BEYOND_TWICE, freedom.max(1)) / 2.0;
    factor * factor
}
