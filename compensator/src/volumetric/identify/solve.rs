//! The errors by weighted least squares, with their covariance.

use units::{Celsius, Metres, Radians};

use super::between::Between;
use super::block::Block;
use super::design::{Design, between_square, error_row};
use super::heat::add_heat;
use super::thermal::{IdentifiedBend, IdentifiedExpansion};
use super::{Axis, IdentifyError, Observation, Plan, Point, Quantity, SquarenessName};
use crate::least_squares::{self, Fit};
use crate::volumetric::function::{Function, FunctionError, Shape};
use crate::volumetric::model::{
    AxisErrors, COVARIANCE_ENTRIES, Coefficient, CoefficientCovariance, ErrorCovariance, ErrorName,
    Squareness,
};

/// One function found: values and uncertainties in SI units, metres or radians by its name.
#[derive(Clone, Debug, PartialEq)]
pub struct IdentifiedFunction {
    /// Which one.
    pub name: ErrorName,
    /// Where.
    pub nodes: Vec<Metres>,
    /// Its values at the nodes, metres or radians.
    pub values: Vec<f64>,
    /// Their standard uncertainties.
    pub u: Vec<f64>,
    /// At a quarter, a half and three quarters of each interval between nodes, the standard uncertainty of how far
    /// the error is from its curve there.
    pub u_between: Vec<f64>,
}

/// Errors found, with what is known of their uncertainty.
///
/// Standard uncertainties are propagated from those of the readings, with what the functions do between
/// their nodes where they were read there ([`IdentifiedFunction::u_between`]), enlarged by the scatter of
/// the readings about the model where that is larger than stated (Birge's ratio).
#[derive(Clone, Debug)]
pub struct Identified {
    plan: Plan,
    blocks: Vec<Block>,
    between: Between,
    /// By reading: its standard uncertainty with how far the functions may be from their curves there, given
    /// what all others say of that.
    pub(super) u: Vec<f64>,
    /// The functions, in the order of the plan.
    pub functions: Vec<IdentifiedFunction>,
    /// The squarenesses; zero where not planned.
    pub squareness: Squareness,
    /// The expansions, in the order of the plan.
    pub expansions: Vec<IdentifiedExpansion>,
    /// The bends, in the order of the plan.
    pub bends: Vec<IdentifiedBend>,
    /// Readings − unknowns.
    pub degrees_of_freedom: usize,
    /// Scatter of the readings in units of their uncertainty; 1 when these are right, `None`
    /// without spare readings.
    pub birge_ratio: Option<f64>,
    /// The same were the functions as far from their curves between the nodes as they can be; told where the
    /// likely scatter is beyond its limit.
    pub(super) ratio_at_least: Option<f64>,
    /// Reading − model of each reading, in units of its uncertainty.
    pub residuals: Vec<f64>,
    /// How much of an error of each reading is left in its own residual: 1 when all of it is, 0
    /// when nothing else tells what this reading does.
    pub redundancies: Vec<f64>,
    /// Of the parameters of functions, squarenesses and warmth alone.
    covariance: Vec<f64>,
}

impl Identified {
    /// The functions as errors of the three axes.
    ///
    /// # Errors
    /// Never for functions found; nodes and values are checked again.
    pub fn axis_errors(&self, shape: Shape) -> Result<[AxisErrors; 3], FunctionError> {
        let mut axes: [AxisErrors; 3] = Default::default();
        for it in &self.functions {
            match it.name {
                ErrorName::Along(axis, k) => {
                    axes[axis.index()].along[k.index()] = Some(function(it, shape, Metres)?);
                }
                ErrorName::About(axis, k) => {
                    axes[axis.index()].about[k.index()] = Some(function(it, shape, Radians)?);
                }
            }
        }
        Ok(axes)
    }

    /// The standard uncertainty of the deviation that the errors found make at a place, their
    /// covariances included: between readings it is far below what the functions' own
    /// uncertainties would make of it. `temperatures`: what the thermometers show, as far as it
    /// is not their references; not how sure that is. `None` outside the nodes.
    pub fn standard_uncertainty(
        &self,
        at: Point,
        tool: Point,
        temperatures: &[Celsius],
    ) -> Option<Point> {
        let inside = |block: &Block| block.reaches(at.along(block.axis()).value());
        if !self.blocks.iter().all(inside) {
            return None;
        }
        let above = self.plan.thermal.above(temperatures);
        let u = Axis::ALL.map(|axis| {
            let row = error_row(&self.plan, &self.blocks, at, tool, &above, |effect| {
                effect.moved[axis.index()]
            });
            let variance = crate::uncertainty::propagate(&row, &self.covariance);
            let (blocks, between) = (&self.blocks, &self.between);
            let square = between_square(&self.plan, blocks, between, at, tool, |effect| {
                effect.moved[axis.index()]
            });
            Metres((variance.max(0.0) + square).sqrt())
        });
        Some(Point::new(u[0], u[1], u[2]))
    }

