//! Image controllers in the configuration file.

use schemars::JsonSchema;
use serde::Deserialize;

/// The kinds of image controller.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum CameraDevice {
    /// A Cognex In-Sight vision system in Native Mode.
    InSight,
}

/// An image controller.
///
/// It sees where the machine's platform is, from where it was taught. It is started when a
/// procedure first needs it.
///
/// The job: `count` is the spreadsheet function `Count` over the image, `found` the number of marks
/// found, `judgement` 1 for good and 0 for bad, the pose 0 where nothing was found, `score` 0 to
/// 100, of the worst mark. The seven are put into one cell of text, separated by commas, with
/// decimal points. The count is how a picture is told from the one before it: do not reset it while
/// the machine runs.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CameraConfig {
    /// The kind of image controller.
    pub device: CameraDevice,
    /// The line that it is on.
    #[schemars(extend("x-range" = "a `[serial.NAME]`"))]
    pub line: String,
    /// The job that must be active; each pose begins by asking for it.
    #[schemars(extend("x-range" = "ends in `.job` or `.jobx`"))]
    pub job: String,
    /// What it must call itself.
    pub serial_number: Option<String>,
    /// The cell of text in which the job puts `count,found,judgement,x,y,angle,score`.
    #[schemars(extend("x-range" = "a letter and a row, `\"A0\"` to `\"Z399\"`"))]
    pub result_cell: String,
    /// One unit of the job's x and y.
    #[schemars(range(min = 1e-06, max = 1000000.0))]
    pub length_um_per_unit: f64,
    /// One unit of the job's angle; 3600 for degrees.
    #[schemars(range(min = 1e-06, max = 1000000.0))]
    pub angle_arcsec_per_unit: f64,
    /// The cameras' x axis against the machine's, counter-clockwise.
    #[serde(default)]
    #[schemars(range(min = -360.0, max = 360.0))]
    pub rotation_deg: f64,
    /// The cameras' y axis goes the other way, as when they look from below; their angles then do,
    /// too.
    #[serde(default)]
    pub mirrored: bool,
    /// Marks that a good picture shows.
    #[schemars(range(min = 1, max = 100))]
    pub targets: u32,
    /// A picture with a lower score is bad, whatever the job says.
    #[schemars(range(min = 0.0, max = 100.0))]
    pub score_min_percent: f64,
    /// So many bad pictures may be left out of one pose; one more, and there is no pose.
    #[schemars(range(min = 0, max = 1000))]
    pub rejects_max: u32,
    /// How long taking and judging a picture may take.
    #[schemars(range(min = 10.0, max = 60000.0))]
    pub inspection_timeout_ms: f64,
    /// Of the cameras' own scale and teaching; what scatters from picture to picture is measured.
    #[schemars(range(min = 0.0, max = 1000000.0))]
    pub standard_uncertainty_um: f64,
    /// Likewise of the angle.
    #[schemars(range(min = 0.0, max = 1000000.0))]
    pub standard_uncertainty_arcsec: f64,
}
