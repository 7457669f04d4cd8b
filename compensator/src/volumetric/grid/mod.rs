//! A map of deviations measured at the nodes of a grid in space, as an alternative to the model.
//!
//! Between the nodes it is trilinear, or the tensor product of cubic splines, whose second
//! derivatives are continuous (C. de Boor, A Practical Guide to Splines (1978), chapters X and
//! XVII; ends without knots next to them). Grids may have uneven distances along each axis. The
//! splines are kept as coefficients of B-splines, so that a call reads 64 of them for each
//! component, wherever it is: sixteen rows along z, all components together.
//!
//! Bounds are proven: a trilinear map is steepest along an edge of a cell; the derivative of a
//! spline is itself a spline of coefficients 3(c₁ − c₀)/(t₃ − t₀), whose largest magnitude it
//! never exceeds.
//!
//! A map knows nothing of tools and temperatures: it holds for the tool it was measured with.
//!
//! Absent: scattered points, extrapolation (commands beyond the ends get the ends' deviation).

use units::{Metres, MetresPerSecond};

use super::inverse::{LIPSCHITZ_MAX, deviation_at_target};
use super::point::{V3, check_size};
use super::{Axis, NoCorrection, Point, Volume};
use crate::error_table::Limits;

mod spline;
mod trilinear;

use spline::Splines;
use trilinear::Trilinear;

/// How the deviation between the nodes is found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GridShape {
    /// Linear along each axis.
    Trilinear,
    /// Cubic splines along each axis, with continuous second derivatives.
    Tricubic,
}

/// Why there is no map.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum GridError {
    /// Fewer than two nodes along an axis.
    #[error("deviation map, axis {axis}: {seen} node(s); at least 2 are needed")]
    TooFewNodes {
        /// Which axis.
        axis: Axis,
        /// Nodes given.
        seen: usize,
    },
    /// A node not beyond the one before it, or not a number.
    #[error(
        "deviation map, axis {axis}, node {index}: its position does not follow the one before"
    )]
    NotIncreasing {
        /// Which axis.
        axis: Axis,
        /// Which node, from 0.
        index: usize,
    },
    /// Another number of deviations than of nodes.
    #[error("deviation map: {seen} deviations for {expected} nodes")]
    Length {
        /// Deviations given.
        seen: usize,
        /// Nodes: the product of the three counts.
        expected: usize,
    },
    /// A limit that is none.
    #[error("deviation map: the limits must be positive and the slope at most {LIPSCHITZ_MAX}, \
        seen {:.3} um, slope {}, {} m/s", size.um(), slope, rate.value())]
    Limits {
        /// Limit of size.
        size: Metres,
        /// Limit of slope.
        slope: f64,
        /// Limit of rate.
        rate: MetresPerSecond,
    },
    /// A deviation larger than the limit, or not a number.
    #[error("deviation map, node ({}, {}, {}) mm: the deviation is {:.3} um, the limit {:.3} um; \
        millimetres taken for micrometres, or the map of another machine?",
        units::Short(at.x.mm()), units::Short(at.y.mm()), units::Short(at.z.mm()), seen.um(),
        limit.um())]
    TooLarge {
        /// Where.
        at: Point,
        /// Its largest component.
        seen: Metres,
        /// The limit.
        limit: Metres,
    },
    /// Steeper than the limit allows.
    #[error("deviation map: the deviation may change by {:.1} um per mm, mostly along {axis}; the \
        limit is {:.1}", seen * 1e3, limit * 1e3)]
    TooSteep {
        /// The bound of the slope.
        seen: f64,
        /// The limit.
        limit: f64,
        /// The axis along which it is steepest.
        axis: Axis,
    },
    /// From a slope of 1 on there may be no command, or several, for a target.
    #[error(
        "deviation map: the deviation may change by {seen:.3} per command, mostly along {axis}; \
        from 1 on the correction has no unique inverse"
    )]
    NotContracting {
        /// The bound of the slope.
        seen: f64,
        /// The axis along which it is steepest.
        axis: Axis,
    },
}

#[derive(Clone, Debug)]
enum Kind {
    Trilinear(Trilinear),
    Tricubic(Splines),
}

/// A map made ready to be applied: no allocation and a constant time per call.
#[derive(Clone, Debug)]
pub struct GridMap {
    kind: Kind,
    volume: Volume,
    commands: Volume,
    limits: Limits,
    lipschitz: f64,
}

impl GridMap {
    /// The map with `deviations` (actual − command) at `nodes` along x, y and z, which are the
    /// commands they were measured at: z changes fastest, then y. The slope limit is for the
    /// bound of |Δ deviation| per |Δ command|, 0.5 at most.
    ///
    /// # Errors
    /// When nodes or deviations do not form a grid, a limit is none or exceeded, or the inverse
    /// cannot be proven unique.
    pub fn new(
        nodes: [&[Metres]; 3],
        deviations: &[Point],
        shape: GridShape,
        limits: Limits,
    ) -> Result<Self, GridError> {
        let nodes = nodes.map(|it| it.iter().map(|m| m.value()).collect::<Vec<f64>>());
        check(&nodes, deviations, &limits)?;
        let volume = {
            let ends =
                |of: fn(&Vec<f64>) -> f64| Point::of(core::array::from_fn(|k| of(&nodes[k])));
            Volume::new(ends(|it| it[0]), ends(|it| it[it.len() - 1]))
                .expect("nodes were just found increasing and finite")
        };
        let values: Vec<V3> = deviations.iter().map(|it| it.array()).collect();
        let (kind, slopes) = match shape {
            GridShape::Trilinear => {
                let (map, slopes) = Trilinear::new(&nodes, &values);
                (Kind::Trilinear(map), slopes)
            }
            GridShape::Tricubic => {
                let (map, slopes) = Splines::new(&nodes, &values);
                (Kind::Tricubic(map), slopes)
            }
        };
        let lipschitz = check_slopes(slopes, limits.slope)?;
        let reach = limits.size;
        let grown = Point::new(reach, reach, reach);
        let commands = Volume::new(volume.low() - grown, volume.high() + grown)
            .expect("a volume that grows stays one");
        Ok(Self {
            kind,
            volume,
            commands,
            limits,
            lipschitz,
        })
    }

