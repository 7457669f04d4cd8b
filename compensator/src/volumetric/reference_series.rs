//! References of detectors that were given beforehand, from a file: where each detector is to see its beam.
//!
//! One row a place: which axis moves, which of its detectors, along which direction across, where, and what it
//! reads there when the axis is right. A detector on the slide, and those of the roll, have a row at each
//! position; the one at the end of the beam stands still and has one row without a position. Places count as the
//! detectors' own do: on the slide that of the slide, at the end that of the beam.
//!
//! Source: CN1214003A: the references y_br, z_br are set beforehand for each x_c, as a table or a function. The
//! function is a [`Polynomial`](crate::volumetric::Polynomial).

use core::fmt;

use units::{Metres, Radians};

use crate::data::{DataError, Format, Table};
use crate::volumetric::Axis;

const FORMAT: Format = Format {
    columns: &["axis", "detector", "along", "position_mm", "value", "unit"],
    header: "axis,detector,along,position_mm,value,unit",
};
const POSITION: usize = 3;
const UNIT: usize = 5;

/// Which reading a reference is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReferenceOf {
    /// That of the detector on the slide, along a direction across.
    Slide(Axis),
    /// That of the detector at the end of the beam.
    End(Axis),
    /// The roll of the slide.
    Roll,
}

impl fmt::Display for ReferenceOf {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Slide(along) => write!(f, "slide along {along}"),
            Self::End(along) => write!(f, "end along {along}"),
            Self::Roll => f.write_str("roll"),
        }
    }
}

/// The reference of one reading of one axis.
#[derive(Clone, Debug, PartialEq)]
pub struct GivenReference {
    /// Which axis moves.
    pub axis: Axis,
    /// Which reading.
    pub of: ReferenceOf,
    /// Positions of the axis, increasing; none for a detector that stands still.
    pub positions: Vec<Metres>,
    /// The reference at each of them, metres or radians; one alone for a detector that stands still.
    pub values: Vec<f64>,
    /// The line of the file it begins in, from 1.
    pub row: usize,
}

/// References from a file, one of each reading.
///
/// # Example
///
/// ```
/// use compensator::volumetric::{ReferenceOf, ReferenceSeries};
///
/// let csv = "axis,detector,along,position_mm,value,unit\n\
///            x,slide,y,0,12.5,um\nx,slide,y,500,14,um\nx,end,y,,-3,um\n";
/// let series = ReferenceSeries::from_csv(csv, "references.csv")?;
/// let [slide, end] = series.references() else { unreachable!() };
/// assert_eq!(end.of, ReferenceOf::End(slide.axis.others()[0]));
/// assert!((slide.values[1] - 14e-6).abs() < 1e-18 && end.positions.is_empty());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct ReferenceSeries {
    references: Vec<GivenReference>,
}

/// What only references can have wrong.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ReferenceFault {
    /// No axis.
    #[error("`{column}` is `{seen}`; write x, y or z")]
    Axis {
        /// The column.
        column: &'static str,
        /// The cell.
        seen: String,
    },
    /// No detector.
    #[error("`detector` is `{seen}`; write slide, end or roll")]
    Detector {
        /// The cell.
        seen: String,
    },
    /// A direction that this detector does not see.
    #[error("the detectors of {axis} see directions across {axis}, and `along` is `{seen}`")]
    Along {
        /// Which axis.
        axis: Axis,
        /// The cell.
        seen: String,
    },
    /// A roll with a direction.
    #[error("a roll has no direction, and `along` is `{seen}`; leave it empty")]
    Roll {
        /// The cell.
        seen: String,
    },
    /// Another unit than this detector's.
    #[error("`unit` is `{seen}`; convert the value, and write {expected}")]
    Unit {
        /// The cell.
        seen: String,
        /// The unit.
        expected: &'static str,
    },
    /// A detector that stands still, with a position.
    #[error("the detector at the end of the beam stands still: leave `position_mm` empty")]
    StandsStill,
    /// A detector that stands still, twice.
    #[error("{axis}, {of}: a second row, and this detector stands still; remove one")]
    Again {
        /// Which axis.
        axis: Axis,
        /// Which reading.
        of: ReferenceOf,
    },
    /// Places that do not increase.
    #[error(
        "{axis} = {} mm does not come after {} mm; each reading needs increasing positions",
        units::Short(seen.mm()), units::Short(before.mm())
    )]
    Order {
        /// Which axis.
        axis: Axis,
        /// The position.
        seen: Metres,
        /// That of the row before of the same reading.
        before: Metres,
    },
    /// One place alone.
    #[error("{axis}, {of}: one position only; along a travel there are two or more")]
    Alone {
        /// Which axis.
        axis: Axis,
        /// Which reading.
        of: ReferenceOf,
    },
}

