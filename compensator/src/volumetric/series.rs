//! Readings of lines of three axes, measured elsewhere.
//!
//! One row a reading, the lines one after the other, each with a number of its own. `reads` says
//! with which optics, and in which unit the row's deviation and its standard uncertainty are:
//!
//! | `reads` | what |
//! |---|---|
//! | `linear_um` | the tool's displacement along the line |
//! | `straightness_y_um` | its displacement along y (or x, z), from a straightedge laid by hand |
//! | `tilt_z_arcsec` | its tilt about z (or x, y), right-handed |
//!
//! Places are machine coordinates; `tool_…` is the offset of the point that is measured.

use units::{Metres, Radians};

use crate::data::{DataError, Format, Table};
use crate::volumetric::identify::{Optics, Reading, direction};
use crate::volumetric::{Axis, Point};

const FORMAT: Format = Format {
    columns: &[
        "line",
        "reads",
        "x_mm",
        "y_mm",
        "z_mm",
        "tool_x_mm",
        "tool_y_mm",
        "tool_z_mm",
        "deviation",
        "u",
    ],
    header: "line,reads,x_mm,y_mm,z_mm,tool_x_mm,tool_y_mm,tool_z_mm,deviation,u",
};

/// What `reads` can be.
const READS: [(&str, Optics); 7] = [
    ("linear_um", Optics::Linear),
    ("straightness_x_um", Optics::Straightness(Axis::X)),
    ("straightness_y_um", Optics::Straightness(Axis::Y)),
    ("straightness_z_um", Optics::Straightness(Axis::Z)),
    ("tilt_x_arcsec", Optics::Angle(Axis::X)),
    ("tilt_y_arcsec", Optics::Angle(Axis::Y)),
    ("tilt_z_arcsec", Optics::Angle(Axis::Z)),
];

/// One reading of a line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VolumePoint {
    /// The commanded position.
    pub at: Point,
    /// Actual − target.
    pub reading: Reading,
    /// The line of the file it stands in, from 1.
    pub row: usize,
}

/// One line with its readings, in the order they were made.
#[derive(Clone, Debug, PartialEq)]
pub struct VolumeLine {
    /// Its number in the file.
    pub number: u32,
    /// With what it was read.
    pub optics: Optics,
    /// The offset of the point that was measured.
    pub tool: Point,
    /// Its readings, at two places at least.
    pub points: Vec<VolumePoint>,
}

/// Lines that were read.
///
/// # Example
///
/// ```
/// use compensator::volumetric::VolumeSeries;
///
/// let csv = "line,reads,x_mm,y_mm,z_mm,tool_x_mm,tool_y_mm,tool_z_mm,deviation,u\n\
///            1,linear_um,0,0,0,0,0,-100,0,0.1\n1,linear_um,300,400,0,0,0,-100,2.5,0.1\n";
/// let series = VolumeSeries::from_csv(csv, "volume.csv")?;
/// let [diagonal] = series.lines() else { unreachable!("one line") };
/// assert_eq!((diagonal.points.len(), diagonal.tool.z.mm()), (2, -100.0));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct VolumeSeries {
    lines: Vec<VolumeLine>,
}

/// What only data of three axes can have.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum VolumeFault {
    /// No optics.
    #[error("`reads` is `{seen}`; write linear_um, straightness_y_um or tilt_z_arcsec (x, y or z)")]
    Reads {
        /// The cell.
        seen: String,
    },
    /// A standard uncertainty that is not above zero.
    #[error("`u` is {seen}; a standard uncertainty is above zero", seen = units::Short(*seen))]
    Uncertainty {
        /// The cell.
        seen: f64,
    },
    /// A line that comes in parts.
    #[error("line {number} appears again; keep its rows together: one set-up is one line")]
    Again {
        /// Its number.
        number: u32,
    },
    /// Optics or tool that change within a line.
    #[error("line {number} was begun with other optics or another tool; number it as another line")]
    Changed {
        /// Its number.
        number: u32,
    },
    /// A line that goes nowhere.
    #[error(
        "line {number} was read at one place only; a line needs readings at two places or more"
    )]
    Nowhere {
        /// Its number.
        number: u32,
    },
    /// Straightness optics that look along the line.
    #[error("line {number} runs along {axis}, so no straightness along {axis} can be read on it")]
    Along {
        /// Its number.
        number: u32,
        /// Which direction.
        axis: Axis,
    },
}

