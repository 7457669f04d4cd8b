//! The budget of results at several places, where each input acts otherwise at each of them.

use units::Quantity;

use super::{BudgetError, Combined, Contribution, combine_shares};

/// What contributes to results at several places, with a sensitivity of its own at each.
///
/// # Example
///
/// ```
/// use compensator::budget::{Contribution, Correlation, Evaluation, PlacesBudget};
/// use units::Metres;
///
/// let line = |value: f64, degrees_of_freedom| Contribution {
///     name: "input".into(),
///     evaluation: Evaluation::A,
///     value,
///     unit: "m".into(),
///     sensitivity: 1.0,
///     degrees_of_freedom,
///     correlation: Correlation::SharedReadings,
///     approach: None,
/// };
/// let lines = vec![line(30e-9, Some(10.0)), line(40e-9, None)];
/// let budget = PlacesBudget::<Metres>::new(lines, vec![vec![1.0, 0.0], vec![1.0, 1.0]])?;
/// assert_eq!(budget.least_certain(), 1);
/// assert!((budget.at(1).expanded().nm() - 100.0).abs() < 1e-9, "2 · (30 nm and 40 nm)");
/// assert_eq!(budget.contributions()[1].sensitivity, 1.0, "where that is largest");
/// # Ok::<(), compensator::budget::BudgetError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct PlacesBudget<Q> {
    contributions: Vec<Contribution>,
    sensitivities: Vec<Vec<f64>>,
    combined: Vec<Combined<Q>>,
}

impl<Q: Quantity> PlacesBudget<Q> {
    /// Of `contributions` with their `sensitivities` at each place, in SI units of the result per unit of
    /// the input; the sensitivity that a contribution states becomes that at the least certain place.
    ///
    /// # Errors
    /// When a value, a sensitivity or degrees of freedom can be none, there is no place, or one has another
    /// number of sensitivities than there are contributions.
    pub fn new(
        contributions: Vec<Contribution>,
        sensitivities: Vec<Vec<f64>>,
    ) -> Result<Self, BudgetError> {
        let as_many = |it: &Vec<f64>| it.len() == contributions.len();
        if sensitivities.is_empty() || !sensitivities.iter().all(as_many) {
            return Err(BudgetError::Sensitivities);
        }
        let mut budget = Self {
            combined: Vec::new(),
            contributions,
            sensitivities,
        };
        for place in 0..budget.sensitivities.len() {
            let lines = budget.lines(place);
            lines.iter().try_for_each(Contribution::check)?;
            let shares = lines.iter().map(|it| {
                let own = (it.value * it.sensitivity).abs();
                (Q::from_value(own), it.degrees_of_freedom)
            });
            budget.combined.push(combine_shares(shares));
        }
        budget.contributions = budget.lines(budget.least_certain());
        Ok(budget)
    }

    /// The contributions, in the order given, with their sensitivities at the least certain place.
    pub fn contributions(&self) -> &[Contribution] {
        &self.contributions
    }

    /// By place, the sensitivities in the order of the contributions.
    pub fn sensitivities(&self) -> &[Vec<f64>] {
        &self.sensitivities
    }

    /// What the contributions come to at the place of this number, counted from 0.
    pub fn at(&self, place: usize) -> Combined<Q> {
        self.combined[place]
    }

    /// The number of the place with the largest uncertainty; of several the first.
    pub fn least_certain(&self) -> usize {
        let u = |at: usize| self.combined[at].standard_uncertainty.value();
        (0..self.combined.len()).fold(0, |most, at| if u(at) > u(most) { at } else { most })
    }

    fn lines(&self, place: usize) -> Vec<Contribution> {
        let own = self.contributions.iter().zip(&self.sensitivities[place]);
        own.map(|(it, sensitivity)| Contribution {
            sensitivity: *sensitivity,
            ..it.clone()
        })
        .collect()
    }
}
