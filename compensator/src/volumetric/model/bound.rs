//! How fast the deviation can change with the command, proven from the functions' extremes.
//!
//! The tool is followed from its end of the chain to the workpiece, as in the evaluation, with
//! magnitudes in place of values. At every axis, with p the place reached, A and A' what its
//! tilts and their slopes are at most, D and D' the same of its displacements,
//!
//! |Δp| ≤ (M(A) + M(A)²/2)·p + D,
//!
//! where M(A)·p is what |a × p| can be. The derivative by the axis's own position is at most
//! (M(A') + (M(A')M(A) + M(A)M(A'))/2)·p + D' (when the slide carries the workpiece, with its own
//! unit vector also turned by the tilt), that by the positions met before (I + M(A) + M(A)²/2)
//! times what it was, their unit vectors included. The Lipschitz constant in the largest
//! component is the largest row sum.

use super::errors::ErrorName;
use crate::volumetric::Axis;
use crate::volumetric::point::{V3, add, cross_bound};

/// What one axis can contribute at most.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct AxisBound {
    /// Magnitudes of displacements, their slopes, tilts, their slopes.
    pub(super) along: V3,
    pub(super) along_slope: V3,
    pub(super) about: V3,
    pub(super) about_slope: V3,
    /// The largest magnitude of its position.
    pub(super) position: f64,
    pub(super) on_workpiece: bool,
}

/// What is proven of a model.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounds {
    /// Largest |Δ deviation| per |Δ command|, both by the largest component.
    pub(super) lipschitz: f64,
    /// What each axis's tilts act on, at most, by axis.
    pub(super) levers: [V3; 3],
    /// The function that contributes most to the Lipschitz constant.
    pub(super) steepest: ErrorName,
}

fn scaled(a: V3, factor: f64) -> V3 {
    a.map(|it| it * factor)
}

/// What a rotation by at most `about` can move a place of at most `place`.
fn turned(about: V3, place: V3) -> V3 {
    let once = cross_bound(about, place);
    add(once, scaled(cross_bound(about, once), 0.5))
}

fn turned_slope(about: V3, slope: V3, place: V3) -> V3 {
    let twice = add(
        cross_bound(slope, cross_bound(about, place)),
        cross_bound(about, cross_bound(slope, place)),
    );
    add(cross_bound(slope, place), scaled(twice, 0.5))
}

/// `order`: axes from the tool to the workpiece.
pub(super) fn bounds(axes: &[AxisBound; 3], order: [Axis; 3], tool: V3) -> Bounds {
    let mut place = tool;
    // By axis: |∂ deviation/∂ position|.
    let mut slopes = [[0.0; 3]; 3];
    let mut levers = [[0.0; 3]; 3];
    let mut met: Vec<usize> = Vec::with_capacity(3);
    let (mut steepest, mut most) = (ErrorName::Along(order[0], order[0]), -1.0);
    for axis in order {
        let (i, own) = (axis.index(), &axes[axis.index()]);
        let unit = |j: usize| core::array::from_fn(|k| f64::from(u8::from(k == j)));
        let shift = own.along;
        if own.on_workpiece {
            place[i] += own.position;
            place = add(place, shift);
        }
        levers[i] = place;
        let mut of_own = add(
            turned_slope(own.about, own.about_slope, place),
            own.along_slope,
        );
        if own.on_workpiece {
            of_own = add(of_own, turned(own.about, add(unit(i), own.along_slope)));
        }
        for j in &met {
            let moved = add(unit(*j), slopes[*j]);
            slopes[*j] = add(slopes[*j], turned(own.about, moved));
        }
        slopes[i] = of_own;
        met.push(i);
        for k in Axis::ALL {
            let along = own.along_slope[k.index()];
            let mut only = [0.0; 3];
            only[k.index()] = own.about_slope[k.index()];
            let about = cross_bound(only, place).into_iter().fold(0.0, f64::max);
            for (share, name) in [
                (along, ErrorName::Along(axis, k)),
                (about, ErrorName::About(axis, k)),
            ] {
                if share > most {
                    (most, steepest) = (share, name);
                }
            }
        }
        place = add(place, turned(own.about, place));
        if !own.on_workpiece {
            place[i] += own.position;
            place = add(place, shift);
        }
    }
    let row = |k: usize| slopes[0][k] + slopes[1][k] + slopes[2][k];
    Bounds {
        lipschitz: row(0).max(row(1)).max(row(2)),
        levers,
        steepest,
    }
}
