//! A table as a Parquet file (parquet.apache.org, format 2.11): one row group, a page for each column, every column
//! optional, values plain and not compressed. Numbers are DOUBLE, counts INT64, texts BYTE_ARRAY in UTF-8, times INT64 as
//! TIMESTAMP_MICROS in UTC.

use super::csv_text::value;
use super::table::{Cell, Column, Sort, Table};
use super::thrift::{Struct, varint};

/// What a file begins and ends with.
const MAGIC: &[u8; 4] = b"PAR1";
/// Of `Encoding`: values as they are, and runs of levels.
const PLAIN: i32 = 0;
const RLE: i32 = 3;
/// Of `FieldRepetitionType`.
const OPTIONAL: i32 = 1;

/// Of `Type`, and of `ConvertedType` where there is one.
const fn types(of: Sort) -> (i32, Option<i32>) {
    match of {
        Sort::Bool => (0, None),
        Sort::Whole => (2, None),
        Sort::Instant => (2, Some(10)),
        Sort::Number => (5, None),
        Sort::Text => (6, Some(0)),
    }
}

/// The whole file.
pub(super) fn parquet_of(table: &Table) -> Vec<u8> {
    let mut file = MAGIC.to_vec();
    let columns = table.columns.iter();
    let chunks: Vec<Struct> = columns.map(|it| chunk(it, table.rows, &mut file)).collect();
    let rows = table.rows as i64;
    let group = Struct::default()
        .structs(1, chunks)
        .i64(2, (file.len() - MAGIC.len()) as i64)
        .i64(3, rows);
    let root = Struct::default()
        .text(4, &table.name)
        .i32(5, table.columns.len() as i32);
    let schema = core::iter::once(root).chain(table.columns.iter().map(element));
    let footer = Struct::default()
        .i32(1, 2)
        .structs(2, schema.collect())
        .i64(3, rows)
        .structs(4, vec![group])
        .text(6, concat!("truestage version ", env!("CARGO_PKG_VERSION")))
        .end();
    file.extend(&footer);
    file.extend((footer.len() as u32).to_le_bytes());
    file.extend(MAGIC);
    file
}

fn element(column: &Column) -> Struct {
    let (physical, converted) = types(column.sort());
    let element = Struct::default()
        .i32(1, physical)
        .i32(3, OPTIONAL)
        .text(4, &column.name);
    match converted {
        None => element,
        Some(converted) => element.i32(6, converted),
    }
}

/// Appends the one page of a column, and returns what the footer says of it.
fn chunk(column: &Column, rows: usize, file: &mut Vec<u8>) -> Struct {
    let page = page(column);
    let data = Struct::default()
        .i32(1, rows as i32)
        .i32(2, PLAIN)
        .i32(3, RLE)
        .i32(4, RLE);
    let head = Struct::default()
        .i32(1, 0)
        .i32(2, page.len() as i32)
        .i32(3, page.len() as i32)
        .inner(5, data)
        .end();
    let begin = file.len() as i64;
    let bytes = (head.len() + page.len()) as i64;
    file.extend(head);
    file.extend(page);
    let meta = Struct::default()
        .i32(1, types(column.sort()).0)
        .i32s(2, &[PLAIN, RLE])
        .texts(3, &[&column.name])
        .i32(4, 0)
        .i64(5, rows as i64)
        .i64(6, bytes)
        .i64(7, bytes)
        .i64(9, begin);
    Struct::default().i64(2, begin).inner(3, meta)
}

/// Which rows have a value, then the values.
fn page(column: &Column) -> Vec<u8> {
    let there: Vec<bool> = column.cells.iter().map(|it| *it != Cell::Empty).collect();
    let mut levels = Vec::new();
    // One run of bits, eight in a group.
    varint(&mut levels, (there.len().div_ceil(8) as u64) << 1 | 1);
    levels.extend(packed(&there));
    let mut page = (levels.len() as u32).to_le_bytes().to_vec();
    page.extend(levels);
    let cells = column.cells.iter().filter(|it| **it != Cell::Empty);
    match column.sort() {
        Sort::Bool => {
            let bits = cells.map(|it| *it == Cell::Bool(true));
            page.extend(packed(&bits.collect::<Vec<_>>()));
        }
        Sort::Whole | Sort::Instant => page.extend(cells.flat_map(|it| whole(it).to_le_bytes())),
        Sort::Number => page.extend(cells.flat_map(|it| number(it).to_le_bytes())),
        Sort::Text => {
            for cell in cells {
                let text = text(cell);
                page.extend((text.len() as u32).to_le_bytes());
                page.extend(text.as_bytes());
            }
        }
    }
    page
}

/// Eight bits a byte, the lowest first.
fn packed(bits: &[bool]) -> Vec<u8> {
    let bytes = bits.chunks(8).map(|chunk| {
        let each = chunk.iter().zip(0..);
        each.fold(0, |byte, (bit, at)| byte | u8::from(*bit) << at)
    });
    bytes.collect()
}

const fn whole(cell: &Cell) -> i64 {
    match cell {
        Cell::Whole(it) | Cell::Instant(it) => *it,
        _ => 0,
    }
}

const fn number(cell: &Cell) -> f64 {
    match cell {
        Cell::Number(it) => *it,
        Cell::Whole(it) => *it as f64,
        _ => f64::NAN,
    }
}

/// As it stands in a CSV, without quotation marks.
fn text(cell: &Cell) -> String {
    match cell {
        Cell::Text(it) => it.clone(),
        other => value(other),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What readers of others find in such files is asked in `tests/peers/export.rs`.
    #[test]
    fn a_file_begins_and_ends_as_it_must_and_its_footer_has_its_length() {
        let cells = (0..20).map(|it| match it % 3 {
            0 => Cell::Empty,
            _ => Cell::Whole(it),
        });
        let column = Column {
            name: "run".into(),
            cells: cells.collect(),
        };
        // Three bytes say which are there; thirteen values.
        let page = page(&column);
        assert_eq!(page[..8], [4, 0, 0, 0, 7, 0b1011_0110, 0b0110_1101, 0b1011]);
        assert_eq!(page.len(), 8 + 13 * 8);
        let file = parquet_of(&Table {
            name: "point".into(),
            rows: 20,
            columns: vec![column],
        });
        assert!(file.starts_with(MAGIC) && file.ends_with(MAGIC));
        let length = &file[file.len() - 8..file.len() - 4];
        let footer = u32::from_le_bytes(length.try_into().unwrap()) as usize;
        assert_eq!(file[file.len() - 8 - footer..][..2], [0x15, 4]);
    }
}
