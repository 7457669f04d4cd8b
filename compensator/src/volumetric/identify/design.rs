//! From readings to the rows of a linear problem.

use nalgebra::{DMatrix, SymmetricEigen};
use units::Metres;

use super::effect::{Effect, lever, seen, u_of};
use super::thermal::ThermalPlan;
use super::{Axis, FunctionPlan, IdentifyError, Observation, Plan, Reading, Unknown};
use crate::volumetric::Point;
use crate::volumetric::function::{Pieces, Shape};
use crate::volumetric::model::{ErrorName, Squareness};
use crate::volumetric::point::cross;

/// A target that rounding puts this far beyond the last node is at it.
const AT_THE_END_M: f64 = 1e-9;

/// One function's nodes and how its parameters make their values.
#[derive(Clone, Debug)]
pub(super) struct Block {
    pub(super) name: ErrorName,
    pub(super) nodes: Vec<f64>,
    /// What a value of 1 at one node alone makes of all places, by node.
    influences: Vec<Pieces>,
    /// nodes × parameters; its columns keep the conventions.
    pub(super) basis: DMatrix<f64>,
    /// The first of its parameters.
    pub(super) first: usize,
}

impl Block {
    /// The value at `position` per parameter.
    pub(super) fn row(&self, position: f64) -> Vec<f64> {
        let values: Vec<f64> = self.influences.iter().map(|it| it.at(position)).collect();
        let column = |column: usize| {
            let shares = self.basis.column(column).into_iter().zip(&values);
            shares.map(|(share, value)| share * value).sum()
        };
        (0..self.basis.ncols()).map(column).collect()
    }
}

/// What a value of 1 at each node alone makes of all places. Monotone cubics are not the sum of
/// what their nodes make: straight lines stand for them.
fn influences(nodes: &[f64], shape: Shape) -> Vec<Pieces> {
    let shape = match shape {
        Shape::Linear | Shape::MonotoneCubic => Shape::Linear,
        Shape::Spline => Shape::Spline,
    };
    let of = |node: usize| {
        let mut values = vec![0.0; nodes.len()];
        values[node] = 1.0;
        Pieces::new(nodes, &values, shape).expect("the nodes were checked")
    };
    (0..nodes.len()).map(of).collect()
}

/// The weighted problem.
#[derive(Clone, Debug)]
pub(super) struct Design {
    pub(super) blocks: Vec<Block>,
    /// What each column belongs to.
    pub(super) unknowns: Vec<Unknown>,
    /// Rows divided by their reading's standard uncertainty.
    pub(super) rows: Vec<f64>,
    pub(super) values: Vec<f64>,
}

impl Design {
    pub(super) fn new(plan: &Plan, observations: &[Observation]) -> Result<Self, IdentifyError> {
        plan.thermal.check(plan.runs.len())?;
        let (blocks, unknowns) = columns(plan)?;
        let above: Vec<Vec<f64>> = (0..plan.runs.len())
            .map(|run| plan.thermal.above_of_run(run))
            .collect();
        let mut design = Self {
            blocks,
            unknowns,
            rows: Vec::new(),
            values: Vec::new(),
        };
        let mut starts: Vec<Option<Point>> = vec![None; plan.runs.len()];
        for (index, observation) in observations.iter().enumerate() {
            design.check(plan, index, observation)?;
            let start = *starts[observation.run].get_or_insert(observation.at);
            design.add(plan, observation, start, &above[observation.run]);
        }
        Ok(design)
    }

    pub(super) fn columns(&self) -> usize {
        self.unknowns.len()
    }

