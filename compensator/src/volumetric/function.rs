//! One error function of a position: a table or a spline, with the uncertainty of its nodes.
//!
//! Beyond the first and last node it holds their values on, so that it changes nowhere faster
//! than between them. Straight lines and monotone cubics ([`crate::interpolation`]) never leave
//! the interval of their nodes; the spline has a continuous curvature instead.
//!
//! Absent: hysteresis (both approaches apart), periodic terms: [`crate::screw`] has them.

use core::marker::PhantomData;

use units::{Metres, Quantity};

use super::find::Finder;
use crate::interpolation::{Segment, monotone_slopes, spline_slopes};

/// How the values between two nodes are found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// Straight lines.
    Linear,
    /// Cubics that are monotone wherever the nodes are.
    MonotoneCubic,
    /// The cubic spline with continuous curvature, without knots next to its ends.
    Spline,
}

/// Why nodes do not form a function. `index` counts from 0.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum FunctionError {
    /// Fewer than two nodes.
    #[error("error function: {seen} node(s); at least 2 are needed")]
    TooFewNodes {
        /// Nodes given.
        seen: usize,
    },
    /// Another number of values or uncertainties than of nodes.
    #[error("error function: {seen} values for {nodes} nodes")]
    Lengths {
        /// Values given.
        seen: usize,
        /// Nodes given.
        nodes: usize,
    },
    /// A NaN, an infinity or a negative uncertainty.
    #[error("error function, node {index}: a value is not finite or an uncertainty is negative")]
    NotFinite {
        /// Which node.
        index: usize,
    },
    /// A node not beyond the one before it.
    #[error("error function, node {index}: its position does not follow the one before")]
    NotIncreasing {
        /// Which node.
        index: usize,
    },
}

/// Where in an interval it is said how far a function may be from its curve: shares of its width.
pub(crate) const INSIDE: [f64; 3] = [0.25, 0.5, 0.75];

/// What a parabola over the interval has [`INSIDE`] it.
fn parabola(middle: f64) -> [f64; 3] {
    INSIDE.map(|t| middle * 4.0 * t * (1.0 - t))
}

/// At the share `t` of an interval, by the polynomial of the fourth degree through `inside` and the nodes, where there
/// is nothing: what a cubic spline leaves of a smooth function goes with t²(1 − t)², what straight lines leave with
/// t(1 − t), and both are such polynomials.
pub(crate) fn between_at(inside: [f64; 3], t: f64) -> f64 {
    let t = t.clamp(0.0, 1.0);
    let [quarter, half, three] = inside;
    let ends = t * (1.0 - t);
    // Lagrange's: each is 1 at its own place and 0 at the four others.
    let of_quarter = 128.0 / 3.0 * (t - 0.5) * (t - 0.75);
    let of_half = -64.0 * (t - 0.25) * (t - 0.75);
    let of_three = 128.0 / 3.0 * (t - 0.25) * (t - 0.5);
    let all = quarter * of_quarter + half * of_half + three * of_three;
    (ends * all).max(0.0)
}

/// Polynomial pieces over increasing nodes, held beyond them. Plain numbers inside.
#[derive(Clone, Debug)]
pub(crate) struct Pieces {
    finder: Finder,
    segments: Vec<Segment>,
    first: f64,
    last: f64,
}

impl Pieces {
    pub(crate) fn new(nodes: &[f64], values: &[f64], shape: Shape) -> Result<Self, FunctionError> {
        check(nodes, values)?;
        let slopes = match shape {
            Shape::Linear => Vec::new(),
            Shape::MonotoneCubic => monotone_slopes(nodes, values),
            Shape::Spline => spline_slopes(nodes, values),
        };
        let piece = |i: usize| {
            let (x0, f0, x1, f1) = (nodes[i], values[i], nodes[i + 1], values[i + 1]);
            match shape {
                Shape::Linear => Segment::line(x0, f0, x1, f1),
                Shape::MonotoneCubic | Shape::Spline => {
                    Segment::hermite(x0, f0, slopes[i], x1, f1, slopes[i + 1])
                }
            }
        };
        Ok(Self {
            segments: (0..nodes.len() - 1).map(piece).collect(),
            finder: Finder::new(nodes.to_vec()),
            first: nodes[0],
            last: nodes[nodes.len() - 1],
        })
    }

    #[inline]
    pub(crate) fn at(&self, position: f64) -> f64 {
        let (inside, at) = self.finder.find(position);
        let piece = &self.segments[at];
        piece.value(inside - piece.start)
    }

