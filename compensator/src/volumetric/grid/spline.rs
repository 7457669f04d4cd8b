//! A map of tensor-product cubic splines: 64 coefficients of each component for a call.

use nalgebra::{DMatrix, DVector};

use crate::interpolation::{Segment, spline_slopes};
use crate::volumetric::find::Finder;
use crate::volumetric::point::V3;

/// A cubic by its powers of the distance from the start of a span.
type Cubic = [f64; 4];

/// The B-splines along one axis.
#[derive(Clone, Debug)]
struct Line {
    finder: Finder,
    spans: Vec<Span>,
    count: usize,
}

/// The four B-splines that are not zero in one span, by power and B-spline.
#[derive(Clone, Copy, Debug)]
struct Span {
    start: f64,
    powers: [[f64; 4]; 4],
}

impl Line {
    /// For at least four nodes: knots at all of them but the second and the last but one, the
    /// ends four times.
    fn new(nodes: &[f64]) -> (Self, Vec<f64>) {
        let count = nodes.len();
        let (first, last) = (nodes[0], nodes[count - 1]);
        let inner = &nodes[2..count - 2];
        let breaks: Vec<f64> = [first]
            .iter()
            .chain(inner)
            .chain(&[last])
            .copied()
            .collect();
        let knots: Vec<f64> = [first; 3]
            .iter()
            .chain(&breaks)
            .chain(&[last; 3])
            .copied()
            .collect();
        let line = Self {
            spans: (0..breaks.len() - 1)
                .map(|at| span(&knots, at + 3))
                .collect(),
            finder: Finder::new(breaks),
            count,
        };
        (line, knots)
    }

    /// The number of the first B-spline that is not zero at a position, and the four values.
    #[inline(always)]
    fn weights(&self, position: f64) -> (usize, [f64; 4]) {
        let (inside, at) = self.finder.find(position);
        let span = &self.spans[at];
        let t = inside - span.start;
        let [a, b, c, d] = &span.powers;
        let weights = core::array::from_fn(|k| a[k] + t * (b[k] + t * (c[k] + t * d[k])));
        (at, weights)
    }

    /// Row by row the values of all B-splines at the nodes.
    fn collocation(&self, nodes: &[f64]) -> DMatrix<f64> {
        let mut matrix = DMatrix::zeros(self.count, self.count);
        for (row, node) in nodes.iter().enumerate() {
            let (at, weights) = self.weights(*node);
            for (k, weight) in weights.into_iter().enumerate() {
                matrix[(row, at + k)] = weight;
            }
        }
        matrix
    }
}

/// The recursion of Cox and de Boor with polynomials instead of numbers, in the span that
/// begins at knot `at`.
fn span(knots: &[f64], at: usize) -> Span {
    let start = knots[at];
    // B-splines at − degree … at; those outside are zero.
    let mut basis: Vec<Cubic> = vec![[1.0, 0.0, 0.0, 0.0]];
    for degree in 1..=3 {
        let ramp = |i: usize, of: Cubic, rises: bool| {
            let width = knots[i + degree] - knots[i];
            let (constant, linear) = if rises {
                ((start - knots[i]) / width, 1.0 / width)
            } else {
                ((knots[i + degree] - start) / width, -1.0 / width)
            };
            let mut product = [0.0; 4];
            for k in 0..4 {
                product[k] += of[k] * constant;
                if k > 0 {
                    product[k] += of[k - 1] * linear;
                }
            }
            product
        };
        let mut next = vec![[0.0; 4]; degree + 1];
        for (m, of) in basis.iter().enumerate() {
            // `of` is B-spline number at − degree + 1 + m of one degree less.
            let i = at + 1 + m - degree;
            let (falls, rises) = (ramp(i, *of, false), ramp(i, *of, true));
            for k in 0..4 {
                next[m][k] += falls[k];
                next[m + 1][k] += rises[k];
            }
        }
        basis = next;
    }
    Span {
        start,
        powers: core::array::from_fn(|power| core::array::from_fn(|k| basis[k][power])),
    }
}

#[derive(Clone, Debug)]
pub(super) struct Splines {
    lines: [Line; 3],
    /// How many numbers apart neighbours along x and along y are.
    stride: [usize; 2],
    /// Coefficients, z changing fastest, each of the three components one after the other: four
    /// along z are twelve numbers in a row.
    coefficients: Vec<f64>,
}

