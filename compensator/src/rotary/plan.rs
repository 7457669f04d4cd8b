//! Plate offsets that amplify noise least, before anyone turns a plate.
//!
//! Exchange descent: from a set of starting offsets (golden section, a Sidon sequence, shuffled
//! ones) one offset at a time is moved where the criterion is best, until no move helps; the best
//! of all ends is taken. The same call always gives the same offsets. Offsets may be shifted
//! together, mirrored, or multiplied by a number prime to N, and amplify noise the same, at other
//! harmonics in the last case; which of those comes out is chance.

use core::cell::Cell;
use core::f64::consts::TAU;
use units::portable::sin_cos;

use super::design::{Design, DesignError};

/// Harmonics of candidates a search may look at; well under a second.
const WORK_MAX: u64 = 80_000_000;

/// Sweeps over all offsets from one start; a descent seldom needs more than five.
const SWEEPS_MAX: usize = 8;

/// Starts tried where the work allows it; more have never found better ones for small plates.
const STARTS_MAX: usize = 150;

/// Information below it is rounding: the harmonic is unobservable.
const INFORMATION_MIN: f64 = 1e-9;

/// What good offsets keep small.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Criterion {
    /// The amplification of the worst harmonic; among equals the rms.
    Worst,
    /// The rms amplification: the standard uncertainty of a table error.
    Rms,
}

/// Why no offsets can be chosen.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PlanError {
    /// More placements than lines, or fewer than two.
    #[error("{placements} placement(s) of a plate with {lines} lines; 2 to {lines} are possible")]
    Placements {
        /// How many were wanted.
        placements: usize,
        /// The lines of the plate.
        lines: usize,
    },
    /// A plate that is none, or larger than is planned for.
    #[error("a plate with {seen} lines; offsets can be planned for 2 to {max} lines")]
    Lines {
        /// Its lines.
        seen: usize,
        /// The most allowed.
        max: usize,
    },
    /// The offsets found are of no use.
    #[error(transparent)]
    Design(#[from] DesignError),
}

/// More lines than any plate has.
const LINES_MAX: usize = 100_000;

/// The best offsets found for `placements` placements of a plate with `lines` lines; the first is
/// 0, and they increase.
///
/// # Errors
/// When there cannot be so many placements.
///
/// # Example
///
/// ```
/// use compensator::rotary::{Criterion, plan};
///
/// // 7 lines have a perfect difference set of 3: every harmonic is amplified alike.
/// let design = plan(7, 3, Criterion::Worst)?;
/// let best = 1.0 / (3.0_f64 - 2.0 / 3.0).sqrt();
/// assert!((design.worst().1 - best).abs() < 1e-9);
/// assert!((design.amplification(1) - best).abs() < 1e-9);
/// # Ok::<(), compensator::rotary::PlanError>(())
/// ```
pub fn plan(lines: usize, placements: usize, criterion: Criterion) -> Result<Design, PlanError> {
    if !(2..=LINES_MAX).contains(&lines) {
        return Err(PlanError::Lines {
            seen: lines,
            max: LINES_MAX,
        });
    }
    if !(2..=lines).contains(&placements) {
        return Err(PlanError::Placements { placements, lines });
    }
    let offsets = if placements == 2 {
        // Every pair an amount apart that is prime to N is as good; this one is the patent's.
        vec![0, 1]
    } else if placements == lines {
        (0..lines).collect()
    } else {
        Search::new(lines, placements, criterion).best()
    };
    Ok(Design::new(lines, &offsets, f64::INFINITY)?)
}

/// Smaller is better.
#[derive(Clone, Copy, PartialEq, PartialOrd)]
struct Score(f64, f64);

const WORTHLESS: Score = Score(f64::INFINITY, f64::INFINITY);

struct Search {
    lines: usize,
    placements: usize,
    criterion: Criterion,
    harmonics: usize,
    /// cos and sin of 2πm/N.
    turn: Vec<(f64, f64)>,
    /// Offsets tried for each place in a sweep.
    candidates: usize,
    work: Cell<u64>,
}

