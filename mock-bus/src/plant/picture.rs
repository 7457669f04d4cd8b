//! What a vision system looks at, and what its pictures show.

use serde::Deserialize;

/// What a vision system's cameras look at.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Scene {
    /// Marks on what the machine moves, each under a camera of its own.
    #[default]
    Marks,
    /// The spot of the reference beam along this axis (0, 1, 2), in the place of one of its detectors.
    Beam {
        /// Which beam.
        axis: usize,
        /// Which of its detectors.
        at: BeamPlace,
    },
}

/// Which of a beam's detectors.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum BeamPlace {
    /// On the slide.
    Slide,
    /// Behind the end of the travel.
    End,
}

impl Scene {
    /// How many marks tell where they are: a turn is not seen by one, and a spot has none.
    pub(crate) const fn least(self) -> usize {
        match self {
            Self::Marks => 2,
            Self::Beam { .. } => 1,
        }
    }
}

/// A mark in a picture, or a spot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mark {
    /// Its place in metres in the cameras' common frame.
    pub place_m: [f64; 2],
    /// Where it would be with all as it was built.
    pub built_m: [f64; 2],
    /// How like the taught mark it looks, 0 to 1.
    pub likeness: f64,
}
