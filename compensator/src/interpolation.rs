//! A function given at nodes, as polynomial pieces between them, with its extreme slopes.
//!
//! Source: F. N. Fritsch and R. E. Carlson, "Monotone piecewise cubic interpolation", SIAM J.
//! Numer. Anal. 17 (1980); the node slopes are the weighted harmonic mean of F. N. Fritsch and
//! J. Butland, SIAM J. Sci. Stat. Comput. 5 (1984), with the one-sided three-point end slopes
//! of PCHIP. Between two nodes a monotone cubic never leaves the interval of their values.
//!
//! | symbol | name here |
//! |---|---|
//! | x_i, f_i | `nodes`, `values` |
//! | h_i, Δ_i | widths, secant slopes |
//! | d_i | [`monotone_slopes`], [`spline_slopes`] |
//!
//! Absent: extrapolation; who calls decides what lies outside the nodes.

/// How the values between two nodes are found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Interpolation {
    /// Every interval has one value: that of the node which ends it (CN104076739A).
    PiecewiseConstant,
    /// Straight lines.
    Linear,
    /// Cubics with continuous slope that are monotone wherever the nodes are.
    MonotoneCubic,
}

/// value(t) = constant + t·(linear + t·(quadratic + t·cubic)), for t = x − start.
///
/// # Example
///
/// ```
/// use compensator::interpolation::Segment;
///
/// // From 0 to 0 with the slopes 4 and −4: 4t(1 − t), which is 1 in the middle.
/// let hump = Segment::hermite(0.0, 0.0, 4.0, 1.0, 0.0, -4.0);
/// assert_eq!(hump.value(0.5), 1.0);
/// assert!((hump.largest() - 1.0).abs() < 1e-15);
/// assert_eq!(hump.steepest(), 4.0);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment {
    /// Where the piece begins.
    pub start: f64,
    /// Its width, > 0.
    pub width: f64,
    /// Coefficient of 1.
    pub constant: f64,
    /// Coefficient of t.
    pub linear: f64,
    /// Coefficient of t².
    pub quadratic: f64,
    /// Coefficient of t³.
    pub cubic: f64,
}

impl Segment {
    /// A straight piece from (x0, f0) to (x1, f1).
    pub fn line(x0: f64, f0: f64, x1: f64, f1: f64) -> Self {
        let width = x1 - x0;
        let linear = (f1 - f0) / width;
        Self {
            start: x0,
            width,
            constant: f0,
            linear,
            quadratic: 0.0,
            cubic: 0.0,
        }
    }

    /// A flat piece of `value` from x0 to x1.
    pub fn flat(x0: f64, x1: f64, value: f64) -> Self {
        Self::line(x0, value, x1, value)
    }

    /// The cubic through both ends with slopes `d0` and `d1` there (Hermite).
    pub fn hermite(x0: f64, f0: f64, d0: f64, x1: f64, f1: f64, d1: f64) -> Self {
        let width = x1 - x0;
        let secant = (f1 - f0) / width;
        Self {
            start: x0,
            width,
            constant: f0,
            linear: d0,
            quadratic: (3.0 * secant - 2.0 * d0 - d1) / width,
            cubic: (d0 + d1 - 2.0 * secant) / (width * width),
        }
    }

    /// Where the piece ends.
    pub fn end(&self) -> f64 {
        self.start + self.width
    }

    /// The value at distance `t` from the start.
    #[inline]
    pub fn value(&self, t: f64) -> f64 {
        self.constant + t * (self.linear + t * (self.quadratic + t * self.cubic))
    }

    /// The slope at distance `t` from the start.
    pub fn slope(&self, t: f64) -> f64 {
        self.linear + t * (2.0 * self.quadratic + t * 3.0 * self.cubic)
    }

    /// The largest magnitude of the value over the whole piece, in closed form: at an end or
    /// where the slope vanishes.
    pub fn largest(&self) -> f64 {
        let ends = self.constant.abs().max(self.value(self.width).abs());
        let root = (self.quadratic * self.quadratic - 3.0 * self.cubic * self.linear).sqrt();
        // This form of the roots keeps its digits, and holds for a parabola too.
        let sum = -(self.quadratic + root.copysign(self.quadratic));
        [self.linear / sum, sum / (3.0 * self.cubic)]
            .into_iter()
            .filter(|t| *t > 0.0 && *t < self.width)
            .fold(ends, |largest, t| largest.max(self.value(t).abs()))
    }

