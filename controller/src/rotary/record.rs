//! The errors of a rotary table at the lines of a plate (`rotary_error_table`).

use compensator::budget::{BudgetError, PlacesBudget};
use compensator::rotary::{PeriodicInterpolation, PeriodicTable, Reading, Solution, harmonic_max};
use core::f64::consts::TAU;
use serde::{Deserialize, Serialize};
use units::Radians;

use crate::store::budget::PlacesBudgetRecord;
use crate::store::{StoreError, short};

/// One reading of the run: a line of the plate in one placement.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ReadingName {
    pub offset: u32,
    pub line: u32,
}

/// A self-calibration as it is stored. Lists have one value for each line; the table error is
/// reading − true angle at line n's nominal table position, so the deviation is its negative.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RotaryContent {
    /// Lines of the plate, equally spaced over the circle.
    pub lines: u32,
    /// How the plate was placed: by how many lines it was turned against the table.
    pub offsets: Vec<u32>,
    /// Error of the table's reading at each line, radians; its sum is zero.
    pub table_error_rad: Vec<f64>,
    /// Its standard uncertainty, radians; `None` where neither residuals nor a stated noise
    /// gave one.
    pub standard_uncertainty_rad: Option<Vec<f64>>,
    /// Error of the plate's lines, radians; `None` for a line that was never read.
    pub plate_error_rad: Vec<Option<f64>>,
    /// Where lines of the plate at offset 0 were from the table positions, radians: how it was
    /// fixed. `None` where only deviations are known.
    #[serde(default)]
    pub plate_phase_rad: Option<f64>,
    /// Standard uncertainty of one reading as it was stated beforehand, radians.
    pub reading_noise_rad: Option<f64>,
    /// Scatter of the readings about the model, radians.
    pub residual_rms_rad: f64,
    /// Readings less unknowns.
    pub degrees_of_freedom: u32,
    /// Standard uncertainty of a table error in units of that of one reading, rms.
    pub noise_amplification: f64,
    /// Readings that were not made.
    pub missing: Vec<ReadingName>,
    /// Readings that were left out because they belong to no model.
    pub outliers: Vec<ReadingName>,
    /// What the uncertainties are made of, at each line and half-way to the next; `None` where they are unknown,
    /// and in files of earlier programs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub budget: Option<PlacesBudgetRecord>,
}

impl RotaryContent {
    /// The name of this kind.
    pub const KIND: &'static str = "rotary_error_table";

    /// What `solution` says.
    pub fn new(solution: &Solution) -> Self {
        let radians = |values: &[Radians]| values.iter().map(|it| it.value()).collect();
        let uncertainty = solution.standard_uncertainty();
        let plate = solution.plate_error.iter();
        let outliers = solution.outliers.iter().map(|it| &it.reading);
        Self {
            lines: small(solution.design.lines()),
            offsets: solution
                .design
                .offsets()
                .iter()
                .copied()
                .map(small)
                .collect(),
            table_error_rad: radians(&solution.table_error),
            standard_uncertainty_rad: uncertainty.as_deref().map(radians),
            plate_error_rad: plate.map(|it| it.map(Radians::value)).collect(),
            plate_phase_rad: None,
            reading_noise_rad: solution.reading_noise_given.map(Radians::value),
            residual_rms_rad: solution.residual_rms.value(),
            degrees_of_freedom: small(solution.degrees_of_freedom),
            noise_amplification: solution.noise_amplification(),
            missing: solution.missing.iter().map(ReadingName::of).collect(),
            outliers: outliers.map(ReadingName::of).collect(),
            budget: None,
        }
    }

    /// The same with what its uncertainties are made of, of a table drawn by `interpolation` between its lines.
    ///
    /// # Errors
    /// When a figure is no uncertainty.
    pub fn with_budget(
        mut self,
        solution: &Solution,
        interpolation: PeriodicInterpolation,
    ) -> Result<Self, BudgetError> {
        let budget = solution.budget(interpolation)?;
        self.budget = budget.map(|it| self.placed(&it));
        Ok(self)
    }

    fn placed(&self, budget: &PlacesBudget<Radians>) -> PlacesBudgetRecord {
        let half_lines = 2 * self.lines;
        let angle = |at: u32| TAU * f64::from(at) / f64::from(half_lines);
        let places = (0..half_lines).map(|at| (vec![angle(at)], None));
        PlacesBudgetRecord::new(budget, places.collect())
    }

    /// The largest table error at the lines: the one figure that lists, screens and pages show. What
    /// an interpolation makes of it between the lines is not measured, and not in it.
    pub fn largest_error(&self) -> Radians {
        largest(self.table_error_rad.iter())
    }

    /// The largest error of the plate's lines, likewise.
    pub fn largest_plate_error(&self) -> Radians {
        largest(self.plate_error_rad.iter().flatten())
    }

    /// The largest standard uncertainty of a table error, where it is known.
    pub fn uncertainty_max(&self) -> Option<Radians> {
        self.standard_uncertainty_rad
            .as_ref()
            .map(|it| largest(it.iter()))
    }

    /// Up to which harmonic the table error and its uncertainty hold between the lines, too.
    pub fn harmonic_max(&self) -> usize {
        harmonic_max(self.lines as usize)
    }

    /// That in words.
    pub fn harmonics_told(&self) -> String {
        format!(
            "holds between the lines, as its uncertainty does, for harmonics up to {} of a turn; \
             faster errors look like slower ones at {} lines, and are not in the uncertainty",
            self.harmonic_max(),
            self.lines
        )
    }

    /// One line about it, for lists.
    pub(crate) fn summary(&self) -> String {
        let largest = self.largest_error().arcsec();
        let (lines, placements) = (self.lines, self.offsets.len());
        format!("{lines} lines, {placements} placements, errors up to {largest:.3} arcsec")
    }

    /// The deviations that calibration `id` holds, ready to be interpolated.
    ///
    /// # Errors
    /// When its values make no table.
    pub fn table(&self, id: &str) -> Result<PeriodicTable, StoreError> {
        // A reading too large is an axis short of its target.
        let deviations = self.table_error_rad.iter().map(|error| Radians(-error));
        let uncertainty = self.standard_uncertainty_rad.as_ref();
        let uncertainty = uncertainty.map(|it| it.iter().copied().map(Radians).collect());
        PeriodicTable::new(deviations.collect(), uncertainty)
            .map_err(|source| StoreError::model(&short(id), source))
    }
}

impl ReadingName {
    fn of(reading: &Reading) -> Self {
        Self {
            offset: small(reading.offset),
            line: small(reading.line),
        }
    }
}

fn largest<'a>(radians: impl Iterator<Item = &'a f64>) -> Radians {
    Radians(radians.fold(0.0, |most: f64, it| most.max(it.abs())))
}

fn small(number: usize) -> u32 {
    u32::try_from(number).expect("no plate has four thousand million lines")
}
