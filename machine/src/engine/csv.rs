//! A path from a file: `time_s,x_mm,y_mm`, one row for each moment, from rest to rest.
//!
//! Between the rows runs the cubic spline with continuous acceleration (C. de Boor, "A Practical
//! Guide to Splines", chapter IV), at rest at both ends, sampled once in every SYNC period. Rows
//! may be any time apart. Comment lines begin with `#`; a byte-order mark is passed over.
//!
//! A spline through rows that turn a corner swings out before and behind it. How far the curve
//! leaves the straight joins of its rows at most is told with the points: [`Departure`].

use core::time::Duration;

use units::Metres;

/// Why a file is no path.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("line {line}{}: {fault}", of_column(column.as_deref()))]
pub struct CsvError {
    /// The line, counted from 1.
    pub line: usize,
    /// The column's name, where one is meant.
    pub column: Option<String>,
    /// What is wrong.
    pub fault: CsvFault,
}

fn of_column(column: Option<&str>) -> String {
    column.map_or_else(String::new, |column| format!(", column {column}"))
}

/// What is wrong with a line.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[expect(missing_docs, reason = "the Display text says what each field is")]
pub enum CsvFault {
    /// The heading is another one.
    #[error("the heading is `{seen}`, expected `{expected}` (the axes in any order)")]
    Heading { expected: String, seen: String },
    /// Too few or too many values.
    #[error("{seen} values, but the heading has {expected} columns")]
    Values { expected: usize, seen: usize },
    /// Not a number with a decimal point.
    #[error("`{seen}` is not a number; write a decimal point, no units")]
    Number { seen: String },
    /// The first row is not at time 0.
    #[error("the path begins at {} s; it must begin at 0", units::Short(*seen))]
    Begin { seen: f64 },
    /// Times do not grow.
    #[error("time {} s after {} s; rows must be in the order of time", units::Short(*seen),
        units::Short(*before))]
    Order { before: f64, seen: f64 },
    /// Nothing to drive.
    #[error("the file has {}; a path needs two or more", units::Several(*rows, "row"))]
    Rows { rows: usize },
    /// Longer than anybody meant.
    #[error("the path takes {} s; at most one day is possible", units::Short(*seconds))]
    Length { seconds: f64 },
}

/// What is driven of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct CsvPath {
    /// One point for each period; the order of its positions is that of the axes.
    pub points: Vec<Vec<Metres>>,
    /// Where they are farthest from the straight joins of the rows.
    pub departure: Departure,
}

/// Where a curve is farthest from the straight line between the two rows that it runs between.
#[derive(Clone, Debug, PartialEq)]
pub struct Departure {
    /// How far, in the space of all axes.
    pub size: Metres,
    /// When, in seconds from the path's beginning.
    pub at_s: f64,
    /// The lines of the two rows in the file, counted from 1.
    pub lines: [usize; 2],
    /// Where the curve is then.
    pub place: Vec<Metres>,
}

/// Reads a path of `axes` (names as in the configuration), one point for each `period`.
///
/// Nothing is checked against the machine's limits here;
/// [`PathWriter::push`](super::PathWriter::push) does that, with every point of the curve.
///
/// # Errors
/// The first line that cannot be used.
///
/// # Example
///
/// ```
/// use machine::engine::read_path;
/// use std::time::Duration;
///
/// let axes = ["x", "y"].map(str::to_owned);
/// let text = "time_s,y_mm,x_mm\n0,5,1\n0.010,5,3\n";
/// let path = read_path(text, &axes, Duration::from_millis(1))?;
/// assert_eq!(path.points.len(), 11);
/// // 1 + 2·(3u² − 2u³): from rest to rest.
/// assert!((path.points[5][0].mm() - 2.0).abs() < 1e-12);
/// assert!((path.points[1][0].mm() - 1.056).abs() < 1e-12);
/// # Ok::<(), machine::engine::CsvError>(())
/// ```
pub fn read_path(text: &str, axes: &[String], period: Duration) -> Result<CsvPath, CsvError> {
    let rows = read_rows(text, axes)?;
    let last = rows.times.last().copied().unwrap_or_default();
    let seconds = period.as_secs_f64();
    let splines: Vec<Spline<'_>> = rows
        .positions
        .iter()
        .map(|values| Spline::new(&rows.times, values))
        .collect();
    // The last row is a point of its own even when it is not on the grid.
    let count = (last / seconds - 1e-9).ceil() as usize;
    let times = (0..=count).map(|at| (at as f64 * seconds).min(last));
    let mut departure = Departure {
        size: Metres::ZERO,
        at_s: 0.0,
        lines: [rows.lines[0], rows.lines[1]],
        place: rows
            .positions
            .iter()
            .map(|it| Metres::from_mm(it[0]))
            .collect(),
    };
    let mut points = Vec::with_capacity(count + 1);
    for at_s in times {
        let point: Vec<f64> = splines.iter().map(|it| it.at(at_s)).collect();
        let place: Vec<Metres> = point.iter().map(|mm| Metres::from_mm(*mm)).collect();
        let row = interval(&rows.times, at_s);
        let size = Metres::from_mm(rows.beside_join(row, &point));
        if size > departure.size {
            departure = Departure {
                size,
                at_s,
                lines: [rows.lines[row], rows.lines[row + 1]],
                place: place.clone(),
            };
        }
        points.push(place);
    }
    Ok(CsvPath { points, departure })
}

