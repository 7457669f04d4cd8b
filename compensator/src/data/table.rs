//! The CSV reader under the series: header, cells, and where each one stood.
//!
//! Numbers are taken only in plain decimal or exponent notation with a decimal point. What a
//! spreadsheet does to data (decimal commas, semicolons, `nan`, other units) is recognised and
//! named, because "invalid float" helps nobody at a machine.

use core::error::Error;
use core::marker::PhantomData;

use units::Approach;

use super::fault::{DataError, Fault};

/// The columns of one file format.
pub(crate) struct Format {
    pub(crate) columns: &'static [&'static str],
    pub(crate) header: &'static str,
}

struct Cell {
    text: String,
    column: usize,
}

/// A file's cells in the format's own column order, with the place of each. `K` is what only data of
/// its kind can have wrong.
pub(crate) struct Table<K> {
    file: String,
    format: &'static [&'static str],
    rows: Vec<(usize, Vec<Cell>)>,
    kind: PhantomData<K>,
}

impl<K: Error + 'static> Table<K> {
    pub(crate) fn read(text: &str, file: &str, format: &Format) -> Result<Self, DataError<K>> {
        let fail = |line: usize, column: usize, fault: Fault<K>| DataError {
            file: file.to_owned(),
            line,
            column,
            fault,
        };
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let mut rows = Vec::new();
        let mut header: Option<Vec<usize>> = None;
        for (index, line) in text.lines().enumerate() {
            if line.trim().is_empty() || line.trim_start().starts_with('#') {
                continue;
            }
            let cells = split(line).ok_or_else(|| fail(index + 1, 1, Fault::Quoting))?;
            match &header {
                None => {
                    let order = read_header(&cells, format)
                        .map_err(|(column, fault)| fail(index + 1, column, fault))?;
                    header = Some(order);
                }
                Some(order) if cells.len() != order.len() => {
                    let (seen, expected) = (cells.len(), order.len());
                    let column = cells
                        .get(expected)
                        .map_or(line.chars().count() + 1, |c| c.column);
                    return Err(fail(index + 1, column, Fault::CellCount { seen, expected }));
                }
                Some(order) => rows.push((index + 1, sorted(cells, order))),
            }
        }
        let end = text.lines().count().max(1);
        if header.is_none() {
            return Err(fail(
                1,
                1,
                Fault::Empty {
                    expected: format.header,
                },
            ));
        }
        if rows.is_empty() {
            return Err(fail(end, 1, Fault::NoRows));
        }
        Ok(Self {
            file: file.to_owned(),
            format: format.columns,
            rows,
            kind: PhantomData,
        })
    }

    pub(crate) fn rows(&self) -> usize {
        self.rows.len()
    }

    pub(crate) fn fail(&self, row: usize, column: usize, fault: Fault<K>) -> DataError<K> {
        let (line, cells) = &self.rows[row];
        DataError {
            file: self.file.clone(),
            line: *line,
            column: cells[column].column,
            fault,
        }
    }

    pub(crate) fn number(&self, row: usize, column: usize) -> Result<f64, DataError<K>> {
        let seen = self.rows[row].1[column].text.as_str();
        let name = self.format[column];
        let fault = match parse_number(seen) {
            Ok(value) => return Ok(value),
            Err(Number::Missing) => Fault::MissingValue { column: name },
            Err(Number::Comma) => Fault::DecimalComma {
                column: name,
                seen: seen.to_owned(),
            },
            Err(Number::Infinite) => Fault::NotFinite {
                column: name,
                seen: seen.to_owned(),
            },
            Err(Number::Word) => Fault::NotANumber {
                column: name,
                seen: seen.to_owned(),
            },
        };
        Err(self.fail(row, column, fault))
    }

    pub(crate) fn run(&self, row: usize, column: usize) -> Result<u32, DataError<K>> {
        let seen = self.rows[row].1[column].text.as_str();
        let digits = !seen.is_empty() && seen.bytes().all(|b| b.is_ascii_digit());
        seen.parse().ok().filter(|_| digits).ok_or_else(|| {
            let fault = match seen {
                "" => Fault::MissingValue {
                    column: self.format[column],
                },
                _ => Fault::NotARun {
                    seen: seen.to_owned(),
                },
            };
            self.fail(row, column, fault)
        })
    }

    pub(crate) fn approach(&self, row: usize, column: usize) -> Result<Approach, DataError<K>> {
        let fault = match self.rows[row].1[column].text.as_str() {
            "+" => return Ok(Approach::Forward),
            "-" => return Ok(Approach::Reverse),
            "" => Fault::MissingValue {
                column: self.format[column],
            },
            seen => Fault::NotAnApproach {
                seen: seen.to_owned(),
            },
        };
        Err(self.fail(row, column, fault))
    }

    /// The line of a row in the file, counted from 1.
    pub(crate) fn line(&self, row: usize) -> usize {
        self.rows[row].0
    }

    /// What a column is called.
    pub(crate) fn column(&self, column: usize) -> &'static str {
        self.format[column]
    }

    /// A cell as it was written.
    pub(crate) fn text(&self, row: usize, column: usize) -> &str {
        &self.rows[row].1[column].text
    }

    /// The name of an axis: letters, digits, `_` and `-`.
    pub(crate) fn axis(&self, row: usize, column: usize) -> Result<String, DataError<K>> {
        let seen = self.rows[row].1[column].text.as_str();
        let plain = |c: char| c.is_alphanumeric() || c == '_' || c == '-';
        let fault = match seen {
            "" => Fault::MissingValue {
                column: self.format[column],
            },
            _ if seen.chars().all(plain) => return Ok(seen.to_owned()),
            _ => Fault::NotAnAxis {
                seen: seen.to_owned(),
            },
        };
        Err(self.fail(row, column, fault))
    }
}

