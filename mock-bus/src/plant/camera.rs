//! The cameras over the platform: two (or more) fiducial marks, each under its own objective.
//!
//! A camera sees its mark where the platform has taken it, in its own frame, which can be
//! turned and mirrored against the platform's; with its own noise, within its own field. How
//! like the taught mark the picture is falls with motion blur and when the mark is covered.
//!
//! Absent: lens distortion, errors of scale, focus; those of a calibrated camera are below its
//! noise over so small a field.

use crate::random::Stream;
use serde::Deserialize;
use units::portable::{hypot, sin_cos};

use super::picture::Mark;
use super::platform::Pose;

/// A clean, standing mark looks this much like the taught one.
const LIKENESS_BEST: f64 = 0.97;
/// A partly covered one only this much of that, and its place is that much noisier.
const LIKENESS_COVERED: f64 = 0.4;
const NOISE_COVERED: f64 = 8.0;
/// A smear of this length halves the likeness.
const SMEAR_M: f64 = 10e-6;

/// Marks and cameras.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct CameraConfig {
    /// The marks in the platform's frame; a camera stands over each.
    pub marks_mm: Vec<[f64; 2]>,
    /// A mark is seen up to this far from its camera's axis, in x and in y.
    pub field_mm: f64,
    /// Standard deviation of a mark's place in one picture, in x and in y.
    pub noise_um: f64,
    /// The cameras' frame against the platform's, counter-clockwise.
    pub rotation_deg: f64,
    /// Whether y is reversed in that frame, as in a camera that looks from below.
    pub mirrored: bool,
}

impl Default for CameraConfig {
    fn default() -> Self {
        Self {
            marks_mm: vec![[-60.0, 0.0], [60.0, 0.0]],
            field_mm: 4.0,
            noise_um: 0.17,
            rotation_deg: 0.0,
            mirrored: false,
        }
    }
}

/// What becomes of the marks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Target {
    /// All in view.
    #[default]
    Good,
    /// Partly covered.
    Covered,
    /// Not there.
    Absent,
}

#[derive(Clone, Debug)]
pub(super) struct Camera {
    config: CameraConfig,
    noise: Stream,
    /// Where the platform was when the shutters opened.
    opened: Option<Pose>,
    pub(super) target: Target,
    /// Standard deviation of a shake of the machine.
    pub(super) vibration_m: f64,
}

impl Camera {
    pub(super) fn new(config: CameraConfig, seed: u64) -> Self {
        Self {
            config,
            noise: Stream::new(seed, "camera"),
            opened: None,
            target: Target::Good,
            vibration_m: 0.0,
        }
    }

    pub(super) const fn open_shutter(&mut self, pose: Pose) {
        self.opened = Some(pose);
    }

    /// The pictures, with the platform at `pose` now: for each mark `None` where it is not in
    /// its picture.
    pub(super) fn close_shutter(&mut self, pose: Pose) -> Vec<Option<Mark>> {
        let opened = self.opened.take().unwrap_or(pose);
        let marks = self.config.marks_mm.clone();
        marks
            .iter()
            .map(|mark| self.picture(mark.map(|mm| mm * 1e-3), &opened, &pose))
            .collect()
    }

    /// The mark is where it was in the middle of the exposure, smeared over its way.
    fn picture(&mut self, built_m: [f64; 2], opened: &Pose, closed: &Pose) -> Option<Mark> {
        // Drawn in any case: a mark out of sight does not shift the noise of the next picture.
        let noise = [self.noise.gaussian(), self.noise.gaussian()];
        let (from, to) = (opened.place_of(built_m), closed.place_of(built_m));
        let smear_m = hypot(to[0] - from[0], to[1] - from[1]);
        let place_m = [0, 1].map(|axis| f64::midpoint(from[axis], to[axis]));
        let field_m = self.config.field_mm * 1e-3;
        let outside = |axis: usize| (place_m[axis] - built_m[axis]).abs() > field_m;
        if self.target == Target::Absent || outside(0) || outside(1) {
            return None;
        }
        let (likeness, noisier) = match self.target {
            Target::Covered => (LIKENESS_COVERED, NOISE_COVERED),
            Target::Good | Target::Absent => (1.0, 1.0),
        };
        let deviation_m = noisier * self.config.noise_um * 1e-6 + self.vibration_m;
        let seen_m = [0, 1].map(|axis| place_m[axis] + deviation_m * noise[axis]);
        Some(Mark {
            place_m: self.in_frame(seen_m),
            built_m: self.in_frame(built_m),
            likeness: LIKENESS_BEST * likeness / (1.0 + smear_m / SMEAR_M),
        })
    }

    fn in_frame(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let (sin, cos) = sin_cos(self.config.rotation_deg.to_radians());
        let (x, y) = (cos * x + sin * y, cos * y - sin * x);
        [x, if self.config.mirrored { -y } else { y }]
    }
}
