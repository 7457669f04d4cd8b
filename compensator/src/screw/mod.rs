//! Ball screw: lead error, lost motion and periodic error, estimated and undone (system S1).
//!
//! Source: the Chinese patent application "error compensation method for an alignment platform"
//! (test step S100, compensation step S200; a UVW platform, ±4 µm brought within ±2 µm). Its
//! estimator is [`patent`], with the misprint of its second direction mended (n2 − m2, where
//! the text divides by n1 − m1). Beyond it: a least-squares model over all strokes with forward
//! and reverse apart, periodic terms over the lead where they are significant, uncertainties,
//! lost motion by remembered engagement, and the exact inverse.
//!
//! With the screw's coordinate s (commanded, from its zero):
//!
//! deviation(s, forward) = offset + slope·s + Σ_h (sine_h sin 2πhs/lead + cosine_h cos 2πhs/lead)
//! deviation(s, reverse) = deviation(s, forward) + lost_motion
//!
//! | symbol | name here |
//! |---|---|
//! | L, X1, X2 | the length of a move, in [`patent`] only |
//! | m, n | [`patent::PatentEstimate::at_m`], [`patent::PatentEstimate::at_n`] |
//! | ΔX, ΔXn, ΔXm | `mean_all`, `mean_at_m`, `mean_at_n` (the text's indices are crossed) |
//! | k | [`patent::PatentRule::gain`] |
//!
//! # Sign
//!
//! Deviation = actual − commanded, along the screw's coordinate, whichever way it was reached. A
//! nut pushed forward leads; when the screw turns back, the nut stays behind at the higher
//! coordinate until the play is used up, so a mechanical lost motion (reverse − forward) is
//! positive. The patent *adds* its "error" to the length of a move: its error is what a move
//! falls short by, commanded − actual length. Forward that is −deviation, in reverse, where the
//! coordinate runs against the move, +deviation. So k = −slope and ΔX = +lost_motion; this is
//! converted in [`patent::PatentRule`] and nowhere else. [`patent::estimate`] and [`fit`]
//! report slope and means of the deviations they are given, in their sign.
//!
//! Absent: temperature, wear, speed-dependent friction, random error (it is the `scatter`).

mod budget;
mod cells;
mod compensation;
mod engagement;
mod error;
mod fit;
mod limits;
mod neighbours;
mod observe;
mod options;
mod outliers;
pub mod patent;
pub mod plan;
mod problem;
mod series;
mod stop;
mod strata;
mod stratum;

use core::f64::consts::TAU;

use units::portable::{hypot, sin_cos};
use units::{Approach, Metres};

use crate::uncertainty::propagate;

pub use budget::{ScatterPart, ScatterParts};
pub use compensation::{Correction, OutOfRange, Rule, ScrewCompensation};
pub use engagement::{Engagement, ScrewMemory};
pub use error::FitError;
pub use fit::{Fitted, LackOfFit, Leak, Scatter, fit};
pub use limits::{LimitName, Limits, ScrewError};
pub use options::FitOptions;
pub use outliers::StrokeOutlier;
pub use problem::HarmonicTest;
pub use series::{AxisStrokes, ScrewFault, Stroke, StrokeError, StrokeSeries};

/// Offset, slope and lost motion come before the harmonics' sines and cosines.
const BASE: usize = 3;

/// An error that repeats with the lead, or a whole number of times within it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Harmonic {
    /// How many periods one lead has, from 1.
    pub number: u32,
    /// Amplitude of the sine.
    pub sine: Metres,
    /// Amplitude of the cosine.
    pub cosine: Metres,
}

impl Harmonic {
    /// The largest deviation it makes.
    pub fn amplitude(&self) -> Metres {
        Metres(hypot(self.sine.value(), self.cosine.value()))
    }

    fn at(&self, stroke: f64, lead: f64) -> f64 {
        let (sin, cos) = sin_cos(turns(stroke, lead, self.number));
        self.sine.value() * sin + self.cosine.value() * cos
    }

    /// d deviation / d stroke.
    fn slope_at(&self, stroke: f64, lead: f64) -> f64 {
        let (sin, cos) = sin_cos(turns(stroke, lead, self.number));
        let per_metre = TAU * f64::from(self.number) / lead;
        per_metre * (self.sine.value() * cos - self.cosine.value() * sin)
    }
}

/// The phase of a harmonic, radians, within one turn of the screw.
fn turns(stroke: f64, lead: f64, number: u32) -> f64 {
    TAU * f64::from(number) * (stroke / lead).rem_euclid(1.0)
}

