//! Strokes by where they were made and from which side: what repetitions have in common.

use std::collections::BTreeMap;

use units::Approach;

use super::design_row;
use crate::screw::Stroke;

/// Repetitions of one stroke from one side.
#[derive(Clone, Debug)]
pub(super) struct Cell {
    pub(super) approach: Approach,
    /// How many.
    pub(super) count: f64,
    /// Their mean deviation, metres.
    pub(super) mean: f64,
}

/// One stroke, from one side or both.
#[derive(Clone, Debug)]
pub(super) struct Place {
    /// Metres.
    pub(super) stroke: f64,
    /// One or two.
    pub(super) cells: Vec<Cell>,
}

impl Place {
    pub(super) fn design(
        &self,
        lead: f64,
        harmonics: &[u32],
    ) -> impl Iterator<Item = (&Cell, Vec<f64>)> {
        let row = move |it: &Cell| design_row(self.stroke, it.approach, lead, harmonics);
        self.cells.iter().map(move |it| (it, row(it)))
    }

    /// Its repetitions, of each side.
    pub(super) fn counts(&self) -> Vec<f64> {
        self.cells.iter().map(|it| it.count).collect()
    }

    /// nF·nR/(nF + nR): the weight of its difference of both sides; 0 with one side only.
    pub(super) fn weight_of_difference(&self) -> f64 {
        match self.cells.as_slice() {
            [a, b] => a.count * b.count / (a.count + b.count),
            _ => 0.0,
        }
    }
}

/// All strokes of one screw.
#[derive(Clone, Debug)]
pub(super) struct Cells {
    /// Each stroke once.
    pub(super) places: Vec<Place>,
    /// Sum of squares of the repetitions about the means of their cells, m².
    pub(super) within: f64,
    pub(super) rows: usize,
}

impl Cells {
    pub(super) fn of(strokes: &[Stroke]) -> Self {
        let mut cells: BTreeMap<_, Vec<f64>> = BTreeMap::new();
        for it in strokes {
            let (approach, bits) = it.cell();
            let cell = cells.entry((bits, approach)).or_default();
            cell.push(it.deviation.value());
        }
        let (mut places, mut within) = (Vec::<Place>::new(), 0.0);
        for ((bits, approach), values) in cells {
            let (stroke, count) = (f64::from_bits(bits), values.len() as f64);
            let mean = values.iter().sum::<f64>() / count;
            within += values.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>();
            let cell = Cell {
                approach,
                count,
                mean,
            };
            match places.last_mut() {
                Some(last) if last.stroke == stroke => last.cells.push(cell),
                _ => places.push(Place {
                    stroke,
                    cells: vec![cell],
                }),
            }
        }
        Self {
            places,
            within,
            rows: strokes.len(),
        }
    }

    /// Different strokes and sides.
    pub(super) fn count(&self) -> usize {
        self.places.iter().map(|it| it.cells.len()).sum()
    }

    /// Strokes made from both sides.
    pub(super) fn shared(&self) -> usize {
        self.places.iter().filter(|it| it.cells.len() == 2).count()
    }
}
