//! The screw's model by least squares over every stroke, with only the periodic terms that are
//! there.
//!
//! A harmonic is kept when noise alone would seldom make one like it. All observable harmonics
//! together give the noise; then the strongest is taken as long as its F-test passes at the
//! level divided by the number of those still in question (Holm's procedure), so that the chance
//! of any false harmonic on a screw that has none is at most the level.
//!
//! What a screw has of errors beyond these terms is the same at a stroke whatever the side and however often it is
//! repeated. Slope and harmonics are therefore judged by what the strokes scatter about the model, and not by
//! their repetitions; the lost motion, a difference at the same stroke, by the latter (see `strata`).
//!
//! Rows that do not belong are left out and named (see `outliers`).
//!
//! Absent: weights.

use units::Metres;

use super::budget::{ORIGIN, SIDES, STROKES, ScatterPart, ScatterParts};
use super::error::FitError;
use super::observe::observable;
use super::options::FitOptions;
use super::outliers::{self, StrokeOutlier};
use super::problem::{FLOOR, HarmonicTest, Problem, SCATTER_FLOOR_M};
use super::strata::{Strata, Variances};
use super::{BASE, Harmonic, ScrewModel};
use crate::least_squares::LeastSquaresError;
use crate::screw::Stroke;

/// Fewer degrees of freedom between strokes are left to the noise only where the first harmonic needs them: from
/// one or two no harmonic of a real screw stands out.
const FREEDOM_WANTED: usize = 4;

/// The level at which strokes count as scattering more than their repetitions.
const LACK_OF_FIT_LEVEL: f64 = 0.01;

/// A model and how it came about.
#[derive(Clone, Debug, PartialEq)]
pub struct Fitted {
    /// The model, with its covariance, which is unknown where no stroke is left to judge it by.
    pub model: ScrewModel,
    /// What the model's uncertainty is made of, where it is known.
    pub parts: Option<ScatterParts>,
    /// Rows that were left out, in the order given.
    pub outliers: Vec<StrokeOutlier>,
    /// Standard deviation of a single row about the model.
    pub residual: Metres,
    /// Where it comes from.
    pub scatter: Scatter,
    /// Degrees of freedom between strokes: behind the uncertainties of offset, slope and harmonics,
    /// which have been widened for it.
    pub degrees_of_freedom: usize,
    /// Degrees of freedom within strokes: likewise behind that of the lost motion.
    pub degrees_of_freedom_within: usize,
    /// `None` where no stroke was repeated or none is left to judge the model by.
    pub lack_of_fit: Option<LackOfFit>,
    /// Every harmonic looked for.
    pub tests: Vec<HarmonicTest>,
    /// Harmonics that these strokes cannot show; they were not looked for.
    pub unobservable: Vec<u32>,
    /// What each harmonic does to the slope where the model lacks it.
    pub leaks: Vec<Leak>,
}

/// Standard deviations of the parts of a row's scatter about the model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scatter {
    /// The screw's own error at a stroke, the same from both sides and in every repetition; zero
    /// where the strokes scatter no more than the rest explains.
    pub stroke: Metres,
    /// The error of one side of a stroke.
    pub side: Metres,
    /// One repetition.
    pub repeatability: Metres,
}

/// Whether the means of the strokes scatter about the model more than their repetitions explain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LackOfFit {
    /// The probability of this by chance.
    pub p_value: f64,
    /// Whether it counts, at 1 %.
    pub significant: bool,
    /// Standard deviation of one measurement from its repetitions alone.
    pub repeatability: Metres,
}

/// What a harmonic does to the slope when it is there and the model lacks it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Leak {
    /// Which harmonic.
    pub number: u32,
    /// By how much the slope is off, in the worst phase, for an amplitude of 1; 1/m.
    pub slope_per_amplitude: f64,
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
    let problem = Problem::new(strokes, options.lead);
    problem.check_rows()?;
    let (candidates, unobservable) = looked_for(strokes, options, &problem)?;
    let (kept, tests) = problem.significant(&candidates, options.significance)?;
    let strata = problem.strata(&kept)?;
    let variances = strata.variances();
    let solved = problem.solve(&kept, &variances)?;
    let origin = square(options.origin);
    let covariance = strata.widened().map(|real| {
        let mut own = problem.covariance(&kept, (&variances, &real), &solved.cofactor);
        // All rows are off by it, as an offset is.
        own[0] += origin;
        own
    });
    let root = |variance: f64| Metres(variance.sqrt());
    let single = strata.single();
    let no_stop = square(options.reading) + strata.followed();
    let of_stop = root(single.of_stop(no_stop));
    let of_model = parts_of(&problem, &kept, &strata, (&solved.cofactor, options.origin));
    let parts = of_model.map(|of_model| ScatterParts {
        of_model,
        freedom_of_stop: single.freedom_of_stop(no_stop),
    });
    let repeatability = root(variances.repeat);
    let lack_of_fit = strata.lack_of_fit(FLOOR).map(|p_value| LackOfFit {
        p_value,
        significant: p_value < LACK_OF_FIT_LEVEL,
        repeatability,
    });
    Ok(Fitted {
        model: model_of(
            &problem,
            options,
            &kept,
            &solved.coefficients,
            covariance,
            of_stop,
        ),
        parts,
        outliers: Vec::new(),
        residual: root(single.variance()),
        scatter: Scatter {
            stroke: root(variances.stroke.max(0.0)),
            side: root(variances.side.max(0.0)),
            repeatability,
        },
        degrees_of_freedom: strata.strokes.freedom,
        degrees_of_freedom_within: strata.freedom_of_sides(),
        lack_of_fit,
        tests,
        unobservable,
        leaks: leaks(&problem, options, &kept, &variances)?,
    })
}