/// All offsets but one: what that one adds to.
struct Rest {
    /// Σ w over the others for k = 1 … N/2.
    sums: Vec<(f64, f64)>,
    /// Harmonics, those first that the others know least about.
    hardest: Vec<u32>,
}

impl Search {
    fn new(lines: usize, placements: usize, criterion: Criterion) -> Self {
        let harmonics = lines / 2;
        // So that one descent of a few sweeps is possible whatever the plate.
        let descent = placements * harmonics * SWEEPS_MAX / 2;
        let share = match criterion {
            // Most candidates are passed over after a few harmonics.
            Criterion::Worst => 16,
            Criterion::Rms => 1,
        };
        let candidates = (share * WORK_MAX as usize / descent).clamp(16.min(lines), lines);
        let turn = (0..lines)
            .map(|m| sin_cos(TAU * m as f64 / lines as f64))
            .map(|(sin, cos)| (cos, sin))
            .collect();
        Self {
            lines,
            placements,
            criterion,
            harmonics,
            turn,
            candidates,
            work: Cell::new(0),
        }
    }

    fn best(&self) -> Vec<usize> {
        let mut best = (WORTHLESS, Vec::new());
        for start in 0..STARTS_MAX {
            if self.work.get() > WORK_MAX && start > 1 {
                break;
            }
            let found = self.descend(self.start(start));
            if found.0 < best.0 || best.1.is_empty() {
                best = found;
            }
        }
        let mut offsets = best.1;
        offsets.sort_unstable();
        offsets
    }

    /// Different offsets, the first of them 0.
    fn start(&self, number: usize) -> Vec<usize> {
        let golden = (5.0_f64.sqrt() - 1.0) / 2.0;
        let mut shuffle = Shuffle(number as u64);
        let mut sidon = sidon_sequence();
        let mut offsets = vec![0];
        let mut used = vec![false; self.lines];
        used[0] = true;
        for at in 1..self.placements {
            let wanted = match number {
                0 => ((at as f64 * golden).fract() * self.lines as f64) as usize,
                1 => sidon.next().unwrap_or(at),
                _ => shuffle.below(self.lines),
            };
            // The next free one: there are more lines than placements.
            let free = (0..self.lines).map(|step| (wanted + step) % self.lines);
            let offset = free.into_iter().find(|it| !used[*it]).unwrap_or(at);
            used[offset] = true;
            offsets.push(offset);
        }
        offsets
    }

    fn descend(&self, mut offsets: Vec<usize>) -> (Score, Vec<usize>) {
        let mut score = WORTHLESS;
        for sweep in 0..SWEEPS_MAX {
            let before = score;
            for place in 1..self.placements {
                let rest = self.rest(&offsets, place);
                score = self.score(&rest, offsets[place], WORTHLESS);
                for candidate in 0..self.candidates {
                    // All of them where the work allows, else others in every sweep.
                    let turned = candidate * self.lines / self.candidates + sweep + place;
                    let offset = turned % self.lines;
                    if offsets.contains(&offset) {
                        continue;
                    }
                    let seen = self.score(&rest, offset, score);
                    if seen < score {
                        (score, offsets[place]) = (seen, offset);
                    }
                }
            }
            if score == before {
                break;
            }
        }
        (score, offsets)
    }

    fn rest(&self, offsets: &[usize], without: usize) -> Rest {
        let mut sums = vec![(0.0, 0.0); self.harmonics];
        for (place, offset) in offsets.iter().enumerate() {
            if place == without {
                continue;
            }
            let mut at = 0;
            for sum in &mut sums {
                at = self.next(at, *offset);
                sum.0 += self.turn[at].0;
                sum.1 += self.turn[at].1;
            }
        }
        let square = |k: &u32| {
            let (re, im) = sums[*k as usize - 1];
            re * re + im * im
        };
        let mut hardest: Vec<u32> = (1..=self.harmonics as u32).collect();
        hardest.sort_by(|a, b| square(b).total_cmp(&square(a)));
        Rest { sums, hardest }
    }

