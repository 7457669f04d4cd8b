//! Why samples give no origin.

use units::{Approach, Metres, Volts};

use super::Sensor;
use crate::hall_zero::Jump;
use crate::least_squares::LeastSquaresError;

/// Which flank.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// x below the peak.
    Left,
    /// x above the peak.
    Right,
}

/// Why no origin can be given.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RefineError {
    /// A voltage or position is not finite.
    #[error("hall refinement: sample {index} is not finite")]
    NotFinite {
        /// Which sample.
        index: usize,
    },
    /// Too few passes in one direction.
    #[error("hall refinement: {seen} passes with approach `{}`, at least 2 are needed", approach.symbol())]
    TooFewPasses {
        /// In which direction.
        approach: Approach,
        /// Passes there.
        seen: usize,
    },
    /// Too few samples altogether, or in one window.
    #[error("hall refinement: {seen} samples around {} mm, at least {needed} are needed; \
             sweep slower or further", units::Short(around.mm()))]
    TooFewSamples {
        /// Centre of the window.
        around: Metres,
        /// Samples there.
        seen: usize,
        /// Samples needed.
        needed: usize,
    },
    /// The maximum of V1 is at the end of the sweep.
    #[error("hall refinement: the peak sensor's maximum {:.4} V lies at the end of the sweep; \
             the sweep missed the peak, or the sensor is inverted or swapped", peak.value())]
    PeakAtEnd {
        /// The maximum seen.
        peak: Volts,
    },
    /// A flank does not reach down to the level.
    #[error("hall refinement, {side:?} flank: the peak sensor fell to {:.4} V only, {:.4} V is \
             needed; sweep further", lowest.value(), level.value())]
    FlankNotCovered {
        /// Which flank.
        side: Side,
        /// Lowest voltage there.
        lowest: Volts,
        /// The level.
        level: Volts,
    },
    /// V2 does not pass its mid voltage between the flanks.
    #[error("hall refinement: the slope sensor does not pass {:.4} V between the flanks; wire \
             open, or sensors swapped?", mid.value())]
    NoCentre {
        /// The mid voltage.
        mid: Volts,
    },
    /// A polynomial has no solution in its window.
    #[error("hall refinement: the {sensor} does not reach {:.4} V in the window around {} mm",
        level.value(), units::Short(around.mm()))]
    NoCrossing {
        /// Whose polynomial.
        sensor: Sensor,
        /// The level sought.
        level: Volts,
        /// Centre of the window.
        around: Metres,
    },
    /// The residuals are well above the noise whatever the degree.
    #[error("hall refinement: the {sensor}'s curve around {} mm is {:.2} mV off any smooth curve, \
             its noise is {:.2} mV; interference,
             or the axis was disturbed", units::Short(around.mm()),
             residual.value() * 1e3, noise.value() * 1e3)]
    LackOfFit {
        /// Whose curve.
        sensor: Sensor,
        /// Centre of the window.
        around: Metres,
        /// Residual standard deviation.
        residual: Volts,
        /// Noise from neighbouring samples.
        noise: Volts,
    },
    /// Too many wild samples.
    #[error("hall refinement: {:.0} % of the samples are wild, the limit is {:.0} %",
        share * 100.0, limit * 100.0)]
    TooManyOutliers {
        /// Their share.
        share: f64,
        /// The limit.
        limit: f64,
    },
    /// A voltage jumped during the passes.
    #[error("hall refinement: {0}")]
    Jumped(Jump),
    /// The slope sensor goes the other way than in the search.
    #[error(
        "hall refinement: the slope sensor looks inverted in polarity: in the passes it goes the other way than in \
             the search; check its wiring"
    )]
    SlopeInverted,
    /// The curves are each other's.
    #[error("hall refinement: curve 1 is odd and curve 2 even around {} mm; the sensors (or the \
             columns of the file) look swapped", units::Short(around.mm()))]
    Swapped {
        /// Centre of the symmetry found.
        around: Metres,
    },
    /// A curve lacks its symmetry.
    #[error("hall refinement: the {sensor}'s curve lacks its symmetry by {:.0} % of its range; \
             sensors swapped, or a magnet damaged?", asymmetry * 100.0)]
    Asymmetric {
        /// Whose curve.
        sensor: Sensor,
        /// Departure as a share of the range.
        asymmetry: f64,
    },
    /// The origin is not where the search stands.
    #[error("hall refinement: the origin at {} mm is further from P0 at {} mm than {:.2} um",
        units::Short(origin.mm()), units::Short(p0.mm()), limit.um())]
    Disagrees {
        /// Refined origin.
        origin: Metres,
        /// Where the search ended.
        p0: Metres,
        /// The distance the tolerance bands explain.
        limit: Metres,
    },
    /// The samples of a window do not determine a polynomial.
    #[error("hall refinement around {} mm: {source}", units::Short(around.mm()))]
    Fit {
        /// Centre of the window.
        around: Metres,
        /// Why.
        source: LeastSquaresError,
    },
}
