//! Where the scatter of strokes comes from: repetitions, sides, and the screw itself.
//!
//! A screw has errors of its own that no model of few terms describes. At one stroke they are the same from
//! both sides and in every repetition, so that repeating averages them out neither of slope nor of harmonics,
//! and takes no part in the lost motion, which is a difference at the same stroke:
//!
//! deviation = model + error of the stroke + error of its side + noise of the repetition
//!
//! Each is a random effect. Their variances follow from three sums of squares, after Henderson's third method
//! (1953): of the repetitions about the mean of their cell; of the sides' differences about the lost motion;
//! and what more is left when the model takes the place of a value for each stroke. Where every stroke is
//! repeated equally, these are the strata of a split plot, and the ratios of estimate and uncertainty are
//! Student's t exactly.
//!
//! Few strokes tell little of the error of a stroke. Each sum of squares is therefore widened by (t(ν)/2)²,
//! ν being its degrees of freedom and t what Student's t exceeds as rarely as a normal distribution twice its
//! standard deviation (GUM G.3): twice the uncertainties holds as often as one expects of them, whatever the
//! number of strokes. For the three strokes of the patent (ν = 1) that is seven times as much.
//!
//! The squares are taken as they are, even where they are smaller than the repetitions permit, which is
//! chance: cut off there, no test would keep its rate. Sides that
//! differ no more than repetitions would in every fourth case are taken together with them (Bancroft 1964) as long
//! as there are few: three strokes would otherwise say little of the lost motion, however often they are repeated.
//! Counted over screws whose sides do have errors of their own, twice the uncertainty of the lost motion then still
//! holds in nine cases of ten at the worst.
//!
//! Absent: errors of neighbouring strokes that resemble each other (they make a slope that is the screw's own
//! over the strokes measured, and count as such); a single stop is judged with them (see `neighbours`).

use super::cells::{Cells, Place};
use super::neighbours::Neighbours;
use super::stop::Single;
use super::stratum::Stratum;
use crate::least_squares::{self, LeastSquaresError};
use crate::significance::f_tail;
use crate::uncertainty::propagate;

/// Fewer sides' differences are an effect of their own only where repetitions would differ so much as seldom as
/// `SIDES_LEVEL` says.
const SIDES_ALONE: usize = 5;

/// Bancroft's (1964) level for taking two variances together.
const SIDES_LEVEL: f64 = 0.25;

/// The strokes' mean square is at least this share of what their repetitions alone make of it.
const SHARE_MIN: f64 = 0.05;

/// Variances of the effects, m².
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Variances {
    /// The error of a stroke, shared by both sides; below zero where strokes scatter less than
    /// the rest of the effects permits.
    pub(super) stroke: f64,
    /// The error of one side of a stroke; likewise.
    pub(super) side: f64,
    /// One repetition.
    pub(super) repeat: f64,
}

impl Variances {
    /// Of the mean of so many repetitions, the error of the stroke apart.
    pub(super) fn of_cell(&self, count: f64) -> f64 {
        self.side + self.repeat / count
    }
}

/// The sums of squares about one model, and how they depend on the variances.
#[derive(Clone, Debug)]
pub(super) struct Strata {
    /// Repetitions, with the sides where these do not differ more; or whatever there is.
    pub(super) within: Stratum,
    /// Sides that differ more than repetitions.
    sides: Option<Stratum>,
    pub(super) strokes: Stratum,
    /// By how much the expected squares of the sides grow with the variance of a side.
    side_in_sides: f64,
    /// Those of the strokes, with the variance of a side and of a stroke.
    side_in_strokes: f64,
    stroke_in_strokes: f64,
    /// The repetitions of each stroke, by side.
    counts: Vec<Vec<f64>>,
    neighbours: Neighbours,
}

/// Whether what the sides differ by is better judged by itself.
fn differs(sides: Stratum, repeats: Stratum) -> bool {
    if sides.freedom >= SIDES_ALONE {
        return true;
    }
    let ratio = sides.mean() / repeats.mean();
    sides.mean() > repeats.mean() && f_tail(ratio, sides.freedom, repeats.freedom) < SIDES_LEVEL
}

