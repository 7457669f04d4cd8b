//! Moves of a rotary axis that are compensated, and the calibration they use.

use compensator::rotary::PeriodicCompensation;
use units::Radians;

use crate::connected::Machine;
use crate::failure::Failure;
use crate::rotary::RotaryContent;
use crate::rotary::Way;
use crate::rotary::failure::RotaryFailure;
use crate::rotary::in_use::TableInUse;
use crate::rotary::settings;
use crate::run::missing;
use crate::store::Store;

/// A move of a rotary axis that was made. Angles count on over the turns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RotaryMoved {
    /// Where the table was told to be.
    pub target: Radians,
    /// What the drive was sent.
    pub set_point: Radians,
    /// Where it is by the drive's reading and the calibration.
    pub expected: Radians,
    /// Standard uncertainty of the correction there, where known. What all angles have in common,
    /// where the zero is, is not in it.
    pub standard_uncertainty: Option<Radians>,
}

impl Machine {
    /// Turns the rotary axis `axis` to `angle`, compensated where it has a calibration.
    ///
    /// # Errors
    /// Before anything moves: not zeroed, no angle. While moving: whatever stops the machine.
    pub fn move_rotary(
        &mut self,
        axis: &str,
        angle: Radians,
        way: Way,
    ) -> Result<RotaryMoved, Failure> {
        self.require_zeroed(axis)?;
        let not_an_angle = |source| RotaryFailure::NotAnAngle {
            axis: axis.to_owned(),
            source,
        };
        let Some(compensation) = self.rotary_compensation(axis).cloned() else {
            let target = self.turn_to(axis, angle, way)?;
            return Ok(RotaryMoved {
                target,
                set_point: target,
                expected: self.table_reading(axis)?,
                standard_uncertainty: None,
            });
        };
        let near = Radians::from_arcsec(self.rotary_config(axis)?.position_window_arcsec);
        let reading = self.table_reading(axis)?;
        // Turns are counted and ways are chosen by where the table is, not by what it reads.
        let here = reading + compensation.deviation(reading).map_err(not_an_angle)?;
        let target = way.target(here, angle, near);
        let set_point = compensation.set_point(target).map_err(not_an_angle)?;
        self.turn_to(axis, set_point, Way::Turns)?;
        let reading = self.table_reading(axis)?;
        let deviation = compensation.deviation(reading).map_err(not_an_angle)?;
        let uncertainty = compensation.standard_uncertainty(set_point);
        Ok(RotaryMoved {
            target,
            set_point,
            expected: reading + deviation,
            standard_uncertainty: uncertainty.map_err(not_an_angle)?,
        })
    }

    /// Loads the calibration that `store` says is active for the rotary axis `axis`, after
    /// checking that it belongs to this machine; returns its name, `None` when there is none.
    ///
    /// # Errors
    /// When it is damaged, of another kind, belongs to another machine or breaks a limit.
    pub fn load_active_rotary(
        &mut self,
        axis: &str,
        store: &Store,
    ) -> Result<Option<String>, Failure> {
        self.rotary_config(axis)?;
        let Some(id) = store.active(axis)?.current else {
            return Ok(None);
        };
        let record = store.load(&id)?;
        record
            .head
            .belongs_to(&id, &self.this_machine(axis), &self.config_hash)?;
        let compensation = self.prepare_table(axis, record.rotary(&id)?, &id)?;
        let in_use = TableInUse::new(&id, &record, compensation)?;
        self.remember_table(axis).calibration = Some(in_use);
        Ok(Some(id))
    }

    /// The calibration that the rotary axis `axis` uses now.
    pub fn rotary_compensation(&self, axis: &str) -> Option<&PeriodicCompensation> {
        let calibration = self.rotary_memory.get(axis)?.calibration.as_ref()?;
        Some(&calibration.compensation)
    }

    /// Uses no calibration for the rotary axis `axis` any more.
    pub fn forget_rotary_calibration(&mut self, axis: &str) {
        self.remember_table(axis).calibration = None;
    }

    /// Proves that a table error can be undone within the limits of the configuration.
    pub(super) fn prepare_table(
        &self,
        axis: &str,
        content: &RotaryContent,
        id: &str,
    ) -> Result<PeriodicCompensation, Failure> {
        let config = self.rotary_config(axis)?.compensation.as_ref();
        let config = config.ok_or_else(|| missing(axis, "compensation"))?;
        settings::periodic_compensation(config, axis, content.table(id)?)
    }
}
