//! The 21 errors of three linear axes.

use core::fmt;

use units::{Metres, Radians};

use crate::volumetric::Axis;
use crate::volumetric::function::Function;

/// One of the eighteen functions, by the letters of ISO 230-1 in lower case: `e_yx` along y
/// while x moves, `e_ax` about x (direction A) while x moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum ErrorName {
    /// A displacement: (of which axis, along which direction).
    Along(Axis, Axis),
    /// A tilt: (of which axis, about which direction).
    About(Axis, Axis),
}

impl fmt::Display for ErrorName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Along(axis, direction) => write!(f, "e_{direction}{axis}"),
            Self::About(axis, direction) => {
                let about = ["a", "b", "c"][direction.index()];
                write!(f, "e_{about}{axis}")
            }
        }
    }
}

/// The six error functions of one axis, each of the axis's own commanded position.
///
/// All are of the tool as seen from the workpiece, where the tool offset is zero: displacements
/// positive along the machine's directions, tilts right-handed about them.
#[derive(Clone, Debug, Default)]
pub struct AxisErrors {
    /// Displacements along x, y, z: the positioning error along the axis itself and its two
    /// straightnesses. Zero where there is none.
    pub along: [Option<Function<Metres>>; 3],
    /// Tilts about x, y, z: roll about the axis itself and two more.
    pub about: [Option<Function<Radians>>; 3],
}

/// The three squarenesses: how far an axis's direction is rotated out of its right angle, as
/// right-handed rotation about the third direction (E_C0Y, E_B0Z and E_A0Z of ISO 230-1).
///
/// A positive `y_to_x` leans y towards −x, a positive `z_to_x` leans z towards +x, a positive
/// `z_to_y` leans z towards −y.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Squareness {
    /// Of y to x, about z.
    pub y_to_x: Radians,
    /// Of z to x, about y.
    pub z_to_x: Radians,
    /// Of z to y, about x.
    pub z_to_y: Radians,
    /// Their standard uncertainties, in this order.
    pub u: [Radians; 3],
}

impl Squareness {
    /// Per metre of each axis, what it displaces along x, y and z.
    pub(crate) fn lean([y_to_x, z_to_x, z_to_y]: [f64; 3]) -> [[f64; 3]; 3] {
        [[0.0; 3], [-y_to_x, 0.0, 0.0], [z_to_x, -z_to_y, 0.0]]
    }

    pub(crate) fn values(&self) -> [f64; 3] {
        [self.y_to_x, self.z_to_x, self.z_to_y].map(Radians::value)
    }
}
