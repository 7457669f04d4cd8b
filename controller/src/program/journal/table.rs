//! Tables of a journal: one for each kind of entry, and one more for the lists of a kind.
//!
//! A member of an entry is a column of the same name, so that its unit stays the end of the name. An object within it
//! is as many columns as it has members (`pose_x_m`), what is of x, y and z three (`at_x_m`). Lists, whatever their
//! length, are in a table of their own, called `<kind>_items`: row after row the first items of all lists of an
//! entry, then the second ones; the columns `journal_line` and `item` say of which entry and which item. Lists within these
//! have one more table in the same way.

use super::entries::Entry;
use super::node::Node;

/// A value of a table.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Cell {
    /// Nothing is said.
    Empty,
    Bool(bool),
    Whole(i64),
    Number(f64),
    Text(String),
    /// Microseconds since 1970 (UTC).
    Instant(i64),
}

/// What all values of a column are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Sort {
    Bool,
    Whole,
    Number,
    Text,
    Instant,
}

/// A column.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Column {
    pub(super) name: String,
    /// One for each row.
    pub(super) cells: Vec<Cell>,
}

/// Rows of one kind.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Table {
    pub(super) name: String,
    pub(super) columns: Vec<Column>,
    pub(super) rows: usize,
}

/// Of x, y and z, in this order.
const OF_AXES: [&str; 14] = [
    "along",
    "at_m",
    "beam_shift_m",
    "correction_m",
    "fixed_m",
    "from_m",
    "high_m",
    "low_m",
    "roll_rad",
    "seen_from_m",
    "sideways_m",
    "to_m",
    "tool_m",
    "zero_m",
];
const XYZ: [&str; 3] = ["x", "y", "z"];
/// In two directions, for each of x, y and z.
const IN_TWO_DIRECTIONS: [&str; 2] = ["beam_shift_m", "sideways_m"];
const ONE_AND_TWO: [&str; 2] = ["1", "2"];
/// The calibrated positions before and behind a point.
const INTERVAL: &str = "interval_m";
const BEFORE_AND_BEHIND: [&str; 2] = ["before", "behind"];

/// The endings of names that are units: such a value is a number, also where it happens to be whole.
const UNITS: [&str; 10] = ["c", "humidity", "k", "m", "pa", "rad", "s", "si", "u", "v"];

/// The names of the parts of a list that always has as many; `None` for any other.
fn parts_of(key: &str) -> Option<&'static [&'static str]> {
    match key {
        INTERVAL => Some(&BEFORE_AND_BEHIND),
        // Lists along x, y and z.
        "nodes_m" => Some(&XYZ),
        _ if OF_AXES.contains(&key) => Some(&XYZ),
        _ => None,
    }
}

/// Whether a value of that name is a number, whatever was seen of it: the name ends in a unit.
pub(super) fn is_number_by_name(name: &str) -> bool {
    let unit = name.rsplit_once('_').map(|it| it.1);
    unit.is_some_and(|it| UNITS.contains(&it))
}

/// `at_m` of x: `at_x_m`.
fn part_named(name: &str, part: &str) -> String {
    match name.rsplit_once('_') {
        Some((head, unit)) if UNITS.contains(&unit) => format!("{head}_{part}_{unit}"),
        _ => format!("{name}_{part}"),
    }
}

impl Column {
    /// What its values are.
    pub(super) fn sort(&self) -> Sort {
        if is_number_by_name(&self.name) {
            let is_number =
                |it: &Cell| matches!(it, Cell::Empty | Cell::Whole(_) | Cell::Number(_));
            if self.cells.iter().all(is_number) {
                return Sort::Number;
            }
        }
        let seen = self.cells.iter().filter_map(sort_of);
        let common = |one, other| match (one, other) {
            (one, other) if one == other => one,
            (Sort::Whole | Sort::Number, Sort::Whole | Sort::Number) => Sort::Number,
            _ => Sort::Text,
        };
        seen.reduce(common).unwrap_or(Sort::Text)
    }
}

const fn sort_of(cell: &Cell) -> Option<Sort> {
    match cell {
        Cell::Empty => None,
        Cell::Bool(_) => Some(Sort::Bool),
        Cell::Whole(_) => Some(Sort::Whole),
        Cell::Number(_) => Some(Sort::Number),
        Cell::Text(_) => Some(Sort::Text),
        Cell::Instant(_) => Some(Sort::Instant),
    }
}

impl Table {
    const fn new(name: String) -> Self {
        Self {
            name,
            columns: Vec::new(),
            rows: 0,
        }
    }