    fn check(&self, plan: &Plan, index: usize, it: &Observation) -> Result<(), IdentifyError> {
        let (run, runs) = (it.run, plan.runs.len());
        if run >= runs {
            return Err(IdentifyError::Run { index, run, runs });
        }
        let reading = match it.reading {
            Reading::Length {
                along,
                deviation,
                u,
            } => {
                let square: f64 = along.iter().map(|k| k * k).sum();
                deviation.is_finite() && u > Metres::ZERO && (square - 1.0).abs() < 1e-9
            }
            Reading::Angle { deviation, u, .. } => deviation.is_finite() && u.value() > 0.0,
        };
        let mut numbers = it.at.array().into_iter().chain(it.tool.array());
        if !(reading && numbers.all(f64::is_finite)) {
            return Err(IdentifyError::NotUsable { index });
        }
        for block in &self.blocks {
            let axis = axis_of(block.name);
            let seen = it.at.along(axis);
            let (first, last) = (block.nodes[0], block.nodes[block.nodes.len() - 1]);
            if seen.value() < first - AT_THE_END_M || seen.value() > last + AT_THE_END_M {
                let name = block.name;
                return Err(IdentifyError::Outside {
                    index,
                    axis,
                    seen,
                    name,
                });
            }
        }
        Ok(())
    }

    /// How many of them belong to errors, the rest to the instrument's settings.
    pub(super) fn errors(&self) -> usize {
        let open = |it: &&Unknown| matches!(it, Unknown::Offset(_) | Unknown::Angle(_));
        self.unknowns.len() - self.unknowns.iter().filter(open).count()
    }

    fn add(&mut self, plan: &Plan, it: &Observation, start: Point, above: &[f64]) {
        let value = match it.reading {
            Reading::Length { deviation, .. } => deviation.value(),
            Reading::Angle { deviation, .. } => deviation.value(),
        };
        let u = u_of(it.reading);
        let errors = error_row(plan, &self.blocks, it.at, it.tool, above, |effect| {
            seen(it.reading, effect)
        });
        let setup = plan.runs[it.run];
        let way = (it.at - start).distance().value();
        let open = self.unknowns[errors.len()..]
            .iter()
            .map(|unknown| match unknown {
                Unknown::Offset(run) if *run == it.run => 1.0,
                Unknown::Angle(angle) => setup
                    .alignment
                    .filter(|own| own.angle == *angle)
                    .map_or(0.0, |own| own.factor * way),
                Unknown::Offset(_)
                | Unknown::Function(_)
                | Unknown::Squareness(_)
                | Unknown::Expansion(..)
                | Unknown::Bend(..) => 0.0,
            });
        self.rows
            .extend(errors.iter().copied().chain(open).map(|it| it / u));
        self.values.push(value / u);
    }
}

/// What each parameter of functions, squarenesses and warmth contributes, as `seen` sees it;
/// `above`: how far each thermometer is above its reference.
pub(super) fn error_row(
    plan: &Plan,
    blocks: &[Block],
    at: Point,
    tool: Point,
    above: &[f64],
    seen: impl Fn(&Effect) -> f64,
) -> Vec<f64> {
    let unit = |axis: Axis| core::array::from_fn(|k| f64::from(u8::from(k == axis.index())));
    let mut row = Vec::new();
    for block in blocks {
        let effect = match block.name {
            ErrorName::Along(_, direction) => Effect::displaced(unit(direction)),
            ErrorName::About(axis, direction) => {
                let turn = unit(direction);
                let moved = cross(turn, lever(plan, axis, at, tool));
                Effect { turn, moved }
            }
        };
        let factor = seen(&effect);
        let position = at.along(axis_of(block.name)).value();
        row.extend(block.row(position).into_iter().map(|it| it * factor));
    }
    for name in &plan.squarenesses {
        let mut one = [0.0; 3];
        one[*name as usize] = 1.0;
        let lean = Squareness::lean(one);
        let q = at.array();
        let moved =
            core::array::from_fn(|k| lean[0][k] * q[0] + lean[1][k] * q[1] + lean[2][k] * q[2]);
        row.push(seen(&Effect::displaced(moved)));
    }
    let warmth = ThermalPlan::effects(plan, at, above, |axis| lever(plan, axis, at, tool));
    row.extend(warmth.iter().map(&seen));
    row
}