/// The harmonics to look for, and those up to the highest asked for that these strokes cannot show: each needs
/// strokes to judge it by.
fn looked_for(
    strokes: &[Stroke],
    options: &FitOptions,
    problem: &Problem,
) -> Result<(Vec<u32>, Vec<u32>), FitError> {
    let (mut candidates, mut unobservable) =
        observable(strokes, options.lead, options.harmonics_max)?;
    let freedom = |harmonics: usize| problem.places().saturating_sub(BASE - 1 + 2 * harmonics);
    while candidates.len() > 1 && freedom(candidates.len()) < FREEDOM_WANTED {
        unobservable.extend(candidates.pop());
    }
    if !candidates.is_empty() && freedom(candidates.len()) == 0 {
        return Err(FitError::TooFewStrokes {
            strokes: problem.places(),
        });
    }
    unobservable.sort_unstable();
    Ok((candidates, unobservable))
}

fn model_of(
    problem: &Problem,
    options: &FitOptions,
    kept: &[u32],
    values: &[f64],
    covariance: Option<Vec<f64>>,
    scatter: Metres,
) -> ScrewModel {
    let harmonic = |(i, &number): (usize, &u32)| Harmonic {
        number,
        sine: Metres(values[BASE + 2 * i]),
        cosine: Metres(values[BASE + 2 * i + 1]),
    };
    let (first, last) = problem.ends();
    ScrewModel {
        offset: Metres(values[0]),
        slope: values[1],
        lost_motion: Metres(values[2]),
        lead: options.lead,
        harmonics: kept.iter().enumerate().map(harmonic).collect(),
        first,
        last,
        covariance,
        scatter: Some(scatter),
    }
}

/// The covariance by what it comes from; `None` where it is unknown.
fn parts_of(
    problem: &Problem,
    kept: &[u32],
    strata: &Strata,
    (cofactor, origin): (&[f64], Option<Metres>),
) -> Option<Vec<ScatterPart>> {
    let (variances, real) = (strata.variances(), strata.widened()?);
    let [strokes, sides] = problem.covariance_in_parts(kept, (&variances, &real), cofactor);
    let part = |name, scatter: f64, degrees_of_freedom, covariance| ScatterPart {
        name,
        scatter: Metres(scatter.max(SCATTER_FLOOR_M)),
        degrees_of_freedom,
        covariance,
    };
    let (between, within) = (strata.strokes.freedom, strata.freedom_of_sides());
    let mut of_model = vec![
        part(STROKES, strata.scatter_of_strokes(), between, strokes),
        part(SIDES, strata.scatter_of_sides(), within, sides),
    ];
    of_model.extend(origin.map(|origin| {
        let mut of_offset = vec![0.0; cofactor.len()];
        of_offset[0] = origin.value() * origin.value();
        // By what the pictures of each row scatter, one degree of freedom or more of each.
        part(ORIGIN, origin.value(), problem.rows(), of_offset)
    }));
    Some(of_model)
}

/// Of a length that may not be known.
fn square(length: Option<Metres>) -> f64 {
    length.map_or(0.0, |it| it.value() * it.value())
}

fn leaks(
    problem: &Problem,
    options: &FitOptions,
    kept: &[u32],
    variances: &Variances,
) -> Result<Vec<Leak>, LeastSquaresError> {
    let asked = options.lead.map_or(0, |_| options.harmonics_max);
    let leak = |number: u32| {
        Ok(Leak {
            number,
            slope_per_amplitude: problem.leak(number, kept, variances)?,
        })
    };
    (1..=asked).map(leak).collect()
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

#[cfg(test)]
#[path = "coverage_tests.rs"]
mod coverage_tests;
