//! A designed shape of three axes, to be kept as a state memory: displacements and rolls of the slides, from a file.
//!
//! One row a place: which axis moves, along which direction across it its slide is to be displaced, where,
//! and by how much, counted from the references of the detectors and in the direction of the machine.
//! Between the places of one axis and direction it is a cubic spline; beyond, the ends hold; a direction
//! without rows is not displaced, an axis without them not rolled. A file with rolls has columns of its own, and in
//! place of the direction the word `roll`.
//!
//! Source: CN1214003A, second part: the state that a machine is built with on purpose; with its seventh aspect a
//! roll is part of it.

use units::{Metres, Radians};

use crate::data::{DataError, Format, Table};
use crate::volumetric::Axis;
use crate::volumetric::function::{Function, FunctionError, Shape};
use crate::volumetric::online::{Coverage, StateMap};

const FORMAT: Format = Format {
    columns: &["axis", "along", "position_mm", "displacement_um"],
    header: "axis,along,position_mm,displacement_um",
};
/// With rolls.
const WITH_ROLLS: Format = Format {
    columns: &["axis", "along", "position_mm", "value", "unit"],
    header: "axis,along,position_mm,value,unit",
};

/// What of a slide is to be otherwise at a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StateValue {
    /// It is displaced along this direction by so much.
    Displacement(Axis, Metres),
    /// It is rolled by so much.
    Roll(Radians),
}

impl StateValue {
    /// `along z`, or `in roll`.
    fn what(self) -> String {
        match self {
            Self::Displacement(along, _) => format!("along {along}"),
            Self::Roll(_) => "in roll".to_owned(),
        }
    }
}

/// One place of a designed shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StatePoint {
    /// Which axis moves.
    pub axis: Axis,
    /// Its position.
    pub at: Metres,
    /// What its slide is to be there.
    pub value: StateValue,
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
    #[error("{axis} {what} has one place only; a shape needs two or more")]
    Alone {
        /// Which axis.
        axis: Axis,
        /// Along which direction, or the roll.
        what: String,
    },
    /// Another unit than what is displaced or rolled has.
    #[error("`unit` is `{seen}`; convert the value, and write {expected}")]
    Unit {
        /// The cell.
        seen: String,
        /// The unit.
        expected: &'static str,
    },
}

impl StateSeries {
    /// The places, in the order they appear.
    pub fn points(&self) -> &[StatePoint] {
        &self.points
    }

    /// Reads the CSV format `axis,along,position_mm,displacement_um` (columns in any order, `#` comment
    /// lines, decimal points), or with rolls `axis,along,position_mm,value,unit`: `unit` is `um`, or `arcsec` where
    /// `along` is `roll`.
    ///
    /// # Errors
    /// The first thing that is not as it should be, with `source_name`, line and column.
    pub fn from_csv(text: &str, source_name: &str) -> Result<Self, DataError<StateFault>> {
        let has_rolls = has_units(text);
        let format = if has_rolls { &WITH_ROLLS } else { &FORMAT };
        let table = Table::read(text, source_name, format)?;
        let mut points: Vec<StatePoint> = Vec::new();
        for row in 0..table.rows() {
            let point = read_row(&table, row, has_rolls)?;
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
                let (axis, what) = (point.axis, point.value.what());
                let fault = StateFault::Alone { axis, what };
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
            let rolls = own.iter().filter_map(|it| match it.value {
                StateValue::Roll(roll) => Some((it.at, roll)),
                StateValue::Displacement(..) => None,
            });
            let (nodes, rolls): (Vec<Metres>, Vec<Radians>) = rolls.unzip();
            if !nodes.is_empty() {
                map.roll[axis.index()] = Some(Function::new(&nodes, &rolls, Shape::Spline)?);
            }
            let [first, second] = axis.others().map(|along| {
                let with = own.iter().filter_map(|it| match it.value {
                    StateValue::Displacement(own, value) if own == along => Some((it.at, value)),
                    StateValue::Displacement(..) | StateValue::Roll(_) => None,
                });
                let (nodes, values): (Vec<Metres>, Vec<Metres>) = with.unzip();
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
        let is_same = match (self.value, other.value) {
            (StateValue::Displacement(own, _), StateValue::Displacement(other, _)) => own == other,
            (StateValue::Roll(_), StateValue::Roll(_)) => true,
            (StateValue::Displacement(..), StateValue::Roll(_))
            | (StateValue::Roll(_), StateValue::Displacement(..)) => false,
        };
        self.axis == other.axis && is_same
    }
}

/// Whether the header says that each row has a unit of its own.
fn has_units(text: &str) -> bool {
    let mut lines = text.lines().map(str::trim);
    let header = lines.find(|it| !it.is_empty() && !it.starts_with('#'));
    header.is_some_and(|it| it.split(',').any(|cell| cell.trim() == "unit"))
}

fn read_row(
    table: &Table<StateFault>,
    row: usize,
    has_rolls: bool,
) -> Result<StatePoint, DataError<StateFault>> {
    let letter = |at: usize, column: &'static str| {
        let seen = table.text(row, at);
        Axis::named(seen).ok_or_else(|| {
            let seen = seen.to_owned();
            table.fail(row, at, StateFault::Axis { column, seen }.into())
        })
    };
    let in_unit = |expected: &'static str| match table.text(row, 4) {
        seen if seen == expected => Ok(()),
        seen => {
            let seen = seen.to_owned();
            Err(table.fail(row, 4, StateFault::Unit { seen, expected }.into()))
        }
    };
    let axis = letter(0, "axis")?;
    let value = if has_rolls && table.text(row, 1) == "roll" {
        in_unit("arcsec")?;
        StateValue::Roll(Radians::from_arcsec(table.number(row, 3)?))
    } else {
        let along = letter(1, "along")?;
        if axis == along {
            return Err(table.fail(row, 1, StateFault::Along { axis }.into()));
        }
        if has_rolls {
            in_unit("um")?;
        }
        StateValue::Displacement(along, Metres::from_um(table.number(row, 3)?))
    };
    Ok(StatePoint {
        axis,
        at: Metres::from_mm(table.number(row, 2)?),
        value,
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

    /// The unit of a row is its own; a roll is zero where there are no rows.
    #[test]
    fn rolls_have_columns_of_their_own() {
        let csv = "axis,along,position_mm,value,unit\n\
                   x,z,0,0,um\nx,roll,0,2,arcsec\nx,z,100,10,um\nx,roll,400,6,arcsec\n";
        let (map, covers) = StateSeries::from_csv(csv, "s").unwrap().map().unwrap();
        let roll = map.roll_at(Axis::X, Metres::from_mm(100.0)).arcsec();
        assert!((roll - 3.0).abs() < 1e-9, "{roll}");
        assert_eq!(map.roll_at(Axis::Y, Metres(0.1)), Radians::ZERO);
        assert_eq!(covers[0], Some((Metres(0.0), Metres::from_mm(400.0))));
        let refused = |rows: &str| {
            let csv = format!("# rolls\naxis,along,position_mm,value,unit\n{rows}");
            StateSeries::from_csv(&csv, "s").unwrap_err().to_string()
        };
        let said = refused("x,roll,0,1,um\n");
        assert!(said.contains("s:3:12: `unit` is `um`"), "{said}");
        let said = refused("x,z,0,1,mm\nx,z,5,1,um\n");
        assert!(said.contains("write um"), "{said}");
        let said = refused("x,roll,0,1,arcsec\n");
        assert!(said.contains("x in roll has one place only"), "{said}");
        check("x,roll,0,1\n", "`along` is `roll`");
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
