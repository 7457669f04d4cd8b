//! From slides to the tool point: a chain of rigid bodies, exact in its rotations.
//!
//! Each slide is a body that its scale and its error motions have shifted and turned against
//! what carries it. Slides after the foot carry the tool and go the way of their coordinate;
//! slides before it carry the workpiece and go the other way, so that a larger coordinate always
//! takes the tool farther along the workpiece. The tool point is told in the workpiece's frame.

use units::Radians;

use super::config::VolumetricConfig;
use super::guide::Motion;
use super::rigid::{Rotation, Transform, Vector, add, times};
use crate::random::Stream;

#[derive(Clone, Debug)]
pub(super) struct Chain {
    /// From the foot outwards.
    tool_side: Vec<usize>,
    workpiece_side: Vec<usize>,
    directions: [Vector; 3],
    squareness: Vector,
    tool_offset: Vector,
}

/// How tool and workpiece stand at one moment, against the foot.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stand {
    tool: Transform,
    workpiece: Transform,
}

impl Stand {
    /// Where what is mounted on the tool is in the workpiece's frame, by its place with all axes
    /// at 0.
    pub(super) fn point(&self, offset_m: Vector) -> Vector {
        self.workpiece.point_at(self.tool.place(offset_m))
    }
}

impl Chain {
    pub(super) fn new(config: &VolumetricConfig, seed: u64) -> Self {
        let (before, after) = config.chain.split_once('F').unwrap_or(("", "XYZ"));
        let axis = |letter: char| "XYZ".find(letter);
        let mut stream = Stream::new(seed, "volumetric squareness");
        let size = Radians::from_arcsec(config.errors.squareness_arcsec).value();
        let squareness = [(); 3].map(|()| {
            let sign = if stream.chance(0.5) { 1.0 } else { -1.0 };
            sign * size * stream.between(0.5, 1.0)
        });
        let [xy, zx, yz] = squareness;
        let turned = |turn, direction| Rotation::about_x_y_z(turn).turn(direction);
        Self {
            tool_side: after.chars().filter_map(axis).collect(),
            workpiece_side: before.chars().rev().filter_map(axis).collect(),
            directions: [
                [1.0, 0.0, 0.0],
                turned([0.0, 0.0, xy], [0.0, 1.0, 0.0]),
                turned([yz, zx, 0.0], [0.0, 0.0, 1.0]),
            ],
            squareness,
            tool_offset: config.tool_offset_mm.map(|mm| mm * 1e-3),
        }
    }

    /// The turn of y about z, of z about y and of z about x.
    pub(super) const fn squareness(&self) -> Vector {
        self.squareness
    }

    /// Where the tool point would be with no error at all.
    pub(super) fn nominal(&self, scales_m: Vector) -> Vector {
        add(scales_m, self.tool_offset)
    }

    /// The tool point in the workpiece's frame.
    pub(super) fn tool_point(&self, scales_m: Vector, motions: &[Motion; 3]) -> Vector {
        self.stand(scales_m, motions).point(self.tool_offset)
    }

    /// How tool and workpiece stand.
    pub(super) fn stand(&self, scales_m: Vector, motions: &[Motion; 3]) -> Stand {
        let body = |axis: usize, way: f64| {
            let motion = &motions[axis];
            // What is off along the axis belongs to its coordinate, what is off sideways to
            // the slide.
            let along = way * (scales_m[axis] + motion.shift[axis]);
            let mut sideways = motion.shift;
            sideways[axis] = 0.0;
            Transform {
                rotation: Rotation::about_x_y_z(motion.turn),
                shift: add(times(self.directions[axis], along), sideways),
            }
        };
        let outermost = |axes: &[usize], way: f64| {
            axes.iter().fold(Transform::identity(), |carrier, axis| {
                carrier.carrying(&body(*axis, way))
            })
        };
        Stand {
            tool: outermost(&self.tool_side, 1.0),
            workpiece: outermost(&self.workpiece_side, -1.0),
        }
    }
}
