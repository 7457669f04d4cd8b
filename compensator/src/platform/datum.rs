//! How far a body has moved since a first look at it.

use units::portable::sin_cos;
use units::{Metres, Radians};

use super::Pose;

impl Pose {
    /// The displacement from the pose `datum` to this one, as a motion of the platform's own
    /// frame: what lay at p then lies at t + R(angle)·p now.
    #[must_use]
    pub fn since(self, datum: Self) -> Self {
        self.where_datum_was_at(Self::default(), datum)
    }

    /// The pose in the platform's frame, where the body was in the pose `there` when the camera saw
    /// `datum`.
    #[must_use]
    pub(super) fn where_datum_was_at(self, there: Self, datum: Self) -> Self {
        let turn = self.angle - datum.angle;
        // What a camera says jumps by a turn where its angles begin again.
        let angle = turn - turn.whole_turns() + there.angle;
        // The place of what is seen in the body's own frame.
        let own = turned([datum.x - there.x, datum.y - there.y], -there.angle);
        let now = turned(own, angle);
        Self {
            x: self.x - now[0],
            y: self.y - now[1],
            angle,
        }
    }
}

fn turned([x, y]: [Metres; 2], angle: Radians) -> [Metres; 2] {
    let (sin, cos) = sin_cos(angle.value());
    [x * cos - y * sin, x * sin + y * cos]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_body_that_was_seen_off_its_origin_is_followed_as_the_platform_moves() {
        // The body's mark 50 mm off: a turn of 0.1 rad alone moves it by far.
        let datum = Pose {
            x: Metres::from_mm(50.0),
            y: Metres::ZERO,
            angle: Radians(0.01),
        };
        let (sin, cos) = 0.1_f64.sin_cos();
        let seen = Pose {
            x: Metres::from_mm(50.0 * cos + 1.0),
            y: Metres::from_mm(50.0 * sin - 2.0),
            angle: Radians(0.11),
        };
        let moved = seen.since(datum);
        assert!((moved.x.mm() - 1.0).abs() < 1e-9 && (moved.y.mm() + 2.0).abs() < 1e-9);
        assert!((moved.angle.value() - 0.1).abs() < 1e-12);
    }

    #[test]
    fn a_body_seen_across_the_seam_of_the_cameras_angles_has_turned_by_little() {
        let half = core::f64::consts::PI;
        let at = |angle| Pose {
            angle: Radians(angle),
            ..Pose::default()
        };
        let moved = at(-half + 0.001).since(at(half - 0.002));
        assert!((moved.angle.value() - 0.003).abs() < 1e-12);
        assert!(moved.x.abs() < Metres(1e-12) && moved.y.abs() < Metres(1e-12));
    }
}
