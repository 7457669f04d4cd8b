//! What the readings of an instrument are counted from.

use compensator::length_correction::LengthCorrection;
use units::Metres;

/// What readings are counted from.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Datum {
    /// How lengths are corrected since.
    pub(super) length: LengthCorrection,
    /// What the instrument still read there, averaged: it makes a single sample its zero.
    pub(super) offset: Metres,
}
