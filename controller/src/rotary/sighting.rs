//! What a person reads of a line of a plate.

use compensator::rotary::{Sighted, SightedPlan};
use units::Radians;

use crate::rotary::{SightedAt, SightingConfig};

/// How the lines of a plate are read by a person.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Sighting {
    pub(crate) value: Sighted,
    range: Radians,
}

impl From<&SightingConfig> for Sighting {
    fn from(config: &SightingConfig) -> Self {
        Self {
            value: config.value.into(),
            range: Radians::from_arcsec(config.range_arcsec),
        }
    }
}

impl Sighting {
    /// Where the table is while a line is read.
    pub(crate) const fn table_at(self) -> SightedAt {
        match self.value {
            Sighted::ToLine => SightedAt::Position,
            Sighted::Angle | Sighted::Deviation => SightedAt::Line,
        }
    }

    /// The placement at `offset` of a plate with `lines`, read in `passes` passes in each direction.
    pub(crate) fn plan(self, offset: f64, lines: u32, passes: u32) -> SightedPlan {
        SightedPlan {
            offset,
            lines: lines as usize,
            passes,
            range: self.range,
        }
    }
}
