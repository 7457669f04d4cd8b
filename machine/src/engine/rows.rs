//! The rows of a path in a file: `time_s,x_mm,y_mm`, one for each moment.

use super::join::Join;

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
    /// A comment that should say what joins the rows says something else.
    #[error(
        "`{seen}` does not say what joins the rows; write `# join: spline`, or `# join: linear 50um` with how far from \
         a corner the path may pass"
    )]
    Join { seen: String },
    /// Two are asked for.
    #[error(
        "the file says `join: {seen}`, and `{asked}` is asked for; ask for the same, or remove the comment"
    )]
    OtherJoin { asked: Join, seen: Join },
    /// Longer than anybody meant.
    #[error("the path takes {} s; at most one day is possible", units::Short(*seconds))]
    Length { seconds: f64 },
}

/// Between which row and the next one `time` is.
pub(super) fn interval(times: &[f64], time: f64) -> usize {
    let after = times.partition_point(|it| *it <= time);
    after.clamp(1, times.len() - 1) - 1
}

/// The rows of a path.
pub(super) struct Rows {
    /// Where in the file, counted from 1.
    pub(super) lines: Vec<usize>,
    /// Seconds.
    pub(super) times: Vec<f64>,
    /// By axis, mm.
    pub(super) positions: Vec<Vec<f64>>,
    /// What joins them, where the file says that, and the line where it does.
    pub(super) join: Option<(Join, usize)>,
}

impl Rows {
    /// How far `point` is from the straight line between `row` and the next one, in mm.
    pub(super) fn beside_join(&self, row: usize, point: &[f64]) -> f64 {
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

/// Reads them.
///
/// # Errors
/// The first line that cannot be used.
pub(super) fn read_rows(text: &str, axes: &[String]) -> Result<Rows, CsvError> {
    // Spreadsheets mark their files so; it is no part of the heading.
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let join = join_of(text)?;
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
        join,
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

/// What the comments before the heading say of what joins the rows; the last of them counts.
fn join_of(text: &str) -> Result<Option<(Join, usize)>, CsvError> {
    let head = text.lines().map(str::trim).zip(1..);
    let head = head.take_while(|(text, _)| text.is_empty() || text.starts_with('#'));
    let said = head.filter_map(|(text, line)| Some((Join::of_comment(text)?, text, line)));
    let each = said.map(|(join, text, line)| match join {
        Ok(join) => Ok((join, line)),
        Err(()) => Err(CsvError {
            line,
            column: None,
            fault: CsvFault::Join {
                seen: text.to_owned(),
            },
        }),
    });
    let all: Vec<_> = each.collect::<Result<_, _>>()?;
    Ok(all.last().copied())
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
