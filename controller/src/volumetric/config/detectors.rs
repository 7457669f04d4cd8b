//! What watches three axes: beams and their detectors, roll detectors, thermometers.

use core::num::NonZeroU32;
use std::sync::Arc;

use compensator::uncertainty::combine;
use schemars::JsonSchema;
use serde::Deserialize;

use super::VolumeAxisName;
use crate::certificate::{CertificateConfig, Certified};

/// The reference beams, of the axes that have one.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BeamsConfig {
    /// Along x.
    pub x: Option<BeamConfig>,
    /// Along y.
    pub y: Option<BeamConfig>,
    /// Along z.
    pub z: Option<BeamConfig>,
}

impl BeamsConfig {
    /// In the order x, y, z.
    pub fn each(&self) -> [Option<&BeamConfig>; 3] {
        [&self.x, &self.y, &self.z].map(Option::as_ref)
    }
}

/// How a beam moves when it moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum BeamDriftName {
    /// Its source stays, its direction changes.
    Pivoting,
    /// Its direction stays, its source moves.
    Translating,
    /// Both, in a share that is known.
    Mixed,
}

/// A reference beam along an axis, and what sees it.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BeamConfig {
    /// How the beam moves when it moves: about its source, sideways as a whole, or both.
    pub drift: BeamDriftName,
    /// Where the source is, by the axis's scale. With both ends of the beam readings that contradict each
    /// other are also tried with another `drift`.
    #[schemars(extend("x-range" = "needed unless `translating`; with `end_mm`"))]
    #[schemars(extend("x-own" = true))]
    pub source_mm: Option<f64>,
    /// Where the end detector is, by the axis's scale.
    #[schemars(extend("x-range" = "needed unless `translating`; elsewhere than the source"))]
    #[schemars(extend("x-own" = true))]
    pub end_mm: Option<f64>,
    /// The share of the shift at the end that is sideways as a whole.
    #[schemars(range(min = 0.0, max = 1.0), extend("x-range" = "with `mixed`, only then"))]
    pub translation_share: Option<f64>,
    /// Of a displacement as it enters the correction: what noise, air, the width of the spot and
    /// how the beam is taken to move leave of it.
    #[schemars(range(min = 0.0, max = 1000.0))]
    pub standard_uncertainty_um: Option<f64>,
    /// Of a straightness that a calibration takes from references of this beam, beside the scatter of their means and the
    /// width of the spot: how straight the beam itself is in the air that stands along it. Without it as much as of a
    /// displacement.
    #[schemars(range(min = 0.0, max = 1000.0))]
    pub reference_standard_uncertainty_um: Option<f64>,
    /// The detector on the slide, of four channels.
    #[schemars(extend("x-range" = "this or `slider_camera`"))]
    pub slider: Option<BeamDetectorConfig>,
    /// The detector on the slide, a camera behind a beam splitter.
    #[schemars(extend("x-range" = "this or `slider`"))]
    pub slider_camera: Option<SpotCameraConfig>,
    /// The detector behind the travel, which sees the beam's own drift.
    #[schemars(extend("x-range" = "not together with `end_camera`"))]
    pub end: Option<BeamDetectorConfig>,
    /// The same, a camera.
    pub end_camera: Option<SpotCameraConfig>,
}

