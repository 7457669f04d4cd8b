//! The usual arrangements, from few dimensions.

use units::Metres;

use super::{Actuator, Platform, PlatformError, Point};

const ALONG_X: [f64; 2] = [1.0, 0.0];
const ALONG_Y: [f64; 2] = [0.0, 1.0];

fn actuator(name: &str, x: Metres, y: Metres, direction: [f64; 2], travel: Metres) -> Actuator {
    Actuator {
        name: name.into(),
        point: Point { x, y },
        direction,
        stroke_min: -travel,
        stroke_max: travel,
    }
}

impl Platform {
    /// `u` and `v` push along x, `spacing` apart on both sides of the centre; `w` pushes along
    /// y at `arm` to the right of it (zero for a line of push through the centre). Each travels
    /// `travel` to both sides.
    ///
    /// # Errors
    /// When a dimension leaves a motion without an actuator.
    pub fn uvw(spacing: Metres, arm: Metres, travel: Metres) -> Result<Self, PlatformError> {
        let half = spacing / 2.0;
        let actuators = vec![
            actuator("u", Metres::ZERO, half, ALONG_X, travel),
            actuator("v", Metres::ZERO, -half, ALONG_X, travel),
            actuator("w", arm, Metres::ZERO, ALONG_Y, travel),
        ];
        Self::new(actuators, Self::CONDITION_MAX)
    }

    /// Three corners of a square at `radius` from the centre: `x1` (below right) and `x2`
    /// (above left) push along x, `y` (below left) along y. Each travels `travel` to both
    /// sides.
    ///
    /// # Errors
    /// When a dimension leaves a motion without an actuator.
    pub fn xxy(radius: Metres, travel: Metres) -> Result<Self, PlatformError> {
        let side = radius / core::f64::consts::SQRT_2;
        let actuators = vec![
            actuator("x1", side, -side, ALONG_X, travel),
            actuator("x2", -side, side, ALONG_X, travel),
            actuator("y", -side, -side, ALONG_Y, travel),
        ];
        Self::new(actuators, Self::CONDITION_MAX)
    }

    /// `x` and `y` push the centre, `theta` pushes along y at the end of an arm. The first two
    /// travel `travel` to both sides, the last one `travel_theta`.
    ///
    /// # Errors
    /// When a dimension leaves a motion without an actuator.
    pub fn xy_theta(
        arm: Metres,
        travel: Metres,
        travel_theta: Metres,
    ) -> Result<Self, PlatformError> {
        let zero = Metres::ZERO;
        let actuators = vec![
            actuator("x", zero, zero, ALONG_X, travel),
            actuator("y", zero, zero, ALONG_Y, travel),
            actuator("theta", arm, zero, ALONG_Y, travel_theta),
        ];
        Self::new(actuators, Self::CONDITION_MAX)
    }
}
