//! Why strokes give no model.

use units::{Approach, Metres};

use crate::least_squares::LeastSquaresError;

/// Why strokes give no model.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FitError {
    /// A significance level that is none.
    #[error("screw: the significance level is {seen}; it must be between 0 and 1",
        seen = units::Short(*seen))]
    Level {
        /// The value.
        seen: f64,
    },
    /// A lead that is none.
    #[error("screw: the lead is {} mm; it must be positive", units::Short(seen.mm()))]
    Lead {
        /// The value.
        seen: Metres,
    },
    /// All strokes are the same.
    #[error("screw: no two different strokes, so the slope is not observable")]
    OneStroke,
    /// One side only: the lost motion cannot be seen.
    #[error(
        "screw: only approach `{}` was measured, so the lost motion is not observable; measure \
         the same strokes from the other side too", measured.symbol()
    )]
    OneApproach {
        /// The approach that is there.
        measured: Approach,
    },
    /// Each side at strokes of its own, so that a lost motion looks like a slope.
    #[error(
        "screw: forward and reverse have too few strokes in common to distinguish lost motion from \
         slope; measure the same strokes from both sides"
    )]
    LostMotionLikeSlope,
    /// The strokes stand at so few places of the turn that a periodic error looks like something
    /// else.
    #[error(
        "screw: the strokes stand at {places} place(s) of the {} mm lead, so its periodic error is \
         not observable (it cannot be distinguished from offset and slope); measure at five or \
         more places spread over more than one turn, or leave the lead out", units::Short(lead.mm())
    )]
    Periodic {
        /// The lead.
        lead: Metres,
        /// Different places of one turn.
        places: usize,
    },
    /// No row to spare.
    #[error(
        "screw: {rows} rows for a model of {parameters} parameters leave nothing from which to \
         judge the noise; repeat the strokes or measure more"
    )]
    TooFewRows {
        /// Rows given.
        rows: usize,
        /// Parameters wanted.
        parameters: usize,
    },
    /// No stroke to spare.
    #[error(
        "screw: offset, slope and a periodic error of {strokes} different strokes leave none from \
         which to judge the screw's own error; measure at five or more different strokes, better \
         nine, or leave the lead out"
    )]
    TooFewStrokes {
        /// Different strokes given.
        strokes: usize,
    },
    /// So many rows do not belong that nobody can say which do.
    #[error(
        "screw: {outliers} of {rows} rows do not fit the others, more than {:.0} %; look for loose \
         parts, vibration or mixed axes and measure again", share_max * 100.0
    )]
    TooManyOutliers {
        /// Rows that do not fit.
        outliers: usize,
        /// Rows given.
        rows: usize,
        /// The share allowed, 0 to 1.
        share_max: f64,
    },
    /// The numbers cannot be solved.
    #[error("screw: {0}")]
    Solve(#[from] LeastSquaresError),
}
