//! A move and what became of it: where the drive's encoder stands, and what corrected the move.

use compensator::budget::Combined;
use compensator::error_table::{Compensation, EndPolicy};
use units::{Approach, Metres};

use crate::failure::Failure;
use crate::linear::stage::LinearStage;

/// What corrected a move.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Corrected {
    /// Nothing: no calibration is in use.
    No,
    /// The calibration, between its first and last position.
    Within,
    /// Beyond the calibrated range, from `first` to `last`: the deviation at its end is used, which
    /// was not measured there.
    Held {
        /// First calibrated position.
        first: Metres,
        /// Last calibrated position.
        last: Metres,
    },
    /// Beyond the calibrated range: the deviation of its end, fading to nothing over `distance`.
    Fading {
        /// First calibrated position.
        first: Metres,
        /// Last calibrated position.
        last: Metres,
        /// Where nothing is left of it, from the end on.
        distance: Metres,
    },
}

/// A finished move.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moved {
    /// Where the point was told to go.
    pub target: Metres,
    /// Where the drive was sent for that.
    pub set_point: Metres,
    /// Where the drive's encoder says that it stands, read after the move.
    pub encoder: Metres,
    /// What corrected the move.
    pub corrected: Corrected,
    /// Where the point itself stands by encoder and calibration; `None` without a calibration.
    pub place: Option<Metres>,
    /// How uncertain that is; `None` where the calibration says nothing of it: beyond its range, or when
    /// it has no uncertainty budget.
    pub uncertainty: Option<Combined>,
}

impl LinearStage<'_> {
    /// [`Self::move_to`], then the encoder's place once the axis stands, and what corrected the move.
    ///
    /// # Errors
    /// As [`Self::move_to`]; an axis that does not come to rest.
    pub fn move_and_read(&mut self, target: Metres) -> Result<Moved, Failure> {
        let corrected = self
            .compensation()
            .map_or(Corrected::No, |table| corrected_at(table, target));
        let set_point = self.move_to(target)?;
        self.core.stand_still(self.axis, STAND)?;
        let reading = self.core.reading(self.axis)?;
        let encoder = reading.expect("an axis that moved has been read").position;
        let approach = self.core.approach(self.axis)?.approach();
        let approach = approach.unwrap_or(Approach::Forward);
        let deviation = self
            .compensation()
            .and_then(|table| table.deviation(encoder, approach).ok());
        Ok(Moved {
            target,
            set_point,
            encoder,
            corrected,
            place: deviation.map(|it| encoder + it),
            uncertainty: self.uncertainty_at(target, approach),
        })
    }
}

/// How long an axis stands before its place is read.
const STAND: core::time::Duration = core::time::Duration::from_millis(20);

fn corrected_at(table: &Compensation, target: Metres) -> Corrected {
    let (first, last) = table.table().range();
    if target >= first && target <= last {
        return Corrected::Within;
    }
    match table.end_policy() {
        // Never driven: the move itself is refused.
        EndPolicy::Refuse => Corrected::Within,
        EndPolicy::Hold => Corrected::Held { first, last },
        EndPolicy::FadeOut(distance) => Corrected::Fading {
            first,
            last,
            distance,
        },
    }
}
