//! What the screws of a machine did when told to make strokes.

use units::{Approach, Metres};

use crate::data::{DataError, Fault, Format, Table};

const FORMAT: Format = Format {
    columns: &["axis", "approach", "stroke_um", "deviation_um"],
    header: "axis,approach,stroke_um,deviation_um",
};

/// What only data of screws can have wrong.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ScrewFault {
    /// Nothing can be said about a screw that made one stroke only.
    #[error(
        "axis {axis} has no other stroke than {} um; measure at least two different \
         strokes, better five and more", units::Short(*stroke_um)
    )]
    OneStroke {
        /// Which axis.
        axis: String,
        /// The only stroke.
        stroke_um: f64,
    },
    /// A stroke a thousand times shorter than the others.
    #[error(
        "axis {axis}: a stroke of {} um does not fit the others, from {} to {} um; are micrometres \
         and millimetres mixed?",
        units::Short(*stroke_um), units::Short(*least_um), units::Short(*most_um)
    )]
    MixedUnits {
        /// Which axis.
        axis: String,
        /// The stroke.
        stroke_um: f64,
        /// The shortest of the others.
        least_um: f64,
        /// The longest of the others.
        most_um: f64,
    },
    /// A deviation larger than any stroke of its axis.
    #[error(
        "axis {axis}: the deviation of {} um is larger than its longest stroke, \
         {} um; are micrometres and millimetres mixed?",
        units::Short(*deviation_um), units::Short(*stroke_um)
    )]
    Implausible {
        /// Which axis.
        axis: String,
        /// The deviation.
        deviation_um: f64,
        /// The longest stroke.
        stroke_um: f64,
    },
}

/// One stroke made once.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stroke {
    /// The direction of the last motion before the measurement.
    pub approach: Approach,
    /// Where the screw was commanded to, counted from its zero; it has a sign.
    pub stroke: Metres,
    /// Actual − commanded, along the same coordinate.
    pub deviation: Metres,
}

/// The strokes of one axis, in the order measured.
#[derive(Clone, Debug, PartialEq)]
pub struct AxisStrokes {
    /// The axis.
    pub axis: String,
    /// The line of its first row, when it was read from a file.
    pub line: Option<usize>,
    /// The line of each stroke, when they were read from a file; empty otherwise.
    pub lines: Vec<usize>,
    /// Its strokes: finite, and not all the same.
    pub strokes: Vec<Stroke>,
}

/// Why strokes do not form a series. `index` counts from 0 in the order given.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum StrokeError {
    /// Nothing measured.
    #[error("no stroke at all")]
    Empty,
    /// A NaN or an infinity.
    #[error("stroke {index} of axis {axis}: stroke or deviation is not finite")]
    NotFinite {
        /// Which one.
        index: usize,
        /// Its axis.
        axis: String,
    },
    /// All strokes of an axis are equal.
    #[error(
        "axis {axis}: no other stroke than {} um; measure at least two different strokes, better \
         five and more", units::Short(stroke.um())
    )]
    OneStroke {
        /// The first of them.
        index: usize,
        /// The axis.
        axis: String,
        /// The only stroke.
        stroke: Metres,
    },
    /// A stroke a thousand times shorter than the others.
    #[error(
        "axis {axis}: a stroke of {} um does not fit the others, from {} to {} um",
        units::Short(stroke.um()),
        units::Short(others.0.um()), units::Short(others.1.um())
    )]
    MixedUnits {
        /// Which one.
        index: usize,
        /// The axis.
        axis: String,
        /// The stroke.
        stroke: Metres,
        /// The shortest and the longest of the others, without sign.
        others: (Metres, Metres),
    },
    /// A deviation larger than any stroke of its axis.
    #[error(
        "axis {axis}: the deviation of {} um is larger than its longest stroke, {} um",
        units::Short(deviation.um()), units::Short(longest.um())
    )]
    Implausible {
        /// Which one.
        index: usize,
        /// The axis.
        axis: String,
        /// The deviation.
        deviation: Metres,
        /// The longest stroke.
        longest: Metres,
    },
}

