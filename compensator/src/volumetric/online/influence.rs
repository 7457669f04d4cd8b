//! From sideways displacements of three axes to the error in space, by influence functions.
//!
//! Source: CN1214003A: E_x = F_xy·D_x(y_c) + F_xz·D_x(z_c) and its like, with F a function of
//! the three positions that follows from the geometry of the machine; 1 without further notice.

use units::{Metres, Radians};

use super::Displacement;
use crate::volumetric::function::Function;
use crate::volumetric::{Axis, Point};

/// What the detectors of all axes say of the slides: the moving state. Displacements and rolls are
/// those of the slide itself, also of one that carries the workpiece: the model knows which way
/// the tool goes then.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MovingState {
    /// D_y, D_z of the x axis; D_x, D_z of y; D_x, D_y of z.
    pub sideways: [Displacement; 3],
    /// Rotation of each axis's slider about its own direction.
    pub roll: [Radians; 3],
}

impl MovingState {
    /// The displacement of the slider of `axis` along `direction`; zero along itself.
    pub fn displacement(&self, axis: Axis, direction: Axis) -> Metres {
        let place = axis.others().iter().position(|it| *it == direction);
        place.map_or(Metres::ZERO, |place| self.sideways[axis.index()][place])
    }

    /// The displacements as a vector in space.
    pub(crate) fn sideways_of(&self, axis: Axis) -> [f64; 3] {
        core::array::from_fn(|k| self.displacement(axis, Axis::ALL[k]).value())
    }
}

/// How much of a displacement appears as an error at the tool: a product of functions of the
/// positions, which are dimensionless.
#[derive(Clone, Debug, Default)]
pub struct Influence {
    /// The factors along x, y and z in metres per metre, as lengths; 1 where there is none.
    pub along: [Option<Function<Metres>>; 3],
}

impl Influence {
    /// Its value at a position; 1 without functions.
    pub fn at(&self, position: Point) -> f64 {
        let factor = |axis: Axis| {
            let function = self.along[axis.index()].as_ref();
            function.map_or(1.0, |it| it.at(position.along(axis)).value())
        };
        factor(Axis::X) * factor(Axis::Y) * factor(Axis::Z)
    }
}

/// F for every displacement: of the axis that moves, along each of its sideways directions.
///
/// # Example
///
/// ```
/// use compensator::volumetric::Point;
/// use compensator::volumetric::online::{Influences, MovingState};
/// use units::{Metres, Radians};
///
/// let um = Metres::from_um;
/// let state = MovingState {
///     sideways: [[um(16.0), um(32.0)], [um(1.0), um(2.0)], [um(4.0), um(8.0)]],
///     roll: [Radians::ZERO; 3],
/// };
/// // Without functions all factors are 1: D_x(y) + D_x(z), D_y(x) + D_y(z), D_z(x) + D_z(y).
/// let errors = Influences::default().errors(Point::ZERO, &state);
/// let seen = [errors.x, errors.y, errors.z].map(|it| it.um().round());
/// assert_eq!(seen, [5.0, 24.0, 34.0]);
/// ```
#[derive(Clone, Debug, Default)]
pub struct Influences {
    /// By axis x, y, z; then along the two other directions in the order x, y, z. F_xy, by
    /// which D_x(y_c) enters E_x, is `of[1][0]`.
    pub of: [[Influence; 2]; 3],
}

impl Influences {
    /// The error E at `position`: the deviation (actual − target) that the displacements make.
    pub fn errors(&self, position: Point, state: &MovingState) -> Point {
        let mut sum = [0.0; 3];
        for axis in Axis::ALL {
            let displacements = state.sideways[axis.index()];
            let factors = &self.of[axis.index()];
            for (k, direction) in axis.others().into_iter().enumerate() {
                sum[direction.index()] += factors[k].at(position) * displacements[k].value();
            }
        }
        Point::of(sum)
    }
}