    /// What functions, squarenesses and thermal coefficients have in common, at places on a grid whose `positions` along
    /// x, y and z are given; what the functions do between their nodes is not in it. `None` when a place is outside the
    /// nodes.
    pub fn covariance(&self, positions: [Vec<Metres>; 3]) -> Option<ErrorCovariance> {
        let [of_x, of_y, of_z] = &positions;
        let mut places = Vec::new();
        for &x in of_x {
            for &y in of_y {
                places.extend(of_z.iter().map(|&z| self.rows_at(Point::new(x, y, z))));
            }
        }
        let is_inside = |axis: Axis, it: &Metres| {
            let own = self.blocks.iter().filter(|block| block.axis() == axis);
            own.into_iter().all(|block| block.reaches(it.value()))
        };
        let mut each = Axis::ALL.into_iter().zip(&positions);
        let inside = each.all(|(axis, own)| own.iter().all(|it| is_inside(axis, it)));
        inside.then_some(())?;
        let errors = places.iter().map(|rows| self.covariance_of(rows));
        let errors = ErrorCovariance::new(positions, errors.collect()).ok()?;
        errors.with_coefficients(self.coefficients(&places)).ok()
    }

    /// What each parameter makes of the tool's deviation along x, y and z and of its turn about them.
    fn rows_at(&self, at: Point) -> [Vec<f64>; 6] {
        // The thermometers' references: what warmth does is uncertain by itself.
        let above = vec![0.0; self.plan.thermal.references.len()];
        let seen = |component: usize| {
            error_row(
                &self.plan,
                &self.blocks,
                at,
                Point::ZERO,
                &above,
                |effect| {
                    let own = [effect.moved, effect.turn].concat();
                    own[component]
                },
            )
        };
        core::array::from_fn(seen)
    }

    fn covariance_of(&self, rows: &[Vec<f64>; 6]) -> [f64; COVARIANCE_ENTRIES] {
        let columns = rows[0].len();
        let mut entries = [0.0; COVARIANCE_ENTRIES];
        let pairs = (0..6).flat_map(|i| (i..6).map(move |k| (i, k)));
        for (entry, (i, k)) in entries.iter_mut().zip(pairs) {
            let pulled = self.covariance.chunks_exact(columns);
            let pulled =
                pulled.map(|row| row.iter().zip(&rows[k]).map(|(a, b)| a * b).sum::<f64>());
            *entry = rows[i].iter().zip(pulled).map(|(a, b)| a * b).sum();
        }
        entries
    }

    /// What the thermal coefficients have in common with each other, and with what `places` are the rows of.
    fn coefficients(&self, places: &[[Vec<f64>; 6]]) -> CoefficientCovariance {
        let expansions = self.expansions.iter();
        let expansions = expansions.map(|it| Coefficient::Expansion(it.plan.axis));
        let bends = self.bends.iter();
        let bends = bends.map(|it| Coefficient::Bend(it.plan.axis, it.plan.towards));
        let coefficients: Vec<Coefficient> = expansions.chain(bends).collect();
        let count = coefficients.len();
        let columns = self.covariance.len().isqrt();
        // They are the last parameters.
        let own = |at: usize| columns - count + at;
        let between = |i: usize, k: usize| self.covariance[i * columns + k];
        let size = |at: usize| between(own(at), own(at)).max(0.0).sqrt();
        // What is known for certain has nothing in common with anything.
        let shared = |value: f64, of: f64| if of > 0.0 { value / of } else { 0.0 };
        let correlation = |i: usize, k: usize| {
            if i == k {
                return 1.0;
            }
            let (low, high) = (i.min(k), i.max(k));
            shared(between(own(low), own(high)), size(low) * size(high)).clamp(-1.0, 1.0)
        };
        let pairs = (0..count).flat_map(|i| (0..count).map(move |k| (i, k)));
        let with = |row: &Vec<f64>, at: usize| {
            let each = row.iter().enumerate();
            let sum = each.map(|(column, it)| it * between(column, own(at)));
            shared(sum.sum(), size(at))
        };
        let with_errors = places.iter().map(|rows| {
            let of_one = |at: usize| rows.each_ref().map(|row| with(row, at));
            (0..count).map(of_one).collect()
        });
        CoefficientCovariance {
            correlations: pairs.map(|(i, k)| correlation(i, k)).collect(),
            with_errors: with_errors.collect(),
            coefficients,
        }
    }
}

fn function<Q: Quantity>(
    it: &IdentifiedFunction,
    shape: Shape,
    unit: fn(f64) -> Q,
) -> Result<Function<Q>, FunctionError> {
    let of = |values: &[f64]| -> Vec<Q> { values.iter().copied().map(unit).collect() };
    let function = Function::new(&it.nodes, &of(&it.values), shape)?;
    function
        .with_uncertainties(&of(&it.u))?
        .with_between(&of(&it.u_between))
}