/// Strokes of one axis or several, each axis with at least two different ones; repetitions are
/// welcome.
///
/// # Example
///
/// ```
/// use compensator::screw::StrokeSeries;
///
/// let csv = "axis,approach,stroke_um,deviation_um\nu,-,-500,2.02\nu,-,-1500,2.62\n";
/// let series = StrokeSeries::from_csv(csv, "screw.csv")?;
/// let [u] = series.axes() else { unreachable!("one axis") };
/// assert_eq!((u.axis.as_str(), u.strokes.len()), ("u", 2));
/// let error = StrokeSeries::from_csv("axis,approach,stroke_um,deviation_um\nu,-,-500,2\n", "it");
/// assert!(error.is_err(), "one stroke says nothing of a slope");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct StrokeSeries {
    axes: Vec<AxisStrokes>,
}

impl StrokeSeries {
    /// Checks `strokes`, in the order they were measured; axes may take turns.
    ///
    /// # Errors
    /// The first stroke that is not finite or not plausible, or the first axis with no two
    /// different ones.
    pub fn new(strokes: Vec<(String, Stroke)>) -> Result<Self, StrokeError> {
        if strokes.is_empty() {
            return Err(StrokeError::Empty);
        }
        for (index, (axis, it)) in strokes.iter().enumerate() {
            if !(it.stroke.is_finite() && it.deviation.is_finite()) {
                let axis = axis.clone();
                return Err(StrokeError::NotFinite { index, axis });
            }
        }
        let mut places: Vec<Vec<usize>> = Vec::new();
        let mut axes: Vec<AxisStrokes> = Vec::new();
        for (index, (axis, stroke)) in strokes.into_iter().enumerate() {
            let known = axes.iter().position(|it| it.axis == axis);
            let which = known.unwrap_or_else(|| {
                places.push(Vec::new());
                axes.push(AxisStrokes {
                    axis,
                    line: None,
                    lines: Vec::new(),
                    strokes: Vec::new(),
                });
                axes.len() - 1
            });
            axes[which].strokes.push(stroke);
            places[which].push(index);
        }
        for (axis, places) in axes.iter().zip(&places) {
            check_axis(axis, places)?;
        }
        Ok(Self { axes })
    }

    /// The axes, in the order they appear.
    pub fn axes(&self) -> &[AxisStrokes] {
        &self.axes
    }

    /// Reads the CSV format `axis,approach,stroke_um,deviation_um` (columns in any order, `#`
    /// comment lines, decimal points).
    ///
    /// # Errors
    /// The first thing that is not as it should be, with `source_name`, line and column.
    pub fn from_csv(text: &str, source_name: &str) -> Result<Self, DataError<ScrewFault>> {
        let table = Table::read(text, source_name, &FORMAT)?;
        let mut strokes = Vec::with_capacity(table.rows());
        for row in 0..table.rows() {
            let stroke = Stroke {
                approach: table.approach(row, 1)?,
                // Adding zero turns -0 into 0, which is the same stroke.
                stroke: Metres::from_um(table.number(row, 2)? + 0.0),
                deviation: Metres::from_um(table.number(row, 3)?),
            };
            strokes.push((table.axis(row, 0)?, stroke));
        }
        let names: Vec<String> = strokes.iter().map(|(axis, _)| axis.clone()).collect();
        let mut series = Self::new(strokes).map_err(|error| placed(&table, error))?;
        for axis in &mut series.axes {
            let rows = names.iter().enumerate();
            let own = rows.filter(|(_, name)| **name == axis.axis);
            axis.lines = own.map(|(row, _)| table.line(row)).collect();
            axis.line = axis.lines.first().copied();
        }
        Ok(series)
    }

    /// The series in the format [`Self::from_csv`] reads.
    pub fn to_csv(&self) -> String {
        let mut text = String::from("axis,approach,stroke_um,deviation_um\n");
        for axis in &self.axes {
            for it in &axis.strokes {
                let (sign, stroke, deviation) =
                    (it.approach.symbol(), it.stroke.um(), it.deviation.um());
                text.push_str(&format!("{},{sign},{stroke},{deviation}\n", axis.axis));
            }
        }
        text
    }
}

