//! Measured series as data files and calibration runs bring them in: checked once, here.
//!
//! A [`LinearSeries`] is what an external instrument measured at targets of a linear axis; a
//! [`HallSeries`] is a sweep of the two Hall sensors of system S5; a [`StrokeSeries`] is what the
//! screws of a platform (system S1) really did when told to make strokes; a [`RotarySeries`] is
//! what a rotary table read of a plate's lines in several placements of the plate (system S2); a
//! [`VolumeSeries`] is what lines of three axes read (system S4).
//! Whoever holds one knows that every number is finite and every point in its place; nothing is
//! guessed or repaired.
//!
//! Source: the data file formats of the project's design; ISO 230-2:2014 4.3 for the order of a
//! series (every run passes the targets in the sense of its approach).
//!
//! | symbol | name here |
//! |---|---|
//! | j | [`Measurement::run`] |
//! | ↑, ↓ | [`Measurement::approach`] |
//! | P_i, P_ij | [`Measurement::target`], [`Measurement::measured`] |
//! | x_ij | [`Measurement::deviation`] |
//!
//! Absent: files (text comes in, text goes out), unit conversion of foreign formats.

mod fault;
mod rotary;
mod stroke;
mod table;
mod units_of;
mod volume;

use std::collections::BTreeSet;

use units::{Approach, Metres, Volts};

pub use fault::{DataError, Fault};
pub use rotary::{Placement, RotaryFault, RotarySeries, RotarySeriesError};
pub use stroke::{AxisStrokes, Stroke, StrokeError, StrokeSeries};
use table::{Format, Table};
pub use volume::{VolumeFault, VolumeLine, VolumePoint, VolumeSeries};

/// One target reached once, and where the instrument saw the point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measurement {
    /// Number of the run; a run passes the targets at most once per approach.
    pub run: u32,
    /// The direction from which the target was reached.
    pub approach: Approach,
    /// Where the point should be.
    pub target: Metres,
    /// Where the instrument saw it.
    pub measured: Metres,
}

impl Measurement {
    /// Actual − target (ISO 230-2).
    pub fn deviation(&self) -> Metres {
        self.measured - self.target
    }
}

/// Why measurements do not form a series. `index` counts from 0 in the order given.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum SeriesError {
    /// Nothing measured.
    #[error("no measurement at all")]
    Empty,
    /// A NaN or an infinity.
    #[error("measurement {index}: target or measured value is not finite")]
    NotFinite {
        /// Which measurement.
        index: usize,
    },
    /// The same target twice in one run and approach.
    #[error("measurement {index}: target {} mm of run {run} ({}) was already measured",
        units::Short(target.mm()), approach.symbol())]
    Duplicate {
        /// Which measurement.
        index: usize,
        /// Its run.
        run: u32,
        /// Its approach.
        approach: Approach,
        /// Its target.
        target: Metres,
    },
    /// A run number smaller than one before it.
    #[error("measurement {index}: run {seen} comes after run {previous}")]
    RunOrder {
        /// Which measurement.
        index: usize,
        /// Its run.
        seen: u32,
        /// The run before it.
        previous: u32,
    },
    /// A target against the sense of its approach.
    #[error("measurement {index}: target {} mm ({}) comes after {} mm",
        units::Short(seen.mm()), approach.symbol(), units::Short(previous.mm()))]
    TargetOrder {
        /// Which measurement.
        index: usize,
        /// Its approach.
        approach: Approach,
        /// Its target.
        seen: Metres,
        /// The target before it in the same run and approach.
        previous: Metres,
    },
}

/// Measurements of a linear axis: finite, no point twice, runs in order, and within one run and
/// approach the targets in the sense of that approach.
#[derive(Clone, Debug, PartialEq)]
pub struct LinearSeries {
    measurements: Vec<Measurement>,
}

impl LinearSeries {
    /// Checks `measurements`, in the order they were taken.
    ///
    /// # Errors
    /// The first measurement that breaks the order or is not finite.
    pub fn new(measurements: Vec<Measurement>) -> Result<Self, SeriesError> {
        if measurements.is_empty() {
            return Err(SeriesError::Empty);
        }
        let mut seen = BTreeSet::new();
        for (index, m) in measurements.iter().enumerate() {
            if !(m.target.is_finite() && m.measured.is_finite()) {
                return Err(SeriesError::NotFinite { index });
            }
            // Adding zero turns -0 into 0, which is the same target.
            let key = (m.run, m.approach, (m.target.value() + 0.0).to_bits());
            if !seen.insert(key) {
                let Measurement {
                    run,
                    approach,
                    target,
                    ..
                } = *m;
                return Err(SeriesError::Duplicate {
                    index,
                    run,
                    approach,
                    target,
                });
            }
            check_order(&measurements[..index], index, m)?;
        }
        Ok(Self { measurements })
    }

    /// Every measurement, in the order taken.
    pub fn measurements(&self) -> &[Measurement] {
        &self.measurements
    }

    /// The distinct targets, increasing.
    pub fn targets(&self) -> Vec<Metres> {
        let mut targets: Vec<Metres> = self.measurements.iter().map(|m| m.target).collect();
        targets.sort_by(|a, b| a.value().total_cmp(&b.value()));
        targets.dedup();
        targets
    }

    /// The distinct run numbers, increasing.
    pub fn runs(&self) -> Vec<u32> {
        let runs: BTreeSet<u32> = self.measurements.iter().map(|m| m.run).collect();
        runs.into_iter().collect()
    }

