//! Image controllers in the configuration file.

use serde::Deserialize;

/// The kinds of image controller.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CameraDevice {
    /// A Cognex In-Sight vision system in Native Mode.
    InSight,
}

/// One image controller, and how its units and axes lie against the machine's.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "configs/README.md documents each key")]
pub struct CameraConfig {
    pub device: CameraDevice,
    pub line: String,
    pub job: String,
    pub serial_number: Option<String>,
    pub result_cell: String,
    pub length_um_per_unit: f64,
    pub angle_arcsec_per_unit: f64,
    #[serde(default)]
    pub rotation_deg: f64,
    #[serde(default)]
    pub mirrored: bool,
    pub targets: u32,
    pub score_min_percent: f64,
    pub rejects_max: u32,
    pub inspection_timeout_ms: f64,
    pub standard_uncertainty_um: f64,
    pub standard_uncertainty_arcsec: f64,
}
