//! What a camera in a detector's place sees of a beam: one spot.
//!
//! Its two directions are those across the beam. It is mounted off its middle like a detector of quadrants, sees the spot
//! where it was in the middle of the exposure, and hardly knows it where it is so bright that the picture burns out.
//!
//! Absent: errors of scale and lens, which are below its noise over the way that the spot goes.

use super::config::BeamConfig;
use crate::plant::picture::Mark;
use crate::random::Stream;

/// A spot as it was taught looks this much like it.
const LIKENESS_BEST: f64 = 0.97;
/// One that is twice as bright burns out its picture.
const LIKENESS_BRIGHT: f64 = 0.4;
const BRIGHT: f64 = 1.5;

#[derive(Clone, Debug)]
pub(super) struct SpotCamera {
    noise_m: f64,
    field_m: f64,
    noise: Stream,
    turbulence: Stream,
    opened_m: Option<[f64; 2]>,
}

impl SpotCamera {
    pub(super) fn new(config: &BeamConfig, seed: u64, whose: &str) -> Self {
        Self {
            noise_m: config.camera_noise_um * 1e-6,
            field_m: config.camera_field_um * 1e-6,
            noise: Stream::new(seed, &format!("{whose} camera")),
            turbulence: Stream::new(seed, &format!("{whose} camera turbulence")),
            opened_m: None,
        }
    }

    /// The shutter opens with the spot there, from the camera's middle.
    pub(super) const fn open(&mut self, spot_m: [f64; 2]) {
        self.opened_m = Some(spot_m);
    }

    /// The shutter closes; `None` where no spot is in the picture.
    pub(super) fn close(
        &mut self,
        spot_m: [f64; 2],
        light: f64,
        turbulence_m: f64,
    ) -> Option<Mark> {
        let opened_m = self.opened_m.take().unwrap_or(spot_m);
        // Drawn in any case: a dark picture does not shift the noise of the next one.
        let place_m = [0, 1].map(|k| {
            let trembles_m = turbulence_m * self.turbulence.gaussian();
            let noise_m = self.noise_m * self.noise.gaussian();
            f64::midpoint(opened_m[k], spot_m[k]) + trembles_m + noise_m
        });
        let is_beside = place_m.iter().any(|it| it.abs() > self.field_m);
        if light <= 0.0 || is_beside {
            return None;
        }
        let likeness = if light > BRIGHT {
            LIKENESS_BRIGHT
        } else {
            LIKENESS_BEST
        };
        Some(Mark {
            place_m,
            built_m: [0.0; 2],
            likeness,
        })
    }
}
