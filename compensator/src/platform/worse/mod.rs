//! Which mistake in the calibrations of a platform explains that they make it worse.
//!
//! A platform has parts that have nothing in common: x and y, the angle, and the strokes of its screws. Each is judged
//! by itself: in its own unit, about its own mean, and only where it is farther off than it may be. Of each pose two
//! things are known of a part: what the calibrations say that it would be off by without them, and what it would have
//! been, which is what was seen and what they took away. Right ones say what was.
//!
//! | symbol | meaning |
//! |---|---|
//! | sᵢ | what is said of a part at pose i, less its mean |
//! | wᵢ | what was, less its mean |
//! | g = Σ sᵢwᵢ / Σ sᵢ² | by which factor what was follows what is said: 1 when it is right |
//! | r = Σ sᵢwᵢ / √(Σ sᵢ² Σ wᵢ²) | how closely |
//!
//! What was follows what is said when |r| is [`ALIKE`] at least and noise would correlate as well with a chance of
//! [`CHANCE`] at most (the t test of a correlation: r²(n − 2)/(1 − r²) is distributed as F with 1 and n − 2 degrees of
//! freedom). A mistake is then told by the factor:
//!
//! | factor | mistake |
//! |---|---|
//! | −1 | the sign |
//! | ±1 of one part by another one, and the other way round, closer than by itself | both are exchanged |
//! | 25.4, 1000 and their inverses | a unit: inches and millimetres, millimetres and micrometres |
//! | anything else but 1 | a scale |
//!
//! What was has nothing to do with what is said where there is no mistake of this kind, so that of figures which are
//! noise fewer than one set in a thousand is taken for a mistake, however large it is: the tests count 1 of 20 000. A factor
//! that noise could make of 1 is no scale.
//!
//! Absent: two mistakes in one part, and errors of the arrangement.

#[cfg(test)]
mod tests;

use crate::significance::f_tail;
use crate::uncertainty::mean;

/// So closely what was follows what is said, at least.
pub const ALIKE: f64 = 0.9;
/// The chance that noise does, at most, for each part.
pub const CHANCE: f64 = 1e-4;
/// With fewer poses nothing can be told: noise correlates, too.
pub const POSES_MIN: usize = 5;
/// A factor of ±1 is no farther from it, as a quotient.
const ONCE: f64 = 1.4;
/// Likewise that of a unit: it is exact, and only noise moves it.
const EXACT: f64 = 1.3;

/// What parts are measured in: those that differ in it are never exchanged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dimension {
    /// Metres.
    Length,
    /// Radians.
    Angle,
}

/// A coordinate of a platform, or one of its screws, at every pose of a verification.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// What it is measured in.
    pub dimension: Dimension,
    /// How far off it may be, metres or radians.
    pub tolerance: f64,
    /// What the calibrations say that it would be off by without them, at each pose.
    pub said: Vec<f64>,
    /// What it would have been off by, at each pose.
    pub was: Vec<f64>,
}

/// What explains that a calibration makes things worse. Parts are counted from 0, in the order given.
#[derive(Clone, Debug, PartialEq)]
pub enum Mistake {
    /// A part has the wrong sign.
    Sign {
        /// Which.
        part: usize,
    },
    /// Of each of two parts the other one's is said.
    Exchanged {
        /// Which.
        parts: [usize; 2],
        /// Whether what is said of the second has the first one's sign changed, and of the first the second one's.
        turned: [bool; 2],
    },
    /// Parts are in another unit, or of another scale.
    Scale {
        /// Which.
        parts: Vec<usize>,
        /// What was, over what is said.
        factor: f64,
        /// What is likely taken for what, where the factor is one of units.
        unit: Option<Unit>,
    },
}

/// Which unit was taken for which.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unit {
    /// Inches were taken for millimetres: what is said is too small.
    InchesForMillimetres,
    /// Millimetres were taken for inches.
    MillimetresForInches,
    /// Millimetres were taken for micrometres.
    MillimetresForMicrometres,
    /// Micrometres were taken for millimetres.
    MicrometresForMillimetres,
}

impl Unit {
    fn of(factor: f64) -> Option<Self> {
        let known = [
            (25.4, Self::InchesForMillimetres),
            (1.0 / 25.4, Self::MillimetresForInches),
            (1e3, Self::MillimetresForMicrometres),
            (1e-3, Self::MicrometresForMillimetres),
        ];
        let it = known.into_iter().find(|it| is_about(factor, it.0, EXACT));
        it.map(|it| it.1)
    }
}

/// Whether two factors of one sign differ by no more than `by`, as a quotient.
fn is_about(factor: f64, wanted: f64, by: f64) -> bool {
    let quotient = factor / wanted;
    (1.0 / by..=by).contains(&quotient)
}

impl Part {
    /// What is left of it at each pose.
    pub fn left(&self) -> impl Iterator<Item = f64> {
        let both = self.said.iter().zip(&self.was);
        both.map(|(said, was)| was - said)
    }