    /// The largest magnitude of the slope over the whole piece, in closed form: the slope is a
    /// parabola, so its extremes are at the ends and at the vertex.
    pub fn steepest(&self) -> f64 {
        let ends = self.slope(0.0).abs().max(self.slope(self.width).abs());
        let vertex = -self.quadratic / (3.0 * self.cubic);
        if vertex > 0.0 && vertex < self.width {
            ends.max(self.slope(vertex).abs())
        } else {
            ends
        }
    }
}

/// The pieces between strictly increasing `nodes` (at least two) with their `values`.
///
/// # Panics
/// With fewer nodes, or of another number than the values.
///
/// # Example
///
/// ```
/// use compensator::interpolation::{Interpolation, segments};
///
/// let (nodes, values) = ([0.0, 3.0, 6.0], [9.0, 1.0, 2.0]);
/// let steps = segments(&nodes, &values, Interpolation::PiecewiseConstant);
/// assert_eq!((steps[0].value(0.1), steps[1].value(2.9)), (1.0, 2.0));
/// let lines = segments(&nodes, &values, Interpolation::Linear);
/// assert_eq!(lines[0].value(1.5), 5.0);
/// ```
pub fn segments(nodes: &[f64], values: &[f64], kind: Interpolation) -> Vec<Segment> {
    assert!(nodes.len() >= 2 && nodes.len() == values.len());
    let slopes = match kind {
        Interpolation::MonotoneCubic => monotone_slopes(nodes, values),
        Interpolation::PiecewiseConstant | Interpolation::Linear => Vec::new(),
    };
    (0..nodes.len() - 1)
        .map(|i| {
            let (x0, f0, x1, f1) = (nodes[i], values[i], nodes[i + 1], values[i + 1]);
            match kind {
                Interpolation::PiecewiseConstant => Segment::flat(x0, x1, f1),
                Interpolation::Linear => Segment::line(x0, f0, x1, f1),
                Interpolation::MonotoneCubic => {
                    Segment::hermite(x0, f0, slopes[i], x1, f1, slopes[i + 1])
                }
            }
        })
        .collect()
}

/// The slope at each node that keeps the cubics monotone.
///
/// # Example
///
/// ```
/// use compensator::interpolation::monotone_slopes;
///
/// let slopes = monotone_slopes(&[0.0, 1.0, 3.0], &[0.0, 1.0, 2.0]);
/// for (slope, expected) in slopes.iter().zip([7.0 / 6.0, 9.0 / 13.0, 1.0 / 6.0]) {
///     assert!((slope - expected).abs() < 1e-15);
/// }
/// ```
pub fn monotone_slopes(nodes: &[f64], values: &[f64]) -> Vec<f64> {
    let last = nodes.len() - 1;
    let width = |i: usize| nodes[i + 1] - nodes[i];
    let secant = |i: usize| (values[i + 1] - values[i]) / width(i);
    if last == 1 {
        return vec![secant(0); 2];
    }
    (0..=last)
        .map(|i| match i {
            0 => end_slope(width(0), width(1), secant(0), secant(1)),
            i if i == last => {
                let (near, far) = (last - 1, last - 2);
                end_slope(width(near), width(far), secant(near), secant(far))
            }
            i => inner_slope(width(i - 1), width(i), secant(i - 1), secant(i)),
        })
        .collect()
}