impl Strata {
    /// About the model with these harmonics.
    pub(super) fn of(
        cells: &Cells,
        lead: f64,
        harmonics: &[u32],
    ) -> Result<Self, LeastSquaresError> {
        let sides = Sides::of(cells);
        let model = Model::of(cells, lead, harmonics)?;
        let repeats = Stratum {
            squares: cells.within,
            freedom: cells.rows - cells.count(),
        };
        let differing = Stratum {
            squares: sides.squares,
            freedom: cells.shared().saturating_sub(1),
        };
        // With a value for each stroke: these, and the lost motion where both sides share a stroke.
        let free = cells.places.len() + usize::from(cells.shared() > 0);
        let strokes = Stratum {
            squares: (model.squares - sides.squares).max(0.0),
            freedom: free.saturating_sub(model.parameters),
        };
        let (within, differing) = match (repeats.freedom, differing.freedom) {
            (0, 0) => (strokes, None),
            (0, _) => (differing, None),
            (_, 0) => (repeats, None),
            _ if differs(differing, repeats) => (repeats, Some(differing)),
            _ => (repeats.with(differing), None),
        };
        Ok(Self {
            within,
            sides: differing,
            strokes,
            side_in_sides: sides.grows,
            side_in_strokes: (model.grows_with_side - sides.grows).max(0.0),
            stroke_in_strokes: model.grows_with_stroke,
            counts: cells.places.iter().map(Place::counts).collect(),
            neighbours: model.neighbours,
        })
    }

    /// The variances that these squares are expected for.
    pub(super) fn variances(&self) -> Variances {
        let side = self.side(self.within.mean(), self.sides);
        self.with_stroke(self.strokes, self.within.mean(), side)
    }

    /// The same, widened for their degrees of freedom; `None` where nothing is left to judge strokes by.
    pub(super) fn widened(&self) -> Option<Variances> {
        if self.strokes.freedom == 0 {
            return None;
        }
        let repeat = self.within.widened().mean();
        let side = self.side(repeat, self.sides.map(Stratum::widened));
        Some(self.with_stroke(self.strokes.widened(), repeat, side))
    }

    /// What a single row scatters about the model: the sum of the variances, each as it is expected from these squares,
    /// even below zero.
    pub(super) fn single(&self) -> Single {
        if self.within == self.strokes {
            return Single::default().with(1.0, self.strokes);
        }
        let of = |squares: Stratum, grows: f64| match squares.freedom {
            0 => 0.0,
            freedom => freedom as f64 / grows,
        };
        let sides = self.sides.unwrap_or(Stratum::NONE);
        let of_strokes = of(self.strokes, self.stroke_in_strokes);
        let without_stroke = match self.strokes.freedom {
            0 => 1.0,
            _ => 1.0 - self.side_in_strokes / self.stroke_in_strokes,
        };
        let of_sides = without_stroke * of(sides, self.side_in_sides);
        Single::default()
            .with(of_strokes, self.strokes)
            .with(of_sides, sides)
            .with(1.0 - of_strokes - of_sides, self.within)
    }

    /// By how much less a stop between strokes scatters than [`Self::single`], m²: neighbouring strokes share errors.
    pub(super) fn followed(&self) -> f64 {
        if self.strokes.freedom == 0 {
            return 0.0;
        }
        let own = self.variances().stroke.max(0.0);
        self.neighbours.followed(self.strokes.mean(), own)
    }

    /// Degrees of freedom of what a difference at the same stroke is judged by.
    pub(super) fn freedom_of_sides(&self) -> usize {
        self.sides.unwrap_or(self.within).freedom
    }

    /// The standard deviation of a row by what a difference at the same stroke is judged by.
    pub(super) fn scatter_of_sides(&self) -> f64 {
        self.sides.unwrap_or(self.within).mean().sqrt()
    }

    /// The same by what strokes are judged by.
    pub(super) fn scatter_of_strokes(&self) -> f64 {
        self.strokes.mean().sqrt()
    }

    /// The probability that strokes without errors of their own scatter so much; `None` where no
    /// repetition or no stroke is left to judge by.
    pub(super) fn lack_of_fit(&self, floor: f64) -> Option<f64> {
        let freedom = self.freedom_of_sides();
        let judged = self.strokes.freedom > 0 && freedom > 0 && self.within != self.strokes;
        let side = self.side(self.within.mean(), self.sides);
        let expected =
            self.within.mean() + self.side_in_strokes * side / self.strokes.freedom as f64;
        let ratio = self.strokes.mean().max(floor) / expected.max(floor);
        judged.then(|| f_tail(ratio, self.strokes.freedom, freedom))
    }