/// `places`: where each stroke stands in the whole series.
fn check_axis(axis: &AxisStrokes, places: &[usize]) -> Result<(), StrokeError> {
    let strokes = &axis.strokes;
    let name = || axis.axis.clone();
    if strokes.iter().all(|it| it.stroke == strokes[0].stroke) {
        return Err(StrokeError::OneStroke {
            index: places[0],
            axis: name(),
            stroke: strokes[0].stroke,
        });
    }
    if let Some((at, others)) = mixed_units(strokes) {
        return Err(StrokeError::MixedUnits {
            index: places[at],
            axis: name(),
            stroke: strokes[at].stroke,
            others,
        });
    }
    let longest = strokes
        .iter()
        .fold(Metres::ZERO, |most, it| most.max(it.stroke.abs()));
    match strokes.iter().position(|it| it.deviation.abs() > longest) {
        Some(at) => Err(StrokeError::Implausible {
            index: places[at],
            axis: name(),
            deviation: strokes[at].deviation,
            longest,
        }),
        None => Ok(()),
    }
}

/// The first stroke that would fit the others as millimetres, and how long those are: none lies
/// between the short ones and the long ones, and a thousand times the short ones are long ones.
fn mixed_units(strokes: &[Stroke]) -> Option<(usize, (Metres, Metres))> {
    const GAP: f64 = 100.0;
    let mut lengths: Vec<f64> = strokes.iter().map(|it| it.stroke.abs().value()).collect();
    lengths.retain(|it| *it > 0.0);
    lengths.sort_by(f64::total_cmp);
    let split = lengths.windows(2).position(|it| it[1] > GAP * it[0])?;
    let (short, long) = lengths.split_at(split + 1);
    let (least, most) = (long[0], long[long.len() - 1]);
    let fits = |it: &f64| (0.5 * least..=2.0 * most).contains(&(it * 1e3));
    let at = strokes.iter().position(|it| {
        let length = it.stroke.abs().value();
        length > 0.0 && length < least
    })?;
    let all_fit = short.iter().all(fits);
    all_fit.then_some((at, (Metres(least), Metres(most))))
}