/// The slope at each node that makes the curvature continuous too, with no knot at the second
/// and last but one node ("not-a-knot"): a cubic is reproduced exactly.
///
/// Source: C. de Boor, A Practical Guide to Splines (1978), chapter IV. Two nodes give a line,
/// three a parabola. Unlike the monotone cubic it may leave the interval of its nodes' values.
///
/// # Example
///
/// ```
/// use compensator::interpolation::spline_slopes;
///
/// // x² at 0, 1 and 3.
/// let slopes = spline_slopes(&[0.0, 1.0, 3.0], &[0.0, 1.0, 9.0]);
/// assert!(slopes.iter().zip([0.0, 2.0, 6.0]).all(|(seen, it)| (seen - it).abs() < 1e-14));
/// ```
pub fn spline_slopes(nodes: &[f64], values: &[f64]) -> Vec<f64> {
    let last = nodes.len() - 1;
    let width = |i: usize| nodes[i + 1] - nodes[i];
    let secant = |i: usize| (values[i + 1] - values[i]) / width(i);
    if last == 1 {
        return vec![secant(0); 2];
    }
    if last == 2 {
        let bend = (secant(1) - secant(0)) / (width(0) + width(1));
        let inner = secant(0) + bend * width(0);
        return vec![
            secant(0) - bend * width(0),
            inner,
            secant(1) + bend * width(1),
        ];
    }
    let end = |near: usize, far: usize| {
        let (h, g) = (width(near), width(far));
        let right = ((h + 2.0 * (h + g)) * g * secant(near) + h * h * secant(far)) / (h + g);
        (g, h + g, right)
    };
    // Rows (below, diagonal, above, right side), eliminated downwards.
    let (diagonal, above, right) = end(0, 1);
    let mut rows = vec![(above / diagonal, right / diagonal)];
    for i in 1..=last {
        let (below, diagonal, above, right) = if i < last {
            let (before, after) = (width(i - 1), width(i));
            let right = 3.0 * (after * secant(i - 1) + before * secant(i));
            (after, 2.0 * (before + after), before, right)
        } else {
            let (diagonal, below, right) = end(last - 1, last - 2);
            (below, diagonal, 0.0, right)
        };
        let (above_before, right_before) = rows[i - 1];
        let pivot = diagonal - below * above_before;
        rows.push((above / pivot, (right - below * right_before) / pivot));
    }
    let mut slopes = vec![0.0; last + 1];
    slopes[last] = rows[last].1;
    for i in (0..last).rev() {
        slopes[i] = rows[i].1 - rows[i].0 * slopes[i + 1];
    }
    slopes
}

fn inner_slope(width_before: f64, width_after: f64, before: f64, after: f64) -> f64 {
    if before * after <= 0.0 {
        return 0.0;
    }
    let weight_before = 2.0 * width_after + width_before;
    let weight_after = width_after + 2.0 * width_before;
    (weight_before + weight_after) / (weight_before / before + weight_after / after)
}