    pub(crate) fn segments(&self) -> &[Segment] {
        &self.segments
    }

    pub(crate) fn range(&self) -> (f64, f64) {
        (self.first, self.last)
    }

    pub(crate) fn largest(&self) -> f64 {
        let each = self.segments.iter().map(Segment::largest);
        each.fold(0.0, f64::max)
    }

    pub(crate) fn steepest(&self) -> f64 {
        let each = self.segments.iter().map(Segment::steepest);
        each.fold(0.0, f64::max)
    }
}

fn check(nodes: &[f64], values: &[f64]) -> Result<(), FunctionError> {
    if nodes.len() < 2 {
        return Err(FunctionError::TooFewNodes { seen: nodes.len() });
    }
    if values.len() != nodes.len() {
        let (seen, nodes) = (values.len(), nodes.len());
        return Err(FunctionError::Lengths { seen, nodes });
    }
    let sound = |i: &usize| nodes[*i].is_finite() && values[*i].is_finite();
    if let Some(index) = (0..nodes.len()).find(|i| !sound(i)) {
        return Err(FunctionError::NotFinite { index });
    }
    match (1..nodes.len()).find(|i| nodes[*i] <= nodes[i - 1]) {
        Some(index) => Err(FunctionError::NotIncreasing { index }),
        None => Ok(()),
    }
}

/// An error (a length or an angle) as a function of a position; constant time per call.
///
/// # Example
///
/// ```
/// use compensator::volumetric::function::{Function, Shape};
/// use units::Metres;
///
/// // 1e-4·x², which a spline reproduces.
/// let nodes = [0.0, 0.1, 0.3, 0.4].map(Metres);
/// let values = [0.0, 1.0, 9.0, 16.0].map(Metres::from_um);
/// let spline = Function::new(&nodes, &values, Shape::Spline)?;
/// assert!((spline.at(Metres(0.2)).um() - 4.0).abs() < 1e-9);
/// assert!((spline.at(Metres(9.0)).um() - 16.0).abs() < 1e-9, "held beyond the last node");
/// assert!((spline.steepest() - 8e-5).abs() < 1e-15);
/// # Ok::<(), compensator::volumetric::function::FunctionError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Function<Q> {
    pieces: Pieces,
    shape: Shape,
    /// Standard uncertainties over the nodes, as straight lines.
    uncertainty: Option<Pieces>,
    /// By piece: how far it may be from its curve at the [`INSIDE`] of it, as standard uncertainties.
    between: Vec<[f64; 3]>,
    quantity: PhantomData<Q>,
}

impl<Q: Quantity> Function<Q> {
    /// The function through `values` at strictly increasing `nodes`.
    ///
    /// # Errors
    /// When there are fewer than two nodes, they do not increase, or a value is not finite.
    pub fn new(nodes: &[Metres], values: &[Q], shape: Shape) -> Result<Self, FunctionError> {
        let nodes: Vec<f64> = nodes.iter().map(|it| it.value()).collect();
        let values: Vec<f64> = values.iter().map(|it| it.value()).collect();
        Ok(Self {
            pieces: Pieces::new(&nodes, &values, shape)?,
            shape,
            uncertainty: None,
            between: Vec::new(),
            quantity: PhantomData,
        })
    }

