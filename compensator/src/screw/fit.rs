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

use std::collections::BTreeMap;

use units::{Approach, Metres};

use super::observe::observable;
use super::outliers::{self, StrokeOutlier};
use super::{BASE, Harmonic, ScrewModel, design_row};
use crate::least_squares::{self, LeastSquaresError};
use crate::measurement::Stroke;
use crate::significance::f_tail;

/// The level at which the strokes' own scatter counts as larger than their repeatability.
const LACK_OF_FIT_LEVEL: f64 = 0.01;

/// The smallest scatter that tests believe in: data without noise have no harmonics by rounding.
pub(super) const SCATTER_FLOOR_M: f64 = 1e-10;

/// What a fit should do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FitOptions {
    /// Travel per turn of the screw; without it no periodic term is looked for.
    pub lead: Option<Metres>,
    /// The highest harmonic of the lead that is looked for.
    pub harmonics_max: u32,
    /// The chance accepted of finding any periodic term where there is none.
    pub significance: f64,
    /// How many scatters off a row must be to be left out.
    pub outlier_threshold: f64,
    /// The largest share of rows that may be left out, 0 to 1.
    pub outlier_share_max: f64,
}

impl Default for FitOptions {
    /// No lead; with one, four harmonics at a level of 1 %.
    fn default() -> Self {
        Self {
            lead: None,
            harmonics_max: 4,
            significance: 0.01,
            outlier_threshold: 6.0,
            outlier_share_max: 0.2,
        }
    }
}

/// What was found about one harmonic.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HarmonicTest {
    /// Which one.
    pub number: u32,
    /// How likely noise alone makes one as strong, in its last test.
    pub p_value: f64,
    /// The level it had to stay within.
    pub level: f64,
    /// Whether it is in the model.
    pub kept: bool,
}

/// Whether the means of the strokes scatter about the model more than their repetitions explain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LackOfFit {
    /// The probability of this by chance.
    pub p_value: f64,
    /// Whether it counts, at 1 %: then the uncertainties are made from the strokes' scatter.
    pub significant: bool,
    /// Standard deviation of one measurement from its repetitions alone.
    pub repeatability: Metres,
}

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
        "screw: forward and reverse have no strokes in common enough to tell lost motion from \
         slope; measure the same strokes from both sides"
    )]
    LostMotionLikeSlope,
    /// The strokes stand at so few places of the turn that a periodic error looks like something
    /// else.
    #[error(
        "screw: the strokes stand at {places} place(s) of the {} mm lead, so its periodic error is \
         not observable (it cannot be told from offset and slope); measure at five or more places \
         spread over more than one turn, or leave the lead out", units::Short(lead.mm())
    )]
    Periodic {
        /// The lead.
        lead: Metres,
        /// Different places of one turn.
        places: usize,
    },
    /// No row to spare.
    #[error(
        "screw: {rows} rows for a model of {parameters} parameters leave nothing to judge the noise \
         by; repeat the strokes or measure more"
    )]
    TooFewRows {
        /// Rows given.
        rows: usize,
        /// Parameters wanted.
        parameters: usize,
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

/// Fits the model to the strokes of one axis.
///
/// # Errors
/// When an option is none, or something is not observable in these strokes, by name.
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

/// How noisy the data are about a model.
struct Noise {
    /// Of one row, for tests and covariance.
    variance: f64,
    degrees_of_freedom: usize,
    /// Of one row about the model, whatever its cause.
    per_row: f64,
    lack_of_fit: Option<LackOfFit>,
}

pub(super) struct Problem<'a> {
    strokes: &'a [Stroke],
    lead: f64,
    deviations: Vec<f64>,
    /// Different strokes and approaches.
    cells: usize,
    /// Sum of squares of the repetitions about their own means.
    within: f64,
}

impl<'a> Problem<'a> {
    pub(super) fn new(strokes: &'a [Stroke], lead: Option<Metres>) -> Self {
        let mut cells: BTreeMap<(Approach, u64), Vec<f64>> = BTreeMap::new();
        for it in strokes {
            cells
                .entry(it.cell())
                .or_default()
                .push(it.deviation.value());
        }
        let spread = |values: &Vec<f64>| -> f64 {
            let mean = values.iter().sum::<f64>() / values.len() as f64;
            values.iter().map(|v| (v - mean) * (v - mean)).sum()
        };
        Self {
            strokes,
            lead: lead.map_or(1.0, Metres::value),
            deviations: strokes.iter().map(|it| it.deviation.value()).collect(),
            cells: cells.len(),
            within: cells.values().map(spread).sum(),
        }
    }