/// A row before its line is known.
struct Row {
    number: u32,
    optics: Optics,
    at: Point,
    tool: Point,
    deviation: f64,
    u: f64,
    row: usize,
}

impl VolumeSeries {
    /// The lines, in the order they appear.
    pub fn lines(&self) -> &[VolumeLine] {
        &self.lines
    }

    /// Reads the CSV format
    /// `line,reads,x_mm,y_mm,z_mm,tool_x_mm,tool_y_mm,tool_z_mm,deviation,u` (columns in any
    /// order, `#` comment lines, decimal points).
    ///
    /// # Errors
    /// The first thing that is not as it should be, with `source_name`, line and column.
    pub fn from_csv(text: &str, source_name: &str) -> Result<Self, DataError<VolumeFault>> {
        let table = Table::read(text, source_name, &FORMAT)?;
        let mut groups: Vec<(usize, Vec<Row>)> = Vec::new();
        for at in 0..table.rows() {
            let row = read_row(&table, at)?;
            let fail = |fault: VolumeFault| table.fail(at, 0, fault.into());
            let number = row.number;
            let known = groups.iter().position(|(_, rows)| rows[0].number == number);
            match known {
                None => groups.push((at, vec![row])),
                Some(last) if last + 1 == groups.len() => {
                    let rows = &mut groups[last].1;
                    if (rows[0].optics, rows[0].tool) != (row.optics, row.tool) {
                        return Err(fail(VolumeFault::Changed { number }));
                    }
                    rows.push(row);
                }
                Some(_) => return Err(fail(VolumeFault::Again { number })),
            }
        }
        let lines = groups.iter().map(|(first, rows)| {
            let line = line_of(rows);
            line.map_err(|fault| table.fail(*first, 0, fault.into()))
        });
        Ok(Self {
            lines: lines.collect::<Result<_, _>>()?,
        })
    }
}

fn read_row(table: &Table<VolumeFault>, row: usize) -> Result<Row, DataError<VolumeFault>> {
    let mm = |column: usize| table.number(row, column).map(Metres::from_mm);
    let seen = table.text(row, 1);
    let optics = READS.iter().find(|(name, _)| *name == seen);
    let (_, optics) = optics.ok_or_else(|| {
        let seen = seen.to_owned();
        table.fail(row, 1, VolumeFault::Reads { seen }.into())
    })?;
    let u = table.number(row, 9)?;
    if u <= 0.0 {
        return Err(table.fail(row, 9, VolumeFault::Uncertainty { seen: u }.into()));
    }
    Ok(Row {
        number: table.run(row, 0)?,
        optics: *optics,
        at: Point::new(mm(2)?, mm(3)?, mm(4)?),
        tool: Point::new(mm(5)?, mm(6)?, mm(7)?),
        deviation: table.number(row, 8)?,
        u,
        row: table.line(row),
    })
}

fn line_of(rows: &[Row]) -> Result<VolumeLine, VolumeFault> {
    let (first, number) = (&rows[0], rows[0].number);
    let ends = [first.at, rows[rows.len() - 1].at];
    let along = direction(&ends).ok_or(VolumeFault::Nowhere { number })?;
    if let Optics::Straightness(axis) = first.optics
        && along[axis.index()].abs() > SQUARE
    {
        return Err(VolumeFault::Along { number, axis });
    }
    let points = rows.iter().map(|it| VolumePoint {
        at: it.at,
        reading: reading(it, along),
        row: it.row,
    });
    Ok(VolumeLine {
        number,
        optics: first.optics,
        tool: first.tool,
        points: points.collect(),
    })
}

/// How far from square to the line a direction across it may be (its cosine).
const SQUARE: f64 = 1e-6;