/// What sees a beam at one place.
#[derive(Clone, Copy, Debug)]
pub enum DetectorConfig<'a> {
    /// Four channels.
    Channels(&'a BeamDetectorConfig),
    /// A camera.
    Camera(&'a SpotCameraConfig),
}

impl<'a> DetectorConfig<'a> {
    /// Of what is given for one place.
    fn of(
        channels: Option<&'a BeamDetectorConfig>,
        camera: Option<&'a SpotCameraConfig>,
    ) -> Option<Self> {
        channels.map(Self::Channels).or(camera.map(Self::Camera))
    }

    /// Where it sits when all axes are at 0, in millimetres from the machine's zero.
    pub const fn place_mm(&self) -> [f64; 3] {
        match self {
            Self::Channels(it) => it.place_mm,
            Self::Camera(it) => it.place_mm,
        }
    }

    /// How far apart two readings of one place can be, in micrometres.
    pub const fn noise_max_um(&self) -> f64 {
        match self {
            Self::Channels(it) => it.noise_max_um,
            Self::Camera(it) => it.noise_max_um,
        }
    }

    /// How old a reading may be, in milliseconds.
    pub const fn age_max_ms(&self) -> f64 {
        match self {
            Self::Channels(it) => it.age_max_ms,
            Self::Camera(it) => it.age_max_ms,
        }
    }
}

impl BeamConfig {
    /// The detector on the slide; there is one in a configuration that was checked.
    pub fn on_the_slide(&self) -> Option<DetectorConfig<'_>> {
        DetectorConfig::of(self.slider.as_ref(), self.slider_camera.as_ref())
    }

    /// The detector at the end of the beam.
    pub fn at_the_end(&self) -> Option<DetectorConfig<'_>> {
        DetectorConfig::of(self.end.as_ref(), self.end_camera.as_ref())
    }

    /// The cameras that see it.
    pub fn cameras(&self) -> impl Iterator<Item = &SpotCameraConfig> {
        self.slider_camera.iter().chain(&self.end_camera)
    }
}

/// How four channels belong to two directions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LayoutName {
    /// Quadrants (+, +), (−, +), (−, −), (+, −).
    Quadrants,
    /// Electrodes first +, first −, second +, second −.
    Lateral,
}

/// A detector of four channels.
///
/// First and second direction are the other two axes in the order x, y, z. The slider's place is
/// that of the *slide* (a slide that goes one way sees its spot go the other way: negative
/// factors), that of the end detector is the *beam's*.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BeamDetectorConfig {
    /// The module that its channels are wired to.
    #[schemars(extend("x-range" = "an `[analog.NAME]` on CAN"))]
    pub analog: String,
    /// Quadrants (+, +), (−, +), (−, −), (+, −), or electrodes first +, first −, second +, second
    /// −.
    #[schemars(extend("x-range" = "of that module's `channels`; each input is one detector's"))]
    pub channels: [u8; 4],
    /// Where the detector sits when all axes are at 0, measured from the machine's zero. It is the
    /// detector's lever arm on its slide: with it, tilts of the slide are taken off what the
    /// detector sees, both when references give straightnesses and at each cycle (tilts that roll
    /// detectors and thermometers know of). Calibrations made with another place are refused as
    /// foreign.
    #[serde(default)]
    #[schemars(extend("x-own" = true))]
    pub place_mm: [f64; 3],
    /// Which of these the channels are.
    pub layout: LayoutName,
    /// What each channel gives in the dark.
    #[serde(default)]
    #[schemars(inner(range(min = -100000.0, max = 100000.0)))]
    pub dark_mv: [f64; 4],
    /// What each channel is multiplied with, after the dark was taken off.
    #[serde(default = "equal")]
    #[schemars(extend("x-above" = 0.0))]
    pub gain: [f64; 4],
    /// Place = this × ratio of the channels (difference by sum), for the first and second
    /// direction.
    #[schemars(extend("x-range" = "with `ratio_max`, or a `curve`"))]
    #[schemars(extend("x-own" = true))]
    pub um_per_one: Option<[f64; 2]>,
    /// Up to which ratio that is used.
    #[schemars(extend("x-range" = "with `um_per_one`"))]
    pub ratio_max: Option<f64>,
    /// Measured curve, monotone cubics between its points.
    #[serde(default)]
    #[schemars(extend("x-range" = "two or more, ratios increasing"))]
    pub curve: Vec<CurvePointConfig>,
    /// At or above this a channel is saturated.
    #[schemars(extend("x-above" = 0.0))]
    pub saturation_v: f64,
    /// Of the sum of the channels: below it the beam is blocked.
    #[schemars(extend("x-above" = 0.0), extend("x-range" = "below `intensity_max_v`"))]
    pub intensity_min_v: f64,
    /// Above it other light is there.
    pub intensity_max_v: f64,
    /// An older sample says nothing about now.
    #[schemars(extend("x-range" = "at least two sampling periods"))]
    pub age_max_ms: f64,
    /// How fast a place can change; more is not believed.
    #[schemars(extend("x-above" = 0.0))]
    pub speed_max_um_per_s: f64,
    /// How far apart two samples of one place can be; more is not believed.
    #[schemars(extend("x-above" = 0.0))]
    pub noise_max_um: f64,
    /// A channel that gives so many equal samples in a row is stuck, and the detector in trouble;
    /// for channels whose noise reaches the converter's next step: with a standard deviation of
    /// half a step at least, 100 in a row are no coincidence; more where a module sends oftener
    /// than it converts.
    #[schemars(range(min = 10, max = 1000000))]
    pub stuck_samples: Option<NonZeroU32>,
}