    fn check_rows(&self, harmonics: &[u32]) -> Result<(), FitError> {
        let (rows, parameters) = (self.strokes.len(), BASE + 2 * harmonics.len());
        if rows > parameters {
            Ok(())
        } else {
            Err(FitError::TooFewRows { rows, parameters })
        }
    }

    fn ends(&self) -> (Metres, Metres) {
        let strokes = || self.strokes.iter().map(|it| it.stroke);
        let infinity = Metres(f64::INFINITY);
        (
            strokes().fold(infinity, Metres::min),
            strokes().fold(-infinity, Metres::max),
        )
    }

    pub(super) fn solve(&self, harmonics: &[u32]) -> Result<least_squares::Fit, LeastSquaresError> {
        let row = |it: &Stroke| design_row(it.stroke.value(), it.approach, self.lead, harmonics);
        let design: Vec<f64> = self.strokes.iter().flat_map(row).collect();
        least_squares::solve(&design, BASE + 2 * harmonics.len(), &self.deviations)
    }

    fn squares(&self, harmonics: &[u32]) -> Result<f64, LeastSquaresError> {
        let fit = self.solve(harmonics)?;
        Ok(fit.residuals.iter().map(|r| r * r).sum())
    }

    fn noise(&self, harmonics: &[u32]) -> Result<Noise, LeastSquaresError> {
        let (rows, parameters) = (self.strokes.len(), BASE + 2 * harmonics.len());
        let squares = self.squares(harmonics)?;
        let degrees_of_freedom = rows - parameters;
        let per_row = squares / degrees_of_freedom as f64;
        let mut noise = Noise {
            variance: per_row,
            degrees_of_freedom,
            per_row,
            lack_of_fit: None,
        };
        let repeated = rows - self.cells;
        let judged = self.cells.saturating_sub(parameters);
        if repeated == 0 || judged == 0 {
            return Ok(noise);
        }
        let repeatability = self.within / repeated as f64;
        let between = (squares - self.within).max(0.0) / judged as f64;
        let floor = SCATTER_FLOOR_M * SCATTER_FLOOR_M;
        let p_value = f_tail(
            between.max(floor) / repeatability.max(floor),
            judged,
            repeated,
        );
        let significant = p_value < LACK_OF_FIT_LEVEL && between > repeatability;
        if significant {
            (noise.variance, noise.degrees_of_freedom) = (between, judged);
        }
        noise.lack_of_fit = Some(LackOfFit {
            p_value,
            significant,
            repeatability: Metres(repeatability.sqrt()),
        });
        Ok(noise)
    }

    /// The harmonics that pass their tests, increasing, and all the tests.
    fn significant(
        &self,
        candidates: &[u32],
        noise: &Noise,
        significance: f64,
    ) -> Result<(Vec<u32>, Vec<HarmonicTest>), LeastSquaresError> {
        let variance = noise.variance.max(SCATTER_FLOOR_M * SCATTER_FLOOR_M);
        let (mut kept, mut tests) = (Vec::new(), Vec::new());
        let mut open = candidates.to_vec();
        let mut squares = self.squares(&kept)?;
        while !open.is_empty() {
            let level = significance / open.len() as f64;
            let mut round = Vec::with_capacity(open.len());
            for &number in &open {
                let mut with = kept.clone();
                with.push(number);
                let left = self.squares(&with)?;
                let f = (squares - left) / 2.0 / variance;
                let p_value = f_tail(f, 2, noise.degrees_of_freedom);
                let kept = false;
                round.push((
                    left,
                    HarmonicTest {
                        number,
                        p_value,
                        level,
                        kept,
                    },
                ));
            }
            round.sort_by(|a, b| a.0.total_cmp(&b.0));
            let (left, mut strongest) = round[0];
            if strongest.p_value > level {
                tests.extend(round.iter().map(|(_, test)| *test));
                break;
            }
            strongest.kept = true;
            tests.push(strongest);
            squares = left;
            kept.push(strongest.number);
            open.retain(|number| *number != strongest.number);
        }
        kept.sort_unstable();
        tests.sort_by_key(|test| test.number);
        Ok((kept, tests))
    }
}

#[cfg(test)]
#[path = "fit_tests.rs"]
mod tests;
