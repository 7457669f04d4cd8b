//! Displacement instruments in the configuration file.

use schemars::JsonSchema;
use serde::Deserialize;

/// The kinds of displacement instrument.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum InstrumentDevice {
    /// A µMD1 or µMD2 interferometer interface.
    Umd2,
}

/// A displacement instrument, and which corrections its readings get.
///
/// On three axes (`[volumetric]`) it is brought along for a calibration and set up for one line
/// after the other, by a person who is asked for it; `correct_dead_path`, `correct_cosine` and
/// `correct_material` then concern linear optics only, `dead_path_mm` is the path at the line's
/// start, and `instrument_standard_uncertainty_nm` is that of a path counted.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct InstrumentConfig {
    /// The kind of instrument.
    pub device: InstrumentDevice,
    /// The line that it is on.
    #[schemars(extend("x-range" = "a `[serial.NAME]`"))]
    pub line: String,
    /// How often the beam passes the measured length there and back: one count is λ/2 divided by
    /// it. 1 linear (corner cube), 2 plane mirror.
    #[schemars(range(min = 1, max = 16))]
    pub optics_factor: u8,
    /// The firmware's rate.
    #[schemars(range(min = 1.0, max = 100000.0))]
    pub sample_rate_hz: f64,
    /// `true` when the path shortens while the axis moves forward.
    pub reverse: bool,
    /// Whether readings are corrected for the refractive index of air, by the instrument's own
    /// weather sensors.
    pub correct_air: bool,
    /// Whether for the expansion to 20 °C.
    pub correct_material: bool,
    /// Of the machine's material; its standard uncertainty is taken as 10 %.
    #[schemars(range(min = -0.0001, max = 0.0001))]
    pub expansion_per_kelvin: f64,
    /// Whether for the dead path; needs `correct_air`.
    pub correct_dead_path: bool,
    /// Path in air between optic and reflector at the axis's zero.
    #[schemars(range(min = 0.0, max = 100000.0))]
    pub dead_path_mm: f64,
    /// Whether for the angle between beam and travel.
    pub correct_cosine: bool,
    /// Angle between beam and travel.
    #[schemars(extend("x-magnitude" = [0.0, 100]))]
    pub misalignment_mrad: f64,
    /// Of one reading; enters the uncertainty of the table.
    #[schemars(range(min = 0.0, max = 1000000.0))]
    pub instrument_standard_uncertainty_nm: f64,
    /// A sensor of air or material that shows the very same digits for longer is broken, and stops
    /// the run.
    #[serde(default = "half_an_hour")]
    #[schemars(range(min = 1.0, max = 1000000.0))]
    pub environment_frozen_s: f64,
    /// What else it can be set up with.
    #[serde(default)]
    pub optics: OpticsConfig,
}

/// What an instrument can be set up with besides linear optics.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OpticsConfig {
    /// Straightness optics: a displacement across the line is so many times the path counted, 1 /
    /// (2 sin φ/2) of a prism that parts its beams by φ; without it no line is measured with them.
    #[schemars(range(min = 1.0, max = 10000.0))]
    pub straightness_factor: Option<f64>,
    /// Angular optics: how far their two reflectors are apart; the sine of a tilt is the path
    /// counted over it; without it no line is measured with them.
    #[schemars(range(min = 1.0, max = 1000.0))]
    pub angular_separation_mm: Option<f64>,
}

/// The last digit of a good sensor moves with the air of a good hall.
const fn half_an_hour() -> f64 {
    1800.0
}