/// How many periods of SYNC it is known where the axes were: half a second at 2 ms. No picture may be older.
pub(crate) const PICTURE_PERIODS_MAX: usize = 255;

/// A camera that sees the spot of a beam behind a beam splitter (CN1214003A, claim 10).
///
/// It takes one picture after the other as long as SYNC runs; what a picture shows counts for where the axis was
/// when the picture was asked for. Its job finds one target, the spot; let it look for more than one, since a picture in
/// which it finds several, reflections, is refused. Turn its frame with `rotation_deg` and `mirrored`
/// of its section, so that x and y are the first and second direction, the other two axes in the order x, y, z. The
/// slider's place is that of the *slide* (a slide that goes one way sees its spot go the other way: turned by 180
/// degrees), that of the end camera is the *beam's*. How uncertain a place is says the beam's `standard_uncertainty_um`, or
/// else a third of `noise_max_um`; that of the camera's own section counts for poses.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SpotCameraConfig {
    /// What finds the spot.
    #[schemars(extend("x-range" = "a `[camera.NAME]` of its own, with `targets = 1`"))]
    pub camera: String,
    /// Where the camera's splitter sits when all axes are at 0, measured from the machine's zero, as for a detector of four
    /// channels.
    #[serde(default)]
    pub place_mm: [f64; 3],
    /// How far the spot may be from where the camera was taught, in the first and second direction; beyond is not believed.
    #[schemars(inner(range(min = 1.0, max = 100000.0)))]
    pub field_um: [f64; 2],
    /// An older picture says nothing about now.
    #[schemars(range(min = 20.0, max = 60000.0))]
    pub age_max_ms: f64,
    /// How fast a place can change; more is not believed.
    #[schemars(extend("x-above" = 0.0))]
    pub speed_max_um_per_s: f64,
    /// How far apart two pictures of one place can be; more is not believed.
    #[schemars(extend("x-above" = 0.0))]
    pub noise_max_um: f64,
}

const fn equal() -> [f64; 4] {
    [1.0; 4]
}

/// A point of a detector's measured curve, monotone cubics between its points.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CurvePointConfig {
    /// Ratio of the channels: difference by sum.
    pub ratio: f64,
    /// The place there, in the first direction.
    pub first_um: f64,
    /// In the second direction.
    pub second_um: f64,
}

/// Two detectors that see one slide roll.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RollConfig {
    /// Whose slide.
    pub axis: VolumeAxisName,
    /// The module that its channels are wired to.
    #[schemars(extend("x-range" = "an `[analog.NAME]` on CAN"))]
    pub analog: String,
    /// The inputs of the two detectors.
    #[schemars(extend("x-range" = "of that module"))]
    pub channels: [u8; 2],
    /// From volts to the readings x₁ and x₂.
    #[schemars(extend("x-magnitude" = [1e-9, 1e3]))]
    #[schemars(extend("x-own" = true))]
    pub mm_per_v: [f64; 2],
    /// H of the optics.
    #[schemars(extend("x-range" = "together they must determine the roll"))]
    #[schemars(extend("x-own" = true))]
    pub height_mm: f64,
    /// L of the optics.
    #[schemars(extend("x-own" = true))]
    pub base_mm: f64,
    /// Φ of the optics.
    pub inclination_deg: f64,
    /// Larger rolls are not believed.
    #[schemars(extend("x-above" = 0.0))]
    pub roll_max_arcsec: f64,
    /// Of a roll as it enters the correction.
    #[schemars(range(min = 0.0, max = 1000.0))]
    pub standard_uncertainty_arcsec: Option<f64>,
    /// Of a roll that a calibration takes from references of these detectors, beside the scatter of their means and the
    /// volts per millimetre. Without it as much as of a roll that enters the correction.
    #[schemars(range(min = 0.0, max = 1000.0))]
    pub reference_standard_uncertainty_arcsec: Option<f64>,
    /// An older sample says nothing about now.
    #[schemars(extend("x-range" = "at least two sampling periods"))]
    pub age_max_ms: f64,
    /// How fast the roll can change; more is not believed.
    #[schemars(range(min = 1e-06, max = 1000000.0))]
    pub speed_max_arcsec_per_s: f64,
    /// How far apart two samples of one roll can be; more is not believed.
    #[schemars(range(min = 1e-06, max = 1000000.0))]
    pub noise_max_arcsec: f64,
    /// A channel that gives so many equal samples in a row is stuck, as for a beam detector.
    #[schemars(range(min = 10, max = 1000000))]
    pub stuck_samples: Option<NonZeroU32>,
}