/// Puts the place of the offending row on an error of the whole series.
fn placed(table: &Table<ScrewFault>, error: StrokeError) -> DataError<ScrewFault> {
    match error {
        StrokeError::Empty => table.fail(0, 0, Fault::NoRows),
        StrokeError::NotFinite { index, .. } => table.fail(
            index,
            2,
            Fault::NotFinite {
                column: "stroke_um",
                seen: "too large".into(),
            },
        ),
        StrokeError::OneStroke {
            index,
            axis,
            stroke,
        } => {
            let stroke_um = stroke.um();
            table.fail(index, 2, ScrewFault::OneStroke { axis, stroke_um }.into())
        }
        StrokeError::MixedUnits {
            index,
            axis,
            stroke,
            others: (least, most),
        } => {
            let fault = ScrewFault::MixedUnits {
                axis,
                stroke_um: stroke.um(),
                least_um: least.um(),
                most_um: most.um(),
            };
            table.fail(index, 2, fault.into())
        }
        StrokeError::Implausible {
            index,
            axis,
            deviation,
            longest,
        } => {
            let (deviation_um, stroke_um) = (deviation.um(), longest.um());
            let fault = ScrewFault::Implausible {
                axis,
                deviation_um,
                stroke_um,
            };
            table.fail(index, 3, fault.into())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEADER: &str = "axis,approach,stroke_um,deviation_um\n";

    #[track_caller]
    fn check_fault(text: &str, line: usize, column: usize, says: &str) {
        let error = StrokeSeries::from_csv(text, "screw.csv").unwrap_err();
        let message = error.to_string();
        assert_eq!((error.line, error.column), (line, column), "{message}");
        assert!(message.contains(says), "{message}");
    }

    #[track_caller]
    fn check_rows(rows: &str, line: usize, column: usize, says: &str) {
        check_fault(&format!("{HEADER}{rows}"), line, column, says);
    }

    #[test]
    fn axes_may_take_turns_and_strokes_repeat() {
        let text = "deviation_um,axis,stroke_um,approach\n# warm\n2.0,u,500,+\n1,w,-500,-\n\
                    2.1,u,500,+\n2.6,u,1500,-\n1.5,w,0,+\n";
        let series = StrokeSeries::from_csv(text, "screw.csv").unwrap();
        let [u, w] = series.axes() else {
            panic!("two axes")
        };
        assert_eq!(
            (u.axis.as_str(), u.line, u.strokes.len()),
            ("u", Some(3), 3)
        );
        assert_eq!((&u.lines[..], &w.lines[..]), (&[3, 5, 6][..], &[4, 7][..]));
        assert_eq!(
            (w.axis.as_str(), w.line, w.strokes.len()),
            ("w", Some(4), 2)
        );
        assert_eq!(u.strokes[2].approach, Approach::Reverse);
        assert_eq!(u.strokes[2].stroke, Metres::from_um(1500.0));
        assert_eq!(w.strokes[0].stroke, Metres::from_um(-500.0));
        let again = StrokeSeries::from_csv(&series.to_csv(), "again").unwrap();
        assert_eq!(again.axes()[1].strokes.len(), 2);
    }

    #[test]
    fn what_is_no_series_of_strokes_is_told_with_its_place() {
        check_fault("", 1, 1, "`axis,approach,stroke_um,deviation_um`");
        check_fault(HEADER, 1, 1, "no data row");
        let wrong = "axis,approach,stroke_mm,deviation_um\n";
        check_fault(wrong, 1, 15, "name it `stroke_um`");
        let wrong = "axis,approach,stroke_um,deviation_mm\n";
        check_fault(wrong, 1, 25, "name it `deviation_um`");
        check_rows("u,+,500\n", 2, 8, "the row has 3 cells, the header 4");
        check_rows("u,+,500,2.0,1\n", 2, 13, "5 cells");
        check_rows("u,+,500,NaN\n", 2, 9, "not a finite number");
        check_rows("u,+,500 um,2\n", 2, 5, "without units");
        check_rows("u,up,500,2\n", 2, 3, "`approach` is `up`");
        check_rows("u,,500,2\n", 2, 3, "`approach` is empty");
        check_rows(",+,500,2\n", 2, 1, "`axis` is empty");
        check_rows("u v,+,500,2\n", 2, 1, "`axis` is `u v`");
    }

    #[test]
    fn an_axis_with_a_single_stroke_is_refused_where_it_begins() {
        let rows = "u,+,500,2\nu,+,1500,2\nw,+,500,1\nu,-,500,2\nw,-,500,3\n";
        check_rows(rows, 4, 5, "axis w has no other stroke than 500 um");
        check_rows("u,+,0,0\nu,+,-0,0\n", 2, 5, "no other stroke than 0 um");
        check_rows("u,+,500,2\n", 2, 5, "at least two different strokes");
    }

    #[test]
    fn a_deviation_beyond_every_stroke_is_a_mistake_of_units() {
        let rows = "u,+,0.5,0.0020\nu,+,1.5,0.0026\nu,+,1.0,2.1\n";
        check_rows(rows, 4, 9, "micrometres and millimetres mixed?");
    }

    #[test]
    fn a_stroke_in_millimetres_among_micrometres_is_told_with_its_place() {
        let rows = "u,+,500,2\nu,+,1000,2\nu,+,1.5,2\nu,-,500,3\n";
        check_rows(
            rows,
            4,
            5,
            "1.5 um does not fit the others, from 500 to 1000 um",
        );
        let rows = "u,+,1,0.3\nu,+,500,0.3\nu,+,1500,0.3\n";
        check_rows(rows, 2, 5, "are micrometres and millimetres mixed?");
        // What passes zero, or grows by tens, is not mixed.
        for strokes in [
            &["-500", "-0.0004", "0", "500"][..],
            &["1", "10", "100", "1000", "10000"],
        ] {
            let rows: Vec<String> = strokes.iter().map(|it| format!("u,+,{it},0.3")).collect();
            let text = format!("{HEADER}{}\n", rows.join("\n"));
            StrokeSeries::from_csv(&text, "screw.csv").unwrap();
        }
    }

    #[test]
    fn strokes_of_a_run_are_held_to_the_same_rules() {
        let it = |um: f64, deviation: f64| {
            let stroke = Stroke {
                approach: Approach::Forward,
                stroke: Metres::from_um(um),
                deviation: Metres::from_um(deviation),
            };
            ("u".to_owned(), stroke)
        };
        assert_eq!(StrokeSeries::new(vec![]), Err(StrokeError::Empty));
        let nan = StrokeSeries::new(vec![it(1.0, 0.0), it(2.0, f64::NAN)]);
        assert!(matches!(nan, Err(StrokeError::NotFinite { index: 1, .. })));
        let one = StrokeSeries::new(vec![it(1.0, 0.0), it(1.0, 0.1)]);
        assert!(matches!(one, Err(StrokeError::OneStroke { .. })));
    }
}
