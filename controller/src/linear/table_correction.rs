//! The calibrations in use, as a correction of cyclic set-points (system S3).

use compensator::error_table::Compensation;
use machine::engine::{EngineFailure, PerAxis, TableCorrection};
use units::MetresPerSecond;

use crate::failure::Failure;
use crate::linear::memory::AxisMemory;
use crate::memories::Memories;

/// What the calibrations in `memories` say of `axes`, for an engine of these axes in this order.
pub(crate) fn table_correction(
    machine: &machine::Machine,
    memories: &Memories,
    axes: &[&str],
) -> Result<TableCorrection, Failure> {
    let mut tables: PerAxis<Option<Compensation>> = core::array::from_fn(|_| None);
    for (own, axis) in tables.iter_mut().zip(axes) {
        let settings = machine.cyclic_settings(axis)?;
        let known: Option<&AxisMemory> = memories.get(axis);
        let Some(table) = known.and_then(|it| it.course.compensation.as_ref()) else {
            continue;
        };
        let rate = MetresPerSecond(table.steepest_slope() * settings.limits.speed.value());
        let size = table.table().largest();
        if rate > settings.correction.rate || size > settings.correction.size {
            return Err(EngineFailure::CorrectionLimit {
                axis: (*axis).to_owned(),
                size,
                rate,
            }
            .into());
        }
        *own = Some(table.clone());
    }
    Ok(TableCorrection::new(tables.into_iter().take(axes.len())))
}
