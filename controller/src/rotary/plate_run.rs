//! How a plate is read, and what a person is asked for.

use core::f64::consts::TAU;

use machine::Stage;
use units::{Radians, RadiansPerSecond};

use crate::failure::Failure;
use crate::rotary::PlatePlanEntry;
use crate::rotary::operator::{PlateMove, PlateTask};
use crate::rotary::sighting::Sighting;
use crate::run::missing;

/// How a plate is read.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct PlateRun {
    pub(super) plate: String,
    pub(super) lines: u32,
    pub(super) passes: u32,
    pub(super) speed: RadiansPerSecond,
    /// Standard deviation of one line in one pass, as it is stated.
    pub(super) noise: Radians,
    /// `None`: a plate that moved is accepted.
    pub(super) closure_limit: Option<Radians>,
    pub(super) stage: Stage,
    /// How a person reads it, where no detector does.
    pub(super) sighting: Option<Sighting>,
}

/// A placement that is to be read next.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct DuePlacement {
    /// By how many lines the plate shall be turned.
    pub(crate) offset: f64,
    /// Which placement, from 1, of how many.
    pub(crate) step: (usize, usize),
    /// An offset at which it lay before, in the same run or in that of the calibration; `None` where this
    /// is the placement that all others are counted from.
    pub(super) known: Option<f64>,
    /// Where it lay in the first placement, from the table positions.
    pub(super) phase: Option<Radians>,
    /// Passes that were made, of how many.
    pub(super) done: (u32, u32),
}

impl PlateRun {
    /// How a person reads it.
    ///
    /// # Errors
    /// When a detector does.
    pub(super) fn sighting(&self, axis: &str) -> Result<Sighting, Failure> {
        self.sighting.ok_or_else(|| missing(axis, "sighting"))
    }

    pub(super) fn spacing(&self) -> f64 {
        TAU / f64::from(self.lines)
    }

    pub(super) fn plan(&self, offsets: Vec<f64>) -> PlatePlanEntry {
        PlatePlanEntry {
            plate: self.plate.clone(),
            lines: self.lines,
            offsets,
            passes: self.passes,
            speed_rad_per_s: self.speed.value(),
            sighted: self.sighting.map(|it| it.table_at()),
        }
    }

    /// Standard deviation of a reading that is the mean of passes in both directions.
    pub(super) fn noise_of_mean(&self) -> Radians {
        self.noise / (2.0 * f64::from(self.passes)).sqrt()
    }

    /// What a person is asked to do for the placement that is `due`; where the plate lies, if that is
    /// known.
    pub(super) fn task(&self, axis: &str, due: &DuePlacement, lies_at: Option<f64>) -> PlateTask {
        let offset = due.offset;
        PlateTask {
            axis: axis.to_owned(),
            plate: self.plate.clone(),
            lines: self.lines,
            step: due.step,
            offset,
            by: match (due.known, lies_at) {
                (None, _) if self.sighting.is_some() => PlateMove::FixAt { offset },
                (None, _) => PlateMove::Fix,
                (Some(_), Some(here)) => PlateMove::TurnBy(offset - here),
                (Some(known), None) => PlateMove::TurnFrom {
                    offset: known,
                    lines: offset - known,
                },
            },
        }
    }

    /// Passes of one placement, the repeated one included.
    pub(super) const fn sweeps(&self) -> u32 {
        2 * self.passes + 1
    }
}
