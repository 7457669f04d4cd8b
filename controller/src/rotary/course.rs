//! What corrects the moves of a rotary axis, also for whoever begins moves without waiting for them.

use compensator::rotary::PeriodicCompensation;
use drivers::device::AxisCommand;
use units::{Radians, RadiansPerSecond, RadiansPerSecondSquared};

use crate::agreed::Agreed;
use crate::failure::Failure;
use crate::rotary::failure::RotaryFailure;
use crate::rotary::table::RotaryTable;
use crate::rotary::turn::Way;

/// What a rotary axis is corrected by at a moment: nothing, or the calibration that was in use when it was asked for.
#[derive(Clone, Debug, Default)]
pub struct TableCourse {
    pub(super) compensation: Option<PeriodicCompensation>,
    /// An angle no farther from where the table is, is there.
    near: Radians,
    speed: RadiansPerSecond,
    acceleration: RadiansPerSecondSquared,
}

/// A turn as it is to be made. Angles count on over the turns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlannedTurn {
    /// Where the table is to be.
    pub target: Radians,
    /// What the drive is sent.
    pub set_point: Radians,
    /// Whether a calibration corrects it.
    pub corrected: bool,
    /// How fast.
    pub speed: RadiansPerSecond,
    acceleration: RadiansPerSecondSquared,
}

impl PlannedTurn {
    /// Begins it, and does not wait: [`machine::Driving::outcome`] says how it ended.
    ///
    /// # Errors
    /// When there is no such axis, or the machine is not started.
    pub fn begin(
        &self,
        machine: &mut machine::Machine,
        axis: &str,
    ) -> Result<(), machine::Failure> {
        machine.turning(axis)?.begin(AxisCommand::MoveTo {
            target: self.set_point,
            speed: self.speed,
            acceleration: self.acceleration,
        })
    }
}

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
    /// What corrects its moves now.
    pub fn course(&self) -> TableCourse {
        TableCourse {
            compensation: self.compensation().cloned(),
            near: Radians::from_arcsec(self.config.position_window_arcsec),
            speed: RadiansPerSecond(self.config.speed_deg_per_s.to_radians()),
            acceleration: RadiansPerSecondSquared(self.config.acceleration_deg_per_s2.to_radians()),
        }
    }
}

impl TableCourse {
    /// The same without its calibration.
    #[must_use]
    pub fn uncompensated(&self) -> Self {
        Self {
            compensation: None,
            ..self.clone()
        }
    }

    /// Whether `axis` may turn to a place so.
    ///
    /// # Errors
    /// Nothing corrects it, and nobody has agreed to that.
    pub fn require(&self, axis: &str, agreed: Agreed) -> Result<(), Failure> {
        match self.compensation {
            None if !agreed.uncompensated => Err(Failure::not_calibrated(axis)),
            None | Some(_) => Ok(()),
        }
    }

    /// What became of a turn, when the table reads `reading` after it.
    pub fn moved(&self, planned: &PlannedTurn, reading: Radians) -> RotaryMoved {
        let own = planned.corrected;
        RotaryMoved {
            target: planned.target,
            set_point: planned.set_point,
            expected: self.place(reading).filter(|_| own).unwrap_or(reading),
            standard_uncertainty: self.standard_uncertainty(planned.set_point).filter(|_| own),
        }
    }

    /// The turn of `axis` to `angle` from where it reads `reading`.
    ///
    /// # Errors
    /// When one of them is no angle.
    pub fn plan(
        &self,
        axis: &str,
        reading: Radians,
        angle: Radians,
        way: Way,
    ) -> Result<PlannedTurn, Failure> {
        let Some(compensation) = &self.compensation else {
            let target = way.target(reading, angle, self.near);
            return Ok(self.planned(target, target, false));
        };
        let not_an_angle = |source| RotaryFailure::NotAnAngle {
            axis: axis.to_owned(),
            source,
        };
        // Turns are counted and ways are chosen by where the table is, not by what it reads.
        let here = reading + compensation.deviation(reading).map_err(not_an_angle)?;
        let target = way.target(here, angle, self.near);
        let set_point = compensation.set_point(target).map_err(not_an_angle)?;
        Ok(self.planned(target, set_point, true))
    }

    const fn planned(&self, target: Radians, set_point: Radians, corrected: bool) -> PlannedTurn {
        PlannedTurn {
            target,
            set_point,
            corrected,
            speed: self.speed,
            acceleration: self.acceleration,
        }
    }

    /// Where the table is when it reads `reading`; `None` where nothing corrects that.
    pub fn place(&self, reading: Radians) -> Option<Radians> {
        let compensation = self.compensation.as_ref()?;
        Some(reading + compensation.deviation(reading).ok()?)
    }

    /// Standard uncertainty of the correction at `set_point`, where known.
    pub fn standard_uncertainty(&self, set_point: Radians) -> Option<Radians> {
        let compensation = self.compensation.as_ref()?;
        compensation.standard_uncertainty(set_point).ok()?
    }
}