impl Splines {
    /// The map and bounds of its slopes: by axis, of each component.
    pub(super) fn new(nodes: &[Vec<f64>; 3], values: &[V3]) -> (Self, [V3; 3]) {
        let mut lengths = [nodes[0].len(), nodes[1].len(), nodes[2].len()];
        let mut components: [Vec<f64>; 3] =
            core::array::from_fn(|k| values.iter().map(|it| it[k]).collect());
        let mut lines = Vec::with_capacity(3);
        let mut all_knots = Vec::with_capacity(3);
        for axis in 0..3 {
            let own = at_least_four(&nodes[axis]);
            let (line, knots) = Line::new(&own);
            let solver = line.collocation(&own).lu();
            let convert = |values: &[f64]| {
                let values = resampled(&nodes[axis], values, &own);
                let solved = solver.solve(&DVector::from_vec(values));
                let solved =
                    solved.expect("nodes that interlace with the knots determine a spline");
                solved.as_slice().to_vec()
            };
            for component in &mut components {
                *component = along(component, lengths, axis, own.len(), convert);
            }
            lengths[axis] = own.len();
            lines.push(line);
            all_knots.push(knots);
        }
        let mut slopes = [[0.0; 3]; 3];
        for axis in 0..3 {
            for (k, component) in components.iter().enumerate() {
                slopes[axis][k] = steepest(component, lengths, axis, &all_knots[axis]);
            }
        }
        let map = Self {
            lines: lines.try_into().expect("one for each axis"),
            stride: [3 * lengths[1] * lengths[2], 3 * lengths[2]],
            coefficients: (0..components[0].len())
                .flat_map(|at| components.each_ref().map(|it| it[at]))
                .collect(),
        };
        (map, slopes)
    }

    #[inline]
    pub(super) fn at(&self, position: V3) -> V3 {
        let (i, of_x) = self.lines[0].weights(position[0]);
        let (j, of_y) = self.lines[1].weights(position[1]);
        let (k, of_z) = self.lines[2].weights(position[2]);
        let [along_x, along_y] = self.stride;
        let corner = i * along_x + j * along_y + 3 * k;
        // Row by row along z: six registers of sums that do not wait for each other.
        let mut sums = [0.0; ROW];
        for (a, weight_x) in of_x.into_iter().enumerate() {
            let begin = corner + a * along_x;
            let plane = &self.coefficients[begin..begin + 3 * along_y + ROW];
            for (b, weight_y) in of_y.into_iter().enumerate() {
                let row = &plane[b * along_y..b * along_y + ROW];
                let row: &[f64; ROW] = row.try_into().expect("it was just made that long");
                let weight = weight_x * weight_y;
                sums = core::array::from_fn(|n| sums[n] + weight * row[n]);
            }
        }
        across(&sums, &of_z)
    }
}

/// Coefficients read at once: four along z of three components.
const ROW: usize = 12;

/// What the four along z come to. Not inlined: seen together with the rows, a compiler pairs the
/// sums as they are needed here and shuffles every row for it.
#[inline(never)]
fn across(sums: &[f64; ROW], weights: &[f64; 4]) -> V3 {
    core::array::from_fn(|c| {
        let [p, q, r, s] = [0, 3, 6, 9].map(|z| sums[z + c]);
        (p * weights[0] + q * weights[1]) + (r * weights[2] + s * weights[3])
    })
}

/// Two or three nodes determine a line or a parabola, which four at even distances keep.
fn at_least_four(nodes: &[f64]) -> Vec<f64> {
    let last = nodes.len() - 1;
    if last >= 3 {
        return nodes.to_vec();
    }
    let part = (nodes[last] - nodes[0]) / 3.0;
    vec![nodes[0], nodes[0] + part, nodes[last] - part, nodes[last]]
}

/// The values of the spline through two or three nodes at four; of more nodes, their own.
fn resampled(nodes: &[f64], values: &[f64], wanted: &[f64]) -> Vec<f64> {
    if nodes.len() == wanted.len() {
        return values.to_vec();
    }
    let slopes = spline_slopes(nodes, values);
    let piece = |x: &f64| {
        let i = usize::from(nodes.len() == 3 && *x > nodes[1]);
        let (a, b) = (nodes[i], nodes[i + 1]);
        let segment = Segment::hermite(a, values[i], slopes[i], b, values[i + 1], slopes[i + 1]);
        segment.value(x - a)
    };
    wanted.iter().map(piece).collect()
}

/// Applies `change` to every line of a three-dimensional array along `axis`; each has the
/// length `length` afterwards.
fn along(
    values: &[f64],
    lengths: [usize; 3],
    axis: usize,
    length: usize,
    change: impl Fn(&[f64]) -> Vec<f64>,
) -> Vec<f64> {
    let inner: usize = lengths[axis + 1..].iter().product();
    let outer: usize = lengths[..axis].iter().product();
    let mut result = vec![0.0; outer * length * inner];
    for out in 0..outer {
        for within in 0..inner {
            let begin = out * lengths[axis] * inner + within;
            let line: Vec<f64> = (0..lengths[axis])
                .map(|at| values[begin + at * inner])
                .collect();
            for (at, value) in change(&line).into_iter().enumerate() {
                result[out * length * inner + at * inner + within] = value;
            }
        }
    }
    result
}

/// The largest coefficient of the derivative along `axis`.
fn steepest(coefficients: &[f64], lengths: [usize; 3], axis: usize, knots: &[f64]) -> f64 {
    let inner: usize = lengths[axis + 1..].iter().product();
    let mut largest = 0.0_f64;
    for (index, value) in coefficients.iter().enumerate() {
        let at = index / inner % lengths[axis];
        if at > 0 {
            let width = knots[at + 3] - knots[at];
            let slope = 3.0 * (value - coefficients[index - inner]) / width;
            largest = largest.max(slope.abs());
        }
    }
    largest
}
