//! Whether enough sound readings are left at each position of the table where some were left out.
//!
//! All that is known of the table at a position is what was read there, once in each placement. Were
//! most of these readings bad, the search for outliers may have kept a bad one and left out the
//! sound ones. So the readings that were left out are compared with one another. Those are sound
//! that are more than half of all readings at the position and agree; fewer are, if no others are
//! as many and they agree to within [`SURE`] standard deviations, which bad ones do by chance only.
//! Otherwise nobody can tell, and the position is undetermined.
//!
//! A line of the plate needs no such care: what is kept of it only gives its own error.

use super::outliers::Judge;

/// Up to so many standard deviations from the others a reading agrees with them for sure.
const SURE: f64 = 3.0;

/// A reading that was left out at some position.
#[derive(Clone, Copy, Debug)]
pub(super) struct LeftOut {
    /// Its index: placement · lines + line.
    pub(super) at: usize,
    /// Reading − prediction.
    pub(super) apart: f64,
    /// The variance of that in units of a reading's variance.
    pub(super) variance: f64,
}

/// The readings that were kept at a position, as far as they say something of the table.
#[derive(Clone, Copy, Debug)]
pub(super) struct Kept {
    pub(super) count: usize,
    /// Of how many that were made there.
    pub(super) read: usize,
    /// The largest residual in units of its standard deviation.
    pub(super) apart: f64,
}

/// What is to be made of the readings at a position.
#[derive(Debug, PartialEq)]
pub(super) enum Majority {
    /// Those kept are sound.
    Kept,
    /// These are sound, and those kept are not.
    LeftOut(Vec<usize>),
    /// Nobody can tell.
    Nowhere,
}

/// Judges a position where some readings are `left_out`.
pub(super) fn majority(
    judge: &Judge<'_>,
    scatter: f64,
    kept: Kept,
    left_out: &[LeftOut],
) -> Majority {
    let agree =
        |a: &LeftOut, b: &LeftOut| judge.fits(a.apart - b.apart, a.variance + b.variance, scatter);
    let with = |a: &LeftOut| -> Vec<usize> {
        let own = left_out.iter().filter(|b| a.at == b.at || agree(a, b));
        own.map(|it| it.at).collect()
    };
    let rivals = left_out.iter().map(with).max_by_key(Vec::len);
    let rivals = rivals.unwrap_or_default();
    let sure = kept.count > rivals.len().max(1) && kept.apart <= SURE;
    if 2 * kept.count > kept.read || sure {
        Majority::Kept
    } else if 2 * rivals.len() > kept.read {
        Majority::LeftOut(rivals)
    } else {
        Majority::Nowhere
    }
}
