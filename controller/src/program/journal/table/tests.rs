use super::*;

/// The tables of entries of one kind.
fn tables(kind: &str, entries: &[&str]) -> Vec<Table> {
    let entries = entries.iter().zip(2..).map(|(text, line)| {
        let Node::Object(members) = serde_json::from_str(text).unwrap() else {
            panic!("{text} is no object")
        };
        Entry {
            line,
            kind: kind.to_owned(),
            time_us: 5,
            members,
        }
    });
    tables_of(entries.collect())
}

fn names(table: &Table) -> Vec<&str> {
    table.columns.iter().map(|it| it.name.as_str()).collect()
}

fn column<'a>(table: &'a Table, name: &str) -> &'a Column {
    let mut columns = table.columns.iter();
    columns
        .find(|it| it.name == name)
        .unwrap_or_else(|| panic!("no {name} in {:?}", names(table)))
}

#[test]
fn members_are_columns_in_their_order_and_units_stay_at_the_end() {
    let all = tables(
        "stroke",
        &[
            r#"{"run":1,"axis":"u","stroke_m":0,"pose":{"x_m":1.5,"angle_rad":2.5},"at_m":[1.0,2.0,3.0]}"#,
            r#"{"run":2,"axis":"v","stroke_m":0.5,"pose":{"x_m":2.5,"angle_rad":3.5},"at_m":[4.0,5.0,6.0]}"#,
        ],
    );
    let [stroke] = all.as_slice() else {
        panic!("{all:?}")
    };
    let expected = [
        "journal_line",
        "time_utc",
        "run",
        "axis",
        "stroke_m",
        "pose_x_m",
        "pose_angle_rad",
        "at_x_m",
        "at_y_m",
        "at_z_m",
    ];
    assert_eq!(names(stroke), expected);
    assert_eq!(column(stroke, "stroke_m").sort(), Sort::Number);
    assert_eq!(column(stroke, "run").sort(), Sort::Whole);
    assert_eq!(column(stroke, "axis").sort(), Sort::Text);
    assert_eq!(column(stroke, "at_y_m").cells, [2.0, 5.0].map(Cell::Number));
    assert_eq!(
        column(stroke, "journal_line").cells,
        [2, 3].map(Cell::Whole)
    );
}

#[test]
fn lists_have_rows_of_their_own_and_those_within_them_too() {
    let all = tables(
        "sweep",
        &[
            r#"{"positions_m":[1.0,2.0],"peak_v":[0.5,null,0.25],"plans":[{"of":[7,8]}]}"#,
            r#"{"positions_m":[],"peak_v":[],"plans":[]}"#,
        ],
    );
    let [sweep, items, deeper] = all.as_slice() else {
        panic!("{all:?}")
    };
    assert_eq!((sweep.name.as_str(), sweep.rows), ("sweep", 2));
    assert_eq!((items.name.as_str(), items.rows), ("sweep_items", 3));
    let peak = [Cell::Number(0.5), Cell::Empty, Cell::Number(0.25)];
    assert_eq!(column(items, "peak_v").cells, peak);
    assert_eq!(column(items, "item").cells, [0, 1, 2].map(Cell::Whole));
    assert_eq!(column(items, "positions_m").cells[2], Cell::Empty);
    assert_eq!(deeper.name, "sweep_items_items");
    assert_eq!(column(deeper, "plans_of").cells, [7, 8].map(Cell::Whole));
    assert_eq!(column(deeper, "item_2").cells, [0, 1].map(Cell::Whole));
}

#[test]
fn nothing_leaves_a_cell_empty_and_makes_no_column_beside_its_parts() {
    let all = tables(
        "pose",
        &[
            r#"{"target":null,"left_rad":null,"interval_m":null,"u_m":null}"#,
            r#"{"target":{"x_m":1.0},"left_rad":[1.0],"interval_m":[1.0,2.0],"u_m":null,"late":true}"#,
        ],
    );
    let expected = [
        "journal_line",
        "time_utc",
        "interval_before_m",
        "interval_behind_m",
        "u_m",
        "target_x_m",
        "late",
    ];
    assert_eq!(names(&all[0]), expected);
    assert_eq!(
        column(&all[0], "target_x_m").cells,
        [Cell::Empty, Cell::Number(1.0)]
    );
    assert_eq!(
        column(&all[0], "late").cells,
        [Cell::Empty, Cell::Bool(true)]
    );
    assert_eq!(column(&all[0], "u_m").sort(), Sort::Number);
}