pub(super) fn solve(
    plan: &Plan,
    design: &Design,
    observations: &[Observation],
) -> Result<Identified, IdentifyError> {
    let all = design.columns();
    let fit = least_squares::solve(&design.rows, all, &design.values)?;
    let birge_ratio = fit.residual_sd();
    let enlarged = birge_ratio.unwrap_or(1.0).max(1.0);
    let functions: usize = design.blocks.iter().map(|it| it.basis.ncols()).sum();
    let count = design.errors();
    let mut covariance: Vec<f64> = (0..count * count)
        .map(|at| fit.cofactor[at / count * all + at % count] * enlarged * enlarged)
        .collect();
    add_heat(plan, design, observations, &fit, &mut covariance);
    let alone = alone(design, &fit);
    let found = design.blocks.iter().enumerate().map(|(number, block)| {
        let mut gradient = vec![0.0; count];
        let (mut values, mut u) = (Vec::new(), Vec::new());
        for node in 0..block.nodes.len() {
            gradient.fill(0.0);
            let mut value = 0.0;
            for column in 0..block.basis.ncols() {
                let part = block.basis[(node, column)];
                gradient[block.first + column] = part;
                value += part * fit.coefficients[block.first + column];
            }
            values.push(value);
            let variance = crate::uncertainty::propagate(&gradient, &covariance);
            u.push(variance.max(0.0).sqrt());
        }
        IdentifiedFunction {
            name: block.name,
            nodes: block.nodes.iter().copied().map(Metres).collect(),
            values,
            u,
            u_between: design.between.of_block(number, block),
        }
    });
    let known = |column: usize| {
        let u = covariance[column * count + column].max(0.0).sqrt();
        (fit.coefficients[column], u)
    };
    let warmth = functions + plan.squarenesses.len();
    let (expansions, bends) = thermal(plan, &|at| known(warmth + at));
    Ok(Identified {
        plan: plan.clone(),
        functions: found.collect(),
        blocks: design.blocks.clone(),
        between: design.between.clone(),
        u: alone.iter().map(|it| it.u).collect(),
        squareness: squareness(plan, &|at| known(functions + at)),
        expansions,
        bends,
        degrees_of_freedom: fit.degrees_of_freedom,
        birge_ratio,
        ratio_at_least: birge_ratio,
        redundancies: alone.iter().map(|it| it.redundancy).collect(),
        residuals: alone.iter().map(|it| it.residual).collect(),
        covariance,
    })
}

/// A reading by itself, given what the others say of the errors that it shares with them.
struct Alone {
    /// Its standard uncertainty, in its SI unit.
    u: f64,
    /// Reading − model in units of that.
    residual: f64,
    /// One less what it has to say of its own model value.
    redundancy: f64,
}

fn alone(design: &Design, fit: &Fit) -> Vec<Alone> {
    let columns = design.columns();
    let of_one = |column: Vec<f64>| {
        let (mut square, mut product) = (0.0, 0.0);
        let mut pull = vec![0.0; columns];
        let rows = design.rows.chunks_exact(columns);
        let seen = column.iter().zip(rows).zip(&fit.residuals);
        for ((it, row), residual) in seen.filter(|((it, _), _)| **it != 0.0) {
            square += it * it;
            product += it * residual;
            let pairs = pull.iter_mut().zip(row);
            pairs.for_each(|(sum, part)| *sum += it * part);
        }
        Alone {
            u: 1.0 / square.sqrt(),
            residual: product / square.sqrt(),
            redundancy: (1.0 - fit.variance(&pull, 1.0) / square).clamp(0.0, 1.0),
        }
    };
    design.whitening.of_each().into_iter().map(of_one).collect()
}

/// By `known` of their number: value and standard uncertainty.
fn squareness(plan: &Plan, known: &impl Fn(usize) -> (f64, f64)) -> Squareness {
    let mut squareness = Squareness::default();
    for (at, name) in plan.squarenesses.iter().enumerate() {
        let (value, u) = known(at);
        match name {
            SquarenessName::YToX => squareness.y_to_x = Radians(value),
            SquarenessName::ZToX => squareness.z_to_x = Radians(value),
            SquarenessName::ZToY => squareness.z_to_y = Radians(value),
        }
        squareness.u[*name as usize] = Radians(u);
    }
    squareness
}

fn thermal(
    plan: &Plan,
    known: &impl Fn(usize) -> (f64, f64),
) -> (Vec<IdentifiedExpansion>, Vec<IdentifiedBend>) {
    let expansions = plan.thermal.expansions.iter().enumerate();
    let expansions = expansions.map(|(at, it)| {
        let (per_kelvin, u) = known(at);
        let plan = it.clone();
        IdentifiedExpansion {
            plan,
            per_kelvin,
            u,
        }
    });
    let bends = plan.thermal.bends.iter().enumerate();
    let bends = bends.map(|(at, it)| {
        let (bow, u) = known(plan.thermal.expansions.len() + at);
        IdentifiedBend {
            plan: *it,
            bow: Metres(bow),
            u: Metres(u),
        }
    });
    (expansions.collect(), bends.collect())
}