    /// Whether it is farther off than it may be.
    pub fn is_off(&self) -> bool {
        let most = self.left().fold(0.0, |most: f64, it| most.max(it.abs()));
        most > self.tolerance
    }
}

/// How what was of one part follows what is said of the same or another one.
#[derive(Clone, Copy, Debug)]
struct Follows {
    factor: f64,
    correlation: f64,
    /// Whether noise would hardly make a factor of 1 such a one.
    is_not_once: bool,
}

/// `None` where it does not follow.
fn follows(said: &[f64], was: &[f64]) -> Option<Follows> {
    let count = said.len().min(was.len());
    if count < POSES_MIN {
        return None;
    }
    let (said, was) = (&said[..count], &was[..count]);
    let (said_mean, was_mean) = (mean(said)?, mean(was)?);
    let (mut of_said, mut of_was, mut of_both) = (0.0, 0.0, 0.0);
    for (s, w) in said.iter().zip(was) {
        let (s, w) = (s - said_mean, w - was_mean);
        of_said += s * s;
        of_was += w * w;
        of_both += s * w;
    }
    let correlation = of_both / (of_said * of_was).sqrt();
    // A comparison with NaN is false: what has no shape follows nothing.
    let is_alike = correlation.abs() >= ALIKE;
    let squared = correlation * correlation;
    let freedom = count - 2;
    let f = squared * freedom as f64 / (1.0 - squared).max(0.0);
    let is_chance = f_tail(f, 1, freedom) > CHANCE;
    let factor = of_both / of_said;
    // What the factor leaves of what was, as a variance of the factor.
    let variance = (of_was / of_said - factor * factor).max(0.0) / freedom as f64;
    let off = (factor - 1.0) * (factor - 1.0) / variance;
    (is_alike && !is_chance).then_some(Follows {
        factor,
        correlation,
        is_not_once: f_tail(off, 1, freedom) <= CHANCE,
    })
}

/// Which mistakes explain what `parts` say; none where nothing does. Every part has as many poses.
///
/// # Example
///
/// ```
/// use compensator::platform::worse::{Dimension, Mistake, Part, mistakes};
///
/// // Of x the opposite is said of what was.
/// let was: Vec<f64> = (0..9_i32).map(|it| 1e-5 * f64::from(it * it % 7)).collect();
/// let x = Part {
///     dimension: Dimension::Length,
///     tolerance: 1e-6,
///     said: was.iter().map(|it| -it).collect(),
///     was,
/// };
/// assert_eq!(mistakes(&[x]), [Mistake::Sign { part: 0 }]);
/// ```
pub fn mistakes(parts: &[Part]) -> Vec<Mistake> {
    let mut found = Vec::new();
    let mut open: Vec<usize> = (0..parts.len()).filter(|it| parts[*it].is_off()).collect();
    while let Some((at, other, turned)) = exchanged(parts, &open) {
        found.push(Mistake::Exchanged {
            parts: [at, other],
            turned,
        });
        open.retain(|it| *it != at && *it != other);
    }
    let mut scales: Vec<(Vec<usize>, f64)> = Vec::new();
    for part in open {
        let Some(it) = follows(&parts[part].said, &parts[part].was) else {
            continue;
        };
        let factor = it.factor;
        if is_about(factor, -1.0, ONCE) {
            found.push(Mistake::Sign { part });
        } else if !is_about(factor, 1.0, ONCE) && it.is_not_once {
            let alike = scales.iter_mut().find(|it| is_about(factor, it.1, ONCE));
            match alike {
                Some((parts, _)) => parts.push(part),
                None => scales.push((vec![part], factor)),
            }
        }
    }
    found.extend(scales.into_iter().map(|(parts, factor)| Mistake::Scale {
        parts,
        factor,
        unit: Unit::of(factor),
    }));
    found
}

/// The first two of the parts that are `open` which say each other's better than their own.
fn exchanged(parts: &[Part], open: &[usize]) -> Option<(usize, usize, [bool; 2])> {
    let pairs = open.iter().enumerate();
    let mut pairs = pairs.flat_map(|(at, one)| open[at + 1..].iter().map(|it| (*one, *it)));
    pairs.find_map(|(one, other)| {
        let (a, b) = (&parts[one], &parts[other]);
        if a.dimension != b.dimension {
            return None;
        }
        let own = |it: &Part| follows(&it.said, &it.was).map_or(0.0, |it| it.correlation.abs());
        let better = |said: &Part, was: &Part| {
            let it = follows(&said.said, &was.was)?;
            let is_once = is_about(it.factor.abs(), 1.0, ONCE);
            (is_once && it.correlation.abs() > own(was)).then_some(it.factor < 0.0)
        };
        Some((one, other, [better(b, a)?, better(a, b)?]))
    })
}