/// Between which row and the next one `time` is.
fn interval(times: &[f64], time: f64) -> usize {
    let after = times.partition_point(|it| *it <= time);
    after.clamp(1, times.len() - 1) - 1
}

struct Rows {
    /// Where in the file, counted from 1.
    lines: Vec<usize>,
    times: Vec<f64>,
    /// By axis.
    positions: Vec<Vec<f64>>,
}

impl Rows {
    /// How far `point` is from the straight line between `row` and the next one, in mm.
    fn beside_join(&self, row: usize, point: &[f64]) -> f64 {
        let ends = |axis: &Vec<f64>| (axis[row], axis[row + 1] - axis[row]);
        let (mut along, mut length) = (0.0, 0.0);
        for ((begin, join), at) in self.positions.iter().map(ends).zip(point) {
            along += (at - begin) * join;
            length += join * join;
        }
        let share = if length > 0.0 {
            (along / length).clamp(0.0, 1.0)
        } else {
            0.0
        };
        let axes = self.positions.iter().map(ends).zip(point);
        let off = axes.map(|((begin, join), at)| at - begin - share * join);
        off.map(|it| it * it).sum::<f64>().sqrt()
    }
}

fn read_rows(text: &str, axes: &[String]) -> Result<Rows, CsvError> {
    // Spreadsheets mark their files so; it is no part of the heading.
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let mut lines = text
        .lines()
        .zip(1..)
        .map(|(text, line)| (text.trim(), line))
        .filter(|(text, _)| !text.is_empty() && !text.starts_with('#'));
    let (heading, line) = lines.next().unwrap_or(("", 1));
    let columns = read_heading(heading, line, axes)?;
    let mut rows = Rows {
        lines: Vec::new(),
        times: Vec::new(),
        positions: vec![Vec::new(); axes.len()],
    };
    let mut last_line = line;
    for (text, line) in lines {
        last_line = line;
        read_row(text, line, &columns, axes, &mut rows)?;
    }
    let fault = match (rows.times.len(), rows.times.last()) {
        (rows @ 0..2, _) => CsvFault::Rows { rows },
        (_, Some(seconds)) if *seconds > 86_400.0 => CsvFault::Length { seconds: *seconds },
        _ => return Ok(rows),
    };
    Err(CsvError {
        line: last_line,
        column: None,
        fault,
    })
}

/// For each column the axis it is of; `None` for the time.
fn read_heading(
    heading: &str,
    line: usize,
    axes: &[String],
) -> Result<Vec<Option<usize>>, CsvError> {
    let wrong = || CsvError {
        line,
        column: None,
        fault: CsvFault::Heading {
            expected: axes
                .iter()
                .fold("time_s".to_owned(), |all, axis| format!("{all},{axis}_mm")),
            seen: heading.to_owned(),
        },
    };
    let mut names = heading.split(',').map(str::trim);
    if names.next() != Some("time_s") {
        return Err(wrong());
    }
    let mut columns = vec![None];
    for name in names {
        let axis = name.strip_suffix("_mm").ok_or_else(wrong)?;
        let at = axes.iter().position(|it| it == axis);
        if at.is_none() || columns.contains(&at) {
            return Err(wrong());
        }
        columns.push(at);
    }
    if columns.len() == axes.len() + 1 {
        Ok(columns)
    } else {
        Err(wrong())
    }
}

