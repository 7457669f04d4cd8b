//! How often the truth lies within a stated uncertainty.

use core::fmt;
use core::ops::RangeInclusive;

/// What the share within 2u is to be where an uncertainty is stated rightly.
const SHARE: RangeInclusive<f64> = 0.93..=0.975;
/// The same of the mean square.
const MEAN_SQUARE: RangeInclusive<f64> = 0.9..=1.15;

/// Errors, each divided by the standard uncertainty stated for it.
#[derive(Clone, Debug, Default)]
pub struct Coverage(Vec<f64>);

impl Coverage {
    /// Of such quotients.
    pub const fn new(by_stated: Vec<f64>) -> Self {
        Self(by_stated)
    }

    /// How many there are.
    pub const fn count(&self) -> usize {
        self.0.len()
    }

    /// How many lie within twice what is stated.
    pub fn within(&self) -> usize {
        self.0.iter().filter(|it| it.abs() <= 2.0).count()
    }

    /// Which share of them does.
    pub fn share(&self) -> f64 {
        self.within() as f64 / self.count() as f64
    }

    /// Their mean square: 1 where exactly the right uncertainty is stated.
    pub fn mean_square(&self) -> f64 {
        self.0.iter().map(|it| it * it).sum::<f64>() / self.count() as f64
    }

    /// Share and mean square are as wanted, give or take three standard deviations of what is counted.
    ///
    /// # Panics
    /// When they are not.
    #[track_caller]
    pub fn judge(&self) {
        self.judge_as(self.count() as f64);
    }

    /// The same where the quotients depend on each other, and count as so many that do not.
    ///
    /// # Panics
    /// When they are not as wanted.
    #[track_caller]
    pub fn judge_as(&self, independent: f64) {
        self.judge_share(independent);
        let chance = 3.0 * (2.0 / independent).sqrt();
        let mean_square = self.mean_square();
        let is_right = mean_square >= MEAN_SQUARE.start() - chance
            && mean_square <= MEAN_SQUARE.end() + chance;
        assert!(is_right, "{self}");
    }

    /// The share alone: the mean square of a Student's t with few degrees of freedom settles at nothing.
    ///
    /// # Panics
    /// When it is not as wanted.
    #[track_caller]
    pub fn judge_share(&self, independent: f64) {
        let share = self.share();
        let most = SHARE.end() + chance_of_share(independent);
        assert!(share <= most, "{self}: more is stated than there is");
        self.judge_enough(independent);
    }

    /// As much as is so is stated, or more.
    ///
    /// # Panics
    /// When it is less.
    #[track_caller]
    pub fn judge_enough(&self, independent: f64) {
        let least = SHARE.start() - chance_of_share(independent);
        assert!(self.share() >= least, "{self}");
    }
}

/// Three standard deviations of a share of 0.95 among so many.
fn chance_of_share(independent: f64) -> f64 {
    3.0 * (0.05 * 0.95 / independent).sqrt()
}

impl fmt::Display for Coverage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (count, share, mean_square) = (self.count(), self.share(), self.mean_square());
        write!(
            f,
            "{count}: {share:.3} within 2u, mean square {mean_square:.3}"
        )
    }
}

impl FromIterator<f64> for Coverage {
    fn from_iter<T: IntoIterator<Item = f64>>(iter: T) -> Self {
        Self(iter.into_iter().collect())
    }
}
