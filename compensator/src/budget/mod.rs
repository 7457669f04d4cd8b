//! An uncertainty budget: what contributes, and what it comes to at any place of a calibrated axis.
//!
//! Source: GUM (JCGM 100:2008), 5.1 for independent inputs, 5.2 for correlated ones, 8 for the
//! procedure, G.4.1 for the effective degrees of freedom (Welch and Satterthwaite).
//!
//! | symbol | name here |
//! |---|---|
//! | u(x_i) | [`Contribution::value`] |
//! | c_i | [`Contribution::sensitivity`] |
//! | ν_i | [`Contribution::degrees_of_freedom`], `None` for infinitely many |
//! | u_c(y), ν_eff | [`Combined`] |
//! | U = k·u_c | [`Combined::expanded`], k = [`COVERAGE_FACTOR`] |
//! | u(y_1, y_2) | [`AxisBudget::covariance`] |
//!
//! An [`AxisBudget`] knows how each contribution depends on the position; a [`PlacesBudget`] is told its
//! sensitivity at each place, which comes out of a fit.
//!
//! The inputs are independent of one another. What one input does at two places is correlated, and
//! [`Correlation`] says how: a thermometer that shows too much stretches every length by the same
//! share, a datum that was read wrongly shifts every place by the same length, and the scatter of
//! the readings at one position says nothing about the next.
//!
//! Absent: inputs that depend on one another, terms of higher order, distributions (U is stated
//! with k = 2, which is 95 % where the effective degrees of freedom are many).

mod axis;
mod places;

pub use axis::AxisBudget;
pub use places::PlacesBudget;

use units::{Approach, Metres, Quantity};

use crate::uncertainty::combine;

/// The factor from a standard uncertainty to the expanded one that is stated.
pub const COVERAGE_FACTOR: f64 = 2.0;

/// Why contributions make no budget.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum BudgetError {
    /// A number that no uncertainty has.
    #[error("uncertainty budget, `{name}`: {what} is {seen}")]
    Value {
        /// Which contribution.
        name: String,
        /// Which of its numbers.
        what: &'static str,
        /// That number.
        seen: f64,
    },
    /// Positions that were measured once only.
    #[error("uncertainty budget: no position was measured twice with approach `{}`, so that \
         nothing is known of the scatter of a reading; measure at least two runs",
        approach.symbol())]
    NoScatter {
        /// Which approach.
        approach: Approach,
    },
    /// Fewer than two positions, or not one behind the other.
    #[error("uncertainty budget: its positions do not increase, or there are fewer than two")]
    Positions,
    /// No place, or one with another number of sensitivities than there are contributions.
    #[error(
        "uncertainty budget: there is no place, or one has not a sensitivity for each contribution"
    )]
    Sensitivities,
}

/// How a standard uncertainty was found (GUM 4.2 and 4.3).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Evaluation {
    /// From repeated readings.
    A,
    /// From anything else: a certificate, a data sheet, experience.
    B,
}

/// What one input does at two places of an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Correlation {
    /// A share of the distance from the datum, the same everywhere.
    CommonScale,
    /// The same length everywhere.
    CommonOffset,
    /// Nothing in common: something else at each calibrated position, and in either approach.
    Independent,
    /// Nothing at the calibrated positions, most half-way between two of them.
    BetweenPositions,
    /// What a fit makes of readings that all places share, told by the sensitivities at each of them; on an
    /// axis the same length everywhere.
    SharedReadings,
}

/// One line of a budget.
#[derive(Clone, Debug, PartialEq)]
pub struct Contribution {
    /// Where it comes from.
    pub name: String,
    /// How it was found.
    pub evaluation: Evaluation,
    /// Standard uncertainty of the input, in `unit`, not negative.
    pub value: f64,
    /// Unit of `value`.
    pub unit: String,
    /// What one `unit` more does to the result: metres, or metres per metre of distance from the
    /// datum with [`Correlation::CommonScale`].
    pub sensitivity: f64,
    /// How well `value` itself is known; `None` for infinitely many.
    pub degrees_of_freedom: Option<f64>,
    /// What it does at different places.
    pub correlation: Correlation,
    /// The one approach that it concerns; `None` for both.
    pub approach: Option<Approach>,
}