    /// The deviations at `target` reached from `approach`, with their runs.
    pub fn deviations(
        &self,
        target: Metres,
        approach: Approach,
    ) -> impl Iterator<Item = (u32, Metres)> {
        self.measurements
            .iter()
            .filter(move |m| m.target == target && m.approach == approach)
            .map(|m| (m.run, m.deviation()))
    }

    /// Reads the CSV format `run,approach,target_mm,measured_mm` (columns in any order, `#`
    /// comment lines, decimal points).
    ///
    /// # Errors
    /// The first thing that is not as it should be, with `source_name`, line and column.
    pub fn from_csv(text: &str, source_name: &str) -> Result<Self, DataError> {
        let table = Table::read(text, source_name, &Format::LINEAR)?;
        let mut measurements = Vec::with_capacity(table.rows());
        for row in 0..table.rows() {
            measurements.push(Measurement {
                run: table.run(row, 0)?,
                approach: table.approach(row, 1)?,
                target: Metres::from_mm(table.number(row, 2)?),
                measured: Metres::from_mm(table.number(row, 3)?),
            });
        }
        let series = Self::new(measurements).map_err(|error| table.series_error(error))?;
        match units_of::judge(&series) {
            Ok(()) => Ok(series),
            Err(reason) => Err(table.fail(0, 3, reason.into())),
        }
    }

    /// The series in the format [`Self::from_csv`] reads, to the last bit of every number.
    pub fn to_csv(&self) -> String {
        let mut text = String::from("run,approach,target_mm,measured_mm\n");
        for m in &self.measurements {
            let (sign, target, measured) = (
                m.approach.symbol(),
                printed(m.target.mm(), m.target),
                m.measured,
            );
            let measured = printed(measured.mm(), measured);
            text.push_str(&format!("{},{sign},{target},{measured}\n", m.run));
        }
        text
    }
}

/// The shortest decimal near `mm` that reads back as exactly `length`.
fn printed(mm: f64, length: Metres) -> String {
    let candidates = [mm, mm.next_up(), mm.next_down()];
    let exact = candidates
        .into_iter()
        .find(|&c| Metres::from_mm(c) == length);
    format!("{}", exact.unwrap_or(mm))
}

fn check_order(before: &[Measurement], index: usize, m: &Measurement) -> Result<(), SeriesError> {
    let Some(last) = before.last() else {
        return Ok(());
    };
    if m.run < last.run {
        return Err(SeriesError::RunOrder {
            index,
            seen: m.run,
            previous: last.run,
        });
    }
    let same = before
        .iter()
        .rev()
        .take_while(|b| b.run == m.run)
        .find(|b| b.approach == m.approach);
    match same {
        Some(b) if Approach::of_move(b.target, m.target) != Some(m.approach) => {
            Err(SeriesError::TargetOrder {
                index,
                approach: m.approach,
                seen: m.target,
                previous: b.target,
            })
        }
        _ => Ok(()),
    }
}

/// Both Hall voltages at one position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HallPoint {
    /// Raw encoder position.
    pub position: Metres,
    /// Sensor 1, over the N-S-N group: even, with its maximum at the zero.
    pub peak: Volts,
    /// Sensor 2, over the S-N group: odd, steep at the zero.
    pub slope: Volts,
}

/// A sweep of the two Hall sensors in the order taken; positions may go back and forth.
#[derive(Clone, Debug, PartialEq)]
pub struct HallSeries {
    points: Vec<HallPoint>,
}

impl HallSeries {
    /// Checks `points`, in the order they were taken.
    ///
    /// # Errors
    /// When there is none, or one is not finite.
    pub fn new(points: Vec<HallPoint>) -> Result<Self, SeriesError> {
        if points.is_empty() {
            return Err(SeriesError::Empty);
        }
        let finite =
            |p: &HallPoint| p.position.is_finite() && p.peak.is_finite() && p.slope.is_finite();
        match points.iter().position(|p| !finite(p)) {
            Some(index) => Err(SeriesError::NotFinite { index }),
            None => Ok(Self { points }),
        }
    }

    /// Every point, in the order taken.
    pub fn points(&self) -> &[HallPoint] {
        &self.points
    }

    /// Reads the CSV format `position_um,peak_v,slope_v` (columns in any order, `#` comment
    /// lines, decimal points).
    ///
    /// # Errors
    /// The first thing that is not as it should be, with `source_name`, line and column.
    pub fn from_csv(text: &str, source_name: &str) -> Result<Self, DataError> {
        let table = Table::read(text, source_name, &Format::HALL)?;
        let mut points = Vec::with_capacity(table.rows());
        for row in 0..table.rows() {
            points.push(HallPoint {
                position: Metres::from_um(table.number(row, 0)?),
                peak: Volts(table.number(row, 1)?),
                slope: Volts(table.number(row, 2)?),
            });
        }
        Self::new(points).map_err(|error| table.series_error(error))
    }

    /// The series in the format [`Self::from_csv`] reads.
    pub fn to_csv(&self) -> String {
        let mut text = String::from("position_um,peak_v,slope_v\n");
        for p in &self.points {
            let (peak, slope) = (p.peak.value(), p.slope.value());
            text.push_str(&format!("{},{peak},{slope}\n", p.position.um()));
        }
        text
    }
}

#[cfg(test)]
mod tests;
