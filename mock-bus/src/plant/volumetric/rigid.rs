//! Rigid motions: exact rotations and homogeneous transforms.
use units::portable::sin_cos;

/// A place or a displacement in metres: x, y, z.
pub(super) type Vector = [f64; 3];

pub(super) fn add(a: Vector, b: Vector) -> Vector {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

pub(super) fn minus(a: Vector, b: Vector) -> Vector {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

pub(super) fn times(a: Vector, factor: f64) -> Vector {
    a.map(|component| component * factor)
}

/// A rotation matrix, row by row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Rotation([Vector; 3]);

impl Rotation {
    /// First about x, then about y, then about z, all by fixed axes: Rz·Ry·Rx.
    pub(super) fn about_x_y_z([a, b, c]: Vector) -> Self {
        let (sin_a, cos_a) = sin_cos(a);
        let (sin_b, cos_b) = sin_cos(b);
        let (sin_c, cos_c) = sin_cos(c);
        Self([
            [
                cos_c * cos_b,
                cos_c * sin_b * sin_a - sin_c * cos_a,
                cos_c * sin_b * cos_a + sin_c * sin_a,
            ],
            [
                sin_c * cos_b,
                sin_c * sin_b * sin_a + cos_c * cos_a,
                sin_c * sin_b * cos_a - cos_c * sin_a,
            ],
            [-sin_b, cos_b * sin_a, cos_b * cos_a],
        ])
    }

    pub(super) fn turn(&self, v: Vector) -> Vector {
        self.0
            .map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
    }

    pub(super) fn inverse(&self) -> Self {
        let m = &self.0;
        Self([0, 1, 2].map(|row| [m[0][row], m[1][row], m[2][row]]))
    }

    fn after(&self, first: &Self) -> Self {
        let columns = first.inverse().0.map(|column| self.turn(column));
        Self(columns).inverse()
    }
}

/// Rotates, then shifts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Transform {
    pub(super) rotation: Rotation,
    pub(super) shift: Vector,
}

impl Transform {
    pub(super) fn identity() -> Self {
        Self {
            rotation: Rotation::about_x_y_z([0.0; 3]),
            shift: [0.0; 3],
        }
    }

    /// A body that is carried by this one.
    pub(super) fn carrying(&self, carried: &Self) -> Self {
        Self {
            rotation: self.rotation.after(&carried.rotation),
            shift: self.place(carried.shift),
        }
    }

    /// Where a point of the body is.
    pub(super) fn place(&self, point: Vector) -> Vector {
        add(self.rotation.turn(point), self.shift)
    }

    /// Which point of the body is at a place.
    pub(super) fn point_at(&self, place: Vector) -> Vector {
        self.rotation.inverse().turn(minus(place, self.shift))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::FRAC_PI_2;

    #[track_caller]
    fn check(seen: Vector, expected: Vector) {
        let error = minus(seen, expected).map(f64::abs);
        assert!(error.iter().all(|e| *e < 1e-15), "{seen:?} {expected:?}");
    }

    #[test]
    fn quarter_turns_follow_the_right_hand() {
        let about = |turn| Rotation::about_x_y_z(turn);
        check(
            about([FRAC_PI_2, 0.0, 0.0]).turn([0.0, 1.0, 0.0]),
            [0.0, 0.0, 1.0],
        );
        check(
            about([0.0, FRAC_PI_2, 0.0]).turn([0.0, 0.0, 1.0]),
            [1.0, 0.0, 0.0],
        );
        check(
            about([0.0, 0.0, FRAC_PI_2]).turn([1.0, 0.0, 0.0]),
            [0.0, 1.0, 0.0],
        );
        // x first: y goes to z, which the turn about z leaves.
        check(
            about([FRAC_PI_2, 0.0, FRAC_PI_2]).turn([0.0, 1.0, 0.0]),
            [0.0, 0.0, 1.0],
        );
    }

    #[test]
    fn a_carried_body_moves_with_its_carrier() {
        let carrier = Transform {
            rotation: Rotation::about_x_y_z([0.0, 0.0, FRAC_PI_2]),
            shift: [1.0, 0.0, 0.0],
        };
        let carried = Transform {
            rotation: Rotation::about_x_y_z([FRAC_PI_2, 0.0, 0.0]),
            shift: [2.0, 0.0, 0.0],
        };
        let both = carrier.carrying(&carried);
        check(both.place([0.0; 3]), [1.0, 2.0, 0.0]);
        let point = [0.3, -0.2, 0.5];
        check(both.place(point), carrier.place(carried.place(point)));
        check(both.point_at(both.place(point)), point);
    }
}