fn axis_of(name: ErrorName) -> Axis {
    match name {
        ErrorName::Along(axis, _) | ErrorName::About(axis, _) => axis,
    }
}

fn columns(plan: &Plan) -> Result<(Vec<Block>, Vec<Unknown>), IdentifyError> {
    let (mut blocks, mut unknowns): (Vec<Block>, Vec<Unknown>) = (Vec::new(), Vec::new());
    for function in &plan.functions {
        let first = unknowns.len();
        let block = block(plan, function, first)?;
        if blocks.iter().any(|it| it.name == block.name) {
            let (name, least) = (block.name, 2);
            return Err(IdentifyError::Nodes { name, least });
        }
        let column = Unknown::Function(block.name);
        unknowns.extend(core::iter::repeat_n(column, block.basis.ncols()));
        blocks.push(block);
    }
    for name in &plan.squarenesses {
        let column = Unknown::Squareness(*name);
        if unknowns.contains(&column) {
            return Err(IdentifyError::Twice { name: *name });
        }
        unknowns.push(column);
    }
    unknowns.extend(plan.thermal.unknowns());
    let offsets = plan.runs.iter().enumerate().filter(|(_, it)| it.offset);
    unknowns.extend(offsets.map(|(run, _)| Unknown::Offset(run)));
    let angles = plan.runs.iter().filter_map(|it| it.alignment);
    let mut angles: Vec<usize> = angles.map(|it| it.angle).collect();
    angles.sort_unstable();
    angles.dedup();
    unknowns.extend(angles.into_iter().map(Unknown::Angle));
    Ok((blocks, unknowns))
}

fn block(plan: &Plan, function: &FunctionPlan, first: usize) -> Result<Block, IdentifyError> {
    let name = function.name;
    let nodes: Vec<f64> = function.nodes.iter().map(|it| it.value()).collect();
    let is_straightness = matches!(name, ErrorName::Along(axis, along) if axis != along);
    let least = if is_straightness { 3 } else { 2 };
    let ordered = nodes.windows(2).all(|it| it[0] < it[1]);
    let finite = nodes.iter().all(|it| it.is_finite());
    if nodes.len() < least || !ordered || !finite {
        return Err(IdentifyError::Nodes { name, least });
    }
    let count = nodes.len();
    let influences = influences(&nodes, plan.shape);
    let conditions = if is_straightness {
        let middle = (nodes[0] + nodes[count - 1]) / 2.0;
        let span = nodes[count - 1] - nodes[0];
        DMatrix::from_fn(2, count, |row, at| {
            if row == 0 {
                1.0
            } else {
                (nodes[at] - middle) / span
            }
        })
    } else {
        let zero = plan.zero.along(axis_of(name));
        if zero.value() < nodes[0] || zero.value() > nodes[count - 1] {
            return Err(IdentifyError::Zero { name, zero });
        }
        DMatrix::from_fn(1, count, |_, at| influences[at].at(zero.value()))
    };
    Ok(Block {
        name,
        basis: kernel(&conditions),
        influences,
        nodes,
        first,
    })
}

/// Orthonormal columns that span all values for which the conditions (independent rows) hold.
fn kernel(conditions: &DMatrix<f64>) -> DMatrix<f64> {
    let (rows, count) = conditions.shape();
    let gram = conditions * conditions.transpose();
    let inverse = gram.try_inverse().expect("the conditions are independent");
    let onto = DMatrix::identity(count, count) - conditions.transpose() * inverse * conditions;
    let eigen = SymmetricEigen::new(onto);
    let mut order: Vec<usize> = (0..count).collect();
    // Eigenvalues are 0 for the conditions and 1 for the rest.
    order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
    order.truncate(count - rows);
    eigen.eigenvectors.select_columns(&order)
}
