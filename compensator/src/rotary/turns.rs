//! Which turns of one placement make all readings fit best: a closed form for each turn.
//!
//! With V̂_j(k) the transform of the readings of placement j and w_j = e^(i2πk s_j/N), table and
//! plate leave of harmonic k
//!
//! ```text
//! Σ_j |V̂_j − V̂̄|² − |Σ_j conj(w_j − w̄) V̂_j|² / Σ_j |w_j − w̄|²
//! ```
//!
//! Another turn of one placement changes its w_j, and its V̂_j by a phase where its lines are
//! called otherwise, too. So every turn is judged without solving anything: P·N turns of N/2
//! harmonics.

use realfft::RealFftPlanner;
use realfft::num_complex::Complex;

use super::design::{INFORMATION_MIN, turn as angles};

/// More harmonics are not needed to tell turns apart.
const HARMONICS_MAX: usize = 400;

/// So many of the likeliest turns of a placement are looked at more closely, of each kind.
const KEPT: usize = 6;

/// One placement turned by another number of lines than was entered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Turn {
    pub(super) placement: usize,
    /// What it was turned to.
    pub(super) offset: usize,
    /// Its lines were told apart by where the table found them, so that each was called by so many
    /// lines too high a number.
    shift: usize,
}

impl Turn {
    /// Offsets, readings, and the indices of those missing (increasing), with this turn.
    pub(super) fn applied(
        &self,
        lines: usize,
        offsets: &[usize],
        readings: &[f64],
        missing: &[usize],
    ) -> (Vec<usize>, Vec<f64>, Vec<usize>) {
        let (mut offsets, mut readings) = (offsets.to_vec(), readings.to_vec());
        offsets[self.placement] = self.offset;
        let start = self.placement * lines;
        readings[start..start + lines].rotate_left(self.shift);
        let moved = |at: &usize| match *at {
            at if (start..start + lines).contains(&at) => {
                start + (at - start + lines - self.shift) % lines
            }
            at => at,
        };
        let mut missing: Vec<usize> = missing.iter().map(moved).collect();
        missing.sort_unstable();
        (offsets, readings, missing)
    }
}

impl Turn {
    /// `readings` as they were called before [`Self::applied`].
    pub(super) fn undone(&self, lines: usize, readings: &[f64]) -> Vec<f64> {
        let mut readings = readings.to_vec();
        let start = self.placement * lines;
        readings[start..start + lines].rotate_right(self.shift);
        readings
    }

    /// The same for indices of readings.
    pub(super) fn undone_at(&self, lines: usize, at: &[usize]) -> Vec<usize> {
        let own = |at: &usize| match (at / lines, at % lines) {
            (placement, line) if placement == self.placement => {
                placement * lines + (line + self.shift) % lines
            }
            _ => *at,
        };
        at.iter().map(own).collect()
    }
}

/// The likeliest turns of each placement; `readings` are whole and without outliers.
pub(super) fn likely_turns(lines: usize, offsets: &[usize], readings: &[f64]) -> Vec<Turn> {
    let spectra = spectra(lines, readings);
    let mut turns = Vec::new();
    for placement in 0..offsets.len() {
        let rest = Rest::new(lines, offsets, &spectra, placement);
        for by_place in [false, true] {
            let all = (0..lines).filter(|it| *it != offsets[placement]);
            let turn = |offset: usize| Turn {
                placement,
                offset,
                shift: match by_place {
                    true => (lines + offset - offsets[placement]) % lines,
                    false => 0,
                },
            };
            let mut judged: Vec<(f64, Turn)> = all
                .map(turn)
                .map(|it| (rest.left(&spectra[placement], &it), it))
                .collect();
            judged.sort_by(|a, b| a.0.total_cmp(&b.0));
            turns.extend(judged.iter().take(KEPT).map(|(_, turn)| *turn));
        }
    }
    turns
}

/// V̂_j(k) for k = 1, 2, …, weighted by how often a harmonic stands in a full spectrum.
fn spectra(lines: usize, readings: &[f64]) -> Vec<Vec<Complex<f64>>> {
    let mut planner = RealFftPlanner::<f64>::new();
    let forward = planner.plan_fft_forward(lines);
    let mut placements = Vec::new();
    for own in readings.chunks_exact(lines) {
        let mut output = forward.make_output_vec();
        let transformed = forward.process(&mut own.to_vec(), &mut output);
        transformed.expect("the lengths are the planner's");
        if lines.is_multiple_of(2) {
            output[lines / 2] *= core::f64::consts::FRAC_1_SQRT_2;
        }
        output.remove(0);
        output.truncate(HARMONICS_MAX);
        placements.push(output);
    }
    placements
}

/// Of one harmonic, what the placements but one add up to.
struct Sums {
    /// Σ V̂_i.
    readings: Complex<f64>,
    /// Σ conj(w_i) V̂_i.
    turned: Complex<f64>,
    /// Σ w_i.
    angles: Complex<f64>,
    /// Σ |V̂_i|².
    squares: f64,
}

/// All placements but one.
struct Rest {
    lines: usize,
    placements: f64,
    /// e^(i2πm/N).
    angles: Vec<Complex<f64>>,
    sums: Vec<Sums>,
}

impl Rest {
    fn new(lines: usize, offsets: &[usize], spectra: &[Vec<Complex<f64>>], without: usize) -> Self {
        let angles = angles(lines).into_iter();
        let angles: Vec<_> = angles.map(|(cos, sin)| Complex::new(cos, sin)).collect();
        let others = || (0..offsets.len()).filter(|it| *it != without);
        let of = |at: usize| {
            let angle = |placement: usize| angles[(at + 1) * offsets[placement] % lines];
            Sums {
                readings: others().map(|it| spectra[it][at]).sum(),
                turned: others().map(|it| angle(it).conj() * spectra[it][at]).sum(),
                angles: others().map(angle).sum(),
                squares: others().map(|it| spectra[it][at].norm_sqr()).sum(),
            }
        };
        Self {
            lines,
            placements: offsets.len() as f64,
            sums: (0..spectra[without].len()).map(of).collect(),
            angles,
        }
    }

    /// What table and plate leave of all readings when the placement left out, whose transform is `own`,
    /// is turned by `turn`.
    fn left(&self, own: &[Complex<f64>], turn: &Turn) -> f64 {
        let (mut at, mut shift) = (0, 0);
        let mut left = 0.0;
        for (sums, own) in self.sums.iter().zip(own) {
            at = (at + turn.offset) % self.lines;
            shift = (shift + turn.shift) % self.lines;
            left += self.left_of(sums, self.angles[at], self.angles[shift] * own);
        }
        left
    }

    fn left_of(&self, sums: &Sums, angle: Complex<f64>, own: Complex<f64>) -> f64 {
        let (readings, angles) = (sums.readings + own, sums.angles + angle);
        let squares = sums.squares + own.norm_sqr() - readings.norm_sqr() / self.placements;
        let information = self.placements - angles.norm_sqr() / self.placements;
        if information <= INFORMATION_MIN {
            return squares;
        }
        let table = sums.turned + angle.conj() * own - angles.conj() * readings / self.placements;
        squares - table.norm_sqr() / information
    }
}
