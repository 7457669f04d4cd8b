//! The two detectors that see a slide roll (S4's roll arrangement, CN 003).
//!
//! In the plane across the travel, u sideways and v up, two parallel beams slant by φ:
//! u = ±L/2 + v·tan φ. The slide's surface is the line v = v₀ + u·tan α. It meets the beams at
//! the heights y₁ on the one side and −y₂ on the other, and each detector tells how far its mark,
//! which stands h off the surface, is from its spot:
//!
//! | symbol | name |
//! |---|---|
//! | α | roll |
//! | v₀ | the slide's shift upwards |
//! | x₁, x₂ | readings, each counted outwards |
//!
//! x = (h + y)·tan α − y·tan φ on both sides. Absent: shifts sideways, which the arrangement is
//! taken not to see.

use super::config::RollConfig;
use units::portable::tan;

#[derive(Clone, Copy, Debug)]
pub(super) struct RollDetectors {
    half_distance_m: f64,
    height_m: f64,
    slant_tan: f64,
    v_per_m: f64,
}

impl RollDetectors {
    pub(super) fn new(config: &RollConfig) -> Self {
        Self {
            half_distance_m: config.distance_mm * 0.5e-3,
            height_m: config.height_mm * 1e-3,
            slant_tan: tan(config.slant_deg.to_radians()),
            v_per_m: config.sensitivity_v_per_mm * 1e3,
        }
    }

    /// How high the surface meets the beams: y₁ and y₂.
    fn heights(&self, roll: f64, lift_m: f64) -> [f64; 2] {
        let tan = tan(roll);
        // On the beam and on the surface: u = side + (v₀ + u·tan α)·tan φ.
        let meets = |side_m: f64| {
            let u = (side_m + lift_m * self.slant_tan) / (1.0 - tan * self.slant_tan);
            lift_m + u * tan
        };
        [meets(self.half_distance_m), -meets(-self.half_distance_m)]
    }

    /// x₁ and x₂ in metres.
    pub(super) fn readings(&self, roll: f64, lift_m: f64) -> [f64; 2] {
        let tan = tan(roll);
        self.heights(roll, lift_m)
            .map(|y| (self.height_m + y) * tan - y * self.slant_tan)
    }

    pub(super) fn volts(&self, roll: f64, lift_m: f64) -> [f64; 2] {
        self.readings(roll, lift_m).map(|x| x * self.v_per_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// S4's three equations, as they stand in the source.
    #[test]
    fn the_readings_solve_the_sources_equations() {
        let config = RollConfig {
            slant_deg: 30.0,
            ..RollConfig::default()
        };
        let detectors = RollDetectors::new(&config);
        let (distance, height) = (0.3, 0.02);
        let f = 30.0_f64.to_radians().tan();
        for (roll, lift) in [(2.4e-5, 0.0), (-1e-3, 4e-6), (0.02, -5e-5), (0.0, 1e-5)] {
            let t = f64::tan(roll);
            let [y1, y2] = detectors.heights(roll, lift);
            let [x1, x2] = detectors.readings(roll, lift);
            let sum = y1 + y2;
            assert!((t - sum / (distance + sum * f)).abs() < 1e-14);
            assert!((y1 - (height * t - x1) / (f - t)).abs() < 1e-14);
            assert!((y2 - (height * t - x2) / (f - t)).abs() < 1e-14);
            assert!((y1 - y2 - 2.0 * lift).abs() < 2.1 * lift.abs() * (f * t).abs() + 1e-15);
        }
    }

    /// 5 arcsec, h 20 mm, L 300 mm, φ 45°: about (2h − L)·tan α together.
    #[test]
    fn five_arcseconds_are_some_micrometres() {
        let detectors = RollDetectors::new(&RollConfig::default());
        let roll = 5.0 / 206_264.806;
        let [x1, x2] = detectors.readings(roll, 0.0);
        assert!((x1 + x2 + 0.26 * roll).abs() < 1e-9, "{x1} {x2}");
        assert!((detectors.volts(roll, 0.0)[0] - x1 * 1e4).abs() < 1e-12);
    }
}
