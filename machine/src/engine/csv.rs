//! A path from a file: `time_s,x_mm,y_mm`, one row for each moment, from rest to rest.
//!
//! Between the rows runs what is asked for ([`Join`]), or what a comment before the heading says (`# join: linear 50um`),
//! sampled once in every SYNC period: the cubic spline with continuous acceleration (C. de Boor, "A Practical
//! Guide to Splines", chapter IV), at rest at both ends, which it is where nothing is said; or straight lines with
//! rounded corners ([`super::blended`]). Rows may be any time apart. Comment lines begin with `#`; a byte-order mark is passed over.
//!
//! A spline through rows that turn a corner swings out before and behind it, and straight lines cut it. How far the curve
//! leaves the straight joins of its rows at most is told with the points: [`Departure`].

use core::time::Duration;

use units::Metres;

use super::blended::{Blended, TightCorner};
use super::join::Join;
use super::limits::AxisLimits;
use super::rows::{CsvError, CsvFault, Rows, interval, read_rows};

/// What a path must be made for.
#[derive(Clone, Copy, Debug)]
pub struct PathForm<'a> {
    /// The axes, by their names in the configuration.
    pub axes: &'a [String],
    /// What each of them can do, in the same order.
    pub limits: &'a [AxisLimits],
    /// From point to point.
    pub period: Duration,
    /// What joins the rows; `None`: what the file says, and the spline where it says nothing.
    pub join: Option<Join>,
}

/// What is driven of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct CsvPath {
    /// One point for each period; the order of its positions is that of the axes.
    pub points: Vec<Vec<Metres>>,
    /// What joins the rows.
    pub join: Join,
    /// Where they are farthest from the straight joins of the rows.
    pub departure: Departure,
    /// How much longer it takes than the rows say: straight lines begin and end at rest besides.
    pub longer: Duration,
    /// The corners of straight lines that the axes cannot follow within what is allowed.
    pub tight: Vec<TightCorner>,
    /// When the curve passes each row, in seconds from its beginning, and the row's line in the file, counted from 1.
    pub passes: Vec<(f64, usize)>,
}

impl CsvPath {
    /// The lines of the rows that the curve runs between at `at_s` seconds.
    #[must_use]
    pub fn lines_at(&self, at_s: f64) -> Option<[usize; 2]> {
        let next = self.passes.partition_point(|it| it.0 <= at_s);
        let before = next.clamp(1, self.passes.len().saturating_sub(1).max(1)) - 1;
        let both = self.passes.get(before..before + 2)?;
        Some([both[0].1, both[1].1])
    }
}

/// Where a curve is farthest from the straight line between the two rows that it runs between. Of straight lines it is the corner
/// that is passed at the largest distance, and that distance.
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

/// Reads a path.
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
/// use machine::engine::{AxisLimits, PathForm, read_path};
/// use std::time::Duration;
///
/// let axes = ["x", "y"].map(str::to_owned);
/// let form = PathForm {
///     axes: &axes,
///     limits: &[AxisLimits::default(); 2],
///     period: Duration::from_millis(1),
///     join: None,
/// };
/// let path = read_path("time_s,y_mm,x_mm\n0,5,1\n0.010,5,3\n", &form)?;
/// assert_eq!(path.points.len(), 11);
/// // 1 + 2·(3u² − 2u³): from rest to rest.
/// assert!((path.points[5][0].mm() - 2.0).abs() < 1e-12);
/// assert!((path.points[1][0].mm() - 1.056).abs() < 1e-12);
/// # Ok::<(), machine::engine::CsvError>(())
/// ```
pub fn read_path(text: &str, form: &PathForm<'_>) -> Result<CsvPath, CsvError> {
    let rows = read_rows(text, form.axes)?;
    match join_of(&rows, form.join)? {
        Join::Spline => Ok(along_spline(&rows, form.period)),
        Join::Linear { blend } => Ok(along_lines(&rows, blend, form)),
    }
}

/// What is asked for, or said in the file.
fn join_of(rows: &Rows, asked: Option<Join>) -> Result<Join, CsvError> {
    match (asked, rows.join) {
        // As they are shown: 50um is 0.05mm.
        (Some(asked), Some((seen, line))) if asked.to_string() != seen.to_string() => {
            Err(CsvError {
                line,
                column: None,
                fault: CsvFault::OtherJoin { asked, seen },
            })
        }
        (asked, said) => Ok(asked.or(said.map(|it| it.0)).unwrap_or(Join::Spline)),
    }
}

/// The moments of a path that takes so long. Its end is a point of its own even when it is not on the grid.
fn moments(takes: f64, period: Duration) -> impl ExactSizeIterator<Item = f64> {
    let seconds = period.as_secs_f64();
    let count = (takes / seconds - 1e-9).ceil() as usize;
    (0..count + 1).map(move |at| (at as f64 * seconds).min(takes))
}

fn along_spline(rows: &Rows, period: Duration) -> CsvPath {
    let splines = rows.positions.iter();
    let splines: Vec<Spline<'_>> = splines.map(|it| Spline::new(&rows.times, it)).collect();
    let mut departure = nowhere(rows);
    let last = rows.times.last().copied().unwrap_or_default();
    let times = moments(last, period);
    let mut points = Vec::with_capacity(times.len());
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
    CsvPath {
        points,
        join: Join::Spline,
        departure,
        longer: Duration::ZERO,
        tight: Vec::new(),
        passes: passes(rows, |row| rows.times[row]),
    }
}

