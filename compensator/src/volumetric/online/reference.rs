//! The displacement of a slider from its reference, freed of the drift of its beam.
//!
//! Source: CN1214003A: D(x_c) = reading − reference(x_c), references as a table or function of
//! the position; the detector at the end of travel says how far the beam itself has moved, the
//! part of which at x_c follows from how it moves: all of it when the beam travels sideways as
//! a whole, the share of the way when it pivots at its source.

use units::{Metres, Quantity};

use super::Displacement;
use crate::volumetric::function::Function;

/// How a beam moves when it moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum BeamDrift {
    /// The source stays, the direction changes.
    Pivoting {
        /// Where the source is, by the axis's scale.
        source: Metres,
        /// Where the detector at the end of travel is.
        end: Metres,
    },
    /// The direction stays, the source moves.
    Translating,
    /// Both; one detector at the end cannot tell how much of each.
    Mixed {
        /// Where the source is, by the axis's scale.
        source: Metres,
        /// Where the detector at the end of travel is.
        end: Metres,
        /// The share of the shift at the end that is translation, 0 to 1.
        translation: f64,
    },
}

/// A drift that is not usable.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum DriftError {
    /// Source and detector at the same place.
    #[error("beam: the source at {} mm and the detector at {} mm are at the same place",
        units::Short(beam.mm()), units::Short(end.mm()))]
    NoLength {
        /// The source.
        beam: Metres,
        /// The detector.
        end: Metres,
    },
    /// A share that is none.
    #[error("beam: a share of translation of {seen} is not between 0 and 1",
        seen = units::Short(*seen))]
    Share {
        /// The share.
        seen: f64,
    },
}

impl BeamDrift {
    /// The share of the shift at the end of travel that the beam has at `position`.
    pub fn fraction(&self, position: Metres) -> f64 {
        match *self {
            Self::Translating => 1.0,
            Self::Pivoting { source, end } => (position - source) / (end - source),
            Self::Mixed {
                source,
                end,
                translation,
            } => translation + (1.0 - translation) * ((position - source) / (end - source)),
        }
    }

    /// The share that a beam has at `position` which only turns about its source.
    pub(in crate::volumetric) fn swing(&self, position: Metres) -> f64 {
        match *self {
            // Nobody says where its source is: it is far away, as far as this beam knows.
            Self::Translating => 1.0,
            Self::Pivoting { source, end } | Self::Mixed { source, end, .. } => {
                (position - source) / (end - source)
            }
        }
    }

    fn check(&self) -> Result<(), DriftError> {
        let (source, end, share) = match *self {
            Self::Translating => return Ok(()),
            Self::Pivoting { source, end } => (source, end, 0.0),
            Self::Mixed {
                source,
                end,
                translation,
            } => (source, end, translation),
        };
        if !(0.0..=1.0).contains(&share) {
            return Err(DriftError::Share { seen: share });
        }
        let length = end - source;
        if length == Metres::ZERO || !length.is_finite() {
            return Err(DriftError::NoLength { beam: source, end });
        }
        Ok(())
    }
}

/// What the detectors of one axis read when the axis is right.
#[derive(Clone, Debug)]
pub struct BeamReference {
    slider: [Function<Metres>; 2],
    end: Displacement,
    drift: BeamDrift,
}

impl BeamReference {
    /// References of the slider's detector along the position, those of the detector at the end
    /// of travel, and how the beam moves.
    ///
    /// # Errors
    /// When the drift has no length or its share is none.
    pub fn new(
        slider: [Function<Metres>; 2],
        end: Displacement,
        drift: BeamDrift,
    ) -> Result<Self, DriftError> {
        drift.check()?;
        Ok(Self { slider, end, drift })
    }

    /// The reference of the slider's detector at `position`.
    pub fn slider(&self, position: Metres) -> Displacement {
        [self.slider[0].at(position), self.slider[1].at(position)]
    }

    /// The reference of the detector at the end of travel.
    pub fn end(&self) -> Displacement {
        self.end
    }

    /// How far the beam has moved at the end of travel, for a reading there.
    pub fn beam_shift(&self, end: Displacement) -> Displacement {
        difference(end, self.end)
    }

    /// The slider's displacement from its reference: what its detector reads more than the
    /// reference, and how far the beam it is read against has moved there.
    ///
    /// `beam_shift` is zero where there is no detector at the end of travel.
    pub fn displacement(
        &self,
        position: Metres,
        slider: Displacement,
        beam_shift: Displacement,
    ) -> Displacement {
        let seen = difference(slider, self.slider(position));
        let fraction = self.drift.fraction(position);
        core::array::from_fn(|k| seen[k] + beam_shift[k] * fraction)
    }
}

pub(super) fn difference<Q: Quantity>(a: [Q; 2], b: [Q; 2]) -> [Q; 2] {
    [a[0] - b[0], a[1] - b[1]]
}
