//! What a set of plate offsets can tell: the information each harmonic gets, before any reading.

use core::f64::consts::PI;
use units::portable::{sin, sin_cos};

/// Information below it is rounding of none; two placements one line apart of 100 000 have 2e-9.
pub(super) const INFORMATION_MIN: f64 = 1e-12;

/// Why offsets cannot part the table from the plate.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum DesignError {
    /// A plate without a spacing.
    #[error("a plate with {seen} line(s); at least 2 are needed")]
    Lines {
        /// Its lines.
        seen: usize,
    },
    /// Fewer than two placements.
    #[error(
        "{seen} placement(s) of the plate; at least 2 are needed to separate the errors of table \
         and plate"
    )]
    Placements {
        /// How many.
        seen: usize,
    },
    /// An offset that repeats or is a whole turn or more.
    #[error("plate offset {offset} is repeated or is not one of 0 to {}", lines - 1)]
    Offset {
        /// The offset.
        offset: usize,
        /// The lines of the plate.
        lines: usize,
    },
    /// All offsets differ by multiples of a number that divides the number of lines.
    #[error(
        "plate offsets {offsets:?} differ by multiples of {step} only, which divides the {lines} \
         lines: harmonic {harmonic} and its multiples look the same in every placement and cannot \
         be distinguished from errors of the plate; choose another offset (`truestage plan \
         rotary`)"
    )]
    Unobservable {
        /// The offsets.
        offsets: Vec<usize>,
        /// Their common step.
        step: usize,
        /// The lines of the plate.
        lines: usize,
        /// The lowest harmonic lost.
        harmonic: usize,
    },
    /// A harmonic that can be told from the plate, but hardly.
    #[error(
        "plate offsets {offsets:?}: the noise of harmonic {harmonic} is amplified {seen:.1} times, \
         the limit is {limit:.1}; choose other offsets (`truestage plan rotary`)"
    )]
    Amplified {
        /// The offsets.
        offsets: Vec<usize>,
        /// The worst harmonic.
        harmonic: usize,
        /// Its amplification.
        seen: f64,
        /// The largest allowed.
        limit: f64,
    },
}

/// A plate's lines and the offsets it is placed at, with what they make of noise.
///
/// *Amplification of harmonic k*: the standard deviation of its coefficient in the table error, in
/// units of that of the same coefficient in the readings of one placement. *rms amplification*:
/// the standard uncertainty of one table error in units of that of one reading.
///
/// # Example
///
/// ```
/// use compensator::rotary::{Design, DesignError};
///
/// let pair = Design::new(360, &[0, 1], f64::INFINITY)?;
/// let (harmonic, amplification) = pair.worst();
/// assert_eq!(harmonic, 1, "the patent's pair is worst for slow errors");
/// assert!((amplification - 81.03).abs() < 0.01);
/// let opposite = Design::new(360, &[0, 180], f64::INFINITY);
/// assert!(matches!(opposite, Err(DesignError::Unobservable { harmonic: 2, .. })));
/// # Ok::<(), DesignError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Design {
    lines: usize,
    offsets: Vec<usize>,
    /// Σ_j |w_j − w̄|² for k = 0 … N/2, the eigenvalues of the normal equations; 0 for k = 0.
    information: Vec<f64>,
}

impl Design {
    /// Judges `offsets` of a plate with `lines` lines, refusing harmonics whose noise would be
    /// amplified more than `amplification_max` times (infinity: refuse only what is invisible).
    ///
    /// # Errors
    /// When there are too few, one repeats or is out of range, or a harmonic is unobservable.
    pub fn new(
        lines: usize,
        offsets: &[usize],
        amplification_max: f64,
    ) -> Result<Self, DesignError> {
        check_offsets(lines, offsets)?;
        let apart = offsets.iter().map(|offset| offset.abs_diff(offsets[0]));
        let step = apart.fold(lines, gcd);
        if step > 1 {
            return Err(DesignError::Unobservable {
                offsets: offsets.to_vec(),
                step,
                lines,
                harmonic: lines / step,
            });
        }
        let design = Self::of_any(lines, offsets);
        let (harmonic, seen) = design.worst();
        // Written so that a NaN limit refuses.
        if seen <= amplification_max {
            Ok(design)
        } else {
            Err(DesignError::Amplified {
                offsets: offsets.to_vec(),
                harmonic,
                seen,
                limit: amplification_max,
            })
        }
    }

    /// The same for offsets below `lines` that may repeat and may leave harmonics unobservable,
    /// whose information is zero.
    pub(super) fn of_any(lines: usize, offsets: &[usize]) -> Self {
        Self {
            lines,
            offsets: offsets.to_vec(),
            information: information(lines, offsets),
        }
    }

    /// The lines of the plate.
    pub fn lines(&self) -> usize {
        self.lines
    }

    /// The offsets, in the order given.
    pub fn offsets(&self) -> &[usize] {
        &self.offsets
    }

    /// The highest harmonic that `lines` readings a turn can tell, half their number.
    pub fn harmonics(&self) -> usize {
        self.lines / 2
    }

    /// The amplification of the noise of `harmonic`, 1 to [`Self::harmonics`].
    ///
    /// # Panics
    /// When there is no such harmonic.
    pub fn amplification(&self, harmonic: usize) -> f64 {
        assert!(harmonic > 0, "harmonic 0 is the zero of the scale");
        1.0 / self.information[harmonic].sqrt()
    }

