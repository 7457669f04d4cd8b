//! A designed shape of three axes, to be kept as a state memory: displacements of the slides, from a file.
//!
//! One row a place: which axis moves, along which direction across it its slide is to be displaced, where,
//! and by how much, counted from the references of the detectors and in the direction of the machine.
//! Between the places of one axis and direction it is a cubic spline; beyond, the ends hold; a direction
//! without rows is not displaced.
//!
//! Source: CN1214003A, second part: the state that a machine is built with on purpose.

use units::Metres;

use crate::data::{DataError, Format, Table};
use crate::volumetric::Axis;
use crate::volumetric::function::{Function, FunctionError, Shape};
use crate::volumetric::online::{Coverage, StateMap};

const FORMAT: Format = Format {
    columns: &["axis", "along", "position_mm", "displacement_um"],
    header: "axis,along,position_mm,displacement_um",
};

/// One place of a designed shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StatePoint {
    /// Which axis moves.
    pub axis: Axis,
    /// The direction across it.
    pub along: Axis,
    /// Its position.
    pub at: Metres,
    /// By how much its slide is displaced there.
    pub displacement: Metres,
    /// The line of the file it stands in, from 1.
    pub row: usize,
}

/// A designed shape.
///
/// # Example
///
/// ```
/// use compensator::volumetric::{Axis, StateSeries};
/// use units::Metres;
///
/// let csv = "axis,along,position_mm,displacement_um\nx,z,0,0\nx,z,250,15\nx,z,500,0\n";
/// let (map, covers) = StateSeries::from_csv(csv, "bow.csv")?.map()?;
/// let [y, z] = map.at(Axis::X, Metres(0.25));
/// assert!(y == Metres(0.0) && (z.um() - 15.0).abs() < 1e-9);
/// assert_eq!(covers[0], Some((Metres(0.0), Metres(0.5))));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct StateSeries {
    points: Vec<StatePoint>,
}

/// What only a designed shape can have wrong.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum StateFault {
    /// No axis.
    #[error("`{column}` is `{seen}`; write x, y or z")]
    Axis {
        /// The column.
        column: &'static str,
        /// The cell.
        seen: String,
    },
    /// A displacement along the travel.
    #[error("a slide of {axis} is displaced across {axis}, not along it; scales are no state")]
    Along {
        /// Which axis.
        axis: Axis,
    },
    /// Places that do not increase.
    #[error(
        "{axis} = {} mm does not come after {} mm; each axis and direction needs increasing positions",
        units::Short(seen.mm()), units::Short(before.mm())
    )]
    Order {
        /// Which axis.
        axis: Axis,
        /// The position.
        seen: Metres,
        /// That of the row before of the same axis and direction.
        before: Metres,
    },
    /// One place alone.
    #[error("{axis} along {along} has one place only; a shape needs two or more")]
    Alone {
        /// Which axis.
        axis: Axis,
        /// Which direction.
        along: Axis,
    },
}

impl StateSeries {
    /// The places, in the order they appear.
    pub fn points(&self) -> &[StatePoint] {
        &self.points
    }

    /// Reads the CSV format `axis,along,position_mm,displacement_um` (columns in any order, `#` comment
    /// lines, decimal points).
    ///
    /// # Errors
    /// The first thing that is not as it should be, with `source_name`, line and column.
    pub fn from_csv(text: &str, source_name: &str) -> Result<Self, DataError<StateFault>> {
        let table = Table::read(text, source_name, &FORMAT)?;
        let mut points: Vec<StatePoint> = Vec::new();
        for row in 0..table.rows() {
            let point = read_row(&table, row)?;
            let before = points.iter().rev().find(|it| it.is_with(&point));
            if let Some(before) = before.map(|it| it.at).filter(|it| *it >= point.at) {
                let (axis, seen) = (point.axis, point.at);
                let fault = StateFault::Order { axis, seen, before };
                return Err(table.fail(row, 2, fault.into()));
            }
            points.push(point);
        }
        for (row, point) in points.iter().enumerate() {
            if points.iter().filter(|it| it.is_with(point)).count() < 2 {
                let StatePoint { axis, along, .. } = *point;
                let fault = StateFault::Alone { axis, along };
                return Err(table.fail(row, 0, fault.into()));
            }
        }
        Ok(Self { points })
    }

