//! What one unit of an error does to the tool, and what a reading sees of it.

use super::{Axis, Observation, Plan, Reading};
use crate::volumetric::Point;
use crate::volumetric::point::V3;

/// What one unit of an error does to the tool.
#[derive(Clone, Copy, Debug)]
pub(super) struct Effect {
    /// A rotation.
    pub(super) turn: V3,
    /// A displacement, that by the rotation included.
    pub(super) moved: V3,
}

impl Effect {
    pub(super) const fn displaced(moved: V3) -> Self {
        Self {
            turn: [0.0; 3],
            moved,
        }
    }
}

/// What a reading sees of an effect.
pub(super) fn seen(reading: Reading, effect: &Effect) -> f64 {
    match reading {
        Reading::Length { along, .. } => dot(along, effect.moved),
        Reading::Angle { about, .. } => effect.turn[about.index()],
    }
}

impl Observation {
    /// Its standard uncertainty without what it has in common with others, in its SI unit.
    pub(super) fn u_by_itself(&self) -> f64 {
        let u = u_of(self.reading);
        (u * u - self.shared_square()).sqrt()
    }

    /// The square of what it has in common with others, likewise.
    pub(super) fn shared_square(&self) -> f64 {
        self.common * self.common + self.common_of_run * self.common_of_run
    }
}

/// The standard uncertainty of a reading, in its SI unit.
pub(super) fn u_of(reading: Reading) -> f64 {
    match reading {
        Reading::Length { u, .. } => u.value(),
        Reading::Angle { u, .. } => u.value(),
    }
}

pub(super) fn lever(plan: &Plan, axis: Axis, at: Point, tool: Point) -> V3 {
    plan.chain.lever(axis, at, tool).array()
}

fn dot(a: V3, b: V3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