    fn side(&self, repeat: f64, sides: Option<Stratum>) -> f64 {
        let all = self.counts.iter().flatten();
        let most = all.copied().fold(1.0, f64::max);
        sides.map_or(0.0, |it| {
            let side = (it.squares - it.freedom as f64 * repeat) / self.side_in_sides;
            side.max((SHARE_MIN - 1.0) * repeat / most)
        })
    }

    fn with_stroke(&self, strokes: Stratum, repeat: f64, side: f64) -> Variances {
        let without = strokes.freedom as f64 * repeat + self.side_in_strokes * side;
        let stroke = (strokes.squares - without) / self.stroke_in_strokes;
        // The variance that repetitions and sides alone give the best mean of a stroke.
        let of_mean = |counts: &Vec<f64>| {
            let weights = counts.iter().map(|count| 1.0 / (side + repeat / count));
            1.0 / weights.sum::<f64>()
        };
        let least = self.counts.iter().map(of_mean).fold(f64::MAX, f64::min);
        let least = (SHARE_MIN - 1.0) * if least.is_finite() { least } else { 0.0 };
        Variances {
            stroke: if stroke > least { stroke } else { least },
            side,
            repeat,
        }
    }
}

/// Every stroke with a value of its own, and a lost motion.
struct Sides {
    /// What is left then of the means of the cells.
    squares: f64,
    /// By how much it is expected to grow with the variance of a side.
    grows: f64,
}

impl Sides {
    fn of(cells: &Cells) -> Self {
        let shared = || cells.places.iter().filter(|it| it.cells.len() == 2);
        let difference = |it: &Place| it.cells[1].mean - it.cells[0].mean;
        let (mut sum, mut weighted, mut squared) = (0.0, 0.0, 0.0);
        for it in shared() {
            let weight = it.weight_of_difference();
            sum += weight;
            weighted += weight * difference(it);
            squared += weight * weight;
        }
        if sum == 0.0 {
            return Self {
                squares: 0.0,
                grows: 0.0,
            };
        }
        let lost_motion = weighted / sum;
        let left = |it: &Place| {
            let off = difference(it) - lost_motion;
            it.weight_of_difference() * off * off
        };
        Self {
            squares: shared().map(left).sum(),
            grows: 2.0 * (sum - squared / sum),
        }
    }
}

/// The model by ordinary least squares over all rows.
struct Model {
    parameters: usize,
    /// What is left then of the means of the cells.
    squares: f64,
    grows_with_side: f64,
    grows_with_stroke: f64,
    neighbours: Neighbours,
}

impl Model {
    fn of(cells: &Cells, lead: f64, harmonics: &[u32]) -> Result<Self, LeastSquaresError> {
        let parameters = super::BASE + 2 * harmonics.len();
        let (mut design, mut observed) = (Vec::new(), Vec::new());
        for place in &cells.places {
            for (cell, row) in place.design(lead, harmonics) {
                let weight = cell.count.sqrt();
                design.extend(row.iter().map(|it| it * weight));
                observed.push(cell.mean * weight);
            }
        }
        let fit = least_squares::solve(&design, parameters, &observed)?;
        let (mut grows_with_side, mut grows_with_stroke) = (0.0, 0.0);
        for place in &cells.places {
            let (mut together, mut rows) = (vec![0.0; parameters], 0.0);
            for (cell, row) in place.design(lead, harmonics) {
                let n = cell.count;
                grows_with_side += n - n * n * propagate(&row, &fit.cofactor);
                rows += n;
                together
                    .iter_mut()
                    .zip(&row)
                    .for_each(|(sum, it)| *sum += n * it);
            }
            grows_with_stroke += rows - propagate(&together, &fit.cofactor);
        }
        Ok(Self {
            parameters,
            squares: fit.squares(),
            grows_with_side,
            grows_with_stroke,
            neighbours: Neighbours::of(cells, (lead, harmonics), &fit),
        })
    }
}
