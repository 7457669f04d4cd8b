//! Where the deviation is largest, and which limits a machine needs.
//!
//! The place is looked for, not proven: on a coarse grid for each direction and sign, and from there
//! along one axis after the other over all nodes and the middles between them, until none is better.
//! Between those a smooth function is no more than a few per cent beyond them.

use units::{Metres, Quantity};

use super::{Conditions, VolumetricModel};
use crate::volumetric::point::V3;
use crate::volumetric::{Axis, Point};

/// Places of the coarse grid along each axis.
const COARSE: usize = 7;
/// So often it goes along all axes at most.
const ROUNDS: usize = 8;

/// The largest deviation in the volume.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extreme {
    /// Along which direction.
    pub along: Axis,
    /// Where.
    pub at: Point,
    /// The deviation there.
    pub deviation: Metres,
}

impl VolumetricModel {
    /// The largest deviation (actual − command) along any direction, over the volume.
    pub fn largest_deviation(&self, now: &Conditions) -> Extreme {
        let places = Axis::ALL.map(|axis| self.places(axis));
        let signs = Axis::ALL
            .into_iter()
            .flat_map(|along| [1.0, -1.0].map(|sign| (along, sign)));
        let each = signs.map(|(along, sign)| self.climb(now, &places, along, sign));
        let none = Extreme {
            along: Axis::X,
            at: self.machine.volume.low(),
            deviation: Metres::ZERO,
        };
        each.fold(none, |a, b| {
            if b.deviation.abs() > a.deviation.abs() {
                b
            } else {
                a
            }
        })
    }

    /// The largest effect on the tool that any function has by itself, at the longest tool: what the
    /// limit of size must be at least.
    pub fn largest_alone(&self) -> Metres {
        let each = self.stages.iter().flat_map(|stage| {
            let lever = self.bounds.levers[stage.axis];
            let effects = stage.errors.largest_effects(lever);
            effects.into_iter().map(Metres)
        });
        each.fold(Metres::ZERO, Quantity::max)
    }

    fn climb(&self, now: &Conditions, places: &[Vec<f64>; 3], along: Axis, sign: f64) -> Extreme {
        let value = |at: [usize; 3]| sign * self.deviation_of(now, places, at)[along.index()];
        let coarse = |k: usize| {
            let last = places[k].len() - 1;
            (0..COARSE).map(move |n| last * n / (COARSE - 1))
        };
        let grid =
            coarse(0).flat_map(|i| coarse(1).flat_map(move |j| coarse(2).map(move |k| [i, j, k])));
        let higher = |a: &[usize; 3], b: &[usize; 3]| value(*a).total_cmp(&value(*b));
        let mut best = grid.max_by(higher).unwrap_or([0; 3]);
        for _ in 0..ROUNDS {
            let before = best;
            for axis in 0..3 {
                let along = (0..places[axis].len()).map(|n| {
                    let mut at = best;
                    at[axis] = n;
                    at
                });
                best = along.max_by(higher).unwrap_or(best);
            }
            if best == before {
                break;
            }
        }
        Extreme {
            along,
            at: Point::of(core::array::from_fn(|k| places[k][best[k]])),
            deviation: Metres(sign * value(best)),
        }
    }

    fn deviation_of(&self, now: &Conditions, places: &[Vec<f64>; 3], at: [usize; 3]) -> V3 {
        let command = core::array::from_fn(|k| places[k][at[k]]);
        self.evaluate(command, now, &mut None)
    }

    /// Nodes and the middles between them, from one end of the volume to the other.
    fn places(&self, axis: Axis) -> Vec<f64> {
        let own = self.stages.iter().find(|it| it.axis == axis.index());
        let nodes = own.map_or_else(Vec::new, |it| it.errors.breaks());
        let middles = nodes.windows(2).map(|it| f64::midpoint(it[0], it[1]));
        let mut places: Vec<f64> = middles.chain(nodes.iter().copied()).collect();
        places.sort_by(f64::total_cmp);
        places
    }
}