    /// The harmonic whose noise is amplified most, and its amplification.
    pub fn worst(&self) -> (usize, f64) {
        let harmonics = 1..=self.harmonics();
        let least = harmonics.min_by(|a, b| self.information[*a].total_cmp(&self.information[*b]));
        let harmonic = least.expect("two lines have a harmonic");
        (harmonic, self.amplification(harmonic))
    }

    /// The standard uncertainty of one table error in units of that of one reading.
    pub fn rms_amplification(&self) -> f64 {
        let inverse = (1..=self.harmonics()).map(|k| self.weight(k) / self.information[k]);
        (inverse.sum::<f64>() / self.lines as f64).sqrt()
    }

    /// How often harmonic k stands in a full spectrum: with its negative, except half of an even N.
    fn weight(&self, harmonic: usize) -> f64 {
        if 2 * harmonic == self.lines { 1.0 } else { 2.0 }
    }

    /// How many terms of a full spectrum the offsets leave with the plate.
    pub(super) fn unseen(&self) -> usize {
        let unseen = (1..=self.harmonics()).filter(|k| self.information[*k] <= INFORMATION_MIN);
        unseen.map(|k| self.weight(k) as usize).sum()
    }

    pub(super) fn information(&self) -> &[f64] {
        &self.information
    }
}

/// Up to which harmonic (periods in a turn) readings at `lines` equally spaced places tell a table
/// error between these places, too: ⌊(N − 1)/2⌋, Nyquist's limit. Of an even number of lines
/// harmonic N/2 shows only its cosine. A harmonic m above the limit looks at the lines like harmonic
/// |m − jN| below it, with the whole number j that makes it so; no placement of the plate parts the
/// two.
///
/// # Example
///
/// ```
/// use compensator::rotary::harmonic_max;
///
/// assert_eq!((harmonic_max(360), harmonic_max(37)), (179, 18));
/// ```
pub const fn harmonic_max(lines: usize) -> usize {
    lines.saturating_sub(1) / 2
}

/// rms amplification of two placements that differ by one line: √((N² − 1)/(6N)).
///
/// # Example
///
/// ```
/// use compensator::rotary::rms_amplification_of_a_pair;
///
/// assert!((rms_amplification_of_a_pair(360) - 7.7459).abs() < 1e-4);
/// ```
pub fn rms_amplification_of_a_pair(lines: usize) -> f64 {
    let n = lines as f64;
    ((n * n - 1.0) / (6.0 * n)).sqrt()
}

/// rms amplification of a placement at every line: √(N − 1)/N.
///
/// # Example
///
/// ```
/// use compensator::rotary::rms_amplification_of_all;
///
/// assert!((rms_amplification_of_all(360) - 0.0526).abs() < 1e-4);
/// ```
pub fn rms_amplification_of_all(lines: usize) -> f64 {
    let n = lines as f64;
    (n - 1.0).sqrt() / n
}

fn check_offsets(lines: usize, offsets: &[usize]) -> Result<(), DesignError> {
    if lines < 2 {
        return Err(DesignError::Lines { seen: lines });
    }
    if offsets.len() < 2 {
        let seen = offsets.len();
        return Err(DesignError::Placements { seen });
    }
    let mut used = vec![false; lines];
    for &offset in offsets {
        if offset >= lines || used[offset] {
            return Err(DesignError::Offset { offset, lines });
        }
        used[offset] = true;
    }
    Ok(())
}

pub(crate) fn gcd(a: usize, b: usize) -> usize {
    if b == 0 { a } else { gcd(b, a % b) }
}

/// Σ_j |w_j − w̄|² for k = 0 … N/2.
fn information(lines: usize, offsets: &[usize]) -> Vec<f64> {
    let count = offsets.len() as f64;
    let turn = turn(lines);
    let mut sums = vec![(0.0, 0.0); lines / 2 + 1];
    for &offset in offsets {
        let mut at = 0;
        for sum in &mut sums[1..] {
            at += offset;
            if at >= lines {
                at -= lines;
            }
            sum.0 += turn[at].0;
            sum.1 += turn[at].1;
        }
    }
    let of = |(harmonic, (re, im)): (usize, &(f64, f64))| {
        let information = count - (re * re + im * im) / count;
        if information > 0.1 * count {
            information
        } else {
            by_pairs(lines, offsets, harmonic)
        }
    };
    let mut information: Vec<f64> = sums.iter().enumerate().map(of).collect();
    information[0] = 0.0;
    information
}

/// cos and sin of 2πm/N; the second half of the circle mirrors the first.
pub(super) fn turn(lines: usize) -> Vec<(f64, f64)> {
    let mut turn = vec![(1.0, 0.0); lines];
    for m in 1..=lines / 2 {
        let (sin, cos) = sin_cos(2.0 * PI * m as f64 / lines as f64);
        turn[m] = (cos, sin);
        turn[lines - m] = (cos, -sin);
    }
    turn
}

/// The same as (4/P) Σ_{i<j} sin²(πk(s_i − s_j)/N): without cancellation, so that it keeps all
/// its digits for slow harmonics and near offsets, where it is smallest.
fn by_pairs(lines: usize, offsets: &[usize], harmonic: usize) -> f64 {
    let mut sum = 0.0;
    for (at, a) in offsets.iter().enumerate() {
        for b in &offsets[..at] {
            let apart = a.abs_diff(*b) * harmonic % lines;
            // sin(π − x) = sin(x), and the smaller argument is the more exact one.
            let sine = sin(PI * apart.min(lines - apart) as f64 / lines as f64);
            sum += sine * sine;
        }
    }
    4.0 * sum / offsets.len() as f64
}

#[cfg(test)]
#[path = "design_tests.rs"]
mod tests;
