//! What forward and reverse passes over a plate differ by, and how well the passes of each direction agree.
//!
//! Figures in the manner of ISO 230-2 (B, B̄, R↑, R↓), from one placement. A detector that is late sees every line
//! later in either direction: that is the same at all lines, and part of the mean reversal value; what differs from
//! line to line is not.

use compensator::uncertainty::{mean, standard_deviation};
use units::Radians;

use crate::rotary::SweepEntry;

/// R is 4 s (ISO 230-2, 3.16).
const REPEATABILITY: f64 = 4.0;

/// The reversal and the repeatability of one placement.
#[derive(Clone, Debug, PartialEq)]
pub struct Bidirectional {
    /// B at each table position: mean deviation forward − mean deviation in reverse; `None` where one is missing.
    pub reversal: Vec<Option<Radians>>,
    /// B̄: their mean, what the detector is late by included.
    pub mean_reversal: Radians,
    /// The largest difference from that mean.
    pub reversal_variation: Radians,
    /// R↑ and R↓, largest over the positions; `None` of a single pass.
    pub repeatability: [Option<Radians>; 2],
}

impl Bidirectional {
    /// Of the first `passes` in each direction of the placement at `offset`; `None` where no line was read in both
    /// directions.
    pub(crate) fn of(sweeps: &[SweepEntry], offset: f64, passes: u32) -> Option<Self> {
        let [forward, reverse] = ['+', '-'].map(|approach| {
            let own = sweeps.iter().filter(|it| it.offset == offset);
            let own = own.filter(|it| it.approach == approach && it.pass <= passes);
            by_position(own)
        });
        let pairs = forward.iter().zip(&reverse);
        // What was read is reading − nominal, the negative of a deviation.
        let reversal = pairs.map(|(f, r)| Some(Radians(mean(r)? - mean(f)?)));
        let reversal: Vec<_> = reversal.collect();
        let known: Vec<f64> = reversal.iter().flatten().map(|it| it.value()).collect();
        let mean_reversal = mean(&known)?;
        let apart = known.iter().map(|it| (it - mean_reversal).abs());
        Some(Self {
            reversal,
            mean_reversal: Radians(mean_reversal),
            reversal_variation: Radians(apart.fold(0.0, f64::max)),
            repeatability: [repeatability(&forward), repeatability(&reverse)],
        })
    }
}

/// What each pass read, at each position.
fn by_position<'a>(sweeps: impl Iterator<Item = &'a SweepEntry>) -> Vec<Vec<f64>> {
    let mut positions: Vec<Vec<f64>> = Vec::new();
    for sweep in sweeps {
        positions.resize(sweep.deviations_rad.len().max(positions.len()), Vec::new());
        for (all, value) in positions.iter_mut().zip(&sweep.deviations_rad) {
            all.extend(value);
        }
    }
    positions
}

fn repeatability(positions: &[Vec<f64>]) -> Option<Radians> {
    let each = positions.iter().filter_map(|it| standard_deviation(it));
    let most = each.reduce(f64::max)?;
    Some(Radians(most) * REPEATABILITY)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sweep(approach: char, pass: u32, read: [f64; 3]) -> SweepEntry {
        SweepEntry {
            approach,
            pass,
            deviations_rad: read.map(Some).to_vec(),
            ..SweepEntry::default()
        }
    }

    #[test]
    fn a_late_detector_is_in_the_mean_reversal_and_not_in_its_variation() {
        // 10 late in both directions, and 1 of lost motion at the second position.
        let mut sweeps = vec![
            sweep('+', 1, [10.0, 11.0, 10.0]),
            sweep('-', 1, [-10.0, -10.0, -10.0]),
            sweep('+', 2, [99.0, 99.0, 99.0]),
        ];
        let of = |sweeps: &[SweepEntry]| Bidirectional::of(sweeps, 0.0, 1);
        let it = of(&sweeps).unwrap();
        assert_eq!(
            it.reversal,
            [-20.0, -21.0, -20.0].map(|it| Some(Radians(it)))
        );
        assert!((it.mean_reversal.value() + 61.0 / 3.0).abs() < 1e-12);
        assert!((it.reversal_variation.value() - 2.0 / 3.0).abs() < 1e-12);
        assert_eq!(it.repeatability, [None, None]);
        sweeps.remove(1);
        assert_eq!(of(&sweeps), None);
    }

    #[test]
    fn passes_that_agree_but_at_one_line_repeat_as_badly_as_there() {
        let sweeps = [
            sweep('+', 1, [0.0, 1.0, 0.0]),
            sweep('+', 2, [0.0, 3.0, 0.0]),
            sweep('-', 1, [0.0; 3]),
            sweep('-', 2, [0.0; 3]),
        ];
        let it = Bidirectional::of(&sweeps, 0.0, 2).unwrap();
        let expected = 4.0 * 2.0_f64.sqrt();
        let [up, down] = it.repeatability.map(|it| it.unwrap().value());
        assert!((up - expected).abs() < 1e-12 && down == 0.0, "{up} {down}");
    }
}
