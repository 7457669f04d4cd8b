//! A trilinear map: eight nodes for a call.

use crate::volumetric::find::Finder;
use crate::volumetric::point::V3;

/// Positions along one axis.
#[derive(Clone, Debug)]
struct Line {
    finder: Finder,
    /// Start and end of each interval, and one over its width.
    intervals: Vec<[f64; 3]>,
}

impl Line {
    fn new(nodes: &[f64]) -> Self {
        let interval = |ends: &[f64]| [ends[0], ends[1], 1.0 / (ends[1] - ends[0])];
        Self {
            finder: Finder::new(nodes.to_vec()),
            intervals: nodes.windows(2).map(interval).collect(),
        }
    }

    /// The interval of a position, and what its two ends weigh there; neither weight waits for the
    /// other.
    #[inline(always)]
    fn find(&self, position: f64) -> (usize, [f64; 2]) {
        let (inside, at) = self.finder.find(position);
        let [start, end, per_width] = self.intervals[at];
        (
            at,
            [(end - inside) * per_width, (inside - start) * per_width],
        )
    }
}

#[derive(Clone, Debug)]
pub(super) struct Trilinear {
    lines: [Line; 3],
    /// How far apart neighbours along x and along y are.
    stride: [usize; 2],
    /// x, y, z of each node and a lane that is not used: two registers.
    nodes: Vec<[f64; 4]>,
}

#[inline(always)]
fn times(node: [f64; 4], weight: f64) -> [f64; 4] {
    node.map(|it| it * weight)
}

#[inline(always)]
fn plus(a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
    core::array::from_fn(|k| a[k] + b[k])
}

impl Trilinear {
    /// The map and its largest slopes: by axis, of each component.
    pub(super) fn new(nodes: &[Vec<f64>; 3], values: &[V3]) -> (Self, [V3; 3]) {
        let lengths = [nodes[0].len(), nodes[1].len(), nodes[2].len()];
        let strides = [lengths[1] * lengths[2], lengths[2], 1];
        let mut slopes = [[0.0_f64; 3]; 3];
        for (index, value) in values.iter().enumerate() {
            for axis in 0..3 {
                let place = index / strides[axis] % lengths[axis];
                if place == 0 {
                    continue;
                }
                let width = nodes[axis][place] - nodes[axis][place - 1];
                let before = values[index - strides[axis]];
                for k in 0..3 {
                    let slope = ((value[k] - before[k]) / width).abs();
                    slopes[axis][k] = slopes[axis][k].max(slope);
                }
            }
        }
        let map = Self {
            lines: [0, 1, 2].map(|axis| Line::new(&nodes[axis])),
            stride: [strides[0], strides[1]],
            nodes: values.iter().map(|v| [v[0], v[1], v[2], 0.0]).collect(),
        };
        (map, slopes)
    }

    #[inline]
    pub(super) fn at(&self, position: V3) -> V3 {
        let (i, s) = self.lines[0].find(position[0]);
        let (j, t) = self.lines[1].find(position[1]);
        let (k, u) = self.lines[2].find(position[2]);
        let [along_x, along_y] = self.stride;
        let corner = i * along_x + j * along_y + k;
        // Two slices with one check each; all eight nodes are within them.
        let low = &self.nodes[corner..corner + along_y + 2];
        let high = &self.nodes[corner + along_x..corner + along_x + along_y + 2];
        // The weights are ready when the nodes arrive: one product and three sums behind them,
        // where nested interpolations would wait for each other.
        let edge = |of: &[[f64; 4]], from: usize, weight: f64| {
            let (near, far) = (of[from], of[from + 1]);
            plus(times(near, weight * u[0]), times(far, weight * u[1]))
        };
        let face = |of: &[[f64; 4]], weight: f64| {
            plus(edge(of, 0, weight * t[0]), edge(of, along_y, weight * t[1]))
        };
        let [x, y, z, _] = plus(face(low, s[0]), face(high, s[1]));
        [x, y, z]
    }
}
