//! The calibrations in use, as a correction of cyclic set-points (system S3).

use compensator::error_table::Compensation;
use machine::engine::{EngineFailure, PerAxis, TableCorrection};
use units::MetresPerSecond;

use crate::connected::Machine;
use crate::failure::Failure;

impl Machine {
    /// What the calibrations in use say of `axes` ([`Machine::load_active`]), for an engine of
    /// these axes in this order.
    ///
    /// # Errors
    /// When there is no such axis, it is not configured for the engine, or its correction at full
    /// speed would change faster than `correction_rate_um_per_s`, or be larger than
    /// `correction_limit_um`: it would be cut off on the way.
    pub fn table_correction(&self, axes: &[&str]) -> Result<TableCorrection, Failure> {
        let mut tables: PerAxis<Option<Compensation>> = core::array::from_fn(|_| None);
        for (own, axis) in tables.iter_mut().zip(axes) {
            let settings = self.cyclic_settings(axis)?;
            let Some(table) = self.compensation(axis) else {
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
}