    fn push(&mut self, row: Vec<(String, Cell)>) {
        for (name, cell) in row {
            let known = self.columns.iter().position(|it| it.name == name);
            let at = known.unwrap_or_else(|| {
                let cells = vec![Cell::Empty; self.rows];
                self.columns.push(Column { name, cells });
                self.columns.len() - 1
            });
            let cells = &mut self.columns[at].cells;
            assert_eq!(cells.len(), self.rows, "two values of one name");
            cells.push(cell);
        }
        self.rows += 1;
        for column in &mut self.columns {
            column.cells.resize(self.rows, Cell::Empty);
        }
    }

    /// What is nothing in every row, and a list or an object in another journal or row, is no column.
    fn drop_nothings(&mut self, items: &[String]) {
        let names: Vec<String> = self.columns.iter().map(|it| it.name.clone()).collect();
        self.columns.retain(|column| {
            let is_empty = column.cells.iter().all(|it| *it == Cell::Empty);
            let head = format!("{}_", column.name);
            let mut all = names.iter().chain(items);
            let is_elsewhere = all.any(|it| it.starts_with(&head)) || items.contains(&column.name);
            !(is_empty && is_elsewhere)
        });
    }
}

/// A row, and the lists that are not in it.
#[derive(Default)]
struct Row {
    cells: Vec<(String, Cell)>,
    lists: Vec<(String, Vec<Node>)>,
}

impl Row {
    fn take(&mut self, name: String, key: &str, node: Node) {
        match (node, parts_of(key)) {
            (Node::List(items), Some(parts)) if items.len() == parts.len() => {
                for (item, part) in items.into_iter().zip(parts) {
                    self.take_part(part_named(&name, part), key, item);
                }
            }
            (Node::Null, Some(parts)) => {
                for part in parts {
                    self.take_part(part_named(&name, part), key, Node::Null);
                }
            }
            (Node::List(items), _) => self.lists.push((name, items)),
            (Node::Object(members), _) => {
                for (key, node) in members {
                    self.take(format!("{name}_{key}"), &key, node);
                }
            }
            (Node::Null, None) => self.cells.push((name, Cell::Empty)),
            (Node::Bool(it), _) => self.cells.push((name, Cell::Bool(it))),
            (Node::Whole(it), _) => self.cells.push((name, Cell::Whole(it))),
            (Node::Number(it), _) => self.cells.push((name, Cell::Number(it))),
            (Node::Text(it), _) => self.cells.push((name, Cell::Text(it))),
        }
    }

    /// Of x, y or z.
    fn take_part(&mut self, name: String, key: &str, node: Node) {
        if !IN_TWO_DIRECTIONS.contains(&key) {
            return self.take(name, "", node);
        }
        let both = match node {
            Node::List(both) => both,
            other => vec![other; 2],
        };
        for (item, part) in both.into_iter().zip(ONE_AND_TWO) {
            self.take(part_named(&name, part), "", item);
        }
    }
}

/// The tables of a journal, in the order in which their kinds first came.
pub(super) fn tables_of(entries: Vec<Entry>) -> Vec<Table> {
    let mut tables = Vec::new();
    for entry in entries {
        let mut row = Row::default();
        let begin = [
            ("journal_line".to_owned(), Cell::Whole(entry.line)),
            ("time_utc".to_owned(), Cell::Instant(entry.time_us)),
        ];
        row.cells.extend(begin.clone());
        for (key, node) in entry.members {
            row.take(key.clone(), &key, node);
        }
        push(&mut tables, entry.kind, row, &begin);
    }
    for at in 0..tables.len() {
        let items = format!("{}_items", tables[at].name);
        let items = tables.iter().find(|it| it.name == items);
        let items = items.map_or_else(Vec::new, |it| {
            it.columns.iter().map(|it| it.name.clone()).collect()
        });
        tables[at].drop_nothings(&items);
    }
    tables
}

fn push(tables: &mut Vec<Table>, name: String, row: Row, begin: &[(String, Cell)]) {
    let at = tables.iter().position(|it: &Table| it.name == name);
    let at = at.unwrap_or_else(|| {
        tables.push(Table::new(name.clone()));
        tables.len() - 1
    });
    tables[at].push(row.cells);
    let items = format!("{name}_items");
    let longest = row.lists.iter().map(|it| it.1.len()).max().unwrap_or(0);
    // The first level counts in `item`, the next one in `item_2`.
    let depth = begin.len() - 1;
    let counter = match depth {
        1 => "item".to_owned(),
        _ => format!("item_{depth}"),
    };
    for index in 0..longest {
        let mut begin = begin.to_vec();
        begin.push((counter.clone(), Cell::Whole(index as i64)));
        let mut row_of_items = Row::default();
        row_of_items.cells.extend(begin.iter().cloned());
        for (key, list) in &row.lists {
            if let Some(item) = list.get(index) {
                row_of_items.take(key.clone(), "", item.clone());
            }
        }
        push(tables, items.clone(), row_of_items, &begin);
    }
}

#[cfg(test)]
mod tests;
