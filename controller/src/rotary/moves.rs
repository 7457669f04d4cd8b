//! Moves of a rotary axis that are compensated, and the calibration they use.

use compensator::rotary::PeriodicCompensation;
use units::Radians;

use crate::failure::Failure;
use crate::rotary::Way;
use crate::rotary::failure::RotaryFailure;
use crate::rotary::table::RotaryTable;
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

impl RotaryTable<'_> {
    /// Turns the table to `angle`, compensated where it has a calibration.
    ///
    /// # Errors
    /// Before anything moves: not zeroed, no angle. While moving: whatever stops the machine.
    pub fn move_to(&mut self, angle: Radians, way: Way) -> Result<RotaryMoved, Failure> {
        self.core.require_zeroed(self.axis)?;
        let not_an_angle = |source| RotaryFailure::NotAnAngle {
            axis: self.axis.to_owned(),
            source,
        };
        let Some(compensation) = self.compensation().cloned() else {
            let target = self.turn_to(angle, way)?;
            return Ok(RotaryMoved {
                target,
                set_point: target,
                expected: self.reading()?,
                standard_uncertainty: None,
            });
        };
        let near = Radians::from_arcsec(self.config.position_window_arcsec);
        let reading = self.reading()?;
        // Turns are counted and ways are chosen by where the table is, not by what it reads.
        let here = reading + compensation.deviation(reading).map_err(not_an_angle)?;
        let target = way.target(here, angle, near);
        let set_point = compensation.set_point(target).map_err(not_an_angle)?;
        self.turn_to(set_point, Way::Turns)?;
        let reading = self.reading()?;
        let deviation = compensation.deviation(reading).map_err(not_an_angle)?;
        let uncertainty = compensation.standard_uncertainty(set_point);
        Ok(RotaryMoved {
            target,
            set_point,
            expected: reading + deviation,
            standard_uncertainty: uncertainty.map_err(not_an_angle)?,
        })
    }

    /// Loads the calibration that `store` says is active for the table, after
    /// checking that it belongs to this machine; returns its name, `None` when there is none.
    ///
    /// # Errors
    /// When it is damaged, of another kind, belongs to another machine or breaks a limit.
    pub fn load_active(&mut self, store: &Store) -> Result<Option<String>, Failure> {
        let Some(in_use) = self.subject().in_use(store)? else {
            return Ok(None);
        };
        let id = in_use.id.clone();
        self.memory.calibration = Some(in_use);
        Ok(Some(id))
    }

    /// The calibration in use.
    pub fn compensation(&self) -> Option<&PeriodicCompensation> {
        let calibration = self.memory.calibration.as_ref()?;
        Some(&calibration.compensation)
    }

    /// Uses no calibration any more.
    pub fn forget_calibration(&mut self) {
        self.memory.calibration = None;
    }
}