fn read_row(
    text: &str,
    line: usize,
    columns: &[Option<usize>],
    axes: &[String],
    rows: &mut Rows,
) -> Result<(), CsvError> {
    let error = |column: Option<usize>, fault| {
        let column = match column {
            None => "time_s".to_owned(),
            Some(axis) => format!("{}_mm", axes[axis]),
        };
        Err(CsvError {
            line,
            column: Some(column),
            fault,
        })
    };
    let values: Vec<&str> = text.split(',').map(str::trim).collect();
    if values.len() != columns.len() {
        return Err(CsvError {
            line,
            column: None,
            fault: CsvFault::Values {
                expected: columns.len(),
                seen: values.len(),
            },
        });
    }
    for (column, text) in columns.iter().zip(values) {
        let value = match text.parse::<f64>() {
            Ok(value) if value.is_finite() => value,
            Ok(_) | Err(_) => {
                let seen = text.to_owned();
                return error(*column, CsvFault::Number { seen });
            }
        };
        match (column, rows.times.last()) {
            (Some(axis), _) => rows.positions[*axis].push(value),
            (None, None) if value != 0.0 => {
                return error(None, CsvFault::Begin { seen: value });
            }
            (None, Some(before)) if value <= *before => {
                let before = *before;
                return error(
                    None,
                    CsvFault::Order {
                        before,
                        seen: value,
                    },
                );
            }
            (None, _) => {
                rows.lines.push(line);
                rows.times.push(value);
            }
        }
    }
    Ok(())
}

/// The clamped cubic spline through points: rest at both ends.
struct Spline<'a> {
    times: &'a [f64],
    values: &'a [f64],
    /// The speed at each point.
    slopes: Vec<f64>,
}

impl<'a> Spline<'a> {
    /// Through two points or more.
    fn new(times: &'a [f64], values: &'a [f64]) -> Self {
        let last = times.len() - 1;
        // Thomas' algorithm for h[i] s[i-1] + 2 (h[i-1] + h[i]) s[i] + h[i-1] s[i+1] = r[i].
        let mut slopes = vec![0.0; times.len()];
        let mut upper = vec![0.0; times.len()];
        for i in 1..last {
            let (before, after) = (times[i] - times[i - 1], times[i + 1] - times[i]);
            let rise_before = (values[i] - values[i - 1]) / before;
            let rise_after = (values[i + 1] - values[i]) / after;
            let right = 3.0 * (rise_before * after + rise_after * before);
            let pivot = 2.0 * (before + after) - after * upper[i - 1];
            upper[i] = before / pivot;
            slopes[i] = (right - after * slopes[i - 1]) / pivot;
        }
        for i in (1..last).rev() {
            slopes[i] -= upper[i] * slopes[i + 1];
        }
        Self {
            times,
            values,
            slopes,
        }
    }

