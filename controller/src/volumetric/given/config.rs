//! The file of references that are functions, as a person writes it.

use schemars::JsonSchema;
use serde::Deserialize;

use crate::volumetric::VolumeAxisName;

/// References of detectors as polynomials of their axis's position: what each detector reads where the axis is right.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct ReferenceFunctionsConfig {
    /// Of this file.
    #[schemars(range(min = 1, max = 1))]
    #[expect(dead_code, reason = "the schema judges it")]
    pub(crate) schema_version: u32,
    /// One for each reading of each detector that the machine has.
    #[schemars(length(min = 1, max = 100))]
    pub(crate) function: Vec<ReferenceFunctionConfig>,
}

/// Which of an axis's detectors.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub(crate) enum ReferenceDetectorName {
    /// That on the slide.
    Slide,
    /// That at the end of the beam.
    End,
    /// The two that tell the roll.
    Roll,
}

/// The reference of one reading.
///
/// It is c₀ + c₁·t + c₂·t² + … with t = (position − `origin_mm`)/`scale_mm`, so that each coefficient is a length,
/// or an angle. On the slide a place is the slide's, at the end it is the beam's.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct ReferenceFunctionConfig {
    /// Which axis moves.
    pub(crate) axis: VolumeAxisName,
    /// Which of its detectors reads.
    pub(crate) detector: ReferenceDetectorName,
    /// The direction that is read.
    #[schemars(extend("x-range" = "across the axis; not with `roll`"))]
    pub(crate) along: Option<VolumeAxisName>,
    /// The coefficients, from c₀ on; one alone at the end of the beam, where the detector stands still.
    #[schemars(length(min = 1, max = 20), extend("x-range" = "with `slide` and `end`, only then"))]
    pub(crate) coefficients_um: Option<Vec<f64>>,
    /// The coefficients of a roll.
    #[schemars(length(min = 1, max = 20), extend("x-range" = "with `roll`, only then"))]
    pub(crate) coefficients_arcsec: Option<Vec<f64>>,
    /// The lowest position that the function holds for.
    #[schemars(extend("x-range" = "needed, except with `end`; at or below the work volume"))]
    pub(crate) from_mm: Option<f64>,
    /// The highest.
    #[schemars(extend("x-range" = "needed, except with `end`; at or above the work volume"))]
    pub(crate) to_mm: Option<f64>,
    /// Where t is 0.
    #[serde(default)]
    #[schemars(extend("x-magnitude" = [0.0, 1e5]))]
    pub(crate) origin_mm: f64,
    /// How far from there t is 1.
    #[serde(default = "one_mm")]
    #[schemars(range(min = 0.001, max = 100000.0))]
    pub(crate) scale_mm: f64,
}

const fn one_mm() -> f64 {
    1.0
}