    /// As a memory, with what it covers of each axis.
    ///
    /// # Errors
    /// Never for places that were read.
    pub fn map(&self) -> Result<(StateMap, Coverage), FunctionError> {
        let (mut map, mut covers) = (StateMap::default(), Coverage::default());
        for axis in Axis::ALL {
            let own: Vec<&StatePoint> = self.points.iter().filter(|it| it.axis == axis).collect();
            let places = own.iter().map(|it| it.at);
            let ends = places.fold(None, |ends: Option<(Metres, Metres)>, at| {
                let (low, high) = ends.unwrap_or((at, at));
                Some((low.min(at), high.max(at)))
            });
            let Some((low, high)) = ends else {
                continue;
            };
            let [first, second] = axis.others().map(|along| {
                let with = own.iter().filter(|it| it.along == along);
                let (nodes, values): (Vec<Metres>, Vec<Metres>) =
                    with.map(|it| (it.at, it.displacement)).unzip();
                if nodes.is_empty() {
                    return Function::new(&[low, high], &[Metres::ZERO; 2], Shape::Spline);
                }
                Function::new(&nodes, &values, Shape::Spline)
            });
            map.of[axis.index()] = Some([first?, second?]);
            covers[axis.index()] = ends;
        }
        Ok((map, covers))
    }
}

impl StatePoint {
    fn is_with(&self, other: &Self) -> bool {
        (self.axis, self.along) == (other.axis, other.along)
    }
}

fn read_row(table: &Table<StateFault>, row: usize) -> Result<StatePoint, DataError<StateFault>> {
    let letter = |at: usize, column: &'static str| {
        let seen = table.text(row, at);
        let axis = Axis::ALL.into_iter().find(|it| it.to_string() == seen);
        axis.ok_or_else(|| {
            let seen = seen.to_owned();
            table.fail(row, at, StateFault::Axis { column, seen }.into())
        })
    };
    let (axis, along) = (letter(0, "axis")?, letter(1, "along")?);
    if axis == along {
        return Err(table.fail(row, 1, StateFault::Along { axis }.into()));
    }
    Ok(StatePoint {
        axis,
        along,
        at: Metres::from_mm(table.number(row, 2)?),
        displacement: Metres::from_um(table.number(row, 3)?),
        row: table.line(row),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(rows: &str, why: &str) {
        let csv = format!("axis,along,position_mm,displacement_um\n{rows}");
        let refused = StateSeries::from_csv(&csv, "shape.csv").unwrap_err();
        let said = refused.to_string();
        assert!(
            said.starts_with("shape.csv:") && said.contains(why),
            "{said}"
        );
    }

    #[test]
    fn a_shape_that_cannot_be_is_refused_with_its_row() {
        check("w,z,0,0\n", "shape.csv:2:1: `axis` is `w`");
        check("x,x,0,0\n", "across x, not along it");
        check(
            "x,z,0,0\nx,z,0,1\n",
            "shape.csv:3:5: x = 0 mm does not come after",
        );
        check("x,z,0,0\nx,y,5,1\n", "one place only");
        check("x,z,0,up\n", "not a number");
        let other = "axis,along,position_m,displacement_um\nx,z,0,0\n";
        let refused = StateSeries::from_csv(other, "s").unwrap_err().to_string();
        assert!(refused.contains("position_mm"), "{refused}");
    }

    /// Two directions at places of their own, another axis, and one that is not there.
    #[test]
    fn each_axis_and_direction_has_places_of_its_own() {
        let csv = "axis,along,position_mm,displacement_um\n\
                   x,z,0,0\nx,z,100,10\nx,y,-50,4\nx,y,200,4\ny,x,0,-3\ny,x,50,-3\n";
        let (map, covers) = StateSeries::from_csv(csv, "s").unwrap().map().unwrap();
        let at = |axis, mm| {
            map.at(axis, Metres::from_mm(mm))
                .map(|it| (it.um() * 1e6).round() / 1e6)
        };
        assert_eq!(at(Axis::X, 50.0), [4.0, 5.0]);
        assert_eq!(at(Axis::Y, 25.0), [-3.0, 0.0]);
        assert_eq!(at(Axis::Z, 25.0), [0.0, 0.0]);
        assert_eq!(
            covers[0],
            Some((Metres::from_mm(-50.0), Metres::from_mm(200.0)))
        );
        assert_eq!(covers[2], None);
    }
}
