//! A move and what became of it: where the drive's encoder stands, and what corrected the move.

use core::time::Duration;

use compensator::budget::Combined;
use units::{Approach, Metres};

use crate::agreed::Agreed;
use crate::failure::Failure;
use crate::linear::course::Corrected;
use crate::linear::stage::LinearStage;

/// A finished move.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moved {
    /// Where the point was told to go.
    pub target: Metres,
    /// Where the drive was sent for that.
    pub set_point: Metres,
    /// Where the drive's encoder says that it stands, read after the move.
    pub encoder: Metres,
    /// From which side it went there.
    pub approach: Approach,
    /// What corrected the move.
    pub corrected: Corrected,
    /// Where the point itself stands by encoder and calibration; `None` without a calibration.
    pub place: Option<Metres>,
    /// How uncertain that is; `None` where the calibration says nothing of it: beyond its range, or when
    /// it has no uncertainty budget.
    pub uncertainty: Option<Combined>,
}

impl LinearStage<'_> {
    /// Whether the axis may be sent to `target` with the calibration that it uses now.
    ///
    /// # Errors
    /// As [`Corrected::require`].
    pub fn require_corrected(&self, target: Metres, agreed: Agreed) -> Result<(), Failure> {
        let corrected = self.memory.course.corrected(target);
        corrected.require(self.axis, target, agreed)
    }

    /// [`Self::move_to`], then the encoder's place once the axis stands, and what corrected the move.
    ///
    /// # Errors
    /// As [`Self::move_to`]; an axis that does not come to rest.
    pub fn move_and_read(&mut self, target: Metres) -> Result<Moved, Failure> {
        self.move_and_settle(target, STAND)
    }

    /// The same with an approach from a side, where one is asked for ([`Self::move_to_from`]).
    ///
    /// # Errors
    /// As [`Self::move_and_read`] and [`Self::move_to_from`].
    pub fn move_and_read_from(
        &mut self,
        target: Metres,
        approach: Option<Approach>,
    ) -> Result<Moved, Failure> {
        match approach {
            None => self.move_and_read(target),
            Some(approach) => {
                let corrected = self.memory.course.corrected(target);
                let set_point = self.move_to_from(target, approach)?;
                self.read_moved((target, set_point), corrected, STAND)
            }
        }
    }

    /// The same once the axis has stood for `settle`.
    ///
    /// # Errors
    /// As [`Self::move_and_read`].
    pub fn move_and_settle(&mut self, target: Metres, settle: Duration) -> Result<Moved, Failure> {
        let corrected = self.memory.course.corrected(target);
        let set_point = self.move_to(target)?;
        self.read_moved((target, set_point), corrected, settle)
    }

    fn read_moved(
        &mut self,
        (target, set_point): (Metres, Metres),
        corrected: Corrected,
        settle: Duration,
    ) -> Result<Moved, Failure> {
        self.core.stand_still(self.axis, settle)?;
        let reading = self.core.reading(self.axis)?;
        let encoder = reading.expect("an axis that moved has been read").position;
        let approach = self.core.approach(self.axis)?.approach();
        let approach = approach.unwrap_or(Approach::Forward);
        Ok(Moved {
            target,
            set_point,
            encoder,
            approach,
            corrected,
            place: self.memory.course.place(encoder, approach),
            uncertainty: self.uncertainty_at(target, approach),
        })
    }
}

/// How long an axis stands before its place is read.
const STAND: Duration = Duration::from_millis(20);