impl Contribution {
    /// Of this standard uncertainty in its unit, with a sensitivity of 1 and infinitely many degrees of freedom, for
    /// both approaches.
    pub fn new(
        name: &str,
        evaluation: Evaluation,
        (value, unit): (f64, &str),
        correlation: Correlation,
    ) -> Self {
        Self {
            name: name.to_owned(),
            evaluation,
            value,
            unit: unit.to_owned(),
            sensitivity: 1.0,
            degrees_of_freedom: None,
            correlation,
            approach: None,
        }
    }

    /// Its share of the standard uncertainty at a calibrated position so far from the datum, or
    /// half-way between two for [`Correlation::BetweenPositions`].
    pub fn share(&self, distance: Metres) -> Metres {
        let own = (self.value * self.sensitivity).abs();
        Metres(match self.correlation {
            Correlation::CommonScale => own * distance.abs().value(),
            Correlation::CommonOffset
            | Correlation::Independent
            | Correlation::BetweenPositions
            | Correlation::SharedReadings => own,
        })
    }

    /// Whether it counts for a place that is reached so.
    pub fn concerns(&self, approach: Approach) -> bool {
        self.approach.is_none_or(|it| it == approach)
    }

    /// Whether its numbers can be those of an uncertainty.
    fn check(&self) -> Result<(), BudgetError> {
        let freedom = self.degrees_of_freedom.unwrap_or(1.0);
        let judged = [
            (
                "the standard uncertainty",
                self.value,
                self.value >= 0.0 && self.value.is_finite(),
            ),
            (
                "the sensitivity",
                self.sensitivity,
                self.sensitivity.is_finite(),
            ),
            (
                "the number of degrees of freedom",
                freedom,
                freedom > 0.0 && freedom.is_finite(),
            ),
        ];
        let wrong = judged.into_iter().find(|(_, _, is_sound)| !is_sound);
        wrong.map_or(Ok(()), |(what, seen, _)| {
            Err(BudgetError::Value {
                name: self.name.clone(),
                what,
                seen,
            })
        })
    }
}

/// What contributions come to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Combined<Q = Metres> {
    /// The combined standard uncertainty.
    pub standard_uncertainty: Q,
    /// Its effective degrees of freedom; `None` for infinitely many.
    pub degrees_of_freedom: Option<f64>,
}

impl<Q: Quantity> Combined<Q> {
    /// The expanded uncertainty, with [`COVERAGE_FACTOR`].
    pub fn expanded(&self) -> Q {
        self.standard_uncertainty * COVERAGE_FACTOR
    }
}

/// Combines independent shares, each with its degrees of freedom (`None` for infinitely many).
///
/// # Example
///
/// ```
/// use compensator::budget::combine_shares;
/// use units::Metres;
///
/// // GUM H.1.6: an end gauge, in nanometres.
/// let shares = [(25.0, Some(18.0)), (9.7, Some(25.6)), (2.9, Some(50.0)), (16.6, Some(2.0))];
/// let nm = |(u, freedom): (f64, Option<f64>)| (Metres(u * 1e-9), freedom);
/// let combined = combine_shares(shares.map(nm));
/// assert!((combined.standard_uncertainty.nm() - 31.7).abs() < 0.1);
/// assert!((combined.degrees_of_freedom.expect("of few readings") - 16.7).abs() < 0.1);
/// ```
pub fn combine_shares<Q: Quantity>(
    shares: impl IntoIterator<Item = (Q, Option<f64>)>,
) -> Combined<Q> {
    let shares: Vec<(f64, Option<f64>)> = shares
        .into_iter()
        .map(|(u, freedom)| (u.value(), freedom))
        .collect();
    let values: Vec<f64> = shares.iter().map(|(u, _)| *u).collect();
    let combined = combine(&values);
    // Relative to the largest: nanometres to the fourth power are far from what divides well.
    let relative = |u: f64| (u / combined) * (u / combined);
    let sum: f64 = shares
        .iter()
        .filter_map(|(u, freedom)| Some(relative(*u) * relative(*u) / (*freedom)?))
        .sum();
    Combined {
        standard_uncertainty: Q::from_value(combined),
        degrees_of_freedom: (combined > 0.0 && sum > 0.0).then(|| 1.0 / sum),
    }
}

#[cfg(test)]
mod tests;
