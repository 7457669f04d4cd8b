//! The six functions of one axis in one place: one search and one run of six lanes per call.

use crate::interpolation::Segment;
use crate::volumetric::find::Finder;
use crate::volumetric::function::Pieces;
use crate::volumetric::point::{V3, V4, cross_bound};

/// Nodes nearer together than this are one: no error function changes within a nanometre.
pub(super) const SAME_NODE_M: f64 = 1e-9;

/// Six cubics over one interval by power: displacements along x, y, z and a lane that is not
/// used, tilts about them and another. The first lanes not used say where it starts and ends.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
struct Six {
    along: [V4; 4],
    about: [V4; 4],
}

/// Largest magnitudes and slopes of six functions over one interval.
#[derive(Clone, Copy, Debug, Default)]
struct Extent {
    largest: [f64; 6],
    steepest: [f64; 6],
}

#[derive(Clone, Debug)]
pub(crate) struct PackedAxis {
    finder: Finder,
    pieces: Vec<Six>,
    /// Largest magnitude and slope of each function.
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
                along: [[0.0; 4]; 4],
                about: [[0.0; 4]; 4],
            };
            (six.along[0][3], six.along[1][3]) = (ends[0], ends[1]);
            let mut extent = Extent::default();
            for (lane, function) in functions.iter().enumerate() {
                let Some(function) = function else { continue };
                let segment = moved(function, ends);
                extent.largest[lane] = segment.largest();
                extent.steepest[lane] = segment.steepest();
                let powers = if lane < 3 {
                    &mut six.along
                } else {
                    &mut six.about
                };
                powers[0][lane % 3] = segment.constant;
                powers[1][lane % 3] = segment.linear;
                powers[2][lane % 3] = segment.quadratic;
                powers[3][lane % 3] = segment.cubic;
            }
            (six, extent)
        };
        let all: Vec<_> = breaks.windows(2).map(piece).collect();
        let extreme = |of: fn(&Extent) -> [f64; 6]| {
            all.iter().map(|it| of(&it.1)).fold([0.0; 6], |a, b| {
                core::array::from_fn(|k| f64::max(a[k], b[k]))
            })
        };
        Self {
            largest: extreme(|it| it.largest),
            steepest: extreme(|it| it.steepest),
            pieces: all.iter().map(|it| it.0).collect(),
            finder: Finder::new(breaks),
        }
    }

    /// Where its pieces begin, and the end of the last.
    pub(super) fn breaks(&self) -> Vec<f64> {
        let starts = self.pieces.iter().map(|it| it.along[0][3]);
        let end = self.pieces.last().map(|it| it.along[1][3]);
        starts.chain(end).collect()
    }

    /// By how much each function by itself moves the tool at most, where its tilts act on `lever`:
    /// displacements, then tilts.
    pub(super) fn largest_effects(&self, lever: V3) -> [f64; 6] {
        core::array::from_fn(|lane| {
            if lane < 3 {
                return self.largest[lane];
            }
            let mut tilt = [0.0; 3];
            tilt[lane - 3] = self.largest[lane];
            cross_bound(tilt, lever).into_iter().fold(0.0, f64::max)
        })
    }

    /// The position within the range, beyond which the ends' values hold, and its piece.
    #[inline(always)]
    pub(crate) fn find(&self, position: f64) -> (f64, usize) {
        self.finder.find(position)
    }

    /// The same, looking at one piece first.
    #[inline(always)]
    pub(crate) fn find_near(&self, position: f64, piece: usize) -> (f64, usize) {
        let own = &self.pieces[piece].along;
        if own[0][3] <= position && position <= own[1][3] {
            (position, piece)
        } else {
            self.finder.find(position)
        }
    }

    /// Displacements and tilts as [`find`](Self::find) gives their place. The fourth lanes mean
    /// nothing.
    #[inline(always)]
    pub(crate) fn at(&self, inside: f64, piece: usize) -> (V4, V4) {
        let piece = &self.pieces[piece];
        let t = inside - piece.along[0][3];
        let value = |of: &[V4; 4]| -> V4 {
            let [constant, linear, quadratic, cubic] = of;
            core::array::from_fn(|k| {
                constant[k] + t * (linear[k] + t * (quadratic[k] + t * cubic[k]))
            })
        };
        (value(&piece.along), value(&piece.about))
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
