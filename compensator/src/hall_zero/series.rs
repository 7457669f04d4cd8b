//! A sweep of the two Hall sensors: checked once, here.

use core::convert::Infallible;

use units::{Metres, Volts};

use crate::data::{DataError, Fault, Format, Table};

const FORMAT: Format = Format {
    columns: &["position_um", "peak_v", "slope_v"],
    header: "position_um,peak_v,slope_v",
};

/// Why points do not form a series. `index` counts from 0 in the order given.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum HallSeriesError {
    /// Nothing measured.
    #[error("no point at all")]
    Empty,
    /// A NaN or an infinity.
    #[error("point {index}: position or voltage is not finite")]
    NotFinite {
        /// Which point.
        index: usize,
    },
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
///
/// # Example
///
/// ```
/// use compensator::hall_zero::HallSeries;
///
/// let csv = "position_um,peak_v,slope_v\n-10,1.5,2.4\n10,1.5,2.6\n-10,1.5,2.4\n";
/// let sweep = HallSeries::from_csv(csv, "hall.csv")?;
/// assert_eq!(sweep.points().len(), 3, "back and forth");
/// let other_unit = HallSeries::from_csv("position_mm,peak_v,slope_v\n1,1,1\n", "hall.csv");
/// assert!(other_unit.is_err_and(|it| it.to_string().contains("name it `position_um`")));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct HallSeries {
    points: Vec<HallPoint>,
}

impl HallSeries {
    /// Checks `points`, in the order they were taken.
    ///
    /// # Errors
    /// When there is none, or one is not finite.
    pub fn new(points: Vec<HallPoint>) -> Result<Self, HallSeriesError> {
        if points.is_empty() {
            return Err(HallSeriesError::Empty);
        }
        let finite =
            |p: &HallPoint| p.position.is_finite() && p.peak.is_finite() && p.slope.is_finite();
        match points.iter().position(|p| !finite(p)) {
            Some(index) => Err(HallSeriesError::NotFinite { index }),
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
    pub fn from_csv(text: &str, source_name: &str) -> Result<Self, DataError<Infallible>> {
        let table = Table::read(text, source_name, &FORMAT)?;
        let mut points = Vec::with_capacity(table.rows());
        for row in 0..table.rows() {
            points.push(HallPoint {
                position: Metres::from_um(table.number(row, 0)?),
                peak: Volts(table.number(row, 1)?),
                slope: Volts(table.number(row, 2)?),
            });
        }
        Self::new(points).map_err(|error| match error {
            HallSeriesError::Empty => table.fail(0, 0, Fault::NoRows),
            HallSeriesError::NotFinite { index } => {
                let (column, seen) = (FORMAT.columns[0], table.text(index, 0).to_owned());
                table.fail(index, 0, Fault::NotFinite { column, seen })
            }
        })
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
mod tests {
    use super::*;

    #[test]
    fn a_hall_sweep_may_go_back_and_forth() {
        let text = "position_um,peak_v,slope_v\n-10,1.5,2.4\n10,1.5,2.6\n-10,1.5,2.4\n";
        let series = HallSeries::from_csv(text, "hall.csv").unwrap();
        assert_eq!(series.points().len(), 3);
        assert_eq!(
            HallSeries::from_csv(&series.to_csv(), "again").unwrap(),
            series
        );
        let error = HallSeries::from_csv("position_mm,peak_v,slope_v\n1,1,1\n", "hall.csv");
        assert!(
            error
                .unwrap_err()
                .to_string()
                .contains("name it `position_um`")
        );
    }
}