fn end_slope(width_near: f64, width_far: f64, near: f64, far: f64) -> f64 {
    let slope =
        ((2.0 * width_near + width_far) * near - width_near * far) / (width_near + width_far);
    if slope * near <= 0.0 {
        0.0
    } else if near * far <= 0.0 && slope.abs() > 3.0 * near.abs() {
        3.0 * near
    } else {
        slope
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Nodes 0, 1, 3 with values 0, 1, 2: Δ = 1, 1/2; h = 1, 2.
    /// Inner: w = 2·2 + 1 = 5 and 2 + 2·1 = 4: 9 / (5/1 + 4/(1/2)) = 9/13.
    /// Left end: ((2·1 + 2)·1 − 1·1/2)/3 = 7/6. Right end: ((2·2 + 1)·1/2 − 2·1)/3 = 1/6.
    #[test]
    fn the_node_slopes_of_a_hand_worked_case_are_met() {
        let slopes = monotone_slopes(&[0.0, 1.0, 3.0], &[0.0, 1.0, 2.0]);
        for (seen, expected) in slopes.iter().zip([7.0 / 6.0, 9.0 / 13.0, 1.0 / 6.0]) {
            assert!((seen - expected).abs() < 1e-15, "{slopes:?}");
        }
    }

    #[test]
    fn the_step_function_takes_the_value_of_the_node_that_ends_the_interval() {
        let pieces = segments(
            &[0.0, 3.0, 6.0],
            &[9.0, 1.0, 2.0],
            Interpolation::PiecewiseConstant,
        );
        assert_eq!((pieces[0].value(0.1), pieces[1].value(2.9)), (1.0, 2.0));
        assert_eq!(pieces[0].steepest(), 0.0);
    }

    #[test]
    fn the_largest_value_may_lie_inside_a_piece() {
        // From 0 to 0 over 1 with slopes 4 and -4: 4t(1 - t), which is 1 in the middle.
        let hump = Segment::hermite(0.0, 0.0, 4.0, 1.0, 0.0, -4.0);
        assert!((hump.largest() - 1.0).abs() < 1e-15);
        // t(t - 1)(t - 2) over 2 has its extremes 2/(3√3) at 1 ± 1/√3.
        let wave = Segment::hermite(0.0, 0.0, 2.0, 2.0, 0.0, 2.0);
        assert!((wave.largest() - 2.0 / 27.0_f64.sqrt()).abs() < 1e-15);
        assert_eq!(Segment::line(0.0, -3.0, 1.0, 2.0).largest(), 3.0);
        assert_eq!(Segment::flat(0.0, 1.0, 2.0).largest(), 2.0);
    }

    #[test]
    fn the_steepest_slope_may_lie_inside_a_piece() {
        // Flat at both ends, rising 1 over 1: the steepest slope is 3/2 in the middle.
        let piece = Segment::hermite(0.0, 0.0, 0.0, 1.0, 1.0, 0.0);
        assert!((piece.steepest() - 1.5).abs() < 1e-15);
    }

    /// x³ − 2x² + 3 at uneven nodes: the slopes are 3x² − 4x, whatever the nodes.
    #[test]
    fn a_spline_reproduces_a_cubic_and_its_ends() {
        let nodes = [-1.0, 0.0, 0.5, 2.0, 2.25];
        let values = nodes.map(|x: f64| x * x * x - 2.0 * x * x + 3.0);
        for (x, seen) in nodes.iter().zip(spline_slopes(&nodes, &values)) {
            assert!(
                (seen - (3.0 * x * x - 4.0 * x)).abs() < 1e-13,
                "{x}: {seen}"
            );
        }
        // Through (0, 0), (1, 1), (3, 9): x², slopes 0, 2, 6.
        let parabola = spline_slopes(&[0.0, 1.0, 3.0], &[0.0, 1.0, 9.0]);
        for (seen, expected) in parabola.iter().zip([0.0, 2.0, 6.0]) {
            assert!((seen - expected).abs() < 1e-14, "{parabola:?}");
        }
        assert_eq!(spline_slopes(&[0.0, 2.0], &[1.0, 2.0]), [0.5, 0.5]);
    }

    proptest! {
        #[test]
        fn a_spline_has_no_jump_in_its_curvature(
            steps in prop::collection::vec((0.3_f64..2.0, -5.0_f64..5.0), 4..12),
        ) {
            let (mut x, mut nodes, mut values) = (0.0, vec![], vec![]);
            for (step, value) in steps {
                x += step;
                nodes.push(x);
                values.push(value);
            }
            let slopes = spline_slopes(&nodes, &values);
            let piece = |i: usize| {
                Segment::hermite(
                    nodes[i], values[i], slopes[i], nodes[i + 1], values[i + 1], slopes[i + 1],
                )
            };
            for i in 0..nodes.len() - 2 {
                let (before, after) = (piece(i), piece(i + 1));
                let bend = 2.0 * before.quadratic + 6.0 * before.cubic * before.width;
                prop_assert!((bend - 2.0 * after.quadratic).abs() < 1e-8 * (1.0 + bend.abs()));
            }
            prop_assert!((piece(0).cubic - piece(1).cubic).abs() < 1e-8 * (1.0 + piece(0).cubic.abs()));
        }

        #[test]
        fn monotone_cubics_stay_between_their_nodes_and_meet_them(
            steps in prop::collection::vec((0.1_f64..3.0, -5.0_f64..5.0), 2..12),
        ) {
            let (mut x, mut nodes, mut values) = (0.0, vec![], vec![]);
            for (step, value) in steps {
                x += step;
                nodes.push(x);
                values.push(value);
            }
            for (i, s) in segments(&nodes, &values, Interpolation::MonotoneCubic).iter().enumerate() {
                let (low, high) = (values[i].min(values[i + 1]), values[i].max(values[i + 1]));
                prop_assert!((s.value(s.width) - values[i + 1]).abs() < 1e-9);
                let mut steepest = 0.0_f64;
                for k in 0..=50 {
                    let t = s.width * f64::from(k) / 50.0;
                    prop_assert!(s.value(t) >= low - 1e-9 && s.value(t) <= high + 1e-9);
                    steepest = steepest.max(s.slope(t).abs());
                }
                prop_assert!(steepest <= s.steepest() * (1.0 + 1e-12) + 1e-12);
            }
        }
    }
}
