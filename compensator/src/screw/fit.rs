//! The screw's model by least squares over every stroke, with only the periodic terms that are
//! there.
//!
//! A harmonic is kept when noise alone would seldom make one like it. All observable harmonics
//! together give the noise; then the strongest is taken as long as its F-test passes at the
//! level divided by the number of those still in question (Holm's procedure), so that the chance
//! of any false harmonic on a screw that has none is at most the level.
//!
//! Where the same stroke was made several times, the repetitions say how large the noise is
//! without any model (pure error). When the means of the strokes then scatter more than that
//! about the model, the strokes have an error of their own that repeating does not average out;
//! tests and uncertainties are then made from the larger scatter, per stroke and not per row.
//!
//! Rows that do not belong are left out and named (see `outliers`).
//!
//! Absent: weights.

use units::Metres;

use super::error::FitError;
use super::observe::observable;
use super::options::FitOptions;
use super::outliers::{self, StrokeOutlier};
use super::problem::{HarmonicTest, LackOfFit, Problem};
use super::{BASE, Harmonic, ScrewModel};
use crate::least_squares::LeastSquaresError;
use crate::screw::Stroke;

/// A model and how it came about.
#[derive(Clone, Debug, PartialEq)]
pub struct Fitted {
    /// The model, with its covariance.
    pub model: ScrewModel,
    /// Rows that were left out, in the order given.
    pub outliers: Vec<StrokeOutlier>,
    /// Standard deviation of the rows about the model.
    pub residual: Metres,
    /// Degrees of freedom behind the covariance.
    pub degrees_of_freedom: usize,
    /// `None` where no stroke was repeated or none is left to judge the model by.
    pub lack_of_fit: Option<LackOfFit>,
    /// Every harmonic looked for.
    pub tests: Vec<HarmonicTest>,
    /// Harmonics that these strokes cannot show; they were not looked for.
    pub unobservable: Vec<u32>,
}

/// Fits the model to the strokes of one axis.
///
/// # Errors
/// When an option is invalid, or a term is not observable in these strokes; the error names it.
///
/// # Example
///
/// ```
/// use compensator::screw::{FitOptions, Stroke, fit};
/// use units::{Approach, Metres};
///
/// // 0.6 µm/mm too long, and 2.3 µm of lost motion.
/// let mut strokes = Vec::new();
/// for (approach, play_um) in [(Approach::Forward, 0.0), (Approach::Reverse, 2.3)] {
///     for mm in [-2.0, -1.0, 0.0, 1.0, 2.0] {
///         let (stroke, um) = (Metres::from_mm(mm), 0.6 * mm + play_um);
///         strokes.push(Stroke { approach, stroke, deviation: Metres::from_um(um) });
///     }
/// }
/// let model = fit(&strokes, &FitOptions::default())?.model;
/// assert!((model.slope * 1e3 - 0.6).abs() < 1e-9);
/// assert!((model.lost_motion.um() - 2.3).abs() < 1e-9);
/// # Ok::<(), compensator::screw::FitError>(())
/// ```
pub fn fit(strokes: &[Stroke], options: &FitOptions) -> Result<Fitted, FitError> {
    check(strokes, options)?;
    let (candidates, _) = observable(strokes, options.lead, options.harmonics_max)?;
    let left_out = outliers::find(strokes, &candidates, options)?;
    let rows = strokes.iter().enumerate();
    let kept = rows.filter(|(index, _)| !left_out.contains(index));
    let kept: Vec<Stroke> = kept.map(|(_, it)| *it).collect();
    let mut fitted = fit_all(&kept, options)?;
    let model = &fitted.model;
    let named = |index: usize| {
        let stroke = strokes[index];
        let residual = stroke.deviation - model.deviation(stroke.stroke, stroke.approach);
        StrokeOutlier {
            index,
            stroke,
            residual,
        }
    };
    fitted.outliers = left_out.into_iter().map(named).collect();
    Ok(fitted)
}

/// The same with every row.
fn fit_all(strokes: &[Stroke], options: &FitOptions) -> Result<Fitted, FitError> {
    let (mut candidates, mut unobservable) =
        observable(strokes, options.lead, options.harmonics_max)?;
    let problem = Problem::new(strokes, options.lead);
    // Without a row to spare for it a harmonic cannot be judged either; the first must be.
    while candidates.len() > 1 && problem.check_rows(&candidates).is_err() {
        unobservable.extend(candidates.pop());
    }
    unobservable.sort_unstable();
    problem.check_rows(&candidates)?;
    let noise = problem.noise(&candidates)?;
    let (kept, tests) = problem.significant(&candidates, &noise, options.significance)?;
    let final_noise = problem.noise(&kept)?;
    let solved = problem.solve(&kept)?;
    let variance = final_noise.variance;
    let covariance = solved.cofactor.iter().map(|c| c * variance).collect();
    let values = &solved.coefficients;
    let harmonic = |(i, &number): (usize, &u32)| Harmonic {
        number,
        sine: Metres(values[BASE + 2 * i]),
        cosine: Metres(values[BASE + 2 * i + 1]),
    };
    let ends = problem.ends();
    let model = ScrewModel {
        offset: Metres(values[0]),
        slope: values[1],
        lost_motion: Metres(values[2]),
        lead: options.lead,
        harmonics: kept.iter().enumerate().map(harmonic).collect(),
        first: ends.0,
        last: ends.1,
        covariance: Some(covariance),
        scatter: Some(Metres(final_noise.per_row.sqrt())),
    };
    Ok(Fitted {
        model,
        outliers: Vec::new(),
        residual: Metres(final_noise.per_row.sqrt()),
        degrees_of_freedom: final_noise.degrees_of_freedom,
        lack_of_fit: final_noise.lack_of_fit,
        tests,
        unobservable,
    })
}

fn check(strokes: &[Stroke], options: &FitOptions) -> Result<(), FitError> {
    let level = options.significance;
    if level.is_nan() || level <= 0.0 || level >= 1.0 {
        return Err(FitError::Level { seen: level });
    }
    if let Some(seen) = options
        .lead
        .filter(|it| !it.is_finite() || *it <= Metres::ZERO)
    {
        return Err(FitError::Lead { seen });
    }
    let finite = |it: &Stroke| it.stroke.is_finite() && it.deviation.is_finite();
    match strokes.iter().position(|it| !finite(it)) {
        Some(observation) => Err(LeastSquaresError::NotFinite { observation }.into()),
        None => Ok(()),
    }
}

#[cfg(test)]
#[path = "fit_tests.rs"]
mod tests;