    /// The deviation (actual − command) of the tool at a command.
    ///
    /// # Errors
    /// When the command is outside the map by more than the limit of size, or the deviation
    /// exceeds that limit.
    #[inline]
    pub fn deviation(&self, command: Point) -> Result<Point, NoCorrection> {
        self.commands.check(command)?;
        let deviation = match &self.kind {
            Kind::Trilinear(map) => map.at(command.array()),
            Kind::Tricubic(map) => map.at(command.array()),
        };
        check_size(deviation, self.limits.size.value())?;
        Ok(Point::of(deviation))
    }

    /// The command that brings the tool to `target`: command + deviation(command) = target, to
    /// ten picometres.
    ///
    /// # Errors
    /// When the target is outside the map or the deviation exceeds its limit.
    #[inline]
    pub fn command(&self, target: Point) -> Result<Point, NoCorrection> {
        self.volume.check(target)?;
        let target = target.array();
        let deviation = match &self.kind {
            Kind::Trilinear(map) => deviation_at_target(target, self.lipschitz, |at| map.at(at)),
            Kind::Tricubic(map) => deviation_at_target(target, self.lipschitz, |at| map.at(at)),
        };
        check_size(deviation, self.limits.size.value())?;
        Ok(Point::of(core::array::from_fn(|k| {
            target[k] - deviation[k]
        })))
    }

    /// From the first to the last node of each axis.
    pub fn volume(&self) -> Volume {
        self.volume
    }

    /// How the deviation between the nodes is found.
    pub fn shape(&self) -> GridShape {
        match self.kind {
            Kind::Trilinear(_) => GridShape::Trilinear,
            Kind::Tricubic(_) => GridShape::Tricubic,
        }
    }

    /// The limits it was checked against.
    pub fn limits(&self) -> Limits {
        self.limits
    }

    /// The proven bound of |Δ deviation| per |Δ command|, both by their largest component.
    pub fn lipschitz(&self) -> f64 {
        self.lipschitz
    }

    /// The speed above which the correction might have to change faster than the rate limit.
    pub fn speed_max(&self) -> MetresPerSecond {
        MetresPerSecond(self.limits.rate.value() / self.lipschitz)
    }
}

fn check(nodes: &[Vec<f64>; 3], deviations: &[Point], limits: &Limits) -> Result<(), GridError> {
    let Limits { size, slope, rate } = *limits;
    let finite = size.is_finite() && rate.is_finite() && slope <= LIPSCHITZ_MAX;
    if !(size > Metres::ZERO && rate > MetresPerSecond::ZERO && slope > 0.0 && finite) {
        return Err(GridError::Limits { size, slope, rate });
    }
    for axis in Axis::ALL {
        let own = &nodes[axis.index()];
        if own.len() < 2 {
            let seen = own.len();
            return Err(GridError::TooFewNodes { axis, seen });
        }
        let follows = |i: &usize| own[*i].is_finite() && (*i == 0 || own[*i] > own[i - 1]);
        if let Some(index) = (0..own.len()).find(|i| !follows(i)) {
            return Err(GridError::NotIncreasing { axis, index });
        }
    }
    let [x, y, z] = nodes;
    let (seen, expected) = (deviations.len(), x.len() * y.len() * z.len());
    if seen != expected {
        return Err(GridError::Length { seen, expected });
    }
    for (index, deviation) in deviations.iter().enumerate() {
        let components = deviation.array();
        if let Some(seen) = components
            .into_iter()
            .find(|it| it.is_nan() || it.abs() > size.value())
        {
            let line = index / z.len();
            let at = [x[line / y.len()], y[line % y.len()], z[index % z.len()]];
            return Err(GridError::TooLarge {
                at: Point::of(at),
                seen: Metres(seen),
                limit: size,
            });
        }
    }
    Ok(())
}

/// `slopes`: for each axis the largest derivative of each component by its position.
fn check_slopes(slopes: [V3; 3], limit: f64) -> Result<f64, GridError> {
    let row = |k: usize| slopes[0][k] + slopes[1][k] + slopes[2][k];
    let seen = row(0).max(row(1)).max(row(2));
    let most = |axis: &Axis| slopes[axis.index()].into_iter().fold(0.0, f64::max);
    let steepest = Axis::ALL
        .into_iter()
        .max_by(|a, b| most(a).total_cmp(&most(b)));
    let axis = steepest.expect("there are three");
    if seen.is_nan() || seen >= 1.0 {
        return Err(GridError::NotContracting { seen, axis });
    }
    if seen > limit {
        return Err(GridError::TooSteep { seen, limit, axis });
    }
    Ok(seen)
}

#[cfg(test)]
mod tests;