/// What is known of one screw. Plain data, so that a store can write its own form of it.
#[derive(Clone, Debug, PartialEq)]
pub struct ScrewModel {
    /// Deviation at stroke zero reached forward, periodic terms apart.
    pub offset: Metres,
    /// Deviation per stroke, dimensionless.
    pub slope: f64,
    /// Deviation reached in reverse − deviation reached forward.
    pub lost_motion: Metres,
    /// Travel per turn; needed where there are harmonics.
    pub lead: Option<Metres>,
    /// The periodic terms, each number at most once.
    pub harmonics: Vec<Harmonic>,
    /// The lowest stroke measured.
    pub first: Metres,
    /// The highest stroke measured.
    pub last: Metres,
    /// Covariance of offset, slope, lost motion, and sine and cosine of each harmonic, in this
    /// order, square row by row, SI units; widened for their degrees of freedom where these are few.
    /// `None` where nothing was left to judge by.
    pub covariance: Option<Vec<f64>>,
    /// Standard uncertainty of a single move around the model, the screw's own errors at a stroke included, and what its
    /// instrument does not repeat where that is not known by itself; of least squares widened like the covariance.
    /// `None` when nothing was repeated.
    pub scatter: Option<Metres>,
}

/// What the model says about one stroke.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prediction {
    /// The mean deviation expected.
    pub deviation: Metres,
    /// Its standard uncertainty; a single move scatters around it by the model's scatter.
    pub standard_uncertainty: Option<Metres>,
}

impl ScrewModel {
    /// The deviation expected at `stroke` reached from `approach` with the play taken up.
    pub fn deviation(&self, stroke: Metres, approach: Approach) -> Metres {
        let forward = Metres(self.forward(stroke.value()));
        match approach {
            Approach::Forward => forward,
            Approach::Reverse => forward + self.lost_motion,
        }
    }

    /// The same with its standard uncertainty, which grows outside the strokes measured.
    pub fn predict(&self, stroke: Metres, approach: Approach) -> Prediction {
        let gradient = self.gradient(stroke.value(), approach);
        let u = |covariance: &[f64]| Metres(propagate(&gradient, covariance).max(0.0).sqrt());
        Prediction {
            deviation: self.deviation(stroke, approach),
            standard_uncertainty: self.known_covariance().map(u),
        }
    }

    /// Standard uncertainty of the offset.
    pub fn u_offset(&self) -> Option<Metres> {
        self.u(0).map(Metres)
    }

    /// Standard uncertainty of the slope, dimensionless.
    pub fn u_slope(&self) -> Option<f64> {
        self.u(1)
    }

    /// Standard uncertainty of the lost motion.
    pub fn u_lost_motion(&self) -> Option<Metres> {
        self.u(2).map(Metres)
    }

    /// Standard uncertainties of sine, cosine and amplitude of the harmonic at `index`.
    pub fn u_harmonic(&self, index: usize) -> Option<[Metres; 3]> {
        let harmonic = self.harmonics.get(index)?;
        let at = BASE + 2 * index;
        let mut gradient = vec![0.0; self.parameters()];
        let (u_sine, u_cosine) = (Metres(self.u(at)?), Metres(self.u(at + 1)?));
        let amplitude = harmonic.amplitude();
        if amplitude == Metres::ZERO {
            // Nothing says in which phase it would grow.
            return Some([u_sine, u_cosine, u_sine.max(u_cosine)]);
        }
        gradient[at] = harmonic.sine / amplitude;
        gradient[at + 1] = harmonic.cosine / amplitude;
        let variance = propagate(&gradient, self.known_covariance()?);
        Some([u_sine, u_cosine, Metres(variance.max(0.0).sqrt())])
    }

    fn u(&self, index: usize) -> Option<f64> {
        let covariance = self.known_covariance()?;
        let variance = covariance.get(index * self.parameters() + index)?;
        Some(variance.max(0.0).sqrt())
    }

    /// One of another size than the parameters need says nothing of them.
    fn known_covariance(&self) -> Option<&[f64]> {
        let covariance = self.covariance.as_deref()?;
        let parameters = self.parameters();
        (covariance.len() == parameters * parameters).then_some(covariance)
    }

    fn parameters(&self) -> usize {
        BASE + 2 * self.harmonics.len()
    }

    /// Deviation reached forward, metres.
    fn forward(&self, stroke: f64) -> f64 {
        self.offset.value() + self.slope * stroke + self.periodic(stroke)
    }

    fn periodic(&self, stroke: f64) -> f64 {
        let lead = self.lead_m();
        self.harmonics.iter().map(|it| it.at(stroke, lead)).sum()
    }

    /// Any number where there are no harmonics.
    fn lead_m(&self) -> f64 {
        self.lead.map_or(1.0, Metres::value)
    }

    /// d deviation / d parameters, in the order of the covariance.
    fn gradient(&self, stroke: f64, approach: Approach) -> Vec<f64> {
        let numbers: Vec<u32> = self.harmonics.iter().map(|it| it.number).collect();
        design_row(stroke, approach, self.lead_m(), &numbers)
    }
}

/// One row of the model's design: 1, stroke, whether reverse, sine and cosine per harmonic.
fn design_row(stroke: f64, approach: Approach, lead: f64, harmonics: &[u32]) -> Vec<f64> {
    let reverse = match approach {
        Approach::Forward => 0.0,
        Approach::Reverse => 1.0,
    };
    let mut row = vec![1.0, stroke, reverse];
    for &number in harmonics {
        let (sin, cos) = sin_cos(turns(stroke, lead, number));
        row.extend([sin, cos]);
    }
    row
}

#[cfg(test)]
mod rig;
