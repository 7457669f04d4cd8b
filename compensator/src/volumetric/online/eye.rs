//! What sees a beam: four channels, or a camera.

use units::{Metres, Time};

use super::{BeamDetector, Displacement, Sample, Spot, SpotCamera, Trouble};

/// What sees a beam.
#[derive(Clone, Debug)]
pub enum Eye {
    /// A detector of four channels.
    Channels(Box<BeamDetector>),
    /// A camera.
    Camera(SpotCamera),
}

/// What it showed last.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shown {
    /// Of a detector of four channels.
    Channels(Sample),
    /// Of a camera.
    Camera(Spot),
}

impl Eye {
    /// The place of the beam by what was shown last, at `now`. What something of the other sort showed counts as
    /// nothing.
    ///
    /// # Errors
    /// What is wrong: nothing may then be concluded.
    pub fn read(&mut self, now: Time, newest: Option<&Shown>) -> Result<Displacement, Trouble> {
        match (self, newest) {
            (Self::Channels(detector), Some(Shown::Channels(sample))) => {
                detector.read(now, Some(sample))
            }
            (Self::Channels(detector), _) => detector.read(now, None),
            (Self::Camera(camera), Some(Shown::Camera(spot))) => camera.read(now, Some(spot)),
            (Self::Camera(camera), _) => camera.read(now, None),
        }
    }

    /// Whether what was read last is the same picture as before. Samples of channels all count: a module says how
    /// often it samples.
    pub const fn repeats(&self) -> bool {
        match self {
            Self::Channels(_) => false,
            Self::Camera(camera) => camera.repeats(),
        }
    }

    /// The lowest and the highest place that it can show, in both directions.
    pub fn field(&self) -> [(Metres, Metres); 2] {
        match self {
            Self::Channels(detector) => detector.field(),
            Self::Camera(camera) => camera.field(),
        }
    }
}

impl From<BeamDetector> for Eye {
    fn from(detector: BeamDetector) -> Self {
        Self::Channels(Box::new(detector))
    }
}

impl From<Sample> for Shown {
    fn from(sample: Sample) -> Self {
        Self::Channels(sample)
    }
}
