//! What can be seen in data, before anything is solved: each term must differ from all
//! combinations of those before it.

use super::error::FitError;
use super::{BASE, design_row};
use crate::screw::Stroke;
use units::portable::hypot;
use units::{Approach, Metres};

/// The share of the lost motion's column that slope and offset must not explain: below it its
/// uncertainty is more than a hundred times what the measurement could give.
const LOST_MOTION_SHARE_MIN: f64 = 0.01;

/// The same for a harmonic, ten times.
const HARMONIC_SHARE_MIN: f64 = 0.1;

/// Orthonormal columns.
struct Basis(Vec<Vec<f64>>);

impl Basis {
    /// What the columns so far do not explain of `column`; twice, against rounding.
    fn remainder(&self, mut column: Vec<f64>) -> Vec<f64> {
        for known in self.0.iter().chain(&self.0) {
            let share = dot(known, &column);
            for (value, explained) in column.iter_mut().zip(known) {
                *value -= share * explained;
            }
        }
        column
    }

    /// Takes `column` in, and returns which share of its length is new.
    fn add(&mut self, column: Vec<f64>) -> f64 {
        let length = dot(&column, &column).sqrt();
        let mut new = self.remainder(column);
        let rest = dot(&new, &new).sqrt();
        if rest > 0.0 {
            new.iter_mut().for_each(|value| *value /= rest);
            self.0.push(new);
        }
        rest / length
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Which harmonics up to `highest` these strokes can tell from everything else, and which they
/// cannot.
///
/// # Errors
/// When the lost motion is not observable, or not even the first harmonic.
pub(super) fn observable(
    strokes: &[Stroke],
    lead: Option<Metres>,
    highest: u32,
) -> Result<(Vec<u32>, Vec<u32>), FitError> {
    let has = |approach| strokes.iter().any(|it| it.approach == approach);
    for (measured, missing) in [
        (Approach::Forward, Approach::Reverse),
        (Approach::Reverse, Approach::Forward),
    ] {
        if !has(missing) {
            return Err(FitError::OneApproach { measured });
        }
    }
    let lead_m = lead.map_or(1.0, Metres::value);
    let column = |harmonics: &[u32], index: usize| -> Vec<f64> {
        let row =
            |it: &Stroke| design_row(it.stroke.value(), it.approach, lead_m, harmonics)[index];
        strokes.iter().map(row).collect()
    };
    let mut basis = Basis(Vec::new());
    let shares: Vec<f64> = (0..BASE).map(|i| basis.add(column(&[], i))).collect();
    if shares[2] < LOST_MOTION_SHARE_MIN {
        return Err(FitError::LostMotionLikeSlope);
    }
    let Some(lead) = lead else {
        return Ok((Vec::new(), Vec::new()));
    };
    let (mut seen, mut unseen) = (Vec::new(), Vec::new());
    for number in 1..=highest {
        let pair = [BASE, BASE + 1].map(|i| basis.remainder(column(&[number], i)));
        if weakest(&pair) < HARMONIC_SHARE_MIN {
            unseen.push(number);
            continue;
        }
        for column in pair {
            basis.add(column);
        }
        seen.push(number);
    }
    if seen.is_empty() && highest > 0 {
        let places = places_of_the_turn(strokes, lead.value());
        return Err(FitError::Periodic { lead, places });
    }
    Ok((seen, unseen))
}

/// The shortest remainder of any mixture of a pair's sine and cosine, compared with what a sine
/// has when it is measured everywhere (√(rows/2)).
fn weakest(pair: &[Vec<f64>; 2]) -> f64 {
    let [sine, cosine] = pair;
    let (ss, cc, sc) = (dot(sine, sine), dot(cosine, cosine), dot(sine, cosine));
    let (mean, half) = ((ss + cc) / 2.0, (ss - cc) / 2.0);
    let smallest = (mean - hypot(half, sc)).max(0.0);
    (smallest / (0.5 * sine.len() as f64)).sqrt()
}

/// How many different places of one turn the strokes stand at.
fn places_of_the_turn(strokes: &[Stroke], lead: f64) -> usize {
    const PARTS: f64 = 1e6;
    let part = |it: &Stroke| (it.stroke.value() / lead * PARTS).round().rem_euclid(PARTS) as u64;
    let mut parts: Vec<u64> = strokes.iter().map(part).collect();
    parts.sort_unstable();
    parts.dedup();
    parts.len()
}