type Refused = DataError<ReferenceFault>;

impl ReferenceSeries {
    /// The references, in the order they appear.
    pub fn references(&self) -> &[GivenReference] {
        &self.references
    }

    /// Reads the CSV format `axis,detector,along,position_mm,value,unit` (columns in any order, `#` comment lines,
    /// decimal points): `detector` is `slide`, `end` (without a position) or `roll` (without a direction), `unit`
    /// `um`, of a roll `arcsec`.
    ///
    /// # Errors
    /// The first thing that is not as it should be, with `source_name`, line and column.
    pub fn from_csv(text: &str, source_name: &str) -> Result<Self, Refused> {
        let table = Table::read(text, source_name, &FORMAT)?;
        let mut own = Self {
            references: Vec::new(),
        };
        for row in 0..table.rows() {
            let (axis, of) = reading(&table, row)?;
            let value = value(&table, row, of)?;
            own.add(&table, row, (axis, of), value)?;
        }
        let alone = |it: &&GivenReference| it.positions.len() == 1;
        if let Some(it) = own.references.iter().find(alone) {
            let is_its = |row: &usize| table.line(*row) == it.row;
            let row = (0..table.rows()).find(is_its).unwrap_or_default();
            let (axis, of) = (it.axis, it.of);
            return Err(table.fail(row, 0, ReferenceFault::Alone { axis, of }.into()));
        }
        Ok(own)
    }

    /// One row more of a reading, or a new one.
    fn add(
        &mut self,
        table: &Table<ReferenceFault>,
        row: usize,
        (axis, of): (Axis, ReferenceOf),
        value: f64,
    ) -> Result<(), Refused> {
        let stands_still = matches!(of, ReferenceOf::End(_));
        let at = match (stands_still, table.text(row, POSITION)) {
            (true, "") => None,
            (true, _) => return Err(table.fail(row, POSITION, ReferenceFault::StandsStill.into())),
            (false, _) => Some(Metres::from_mm(table.number(row, POSITION)?)),
        };
        let mut each = self.references.iter_mut();
        let Some(known) = each.find(|it| (it.axis, it.of) == (axis, of)) else {
            self.references.push(GivenReference {
                axis,
                of,
                positions: at.into_iter().collect(),
                values: vec![value],
                row: table.line(row),
            });
            return Ok(());
        };
        let (Some(seen), Some(&before)) = (at, known.positions.last()) else {
            return Err(table.fail(row, 1, ReferenceFault::Again { axis, of }.into()));
        };
        if seen <= before {
            let fault = ReferenceFault::Order { axis, seen, before };
            return Err(table.fail(row, POSITION, fault.into()));
        }
        known.positions.push(seen);
        known.values.push(value);
        Ok(())
    }
}

