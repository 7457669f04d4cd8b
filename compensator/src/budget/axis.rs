//! The budget of a calibrated axis, at its positions and between them.

use units::{Approach, Metres};

use super::{BudgetError, Combined, Contribution, Correlation, combine_shares};

/// What contributes to the uncertainty of an axis that was calibrated at some positions.
///
/// # Example
///
/// ```
/// use compensator::budget::{AxisBudget, Contribution, Correlation, Evaluation};
/// use units::{Approach, Metres};
///
/// let line = |name: &str, value, unit: &str, sensitivity, correlation| Contribution {
///     name: name.into(),
///     evaluation: Evaluation::B,
///     value,
///     unit: unit.into(),
///     sensitivity,
///     degrees_of_freedom: None,
///     correlation,
///     approach: None,
/// };
/// let lines = vec![
///     line("material temperature", 0.1, "K", 11.5e-6, Correlation::CommonScale),
///     line("datum", 20e-9, "m", 1.0, Correlation::CommonOffset),
/// ];
/// let budget = AxisBudget::new(lines, vec![Metres(0.0), Metres::from_mm(60.0)])?;
/// let at = |mm| budget.at(Metres::from_mm(mm), Approach::Forward);
/// let end = at(60.0).expect("it was calibrated there");
/// assert!((end.standard_uncertainty.nm() - 71.8).abs() < 0.1, "69 nm and 20 nm");
/// assert!((end.expanded().nm() - 143.7).abs() < 0.1, "k = 2");
/// assert_eq!(at(61.0), None, "nothing is known beyond");
/// # Ok::<(), compensator::budget::BudgetError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct AxisBudget {
    contributions: Vec<Contribution>,
    positions: Vec<Metres>,
}

/// A place as its neighbours see it.
struct Place {
    position: Metres,
    /// The position before it, and the share of the one after that.
    before: usize,
    share: f64,
}

impl Place {
    /// How much the calibrated position `index` has to say here.
    fn weight(&self, index: usize) -> f64 {
        match index {
            it if it == self.before => 1.0 - self.share,
            it if it == self.before + 1 => self.share,
            _ => 0.0,
        }
    }

    /// 0 at a calibrated position, 1 half-way between two: the error of a straight line instead of
    /// a parabola.
    fn between(&self) -> f64 {
        4.0 * self.share * (1.0 - self.share)
    }
}

impl AxisBudget {
    /// Checks `contributions` and the calibrated `positions`, distances from the datum.
    ///
    /// # Errors
    /// When a value, a sensitivity or degrees of freedom can be none, or the positions do not
    /// increase.
    pub fn new(
        contributions: Vec<Contribution>,
        positions: Vec<Metres>,
    ) -> Result<Self, BudgetError> {
        contributions.iter().try_for_each(Contribution::check)?;
        let increases = |it: &[Metres]| it[1] > it[0];
        if positions.len() < 2 || !positions.windows(2).all(increases) {
            return Err(BudgetError::Positions);
        }
        Ok(Self {
            contributions,
            positions,
        })
    }

    /// The contributions, in the order given.
    pub fn contributions(&self) -> &[Contribution] {
        &self.contributions
    }

    /// The calibrated positions.
    pub fn positions(&self) -> &[Metres] {
        &self.positions
    }

    /// What the contributions come to at `position` reached from `approach`; `None` beyond the
    /// calibrated positions.
    ///
    /// Between two positions the scatter of both counts by their distance, as for a straight line.
    pub fn at(&self, position: Metres, approach: Approach) -> Option<Combined> {
        let shares = self.shares(position, approach)?.into_iter();
        Some(combine_shares(
            shares.map(|(it, share)| (share, it.degrees_of_freedom)),
        ))
    }

    /// What each contribution that concerns `approach` comes to at `position`; `None` beyond the
    /// calibrated positions.
    pub fn shares(
        &self,
        position: Metres,
        approach: Approach,
    ) -> Option<Vec<(&Contribution, Metres)>> {
        let place = self.place(position)?;
        let own = self.contributions.iter().filter(|it| it.concerns(approach));
        let share = |it| (it, Metres(self.product(it, &place, &place, true).sqrt()));
        Some(own.map(share).collect())
    }

    /// The covariance of two places in m², each with its approach; `None` beyond the calibrated
    /// positions.
    pub fn covariance(&self, one: (Metres, Approach), other: (Metres, Approach)) -> Option<f64> {
        let places = (self.place(one.0)?, self.place(other.0)?);
        let same = one.1 == other.1;
        let both = |it: &&Contribution| it.concerns(one.1) && it.concerns(other.1);
        let products = self.contributions.iter().filter(both);
        Some(
            products
                .map(|it| self.product(it, &places.0, &places.1, same))
                .sum(),
        )
    }

    /// What one contribution does at both of two places, in m².
    fn product(&self, it: &Contribution, one: &Place, other: &Place, same_approach: bool) -> f64 {
        let own = it.value * it.sensitivity;
        let factor = match it.correlation {
            Correlation::CommonOffset | Correlation::SharedReadings => 1.0,
            Correlation::CommonScale => one.position.value() * other.position.value(),
            Correlation::Independent if !same_approach => 0.0,
            Correlation::Independent => [one.before, one.before + 1]
                .into_iter()
                .map(|index| one.weight(index) * other.weight(index))
                .sum(),
            // Both approaches follow the same curve.
            Correlation::BetweenPositions if one.before != other.before => 0.0,
            Correlation::BetweenPositions => one.between() * other.between(),
        };
        own * own * factor
    }

    fn place(&self, position: Metres) -> Option<Place> {
        let (first, last) = (self.positions[0], *self.positions.last()?);
        // A comparison with NaN is false.
        if !(position >= first && position <= last) {
            return None;
        }
        let after = self.positions.partition_point(|it| *it < position).max(1);
        let (low, high) = (self.positions[after - 1], self.positions[after]);
        let share = (position - low).value() / (high - low).value();
        Some(Place {
            position,
            before: after - 1,
            share,
        })
    }
}