/// The cells of one line and where each starts; `None` when its quotes do not match.
fn split(line: &str) -> Option<Vec<Cell>> {
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .trim(csv::Trim::All)
        .from_reader(line.as_bytes());
    let record = reader.records().next()?.ok()?;
    if line.contains('"') {
        // Quoted cells are legal CSV; their place is then only known to the line.
        let whole = line.matches('"').count().is_multiple_of(2);
        return whole.then(|| {
            record
                .iter()
                .map(|text| Cell {
                    text: text.to_owned(),
                    column: 1,
                })
                .collect()
        });
    }
    let mut column = 1;
    let mut cells = Vec::with_capacity(record.len());
    for (raw, text) in line.split(',').zip(record.iter()) {
        let indent = raw.chars().take_while(|c| c.is_whitespace()).count();
        cells.push(Cell {
            text: text.to_owned(),
            column: column + indent,
        });
        column += raw.chars().count() + 1;
    }
    Some(cells)
}

/// For each column of the format, the place of its cell in a row of the file.
fn read_header<K: Error + 'static>(
    cells: &[Cell],
    format: &Format,
) -> Result<Vec<usize>, (usize, Fault<K>)> {
    let expected = format.header;
    let mut order = vec![None; format.columns.len()];
    for (place, cell) in cells.iter().enumerate() {
        let known = format.columns.iter().position(|&name| name == cell.text);
        let Some(index) = known else {
            return Err((cell.column, unknown_column(&cell.text, format)));
        };
        if order[index].replace(place).is_some() {
            return Err((
                cell.column,
                Fault::DuplicateColumn {
                    seen: format.columns[index],
                },
            ));
        }
    }
    let mut places = Vec::with_capacity(order.len());
    for (place, missing) in order.into_iter().zip(format.columns) {
        places.push(place.ok_or((1, Fault::MissingColumn { missing, expected }))?);
    }
    Ok(places)
}

fn unknown_column<K: Error + 'static>(seen: &str, format: &Format) -> Fault<K> {
    if let Some(separator) = seen.chars().find(|c| matches!(c, ';' | '\t' | '|')) {
        return Fault::Separator { seen: separator };
    }
    let quantity = |name: &str| name.split('_').next().unwrap_or(name).to_ascii_lowercase();
    let same = format
        .columns
        .iter()
        .find(|name| name.contains('_') && quantity(name) == quantity(seen));
    match same {
        Some(wanted) => Fault::WrongUnit {
            seen: seen.to_owned(),
            wanted,
        },
        None => Fault::UnknownColumn {
            seen: seen.to_owned(),
            expected: format.header,
        },
    }
}

fn sorted(cells: Vec<Cell>, order: &[usize]) -> Vec<Cell> {
    let mut cells: Vec<Option<Cell>> = cells.into_iter().map(Some).collect();
    order
        .iter()
        .map(|&place| {
            cells[place]
                .take()
                .expect("the header's places are distinct")
        })
        .collect()
}

/// Why a cell is not a number.
enum Number {
    Missing,
    Comma,
    Infinite,
    Word,
}

fn parse_number(cell: &str) -> Result<f64, Number> {
    if cell.is_empty() {
        return Err(Number::Missing);
    }
    let plain = cell
        .bytes()
        .all(|b| b.is_ascii_digit() || b"+-.eE".contains(&b));
    if plain {
        return match cell.parse::<f64>() {
            // Some writers put 1e308 for "no value": it survives parsing but no conversion.
            Ok(value) if value.abs() < 1e12 => Ok(value),
            Ok(_) => Err(Number::Infinite),
            Err(_) => Err(Number::Word),
        };
    }
    if cell.contains(',') && cell.replace(',', ".").parse::<f64>().is_ok() {
        return Err(Number::Comma);
    }
    match cell.parse::<f64>() {
        Ok(_) => Err(Number::Infinite),
        Err(_) => Err(Number::Word),
    }
}
