//! What a camera in a detector's place sees of a beam: one spot, and one more where there is a reflection.
//!
//! Its two directions are those across the beam. It is mounted off its middle like a detector of quadrants, sees the spot
//! where it was in the middle of the exposure, and hardly knows it where it is so bright that the picture burns out.
//!
//! Absent: errors of scale and lens, which are below its noise over the way that the spot goes.

use super::config::BeamConfig;
use super::reflection::Reflection;
use crate::plant::picture::Mark;
use crate::random::Stream;

/// A spot as it was taught looks this much like it.
const LIKENESS_BEST: f64 = 0.97;
/// One that is twice as bright burns out its picture.
const LIKENESS_BRIGHT: f64 = 0.4;
const BRIGHT: f64 = 1.5;
/// One with less light than this drowns in the picture's noise, the more the less it has.
const FAINT: f64 = 0.2;

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

    /// The shutter closes: the spots in the picture, the brightest first.
    pub(super) fn close(
        &mut self,
        spot_m: [f64; 2],
        light: f64,
        turbulence_m: f64,
        reflection: Option<Reflection>,
    ) -> Vec<Mark> {
        let opened_m = self.opened_m.take().unwrap_or(spot_m);
        // Drawn in any case: a dark picture does not shift the noise of the next one.
        let place_m = [0, 1].map(|k| {
            let trembles_m = turbulence_m * self.turbulence.gaussian();
            let noise_m = self.noise_m * self.noise.gaussian();
            f64::midpoint(opened_m[k], spot_m[k]) + trembles_m + noise_m
        });
        let beside =
            reflection.map(|it| ([0, 1].map(|k| place_m[k] + it.off_m[k]), light * it.share));
        let mut spots: Vec<([f64; 2], f64)> = [(place_m, light)]
            .into_iter()
            .chain(beside)
            .filter(|(place_m, light)| *light > 0.0 && self.is_in_the_field(*place_m))
            .collect();
        spots.sort_by(|a, b| b.1.total_cmp(&a.1));
        let marks = spots.into_iter().map(|(place_m, light)| Mark {
            place_m,
            built_m: [0.0; 2],
            likeness: likeness(light),
        });
        marks.collect()
    }

    fn is_in_the_field(&self, place_m: [f64; 2]) -> bool {
        place_m.iter().all(|it| it.abs() <= self.field_m)
    }
}

fn likeness(light: f64) -> f64 {
    if light > BRIGHT {
        return LIKENESS_BRIGHT;
    }
    LIKENESS_BEST * (light / FAINT).min(1.0)
}
