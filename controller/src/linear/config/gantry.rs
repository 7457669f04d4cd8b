//! Two linear axes that move one stage side by side.

use schemars::JsonSchema;
use serde::Deserialize;

/// Two linear axes that move one stage side by side. Each has its zero from two Hall sensors; both together tell how
/// far the stage is turned: the difference of their zero points over their distance (system S5).
///
/// `zero --axis NAME` refers both sides together to their limit switches, brings both together to their nominal
/// zero, and lets one after the other find its zero while the other one stands. The angle that it tells is that at
/// which the stage stands when both drives show the same, by what they were referred to; afterwards both count from
/// their zero points, and where they show the same the stage is not turned. How well limit switches repeat is part of
/// the angle, and of its change since acceptance, not of the stage as it stands after the zero.
///
/// A side is not zeroed by itself: `zero`, `calibrate`, `verify`, `move` and jobs of one side alone are refused.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GantryConfig {
    /// Both sides.
    #[schemars(extend("x-range" = "two `[axis.NAME]`, each with a section `zero`"))]
    pub axes: [String; 2],
    /// From the one side's magnets to the other's, across the travel.
    #[schemars(range(min = 1.0, max = 100000.0))]
    pub distance_mm: f64,
    /// Standard uncertainty of that distance.
    #[schemars(range(min = 0.0, max = 1000.0))]
    pub distance_standard_uncertainty_mm: f64,
    /// The side that is ahead, along the travel, where the stage is turned in the positive direction.
    #[schemars(extend("x-range" = "one of `axes`"))]
    pub ahead_when_positive: String,
    /// How far the stage may be turned by moving one side while the other one stands.
    #[schemars(range(min = 0.001, max = 100.0), extend("x-range" = "at least the larger `search_limit_mm` of both sides / `distance_mm`"))]
    pub turn_limit_mrad: f64,
    /// How well a side is found again by its limit switch.
    #[schemars(range(min = 0.0, max = 10000.0))]
    pub reference_standard_uncertainty_um: f64,
    /// How well an encoder tells a length of a fraction of a millimetre, before it is calibrated: the angle is counted by
    /// both.
    #[schemars(range(min = 0.0, max = 100000.0))]
    pub scale_standard_uncertainty_ppm: f64,
    /// The angle that `zero` told when the stage was accepted; later ones are compared with it.
    #[schemars(range(min = -100000.0, max = 100000.0), extend("x-range" = "with `angle_limit_urad`, only then"))]
    pub angle_at_acceptance_urad: Option<f64>,
    /// How far a later angle may differ from that one.
    #[schemars(range(min = 0.001, max = 100000.0), extend("x-range" = "with `angle_at_acceptance_urad`, only then"))]
    pub angle_limit_urad: Option<f64>,
}

impl GantryConfig {
    /// The side that is not `axis`.
    pub(crate) fn other_than(&self, axis: &str) -> &str {
        let [first, second] = &self.axes;
        if first == axis { second } else { first }
    }

    /// How far limit switches alone turn the stage from one zero to another, standard uncertainty of the difference.
    #[cfg(any(test, feature = "program"))]
    pub(crate) fn change_by_references_urad(&self) -> f64 {
        // Two sides, each referred once at acceptance and once now.
        2.0 * self.reference_standard_uncertainty_um * 1e3 / self.distance_mm
    }
}