/// A thermometer, and what warmth does to the machine.
///
/// What it does counts from the temperature at the calibration. Thermometers that make one effect
/// between them (`over` and `under` of a bend; expansion along one axis, growth along one
/// direction, one squareness) fail together: when one of them cannot be relied upon, the `reaction`
/// applies to all of them, and they return to use together.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TemperatureConfig {
    /// The module that it is wired to.
    #[schemars(extend("x-range" = "an `[analog.NAME]` on CAN"))]
    pub analog: String,
    /// The input.
    #[schemars(extend("x-range" = "of its `temperature_channels`"))]
    pub channel: u8,
    /// The lowest that can be, and that the coefficients are known for.
    #[schemars(range(min = -273.15, max = 1000.0), extend("x-range" = "below `high_c`"))]
    pub low_c: f64,
    /// The highest.
    #[schemars(range(min = -273.15, max = 1000.0))]
    pub high_c: f64,
    /// How fast it can change; more is not believed.
    #[schemars(range(min = 1e-06, max = 10000.0))]
    pub rate_max_k_per_min: f64,
    /// How far apart two samples of one temperature can be; more is not believed.
    #[schemars(range(min = 1e-06, max = 1000.0))]
    pub noise_max_k: f64,
    /// An older sample says nothing about now.
    #[schemars(extend("x-range" = "at least two sampling periods"))]
    pub age_max_ms: f64,
    /// So many equal samples in a row, and it is stuck; with noise of a third of a step, 1000.
    #[schemars(range(min = 10, max = 1000000))]
    pub stuck_samples: Option<NonZeroU32>,
    /// Of a change since the calibration; an offset that the sensor keeps does not matter. With a certificate of what it
    /// does not say, which is added in squares.
    #[schemars(range(min = 0.0, max = 1000.0))]
    pub standard_uncertainty_k: f64,
    /// Of the thermometer: its readings are corrected by it.
    pub certificate: Option<CertificateConfig>,
    /// Expansion of the x, y and z scale; negative where the workpiece expands. `calibrate` with
    /// warm lines finds it anew and its value is used instead, for an axis by the mean of those
    /// thermometers where this is not 0; it finds none for an axis where all are 0.
    #[serde(default)]
    #[schemars(extend("x-magnitude" = [0.0, 1000]))]
    pub expansion_ppm_per_k: [f64; 3],
    /// Displacement of the tool.
    #[serde(default)]
    #[schemars(extend("x-magnitude" = [0.0, 1e4]))]
    pub growth_um_per_k: [f64; 3],
    /// Change of the squareness y to x, z to x, z to y.
    #[serde(default)]
    #[schemars(extend("x-magnitude" = [0.0, 1e4]))]
    pub squareness_arcsec_per_k: [f64; 3],
}

impl TemperatureConfig {
    /// What its certificate says of its readings, if it has one.
    pub(crate) fn certified(&self) -> Option<Arc<Certified>> {
        self.certificate.as_ref()?.certified.clone()
    }

    /// The standard uncertainty of what it shows, in kelvin, with that of its certificate.
    pub(crate) fn u_kelvin(&self) -> f64 {
        let certified = self.certified().map_or(0.0, |it| it.figures.u());
        combine(&[self.standard_uncertainty_k, certified])
    }
}