    fn at(&self, time: f64) -> f64 {
        let i = interval(self.times, time);
        let span = self.times[i + 1] - self.times[i];
        let u = (time - self.times[i]) / span;
        let rise = self.values[i + 1] - self.values[i];
        let (begin, end) = (self.slopes[i] * span, self.slopes[i + 1] * span);
        let (a, b) = (begin - rise, rise - end);
        let w = 1.0 - u;
        self.values[i] * w + self.values[i + 1] * u + u * w * (a * w + b * u)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: Duration = Duration::from_millis(1);

    fn axes() -> Vec<String> {
        ["x", "y"].map(str::to_owned).to_vec()
    }

    #[track_caller]
    fn check(text: &str, expected: &str) {
        let error = read_path(text, &axes(), MS).unwrap_err();
        assert_eq!(error.to_string(), expected);
    }

    /// 3 u² − 2 u³ is the spline of one step between two rests.
    #[test]
    fn a_step_is_the_cubic_between_two_rests() {
        let text = "# a step\ntime_s,y_mm,x_mm\n0,5,1\n0.010,5,3\n";
        let path = read_path(text, &axes(), MS).unwrap().points;
        assert_eq!(path.len(), 11);
        for (at, point) in path.iter().enumerate() {
            let u = at as f64 / 10.0;
            let expected = 1.0 + 2.0 * (3.0 * u * u - 2.0 * u * u * u);
            assert!((point[0].mm() - expected).abs() < 1e-12, "{at}");
            assert!((point[1].mm() - 5.0).abs() < 1e-12, "{at}");
        }
    }

    /// A cubic with zero slope at both ends is its own clamped spline, rows apart as they like.
    #[test]
    fn a_cubic_between_rests_is_kept_whatever_the_rows() {
        let cubic = |t: f64| 7.0 + 30.0 * t * t - 20.0 * t * t * t;
        let mut text = "time_s,x_mm,y_mm\n".to_owned();
        for t in [0.0, 0.1, 0.15, 0.4, 0.85, 1.0] {
            text += &format!("{t},{},0\n", cubic(t));
        }
        let path = read_path(&text, &axes(), 10 * MS).unwrap().points;
        for (at, point) in path.iter().enumerate() {
            let expected = cubic(at as f64 * 0.01);
            assert!((point[0].mm() - expected).abs() < 1e-9, "{at}");
        }
    }

    #[test]
    fn the_last_row_is_reached_off_the_grid() {
        let path = read_path("time_s,x_mm,y_mm\n0,0,0\n0.0105,1,1\n", &axes(), MS)
            .unwrap()
            .points;
        assert_eq!(path.len(), 12);
        assert!((path[11][0].mm() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn what_is_wrong_is_said_with_line_and_column() {
        check(
            "t,x,y\n",
            "line 1: the heading is `t,x,y`, expected `time_s,x_mm,y_mm` (the axes in any order)",
        );
        check(
            "time_s,x_mm,x_mm\n",
            "line 1: the heading is `time_s,x_mm,x_mm`, expected `time_s,x_mm,y_mm` (the axes in \
             any order)",
        );
        let head = |rows: &str| format!("# path\n\ntime_s,x_mm,y_mm\n{rows}");
        check(
            &head("0,0\n"),
            "line 4: 2 values, but the heading has 3 columns",
        );
        check(
            &head("0,0,0\n1,0;5,0\n"),
            "line 5, column x_mm: `0;5` is not a number; write a decimal point, no units",
        );
        check(
            &head("0,0,NaN\n"),
            "line 4, column y_mm: `NaN` is not a number; write a decimal point, no units",
        );
        check(
            &head("1,0,0\n"),
            "line 4, column time_s: the path begins at 1 s; it must begin at 0",
        );
        check(
            &head("0,0,0\n1,0,0\n1,1,1\n"),
            "line 6, column time_s: time 1 s after 1 s; rows must be in the order of time",
        );
        check(
            &head("0,0,0\n"),
            "line 4: the file has 1 row; a path needs two or more",
        );
        check(
            "",
            "line 1: the heading is ``, expected `time_s,x_mm,y_mm` (the axes in any order)",
        );
    }

    #[test]
    fn a_byte_order_mark_before_the_heading_is_passed_over() {
        let text = "time_s,x_mm,y_mm\n0,0,0\n0.010,1,2\n";
        let marked = format!("\u{feff}{text}");
        assert_eq!(
            read_path(&marked, &axes(), MS),
            read_path(text, &axes(), MS)
        );
    }

    /// Along x, then along y, rows of 5 mm: beyond the corner x goes on, and before it y goes back.
    #[test]
    fn how_far_a_corner_is_overshot_is_told_with_its_place() {
        let mut text = "time_s,x_mm,y_mm\n".to_owned();
        for row in 0..=20 {
            let (x, y) = (row.min(10), (row - 10).max(0));
            text += &format!("{},{},{}\n", f64::from(row) * 0.1, x * 5, y * 5);
        }
        let path = read_path(&text, &axes(), MS).unwrap();
        let highest = path.points.iter().map(|it| it[0].mm()).fold(0.0, f64::max);
        let departure = &path.departure;
        assert!((50.4..50.5).contains(&highest), "{highest}");
        assert!(
            (departure.size.mm() - (highest - 50.0)).abs() < 0.01,
            "{departure:?}"
        );
        let around = [[11, 12], [12, 13]];
        assert!(around.contains(&departure.lines), "{departure:?}");
        assert!((0.9..1.1).contains(&departure.at_s), "{departure:?}");
        let farthest = path.points.iter().find(|it| **it == departure.place);
        assert!(farthest.is_some(), "{departure:?}");
    }

    #[test]
    fn a_straight_path_leaves_its_joins_nowhere_however_its_speed_changes() {
        let text = "time_s,x_mm,y_mm\n0,0,0\n0.2,1,2\n0.4,3,6\n0.6,4,8\n";
        let departure = read_path(text, &axes(), MS).unwrap().departure;
        assert!(departure.size.nm() < 1.0, "{departure:?}");
    }

    /// Between two equal rows it goes on, and comes back.
    #[test]
    fn going_beyond_the_last_row_of_a_straight_line_is_a_departure_too() {
        let text = "time_s,x_mm,y_mm\n0,0,0\n1,10,0\n2,10,0\n3,10,0\n";
        let departure = read_path(text, &axes(), MS).unwrap().departure;
        assert!(departure.size.mm() > 0.5, "{departure:?}");
        assert_eq!(departure.lines, [3, 4]);
        assert!(departure.place[0].mm() > 10.5, "{departure:?}");
    }
}
