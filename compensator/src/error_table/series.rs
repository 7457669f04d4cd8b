//! What an instrument measured at targets of a linear axis: checked once, here.
//!
//! Source: ISO 230-2:2014 4.3 for the order of a series (every run passes the targets in the sense of
//! its approach).
//!
//! | symbol | name here |
//! |---|---|
//! | j | [`Measurement::run`] |
//! | ↑, ↓ | [`Measurement::approach`] |
//! | P_i, P_ij | [`Measurement::target`], [`Measurement::measured`] |
//! | x_ij | [`Measurement::deviation`] |

mod environment;
mod units_of;

use std::collections::BTreeSet;

use units::{Approach, Metres};

use self::units_of::Unbelievable;
use crate::data::{DataError, Fault, Format, Table};
use crate::length_correction::{Environment, EnvironmentError};

const FORMAT: Format = Format {
    columns: &["run", "approach", "target_mm", "measured_mm"],
    header: "run,approach,target_mm,measured_mm",
};

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

/// What only data of a linear axis can have wrong.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum LinearFault {
    /// The same point twice.
    #[error("target {} mm of run {run} ({approach}) is already in the file; keep one",
        units::Short(*target_mm))]
    Duplicate {
        /// Its run.
        run: u32,
        /// `+` or `-`.
        approach: char,
        /// Its target.
        target_mm: f64,
    },
    /// Runs out of order.
    #[error("run {seen} comes after run {previous}; keep the rows in the order measured")]
    RunOrder {
        /// This row's run.
        seen: u32,
        /// The row before's.
        previous: u32,
    },
    /// Targets against the approach.
    #[error(
        "target {} mm comes after {} mm, which is not approach `{approach}`; \
         keep the rows in the order measured",
        units::Short(*seen_mm), units::Short(*previous_mm)
    )]
    TargetOrder {
        /// `+` or `-`.
        approach: char,
        /// This row's target.
        seen_mm: f64,
        /// The target before it.
        previous_mm: f64,
    },
    /// Positions that grow otherwise than their targets, by more than any stage does.
    #[error(
        "`measured_mm` grows by {} mm for each millimetre of `target_mm`, which no stage does: {cause}",
        digits(*slope)
    )]
    OtherUnit {
        /// Measured over target.
        slope: f64,
        /// What it looks like.
        cause: &'static str,
    },
    /// Columns of an environment that no place of a machine has.
    #[error(transparent)]
    Environment(EnvironmentError),
    /// Positions that do not follow their targets.
    #[error(
        "`measured_mm` lies {:.0} % of the range off a line with `target_mm`, which no stage does: are \
         the columns what their names say?", share * 100.0
    )]
    Scattered {
        /// The scatter about the line, as a share of the range.
        share: f64,
    },
}

/// Three significant digits: a slope is a hint, not a result.
fn digits(value: f64) -> units::Short {
    units::Short(format!("{value:.2e}").parse().unwrap_or(value))
}

impl From<Unbelievable> for LinearFault {
    fn from(reason: Unbelievable) -> Self {
        match reason {
            Unbelievable::Slope { slope, cause } => Self::OtherUnit { slope, cause },
            Unbelievable::Scatter { share } => Self::Scattered { share },
        }
    }
}

/// Measurements of a linear axis: finite, no point twice, runs in order, and within one run and
/// approach the targets in the sense of that approach.
///
/// # Example
///
/// ```
/// use compensator::error_table::LinearSeries;
/// use units::{Approach, Metres};
///
/// let csv = "run,approach,target_mm,measured_mm\n1,+,0,0\n1,+,3,3.0021\n1,+,6,6.0040\n";
/// let series = LinearSeries::from_csv(csv, "x.csv")?;
/// let (_, deviation) = series
///     .deviations(Metres::from_mm(3.0), Approach::Forward)
///     .next()
///     .expect("one run");
/// assert!((deviation.um() - 2.1).abs() < 1e-9, "actual − target");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct LinearSeries {
    measurements: Vec<Measurement>,
    environments: Vec<Environment>,
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
        Ok(Self {
            measurements,
            environments: Vec::new(),
        })
    }

    /// Every measurement, in the order taken.
    pub fn measurements(&self) -> &[Measurement] {
        &self.measurements
    }

    /// The series with what `correction` says of each measured position added to it.
    #[must_use]
    pub fn plus(&self, correction: impl Fn(Metres) -> Metres) -> Self {
        let each = self.measurements.iter().map(|it| Measurement {
            measured: it.measured + correction(it.measured),
            ..*it
        });
        Self {
            measurements: each.collect(),
            environments: self.environments.clone(),
        }
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
    /// comment lines, decimal points), with the columns of the environment beside them or without.
    ///
    /// # Errors
    /// The first thing that is not as it should be, with `source_name`, line and column.
    pub fn from_csv(text: &str, source_name: &str) -> Result<Self, DataError<LinearFault>> {
        let is_with_environment = environment::is_named(text);
        let format = [&FORMAT, &environment::FORMAT][usize::from(is_with_environment)];
        let table = Table::read(text, source_name, format)?;
        let mut environments = Vec::new();
        let mut measurements = Vec::with_capacity(table.rows());
        for row in 0..table.rows() {
            measurements.push(Measurement {
                run: table.run(row, 0)?,
                approach: table.approach(row, 1)?,
                target: Metres::from_mm(table.number(row, 2)?),
                measured: Metres::from_mm(table.number(row, 3)?),
            });
            if is_with_environment {
                environments.push(environment::read(&table, row)?);
            }
        }
        let series = Self::new(measurements).map_err(|error| placed(&table, error))?;
        let series = Self {
            environments,
            ..series
        };
        match units_of::judge(&series) {
            Ok(()) => Ok(series),
            Err(reason) => Err(table.fail(0, 3, LinearFault::from(reason).into())),
        }
    }

    /// The series in the format [`Self::from_csv`] reads, to the last bit of every number; without the environment.
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

/// Puts the place of the offending row on an error of the whole series.
fn placed(table: &Table<LinearFault>, error: SeriesError) -> DataError<LinearFault> {
    match error {
        SeriesError::Empty => table.fail(0, 0, Fault::NoRows),
        SeriesError::NotFinite { index } => {
            let seen = table.text(index, 0).to_owned();
            table.fail(
                index,
                0,
                Fault::NotFinite {
                    column: FORMAT.columns[0],
                    seen,
                },
            )
        }
        SeriesError::Duplicate {
            index,
            run,
            approach,
            target,
        } => {
            let (approach, target_mm) = (approach.symbol(), target.mm());
            table.fail(
                index,
                2,
                LinearFault::Duplicate {
                    run,
                    approach,
                    target_mm,
                }
                .into(),
            )
        }
        SeriesError::RunOrder {
            index,
            seen,
            previous,
        } => table.fail(index, 0, LinearFault::RunOrder { seen, previous }.into()),
        SeriesError::TargetOrder {
            index,
            approach,
            seen,
            previous,
        } => {
            let (seen_mm, previous_mm) = (seen.mm(), previous.mm());
            let approach = approach.symbol();
            table.fail(
                index,
                2,
                LinearFault::TargetOrder {
                    approach,
                    seen_mm,
                    previous_mm,
                }
                .into(),
            )
        }
    }
}

#[cfg(test)]
mod tests;
