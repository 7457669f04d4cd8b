//! Least squares over strokes: how noisy they are about a model, and which harmonics they show.

use std::collections::BTreeMap;

use units::{Approach, Metres};

use super::error::FitError;
use super::{BASE, design_row};
use crate::least_squares::{self, LeastSquaresError};
use crate::screw::Stroke;
use crate::significance::f_tail;

/// The level at which the strokes' own scatter counts as larger than their repeatability.
const LACK_OF_FIT_LEVEL: f64 = 0.01;

/// The smallest scatter that tests believe in: data without noise have no harmonics by rounding.
pub(super) const SCATTER_FLOOR_M: f64 = 1e-10;

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

/// How noisy the data are about a model.
pub(super) struct Noise {
    /// Of one row, for tests and covariance.
    pub(super) variance: f64,
    pub(super) degrees_of_freedom: usize,
    /// Of one row about the model, whatever its cause.
    pub(super) per_row: f64,
    pub(super) lack_of_fit: Option<LackOfFit>,
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

    pub(super) fn check_rows(&self, harmonics: &[u32]) -> Result<(), FitError> {
        let (rows, parameters) = (self.strokes.len(), BASE + 2 * harmonics.len());
        if rows > parameters {
            Ok(())
        } else {
            Err(FitError::TooFewRows { rows, parameters })
        }
    }

    pub(super) fn ends(&self) -> (Metres, Metres) {
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
        Ok(fit.squares())
    }

    pub(super) fn noise(&self, harmonics: &[u32]) -> Result<Noise, LeastSquaresError> {
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
    pub(super) fn significant(
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
