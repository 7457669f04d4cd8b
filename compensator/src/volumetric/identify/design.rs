//! From readings to the rows of a linear problem.

use nalgebra::DMatrix;
use units::Metres;

use super::between::{Between, Extent};
use super::block::{Block, axis_of, block};
use super::effect::{Effect, lever, seen, u_of};
use super::thermal::ThermalPlan;
use super::whiten::Whitening;
use super::{Axis, IdentifyError, Observation, Plan, Reading, Unknown};
use crate::least_squares::{self, Fit};
use crate::volumetric::Point;
use crate::volumetric::model::{ErrorName, Squareness};
use crate::volumetric::point::cross;

/// A target that rounding puts this far beyond the last node is at it.
const AT_THE_END_M: f64 = 1e-9;

/// The weighted problem.
#[derive(Clone, Debug)]
pub(super) struct Design {
    pub(super) blocks: Vec<Block>,
    /// What each column belongs to.
    pub(super) unknowns: Vec<Unknown>,
    /// Rows divided by their reading's standard uncertainty, made independent of each other.
    pub(super) rows: Vec<f64>,
    pub(super) values: Vec<f64>,
    /// By what they were divided and made independent.
    pub(super) whitening: Whitening,
    /// How far that is.
    pub(super) between: Between,
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
            whitening: Whitening::default(),
            between: Between::default(),
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
        let u = u_of(it.reading);
        let reading = reading && it.shared_square() < u * u;
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
        let u = it.u_by_itself();
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
        self.whitening.push(u);
    }

    /// Weighted with what the functions do between their nodes, which is told by a first fit; `wrong`:
    /// columns of what is grossly wrong in the readings, which is no part of that.
    pub(super) fn with_between(
        self,
        plan: &Plan,
        observations: &[Observation],
        wrong: &[Vec<f64>],
        extent: Extent,
    ) -> Result<Self, IdentifyError> {
        let columns = self.columns();
        let rows = self.rows.chunks_exact(columns).enumerate();
        let rows: Vec<f64> = rows
            .flat_map(|(at, row)| {
                row.iter()
                    .copied()
                    .chain(wrong.iter().map(move |it| it[at]))
            })
            .collect();
        let fit = least_squares::solve(&rows, columns + wrong.len(), &self.values)?;
        Ok(self.between(plan, observations, &fit, extent))
    }

    /// Likewise, told by a fit of these and any other unknowns.
    pub(super) fn between(
        mut self,
        plan: &Plan,
        observations: &[Observation],
        fit: &Fit,
        extent: Extent,
    ) -> Self {
        let columns = self.columns();
        self.between = Between::of(&self.blocks, fit, plan.shape, extent);
        let shared = self.shared(plan, observations);
        self.whitening.share(shared);
        self.whitening.whiten(&mut self.rows, columns);
        self.whitening.whiten(&mut self.values, 1);
        self
    }

    /// The covariance of what readings share, in units of their own uncertainties: what the functions do between their
    /// nodes, an error of the instrument that all of them have, and those of detectors that all readings of a run have.
    fn shared(&self, plan: &Plan, observations: &[Observation]) -> DMatrix<f64> {
        let count = observations.len();
        let mut covariance = DMatrix::zeros(count, count);
        for (number, block) in self.blocks.iter().enumerate() {
            let read = observations.iter().zip(self.whitening.own());
            let read = read.map(|(it, u)| {
                let effect = effect_of(plan, block.name, it.at, it.tool);
                let position = it.at.along(axis_of(block.name)).value();
                (position, seen(it.reading, &effect) / u)
            });
            let read: Vec<(f64, f64)> = read.collect();
            let between = &self.between;
            between.add_shared(number, block, &read, &mut covariance);
        }
        let common = self.common(observations);
        let of_run = self.common_of_runs(observations);
        for i in 0..count {
            for j in 0..count {
                covariance[(i, j)] += common[i] * common[j];
                if observations[i].run == observations[j].run {
                    covariance[(i, j)] += of_run[i] * of_run[j];
                }
            }
        }
        covariance
    }

    /// What one error of the instrument makes of each reading, in units of its own uncertainty.
    pub(super) fn common(&self, observations: &[Observation]) -> Vec<f64> {
        let each = observations.iter().zip(self.whitening.own());
        each.map(|(it, u)| it.common / u).collect()
    }

    /// Likewise one error of the detector of its run.
    pub(super) fn common_of_runs(&self, observations: &[Observation]) -> Vec<f64> {
        let each = observations.iter().zip(self.whitening.own());
        each.map(|(it, u)| it.common_of_run / u).collect()
    }
}

/// The square of what functions may be from their curves at a place, as `seen` sees it.
pub(super) fn between_square(
    plan: &Plan,
    blocks: &[Block],
    between: &Between,
    at: Point,
    tool: Point,
    seen: impl Fn(&Effect) -> f64,
) -> f64 {
    let each = blocks.iter().enumerate().map(|(number, block)| {
        let position = at.along(axis_of(block.name)).value();
        let effect = effect_of(plan, block.name, at, tool);
        let u = seen(&effect) * between.at(number, block, position);
        u * u
    });
    each.sum()
}

/// What one unit of an error function does to the tool.
fn effect_of(plan: &Plan, name: ErrorName, at: Point, tool: Point) -> Effect {
    let unit = |axis: Axis| core::array::from_fn(|k| f64::from(u8::from(k == axis.index())));
    match name {
        ErrorName::Along(_, direction) => Effect::displaced(unit(direction)),
        ErrorName::About(axis, direction) => {
            let turn = unit(direction);
            let moved = cross(turn, lever(plan, axis, at, tool));
            Effect { turn, moved }
        }
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
    let mut row = Vec::new();
    for block in blocks {
        let effect = effect_of(plan, block.name, at, tool);
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
