//! A table as CSV: a heading with units in the names, decimal points, nothing where nothing is said.

use jiff::Timestamp;

use super::table::{Cell, Table};

/// The whole file.
pub(super) fn csv_of(table: &Table) -> String {
    let names: Vec<String> = table.columns.iter().map(|it| quoted(&it.name)).collect();
    let mut text = names.join(",") + "\n";
    for row in 0..table.rows {
        let cells = table.columns.iter().map(|it| value(&it.cells[row]));
        text += &cells.collect::<Vec<_>>().join(",");
        text.push('\n');
    }
    text
}

pub(super) fn value(cell: &Cell) -> String {
    match cell {
        Cell::Empty => String::new(),
        Cell::Bool(it) => it.to_string(),
        Cell::Whole(it) => it.to_string(),
        // The shortest number that is read as this one again.
        Cell::Number(it) => format!("{it:?}"),
        Cell::Text(it) => quoted(it),
        Cell::Instant(micros) => instant(*micros),
    }
}

/// RFC 3339, to the microsecond.
fn instant(micros: i64) -> String {
    let at = Timestamp::from_microsecond(micros).expect("a time that a journal said");
    format!("{at:.6}")
}

/// By RFC 4180.
fn quoted(text: &str) -> String {
    match text.contains([',', '"', '\n', '\r']) {
        true => format!("\"{}\"", text.replace('"', "\"\"")),
        false => text.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::program::journal::table::Column;

    #[test]
    fn numbers_are_exact_texts_are_quoted_and_nothing_is_nothing() {
        let column = |name: &str, cells: [Cell; 2]| Column {
            name: name.into(),
            cells: cells.into(),
        };
        let table = Table {
            name: "point".into(),
            rows: 2,
            columns: vec![
                column("time_utc", [Cell::Instant(1_500_000), Cell::Instant(0)]),
                column("at_m", [Cell::Number(2.8e-8), Cell::Empty]),
                column("cause", [Cell::Text("a \"b\", c".into()), Cell::Bool(true)]),
            ],
        };
        let expected = "time_utc,at_m,cause\n\
                        1970-01-01T00:00:01.500000Z,2.8e-8,\"a \"\"b\"\", c\"\n\
                        1970-01-01T00:00:00.000000Z,,true\n";
        assert_eq!(csv_of(&table), expected);
    }
}
