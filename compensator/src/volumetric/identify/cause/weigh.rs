//! How well a model explains readings, in a form that models of other unknowns and other weights are
//! compared by.

use units::portable::ln;

use crate::least_squares::{self, Decomposed, Fit, LeastSquaresError};
use crate::volumetric::identify::between::Extent;
use crate::volumetric::identify::design::Design;
use crate::volumetric::identify::scatter::scatter_limit;
use crate::volumetric::identify::{IdentifyError, Observation, Plan};

/// A column of which less than this share is beyond the others tells nothing.
const SEEN_MIN: f64 = 1e-9;

/// Whether what functions do between their nodes is part of how uncertain a reading is: a search for the
/// best unknowns needs it only at its end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Weights {
    AsRead,
    BetweenNodes,
}

/// A model with what it leaves of the readings.
#[derive(Clone, Debug)]
pub(super) struct Weighed {
    pub(super) design: Design,
    pub(super) fit: Fit,
    /// Σ ln u² (where readings share something, of what is independent), of what the functions do between their nodes with the readings' own uncertainty: a wrong
    /// model makes the functions rough, and must not gain by what that adds to the uncertainty.
    logarithms: f64,
}

impl Weighed {
    /// With `extra` columns besides, by reading in its SI unit for each unit of an unknown of theirs. What
    /// the plan wants and the readings do not tell is left at nothing.
    pub(super) fn new(
        plan: &Plan,
        observations: &[Observation],
        extra: &[Vec<f64>],
        weights: Weights,
    ) -> Result<Self, IdentifyError> {
        let mut design = Design::new(plan, observations)?;
        let mut fit = solve(&design, extra)?;
        if weights == Weights::BetweenNodes {
            design = design.between(plan, observations, &fit, Extent::Likely);
            fit = solve(&design, extra)?;
        }
        let logarithms = design.whitening.logarithms();
        Ok(Self {
            design,
            fit,
            logarithms,
        })
    }

    /// The scatter of the readings in units of their uncertainty; `None` without readings to spare.
    pub(super) fn ratio(&self) -> Option<f64> {
        self.fit.residual_sd()
    }

    /// Whether the readings scatter no more than they may.
    pub(super) fn explains(&self) -> bool {
        let limit = scatter_limit(self.fit.degrees_of_freedom);
        self.ratio().is_some_and(|it| it <= limit)
    }

    /// Schwarz's criterion: −2 ln L and ln n for each unknown, with a scatter of `scale` in units of what
    /// was stated. What is the same for all models of the same readings is left out.
    pub(super) fn information(&self, scale: f64) -> f64 {
        let readings = self.design.values.len();
        let unknowns = readings - self.fit.degrees_of_freedom;
        let cost = unknowns as f64 * ln(readings as f64);
        self.fit.squares() / (scale * scale) + self.logarithms + cost
    }

    /// An unknown beyond those of the plan, with its standard uncertainty.
    pub(super) fn extra(&self, at: usize) -> (f64, f64) {
        let (column, all) = (self.design.columns() + at, self.fit.coefficients.len());
        let scale = self.ratio().unwrap_or(1.0).max(1.0);
        let u = self.fit.cofactor[column * all + column].max(0.0).sqrt();
        (self.fit.coefficients[column], u * scale)
    }

    /// Orthonormal columns that span what the unknowns can explain.
    pub(super) fn basis(&self) -> Vec<Vec<f64>> {
        least_squares::orthonormal_columns(&self.design.rows, self.design.columns())
    }

    /// About how much `extra` columns would take out of χ²; `basis` is that of this model, without others.
    pub(super) fn gain(&self, basis: &[Vec<f64>], extra: &[Vec<f64>]) -> f64 {
        let mut own: Vec<Vec<f64>> = Vec::new();
        for column in extra {
            let mut column = self.design.whitening.of_column(column);
            let whole = squares(&column);
            leave_out(basis, &mut column);
            for before in &own {
                let part = dot(before, &column);
                let pairs = column.iter_mut().zip(before);
                pairs.for_each(|(it, before)| *it -= part * before);
            }
            let left = squares(&column);
            if left > SEEN_MIN * whole {
                let length = left.sqrt();
                own.push(column.into_iter().map(|it| it / length).collect());
            }
        }
        let parts = own.iter().map(|it| dot(it, &self.fit.residuals));
        parts.map(|it| it * it).sum()
    }
}

fn solve(design: &Design, extra: &[Vec<f64>]) -> Result<Fit, LeastSquaresError> {
    let columns = design.columns();
    let whitening = &design.whitening;
    let extra: Vec<Vec<f64>> = extra.iter().map(|it| whitening.of_column(it)).collect();
    let rows = design.rows.chunks_exact(columns).enumerate();
    let rows: Vec<f64> = rows
        .flat_map(|(at, row)| {
            row.iter()
                .copied()
                .chain(extra.iter().map(move |it| it[at]))
        })
        .collect();
    let all = columns + extra.len();
    let decomposed = Decomposed::new(&rows, all, &design.values)?;
    match decomposed.fit() {
        // Unknowns that are looked for must be told; those of the errors need not be.
        Err(LeastSquaresError::Dependent { column }) if column < columns => {
            Ok(decomposed.fit_of_what_is_told())
        }
        solved => solved,
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn squares(of: &[f64]) -> f64 {
    dot(of, of)
}

/// Takes off what `basis`, by reading, explains.
fn leave_out(basis: &[Vec<f64>], column: &mut [f64]) {
    let mut parts = vec![0.0; basis.first().map_or(0, Vec::len)];
    for (row, it) in basis.iter().zip(column.iter()) {
        let pairs = parts.iter_mut().zip(row);
        pairs.for_each(|(sum, q)| *sum += q * it);
    }
    for (row, it) in basis.iter().zip(column.iter_mut()) {
        *it -= dot(row, &parts);
    }
}