fn reading(row: &Row, way: [f64; 3]) -> Reading {
    let length = |along| Reading::Length {
        along,
        deviation: Metres::from_um(row.deviation),
        u: Metres::from_um(row.u),
    };
    match row.optics {
        Optics::Linear => length(way),
        Optics::Straightness(axis) => length(Axis::ALL.map(|it| f64::from(u8::from(it == axis)))),
        Optics::Angle(about) => Reading::Angle {
            about,
            deviation: Radians::from_arcsec(row.deviation),
            u: Radians::from_arcsec(row.u),
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEADER: &str = "line,reads,x_mm,y_mm,z_mm,tool_x_mm,tool_y_mm,tool_z_mm,deviation,u\n";

    fn read(rows: &str) -> Result<VolumeSeries, DataError<VolumeFault>> {
        VolumeSeries::from_csv(&format!("{HEADER}{rows}"), "v.csv")
    }

    #[test]
    fn lines_are_read_with_their_units_and_directions() {
        let series = read(
            "1,linear_um,0,0,0,0,0,-100,0,0.1\n1,linear_um,300,400,0,0,0,-100,2.5,0.1\n\
             7,tilt_y_arcsec,0,0,0,0,0,0,0,0.05\n7,tilt_y_arcsec,10,0,0,0,0,0,-1,0.05\n\
             8,straightness_z_um,0,0,0,0,0,0,0,0.3\n8,straightness_z_um,10,0,0,0,0,0,4,0.3\n",
        );
        let series = series.unwrap();
        let [diagonal, tilt, straight] = series.lines() else {
            panic!("{series:?}")
        };
        let last = diagonal.points[1];
        let Reading::Length {
            along,
            deviation,
            u,
        } = last.reading
        else {
            panic!("{last:?}")
        };
        assert!((0..3).all(|k| (along[k] - [0.6, 0.8, 0.0][k]).abs() < 1e-12));
        assert_eq!((deviation, u), (Metres::from_um(2.5), Metres::from_um(0.1)));
        assert_eq!((last.row, diagonal.tool.z.mm()), (3, -100.0));
        let Reading::Angle {
            about, deviation, ..
        } = tilt.points[1].reading
        else {
            panic!("{tilt:?}")
        };
        assert_eq!((about, deviation), (Axis::Y, Radians::from_arcsec(-1.0)));
        let Reading::Length { along, .. } = straight.points[0].reading else {
            panic!("{straight:?}")
        };
        assert_eq!(along, [0.0, 0.0, 1.0]);
    }

    #[track_caller]
    fn check_fault(rows: &str, place: (usize, usize), says: &str) {
        let error = read(rows).unwrap_err();
        assert_eq!((error.line, error.column), place, "{error}");
        assert!(error.to_string().contains(says), "{error}");
    }

    #[test]
    fn what_is_no_line_is_told_with_its_place() {
        let row = "1,linear_um,0,0,0,0,0,0,0,0.1\n";
        let end = "1,linear_um,9,0,0,0,0,0,0,0.1\n";
        check_fault("1,linear_mm,0,0,0,0,0,0,0,0.1\n", (2, 3), "`linear_mm`");
        check_fault("1,linear_um,0,0,0,0,0,0,0,0\n", (2, 27), "above zero");
        check_fault("1,linear_um,0,0,nan,0,0,0,0,1\n", (2, 17), "finite");
        check_fault(&format!("{row}{row}"), (2, 1), "one place only");
        let other = "2,linear_um,0,0,0,0,0,0,0,0.1\n2,linear_um,9,0,0,0,0,0,0,0.1\n";
        check_fault(&format!("{row}{end}{other}{row}"), (6, 1), "appears again");
        let tool = "1,linear_um,9,0,0,0,0,5,0,0.1\n";
        check_fault(&format!("{row}{tool}"), (3, 1), "another tool");
        let along = "3,straightness_x_um,0,0,0,0,0,0,0,1\n3,straightness_x_um,9,0,0,0,0,0,0,1\n";
        check_fault(along, (2, 1), "runs along x");
    }
}
