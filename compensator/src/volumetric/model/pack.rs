//! The six functions of one axis in one place: one search and one run of six lanes per call.

use crate::error_table::Grid;
use crate::interpolation::Segment;
use crate::volumetric::function::Pieces;

/// Nodes nearer together than this are one: no error function changes within a nanometre.
const SAME_NODE_M: f64 = 1e-9;

/// Six cubics over one interval, by power and lane: displacements along x, y, z, tilts about
/// them.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
struct Six {
    start: f64,
    powers: [[f64; 6]; 4],
}

#[derive(Clone, Debug)]
pub(crate) struct PackedAxis {
    grid: Grid,
    pieces: Vec<Six>,
    low: f64,
    high: f64,
    /// Largest magnitude and slope of each lane.
    pub(crate) largest: [f64; 6],
    pub(crate) steepest: [f64; 6],
}

impl PackedAxis {
    /// Functions that all cover `low` to `high`; `None` is zero.
    pub(crate) fn new(functions: [Option<&Pieces>; 6], low: f64, high: f64) -> Self {
        let mut breaks: Vec<f64> = functions
            .iter()
            .flatten()
            .flat_map(|it| it.segments())
            .map(|segment| segment.start)
            .filter(|it| *it > low + SAME_NODE_M && *it < high - SAME_NODE_M)
            .chain([low, high])
            .collect();
        breaks.sort_by(f64::total_cmp);
        breaks.dedup_by(|next, before| *next - *before < SAME_NODE_M);
        let piece = |ends: &[f64]| {
            let mut six = Six {
                start: ends[0],
                powers: [[0.0; 6]; 4],
            };
            let (mut largest, mut steepest) = ([0.0; 6], [0.0; 6]);
            for (lane, function) in functions.iter().enumerate() {
                let Some(function) = function else { continue };
                let segment = moved(function, ends);
                largest[lane] = segment.largest();
                steepest[lane] = segment.steepest();
                six.powers[0][lane] = segment.constant;
                six.powers[1][lane] = segment.linear;
                six.powers[2][lane] = segment.quadratic;
                six.powers[3][lane] = segment.cubic;
            }
            (six, largest, steepest)
        };
        let all: Vec<_> = breaks.windows(2).map(piece).collect();
        let extreme = |of: fn(&(Six, [f64; 6], [f64; 6])) -> [f64; 6]| {
            all.iter().map(of).fold([0.0; 6], |a, b| {
                core::array::from_fn(|k| f64::max(a[k], b[k]))
            })
        };
        Self {
            low,
            high,
            largest: extreme(|it| it.1),
            steepest: extreme(|it| it.2),
            pieces: all.iter().map(|it| it.0).collect(),
            grid: Grid::new(breaks),
        }
    }

    /// The six values at `position`, which holds its ends' beyond the range.
    #[inline(always)]
    pub(crate) fn at(&self, position: f64) -> [f64; 6] {
        let inside = position.max(self.low).min(self.high);
        let piece = &self.pieces[self.grid.find(inside)];
        let t = inside - piece.start;
        let [constant, linear, quadratic, cubic] = &piece.powers;
        core::array::from_fn(|k| constant[k] + t * (linear[k] + t * (quadratic[k] + t * cubic[k])))
    }
}

/// The cubic that `function` is between `ends`, counted from the first of them.
fn moved(function: &Pieces, ends: &[f64]) -> Segment {
    let middle = ends[0] + (ends[1] - ends[0]) / 2.0;
    let segments = function.segments();
    let after = segments.partition_point(|it| it.start <= middle);
    let own = segments[after.saturating_sub(1)];
    let by = ends[0] - own.start;
    Segment {
        start: ends[0],
        width: ends[1] - ends[0],
        constant: own.value(by),
        linear: own.slope(by),
        quadratic: own.quadratic + 3.0 * own.cubic * by,
        cubic: own.cubic,
    }
}
