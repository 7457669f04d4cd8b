//! What a certificate certifies: a value, or corrections by readings.

use jiff::civil::Date;

/// What was read of a certificate.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Certified {
    /// What the laboratory calls it.
    pub(crate) identifier: String,
    /// Who issued it.
    pub(crate) laboratory: String,
    /// Of what.
    pub(crate) serial_number: String,
    /// The last day of the calibration.
    pub(crate) calibrated: Date,
    /// The last day that it holds.
    pub(crate) valid_until: Date,
    /// BLAKE3 of the file.
    pub(crate) hash: String,
    /// What it says.
    pub(crate) figures: Figures,
}

/// In SI units, temperatures in degrees Celsius.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Figures {
    /// Of a quantity that has one value.
    Value {
        /// The value.
        value: f64,
        /// Its standard uncertainty.
        u: f64,
    },
    /// Of an instrument that reads.
    Table(Vec<Point>),
}

/// A place of a table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Point {
    /// What the instrument read.
    pub(crate) reading: f64,
    /// What is added to that.
    pub(crate) correction: f64,
    /// Its standard uncertainty.
    pub(crate) u: f64,
}

impl Figures {
    /// What is added to `reading`: straight lines between the places, the end's correction beyond them.
    pub(crate) fn correction(&self, reading: f64) -> f64 {
        let Self::Table(points) = self else {
            return 0.0;
        };
        let after = points.partition_point(|it| it.reading < reading);
        match (
            after.checked_sub(1).and_then(|at| points.get(at)),
            points.get(after),
        ) {
            (Some(low), Some(high)) => {
                let share = (reading - low.reading) / (high.reading - low.reading);
                low.correction + share * (high.correction - low.correction)
            }
            (Some(end), None) | (None, Some(end)) => end.correction,
            (None, None) => 0.0,
        }
    }

    /// Whether the instrument was calibrated at such readings.
    pub(crate) fn covers(&self, reading: f64) -> bool {
        match self {
            Self::Value { .. } => true,
            Self::Table(points) => {
                let ends = points.first().zip(points.last());
                ends.is_some_and(|(first, last)| (first.reading..=last.reading).contains(&reading))
            }
        }
    }

    /// The least and the largest reading that it was calibrated at.
    pub(crate) fn range(&self) -> Option<(f64, f64)> {
        match self {
            Self::Value { .. } => None,
            Self::Table(points) => Some((points.first()?.reading, points.last()?.reading)),
        }
    }

    /// The largest standard uncertainty that it states.
    pub(crate) fn u(&self) -> f64 {
        match self {
            Self::Value { u, .. } => *u,
            Self::Table(points) => points.iter().fold(0.0, |most, it| most.max(it.u)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corrections_lie_on_straight_lines_and_the_ends_hold() {
        let point = |reading, correction, u| Point {
            reading,
            correction,
            u,
        };
        let table = Figures::Table(vec![
            point(10.0, 0.1, 0.02),
            point(20.0, -0.1, 0.03),
            point(30.0, 0.0, 0.01),
        ]);
        for (reading, expected) in [
            (0.0, 0.1),
            (10.0, 0.1),
            (15.0, 0.0),
            (20.0, -0.1),
            (25.0, -0.05),
            (99.0, 0.0),
        ] {
            let seen = table.correction(reading);
            assert!((seen - expected).abs() < 1e-15, "{reading}: {seen}");
        }
        assert!(table.covers(10.0) && table.covers(30.0));
        assert!(!table.covers(9.999) && !table.covers(f64::NAN));
        assert_eq!((table.u(), table.range()), (0.03, Some((10.0, 30.0))));
        let one = Figures::Table(vec![point(20.0, 0.5, 0.1)]);
        assert_eq!(
            (
                one.correction(-5.0),
                one.correction(20.0),
                one.correction(25.0)
            ),
            (0.5, 0.5, 0.5)
        );
    }
}
