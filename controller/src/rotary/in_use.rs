//! The calibration that a table is corrected by.

use compensator::rotary::PeriodicCompensation;

use crate::rotary::RotaryContent;
use crate::store::{CalibrationRecord, StoreError};

/// A calibration in use.
#[derive(Clone, Debug)]
pub(crate) struct TableInUse {
    pub(super) id: String,
    /// The plate it was made with.
    pub(super) plate: String,
    pub(super) content: RotaryContent,
    pub(super) compensation: PeriodicCompensation,
}

impl TableInUse {
    pub(super) fn new(
        id: &str,
        record: &CalibrationRecord<RotaryContent>,
        compensation: PeriodicCompensation,
    ) -> Result<Self, StoreError> {
        Ok(Self {
            id: id.to_owned(),
            plate: record.head.instrument.name.clone(),
            content: record.content.clone(),
            compensation,
        })
    }
}