fn along_lines(rows: &Rows, blend: Metres, form: &PathForm<'_>) -> CsvPath {
    let path = Blended::new(&rows.times, &rows.positions, blend.mm(), form.limits);
    let place = |at_s: f64| -> Vec<Metres> {
        let axes = 0..rows.positions.len();
        axes.map(|axis| Metres::from_mm(path.at(axis, at_s)))
            .collect()
    };
    let departure = path.widest().map(|(row, size)| Departure {
        size: Metres::from_mm(size),
        at_s: path.passes(row),
        lines: [rows.lines[row - 1], rows.lines[row + 1]],
        place: place(path.passes(row)),
    });
    let last = rows.times.last().copied().unwrap_or_default();
    CsvPath {
        points: moments(path.takes(), form.period).map(place).collect(),
        join: Join::Linear { blend },
        departure: departure.unwrap_or_else(|| nowhere(rows)),
        longer: Duration::from_secs_f64((path.takes() - last).max(0.0)),
        tight: path.tight(&rows.lines),
        passes: passes(rows, |row| path.passes(row)),
    }
}

fn passes(rows: &Rows, at_s: impl Fn(usize) -> f64) -> Vec<(f64, usize)> {
    let lines = rows.lines.iter().enumerate();
    lines.map(|(row, line)| (at_s(row), *line)).collect()
}

/// The departure of a path that leaves its joins nowhere.
fn nowhere(rows: &Rows) -> Departure {
    let begin = rows.positions.iter().map(|it| Metres::from_mm(it[0]));
    Departure {
        size: Metres::ZERO,
        at_s: 0.0,
        lines: [rows.lines[0], rows.lines[1]],
        place: begin.collect(),
    }
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

    fn read_every(text: &str, period: Duration) -> Result<CsvPath, CsvError> {
        let axes = ["x", "y"].map(str::to_owned);
        let form = PathForm {
            axes: &axes,
            limits: &[AxisLimits::default(); 2],
            period,
            join: None,
        };
        read_path(text, &form)
    }

    fn read(text: &str) -> Result<CsvPath, CsvError> {
        read_every(text, MS)
    }

    #[track_caller]
    fn check(text: &str, expected: &str) {
        let error = read(text).unwrap_err();
        assert_eq!(error.to_string(), expected);
    }

    #[test]
    fn each_moment_is_between_two_lines_of_the_file() {
        let path = read("time_s,x_mm,y_mm\n0,0,0\n0.01,1,0\n0.03,2,0\n").unwrap();
        let lines = [-1.0, 0.0, 0.009, 0.01, 0.02, 0.03, 9.0].map(|it| path.lines_at(it));
        let expected = [[2, 3], [2, 3], [2, 3], [3, 4], [3, 4], [3, 4], [3, 4]];
        assert_eq!(lines, expected.map(Some));
    }

    /// 3 u² − 2 u³ is the spline of one step between two rests.
    #[test]
    fn a_step_is_the_cubic_between_two_rests() {
        let text = "# a step\ntime_s,y_mm,x_mm\n0,5,1\n0.010,5,3\n";
        let path = read(text).unwrap().points;
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
        let path = read_every(&text, 10 * MS).unwrap().points;
        for (at, point) in path.iter().enumerate() {
            let expected = cubic(at as f64 * 0.01);
            assert!((point[0].mm() - expected).abs() < 1e-9, "{at}");
        }
    }

    #[test]
    fn a_join_is_asked_for_in_any_unit() {
        let axes = ["x", "y"].map(str::to_owned);
        let limits = [AxisLimits::default(); 2];
        let form = |blend: f64| PathForm {
            axes: &axes,
            limits: &limits,
            period: MS,
            join: Some(Join::Linear {
                blend: Metres::from_um(blend),
            }),
        };
        let text = "# join: linear 0.05mm\ntime_s,x_mm,y_mm\n0,0,0\n1,1,1\n";
        assert!(read_path(text, &form(50.0)).is_ok());
        let other = read_path(text, &form(51.0)).unwrap_err();
        assert_eq!(other.line, 1, "{other}");
    }

    #[test]
    fn the_last_row_is_reached_off_the_grid() {
        let path = read("time_s,x_mm,y_mm\n0,0,0\n0.0105,1,1\n")
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
        assert_eq!(read(&marked), read(text));
    }

    /// Along x, then along y, rows of 5 mm: beyond the corner x goes on, and before it y goes back.
    #[test]
    fn how_far_a_corner_is_overshot_is_told_with_its_place() {
        let mut text = "time_s,x_mm,y_mm\n".to_owned();
        for row in 0..=20 {
            let (x, y) = (row.min(10), (row - 10).max(0));
            text += &format!("{},{},{}\n", f64::from(row) * 0.1, x * 5, y * 5);
        }
        let path = read(&text).unwrap();
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
        let departure = read(text).unwrap().departure;
        assert!(departure.size.nm() < 1.0, "{departure:?}");
    }

    /// Between two equal rows it goes on, and comes back.
    #[test]
    fn going_beyond_the_last_row_of_a_straight_line_is_a_departure_too() {
        let text = "time_s,x_mm,y_mm\n0,0,0\n1,10,0\n2,10,0\n3,10,0\n";
        let departure = read(text).unwrap().departure;
        assert!(departure.size.mm() > 0.5, "{departure:?}");
        assert_eq!(departure.lines, [3, 4]);
        assert!(departure.place[0].mm() > 10.5, "{departure:?}");
    }
}