    fn next(&self, at: usize, offset: usize) -> usize {
        let next = at + offset;
        if next >= self.lines {
            next - self.lines
        } else {
            next
        }
    }

    /// Σ |w_j − w̄|² = P − |Σ w_j|²/P.
    fn information(&self, sum: (f64, f64), turn: (f64, f64)) -> f64 {
        let count = self.placements as f64;
        let (re, im) = (sum.0 + turn.0, sum.1 + turn.1);
        count - (re * re + im * im) / count
    }

    /// The score of `offset` beside the others; anything not below `bound` when it is not.
    fn score(&self, rest: &Rest, offset: usize, bound: Score) -> Score {
        match self.criterion {
            Criterion::Rms => {
                let inverse = self.inverse(rest, offset, bound.0);
                Score(inverse, 0.0)
            }
            Criterion::Worst => {
                let worst = self.worst(rest, offset, bound.0);
                if worst > bound.0 {
                    return WORTHLESS;
                }
                let bound = if worst < bound.0 {
                    f64::INFINITY
                } else {
                    bound.1
                };
                Score(worst, self.inverse(rest, offset, bound))
            }
        }
    }

    /// 1/information of the worst harmonic; more than `bound` when it is above that.
    fn worst(&self, rest: &Rest, offset: usize, bound: f64) -> f64 {
        let least = (1.0 / bound) * (1.0 - 1e-6);
        let mut lowest = f64::INFINITY;
        for (seen, &harmonic) in rest.hardest.iter().enumerate() {
            let at = harmonic as usize * offset % self.lines;
            let sum = rest.sums[harmonic as usize - 1];
            lowest = lowest.min(self.information(sum, self.turn[at]));
            if lowest < least.max(INFORMATION_MIN) {
                self.work.set(self.work.get() + 4 * seen as u64 + 4);
                return f64::INFINITY;
            }
        }
        self.work.set(self.work.get() + 4 * self.harmonics as u64);
        // Equals must not differ by rounding, or the rms would never decide.
        (1e9 / lowest).round() / 1e9
    }

    /// Σ 1/information over all harmonics; infinite or more than `bound` when it is above that.
    fn inverse(&self, rest: &Rest, offset: usize, bound: f64) -> f64 {
        let mut total = 0.0;
        // Half of an even N stands once in the spectrum, all others twice.
        if self.lines.is_multiple_of(2) {
            let (last, turn) = (rest.sums[self.harmonics - 1], self.harmonics * offset);
            let information = self.information(last, self.turn[turn % self.lines]);
            total -= 0.5 / information.max(INFORMATION_MIN);
        }
        let mut at = 0;
        for sums in rest.sums.chunks(256) {
            self.work.set(self.work.get() + sums.len() as u64);
            for sum in sums {
                at = self.next(at, offset);
                let information = self.information(*sum, self.turn[at]);
                total += 1.0 / information.max(INFORMATION_MIN);
            }
            if total >= bound {
                return f64::INFINITY;
            }
        }
        if total < 0.5 / INFORMATION_MIN {
            total
        } else {
            f64::INFINITY
        }
    }
}

/// Numbers of which no two pairs have the same difference, each the least possible (A. M. Mian
/// and S. Chowla, Proc. Natl. Acad. Sci. India A14, 1944); the first, 0, left out.
fn sidon_sequence() -> impl Iterator<Item = usize> {
    let mut members = vec![0_usize];
    let mut differences = std::collections::BTreeSet::new();
    core::iter::from_fn(move || {
        let last = *members.last()?;
        let fits = |it: &usize| {
            members
                .iter()
                .all(|member| !differences.contains(&(it - member)))
        };
        let next = (last + 1..).find(fits)?;
        differences.extend(members.iter().map(|member| next - member));
        members.push(next);
        Some(next)
    })
}

/// Numbers in no order, always the same (Knuth's MMIX multiplier).
struct Shuffle(u64);

impl Shuffle {
    fn below(&mut self, limit: usize) -> usize {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 33) as usize) % limit
    }
}

#[cfg(test)]
#[path = "plan_tests.rs"]
mod tests;
