//! What an evaluation is told, what it says, and why it says nothing.

use units::Radians;

use super::design::{Design, DesignError};
use super::missing::UNKNOWNS_MAX;
use crate::uncertainty::rms;

/// How readings are evaluated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SolveOptions {
    /// The standard uncertainty of one reading, where known: it is then propagated.
    pub reading_noise: Option<Radians>,
    /// The largest amplification of the noise of a harmonic, or of a table error, accepted.
    pub amplification_max: f64,
    /// From how many scatters on a reading is an outlier; infinity searches none.
    pub outlier_threshold: f64,
    /// The largest share of outliers believed.
    pub outlier_share_max: f64,
}

impl Default for SolveOptions {
    fn default() -> Self {
        Self {
            reading_noise: None,
            amplification_max: 1e4,
            outlier_threshold: 5.5,
            outlier_share_max: 0.05,
        }
    }
}

/// One reading: a line of the plate in one placement.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Reading {
    /// Which placement, counted from 0 in the order of the series.
    pub placement: usize,
    /// Its offset.
    pub offset: usize,
    /// Which line.
    pub line: usize,
}

/// A reading that was left out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outlier {
    /// Which one.
    pub reading: Reading,
    /// Reading less what all others predict for it.
    pub residual: Radians,
}

/// Why readings give no table error.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SolveError {
    /// The offsets are of no use.
    #[error(transparent)]
    Design(#[from] DesignError),
    /// So much is missing that one reading decides alone.
    #[error(
        "line {} at plate offset {} is needed: without it and the others that are missing or left \
         out, part of the table has no connection to the rest; read that line again",
        reading.line, reading.offset
    )]
    Unobservable {
        /// The reading that would help.
        reading: Reading,
    },
    /// More is missing than can be evaluated.
    #[error(
        "{seen} readings are missing, {UNKNOWNS_MAX} can be bridged; clean the plate and read again"
    )]
    TooManyMissing {
        /// How many.
        seen: usize,
    },
    /// A table error is known too badly.
    #[error(
        "the table error at position {position} has {seen:.1} times the standard uncertainty of a \
         reading, the limit is {limit:.1}; too many readings are missing there"
    )]
    Amplified {
        /// Where, in lines.
        position: usize,
        /// The amplification.
        seen: f64,
        /// The largest allowed.
        limit: f64,
    },
    /// Most readings at one position of the table disagree.
    #[error(
        "the table error at position {position} ({:.4} degrees) cannot be told: of the {read} readings \
         made there {} cannot be reconciled with the rest ({}), and no majority agrees, so that it is \
         not clear which are right; clean the plate and read these lines again, or read the plate \
         at another offset too",
        360.0 * *position as f64 / *lines as f64, disagree.len(), names(disagree)
    )]
    Undetermined {
        /// Where, in lines.
        position: usize,
        /// The lines of the plate.
        lines: usize,
        /// How many readings were made there.
        read: usize,
        /// Those that were left out.
        disagree: Vec<Reading>,
    },
    /// One of two readings is bad, and nothing tells which.
    #[error(
        "either line {} at plate offset {} or line {} at plate offset {} was read wrongly: the other \
         readings do not tell which, and the table error depends on it; read both again, or read the \
         plate at another offset too",
        one.line, one.offset, other.line, other.offset
    )]
    Ambiguous {
        /// The one.
        one: Reading,
        /// The other.
        other: Reading,
    },
    /// So many readings disagree that it is not clear which are wrong.
    #[error(
        "{seen} of {readings} readings disagree with the others, first line {} at plate offset {}; \
         at most {limit} may be outliers: was the plate clamped firmly, and was each offset \
         entered correctly?",
        first.line, first.offset
    )]
    TooManyOutliers {
        /// How many disagree.
        seen: usize,
        /// Of how many.
        readings: usize,
        /// How many would be accepted.
        limit: usize,
        /// One of them.
        first: Reading,
    },
}

fn names(readings: &[Reading]) -> String {
    let name = |it: &Reading| format!("line {} at plate offset {}", it.line, it.offset);
    readings.iter().map(name).collect::<Vec<_>>().join(", ")
}

/// What readings say about the table and the plate.
///
/// Sign: a table error is reading − true angle, so the deviation (actual − target) of a table
/// that is moved by its readings is the negative of it: [`Solution::deviations`].
#[derive(Clone, Debug, PartialEq)]
pub struct Solution {
    /// What the offsets make of noise when nothing is missing.
    pub design: Design,
    /// G at each position of the table (in line spacings); its sum is zero.
    pub table_error: Vec<Radians>,
    /// A of each line, `None` where it was never read, or where half of what was read of it was left
    /// out; the sum of the others is zero.
    pub plate_error: Vec<Option<Radians>>,
    /// The standard uncertainty of each table error in units of that of one reading.
    pub amplification: Vec<f64>,
    /// Readings − unknowns, outliers and missing ones not counted.
    pub degrees_of_freedom: usize,
    /// Scatter of the readings about the model.
    pub residual_rms: Radians,
    /// The standard uncertainty of one reading by the residuals; `None` without freedom.
    pub reading_noise_seen: Option<Radians>,
    /// The standard uncertainty of one reading as it was given.
    pub reading_noise_given: Option<Radians>,
    /// Readings that were not made.
    pub missing: Vec<Reading>,
    /// Readings that were left out.
    pub outliers: Vec<Outlier>,
}

impl Solution {
    /// The rms of the amplification over the table: [`Design::rms_amplification`], enlarged by
    /// what is missing.
    pub fn noise_amplification(&self) -> f64 {
        rms(&self.amplification)
    }

    /// The standard uncertainty of each table error by the residuals; `None` without freedom.
    pub fn uncertainty_seen(&self) -> Option<Vec<Radians>> {
        self.reading_noise_seen.map(|noise| self.spread(noise))
    }

    /// The standard uncertainty of each table error propagated from the noise that was given.
    pub fn uncertainty_propagated(&self) -> Option<Vec<Radians>> {
        self.reading_noise_given.map(|noise| self.spread(noise))
    }

    /// The best statement there is: by the residuals, else propagated.
    pub fn standard_uncertainty(&self) -> Option<Vec<Radians>> {
        self.uncertainty_seen()
            .or_else(|| self.uncertainty_propagated())
    }

    /// Deviation (actual − target) of the table at each position: −[`Self::table_error`].
    pub fn deviations(&self) -> Vec<Radians> {
        self.table_error.iter().map(|error| -*error).collect()
    }

    /// What line by line is expected of a further placement at `offset`, but for its constant:
    /// G\[n + s\] + A\[n\]; `None` for lines never read.
    pub fn expected(&self, offset: usize) -> Vec<Option<Radians>> {
        let lines = self.table_error.len();
        let table = |line: usize| self.table_error[(line + offset) % lines];
        let plate = self.plate_error.iter().enumerate();
        plate
            .map(|(line, it)| it.map(|error| table(line) + error))
            .collect()
    }

    fn spread(&self, noise: Radians) -> Vec<Radians> {
        self.amplification.iter().map(|it| noise * *it).collect()
    }
}