/// Which reading of which axis a row is of.
fn reading(table: &Table<ReferenceFault>, row: usize) -> Result<(Axis, ReferenceOf), Refused> {
    let seen = |column: usize| table.text(row, column).to_owned();
    let axis = Axis::named(&seen(0)).ok_or_else(|| {
        let (column, seen) = ("axis", seen(0));
        table.fail(row, 0, ReferenceFault::Axis { column, seen }.into())
    })?;
    let across = || {
        let along = Axis::named(&seen(2)).filter(|it| *it != axis);
        along.ok_or_else(|| {
            let seen = seen(2);
            table.fail(row, 2, ReferenceFault::Along { axis, seen }.into())
        })
    };
    let of = match table.text(row, 1) {
        "slide" => ReferenceOf::Slide(across()?),
        "end" => ReferenceOf::End(across()?),
        "roll" if seen(2).is_empty() => ReferenceOf::Roll,
        "roll" => {
            let seen = seen(2);
            return Err(table.fail(row, 2, ReferenceFault::Roll { seen }.into()));
        }
        _ => {
            let seen = seen(1);
            return Err(table.fail(row, 1, ReferenceFault::Detector { seen }.into()));
        }
    };
    Ok((axis, of))
}

/// The value of a row in metres or radians.
fn value(table: &Table<ReferenceFault>, row: usize, of: ReferenceOf) -> Result<f64, Refused> {
    let (expected, si) = match of {
        ReferenceOf::Slide(_) | ReferenceOf::End(_) => ("um", Metres::from_um(1.0).value()),
        ReferenceOf::Roll => ("arcsec", Radians::from_arcsec(1.0).value()),
    };
    let value = table.number(row, 4)?;
    match table.text(row, UNIT) {
        seen if seen == expected => Ok(value * si),
        seen => {
            let seen = seen.to_owned();
            Err(table.fail(row, UNIT, ReferenceFault::Unit { seen, expected }.into()))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(rows: &str) -> Result<ReferenceSeries, Refused> {
        let csv = format!("axis,detector,along,position_mm,value,unit\n{rows}");
        ReferenceSeries::from_csv(&csv, "r.csv")
    }

    #[track_caller]
    fn check(rows: &str, why: &str) {
        let said = read(rows).unwrap_err().to_string();
        assert!(said.starts_with("r.csv:") && said.contains(why), "{said}");
    }

    #[test]
    fn references_that_cannot_be_are_refused_with_their_row() {
        check("w,slide,y,0,1,um\n", "r.csv:2:1: `axis` is `w`");
        check("x,middle,y,0,1,um\n", "write slide, end or roll");
        check("x,slide,x,0,1,um\n", "across x, and `along` is `x`");
        check("x,slide,,0,1,um\n", "across x, and `along` is ``");
        check("x,roll,y,0,1,arcsec\n", "a roll has no direction");
        check("x,slide,y,0,1,mm\n", "r.csv:2:15: `unit` is `mm`");
        check("x,roll,,0,1,um\n", "write arcsec");
        check("x,end,y,600,1,um\n", "leave `position_mm` empty");
        check("x,slide,y,,1,um\n", "`position_mm` is empty");
        check(
            "x,end,y,,1,um\nx,end,y,,2,um\n",
            "r.csv:3:3: x, end along y",
        );
        check(
            "x,slide,y,5,1,um\nx,slide,y,5,1,um\n",
            "x = 5 mm does not come after 5 mm",
        );
        let alone = "x,end,y,,1,um\nx,slide,y,5,1,um\n";
        check(alone, "r.csv:3:1: x, slide along y: one position only");
    }

    #[test]
    fn rows_of_a_reading_may_stand_among_others() {
        let rows = "x,slide,y,0,1,um\nx,roll,,0,2,arcsec\nx,slide,y,10,3,um\nx,roll,,5,4,arcsec\n";
        let series = read(rows).unwrap();
        let [slide, roll] = series.references() else {
            panic!("{series:?}")
        };
        assert_eq!(slide.positions, [0.0, 10.0].map(Metres::from_mm));
        assert_eq!((slide.row, roll.row), (2, 3));
        assert_eq!(roll.of, ReferenceOf::Roll);
        let arcsec = Radians(roll.values[1]).arcsec();
        assert!((arcsec - 4.0).abs() < 1e-12, "{arcsec}");
    }
}