    /// The same value everywhere from `low` to `high`.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn constant(low: Metres, high: Metres, value: Q) -> Result<Self, FunctionError> {
        Self::new(&[low, high], &[value; 2], Shape::Linear)
    }

    /// With a standard uncertainty for every node; straight lines between them.
    ///
    /// # Errors
    /// When there is another number of them than of nodes, or one is negative or not finite.
    pub fn with_uncertainties(mut self, uncertainties: &[Q]) -> Result<Self, FunctionError> {
        let values: Vec<f64> = uncertainties.iter().map(|it| it.value()).collect();
        if let Some(index) = values.iter().position(|u| u.is_nan() || *u < 0.0) {
            return Err(FunctionError::NotFinite { index });
        }
        let nodes: Vec<f64> = self.nodes().map(Metres::value).collect();
        self.uncertainty = Some(Pieces::new(&nodes, &values, Shape::Linear)?);
        Ok(self)
    }

    /// With how far the true function may be from this one between two nodes, as standard uncertainties: three for each
    /// interval, at a quarter, a half and three quarters of it, or one, in its middle, and then 4t(1 − t) of it at the
    /// share t of the interval.
    ///
    /// # Errors
    /// When there is another number of them than of intervals or three times that, or one is negative or not finite.
    pub fn with_between(mut self, uncertainties: &[Q]) -> Result<Self, FunctionError> {
        let values: Vec<f64> = uncertainties.iter().map(|it| it.value()).collect();
        let (seen, intervals) = (values.len(), self.pieces.segments.len());
        if seen != intervals && seen != INSIDE.len() * intervals {
            return Err(FunctionError::Lengths {
                seen,
                nodes: intervals,
            });
        }
        let sound = |u: &f64| u.is_finite() && *u >= 0.0;
        if let Some(index) = values.iter().position(|u| !sound(u)) {
            return Err(FunctionError::NotFinite { index });
        }
        self.between = if seen == intervals {
            values.iter().map(|middle| parabola(*middle)).collect()
        } else {
            let each = values.chunks_exact(INSIDE.len());
            each.map(|it| core::array::from_fn(|k| it[k])).collect()
        };
        Ok(self)
    }

    /// What [`with_between`](Self::with_between) said, three for each interval; `None` when it said nothing.
    pub fn between(&self) -> Option<Vec<Q>> {
        let known = !self.between.is_empty();
        let all = || self.between.iter().flatten().copied();
        known.then(|| all().map(Q::from_value).collect())
    }

    /// Its value at `position`; the end nodes' values beyond them. NaN for NaN.
    #[inline]
    pub fn at(&self, position: Metres) -> Q {
        if position.value().is_nan() {
            return Q::from_value(f64::NAN);
        }
        Q::from_value(self.pieces.at(position.value()))
    }

    /// Its standard uncertainty there, that between the nodes included; `None` when the nodes have none.
    pub fn standard_uncertainty(&self, position: Metres) -> Option<Q> {
        let at_nodes = self.uncertainty_of_nodes(position)?.value();
        let between = self.between_at(position).value();
        Some(Q::from_value(
            (at_nodes * at_nodes + between * between).sqrt(),
        ))
    }

    /// What its nodes' standard uncertainties make there, by straight lines; `None` when they have none.
    pub(super) fn uncertainty_of_nodes(&self, position: Metres) -> Option<Q> {
        let pieces = self.uncertainty.as_ref()?;
        Some(Q::from_value(pieces.at(position.value())))
    }

    /// How far the true function may be from this one there, by what it does between its nodes alone: a standard
    /// uncertainty; zero where [`with_between`](Self::with_between) said nothing.
    pub fn between_at(&self, position: Metres) -> Q {
        let (inside, at) = self.pieces.finder.find(position.value());
        let between = self.between.get(at).map_or(0.0, |own| {
            let piece = &self.pieces.segments[at];
            between_at(*own, (inside - piece.start) / piece.width)
        });
        Q::from_value(between)
    }

    /// Where its nodes are.
    pub fn nodes(&self) -> impl Iterator<Item = Metres> {
        let starts = self.pieces.segments.iter().map(|it| Metres(it.start));
        starts.chain([Metres(self.pieces.last)])
    }

    /// First and last node.
    pub fn range(&self) -> (Metres, Metres) {
        let (first, last) = self.pieces.range();
        (Metres(first), Metres(last))
    }

    /// How the values between two nodes are found.
    pub fn shape(&self) -> Shape {
        self.shape
    }

    /// The largest magnitude anywhere, in closed form.
    pub fn largest(&self) -> Q {
        Q::from_value(self.pieces.largest())
    }

    /// The largest magnitude of its slope anywhere, in its SI unit per metre, in closed form.
    pub fn steepest(&self) -> f64 {
        self.pieces.steepest()
    }

    pub(crate) fn pieces(&self) -> &Pieces {
        &self.pieces
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn function(shape: Shape) -> Function<Metres> {
        let nodes = [0.0, 0.1, 0.3, 0.4].map(Metres);
        let values = [0.0, 1e-6, 9e-6, 16e-6].map(Metres);
        Function::new(&nodes, &values, shape).unwrap()
    }

    #[test]
    fn every_shape_meets_its_nodes_and_holds_its_ends() {
        for shape in [Shape::Linear, Shape::MonotoneCubic, Shape::Spline] {
            let f = function(shape);
            for (x, y) in [
                (0.0, 0.0),
                (0.1, 1e-6),
                (0.3, 9e-6),
                (0.4, 16e-6),
                (9.0, 16e-6),
            ] {
                assert!(
                    (f.at(Metres(x)).value() - y).abs() < 1e-18,
                    "{shape:?} at {x}"
                );
            }
            assert_eq!(f.at(Metres(-5.0)), Metres(0.0));
            assert!(f.at(Metres(f64::NAN)).value().is_nan());
        }
    }

    /// The values are 1e-4·x² at all nodes, which a spline reproduces; 8 µm over 0.2 m is the
    /// straight line's slope there.
    #[test]
    fn slopes_are_those_of_the_interpolant_in_use() {
        assert!((function(Shape::Spline).at(Metres(0.2)).um() - 4.0).abs() < 1e-9);
        assert!((function(Shape::Spline).steepest() - 8e-5).abs() < 1e-15);
        assert!((function(Shape::Linear).at(Metres(0.2)).um() - 5.0).abs() < 1e-9);
        assert!((function(Shape::Linear).steepest() - 7e-5).abs() < 1e-15);
        assert!((function(Shape::Linear).largest().um() - 16.0).abs() < 1e-9);
    }

    #[test]
    fn uncertainties_belong_to_nodes() {
        let f = function(Shape::Linear);
        assert_eq!(f.standard_uncertainty(Metres(0.1)), None);
        let u = [1e-7, 3e-7, 3e-7, 3e-7].map(Metres);
        let f = f.with_uncertainties(&u).unwrap();
        assert!((f.standard_uncertainty(Metres(0.05)).unwrap().um() - 0.2).abs() < 1e-9);
        let wrong = f.with_uncertainties(&[Metres(-1.0); 4]).unwrap_err();
        assert_eq!(wrong, FunctionError::NotFinite { index: 0 });
    }

    /// At the first interval, from 0 to 0.1 m.
    #[track_caller]
    fn check_between(said: &[f64], expected: impl Fn(f64) -> f64) {
        let said: Vec<Metres> = said.iter().copied().map(Metres).collect();
        let f = function(Shape::Spline).with_between(&said).unwrap();
        for t in [0.0, 0.1, 0.25, 0.4, 0.5, 0.8, 1.0] {
            let seen = f.between_at(Metres(0.1 * t)).value();
            assert!((seen - expected(t)).abs() < 1e-18, "{seen} at {t}");
        }
        let again = function(Shape::Spline).with_between(&f.between().unwrap());
        let (seen, before) = (again.unwrap().between(), f.between());
        assert_eq!(seen, before);
    }

    /// 1 in the middle is 0.75 at the quarters of a parabola, 0.5625 at those of its square.
    #[test]
    fn what_is_between_nodes_has_the_shape_that_was_said() {
        check_between(&[1e-7; 3], |t| 1e-7 * 4.0 * t * (1.0 - t));
        let (quarter, half) = (0.5625e-7, 1e-7);
        let steep = [quarter, half, quarter].repeat(3);
        check_between(&steep, |t| 1e-7 * (4.0 * t * (1.0 - t)).powi(2));
        let aside = function(Shape::Spline).with_between(&[Metres(1.0); 4]);
        let expected = FunctionError::Lengths { seen: 4, nodes: 3 };
        assert_eq!(aside.unwrap_err(), expected);
        // Next to a node nothing is below zero, however steep it is.
        let steeper = [0.1e-7, 1e-7, 0.1e-7].repeat(3).into_iter().map(Metres);
        let f = function(Shape::Spline).with_between(&steeper.collect::<Vec<_>>());
        assert_eq!(f.unwrap().between_at(Metres(0.005)), Metres::ZERO);
    }

    #[test]
    fn nodes_that_are_none_are_refused_by_number() {
        let make = |nodes: &[f64], values: &[f64]| {
            let nodes: Vec<Metres> = nodes.iter().copied().map(Metres).collect();
            let values: Vec<Metres> = values.iter().copied().map(Metres).collect();
            Function::new(&nodes, &values, Shape::Linear).map(|_| ())
        };
        let too_few = FunctionError::TooFewNodes { seen: 1 };
        assert_eq!(make(&[0.0], &[0.0]), Err(too_few));
        let lengths = FunctionError::Lengths { seen: 1, nodes: 2 };
        assert_eq!(make(&[0.0, 1.0], &[0.0]), Err(lengths));
        let order = FunctionError::NotIncreasing { index: 2 };
        assert_eq!(make(&[0.0, 1.0, 1.0], &[0.0; 3]), Err(order));
        let value = FunctionError::NotFinite { index: 1 };
        assert_eq!(make(&[0.0, 1.0], &[0.0, f64::NAN]), Err(value));
    }
}
