use proptest::prelude::*;

use super::*;

const HEADER: &str = "offset,line,deviation_arcsec\n";

/// Two placements of a plate with `lines` lines at offsets 0 and 1.
fn good(lines: usize) -> Vec<String> {
    let rows = |offset| (0..lines).map(move |line| format!("{offset},{line},0.5"));
    rows(0).chain(rows(1)).collect()
}

fn check_text(text: &str, given: Option<usize>, line: usize, column: usize, says: &str) {
    let error = RotarySeries::from_csv(text, "plate.csv", given).unwrap_err();
    let message = error.to_string();
    assert_eq!((error.line, error.column), (line, column), "{message}");
    assert!(message.contains(says), "{message}");
    assert!(message.starts_with("plate.csv:"), "{message}");
}

/// The good file of four lines with one row, counted from 1, written differently.
fn check_row(at: usize, row: &str, column: usize, says: &str) {
    let mut rows = good(4);
    row.clone_into(&mut rows[at - 1]);
    let text = format!("{HEADER}{}\n", rows.join("\n"));
    check_text(&text, Some(4), at + 1, column, says);
}

#[test]
fn a_good_file_is_read_with_columns_in_any_order_and_a_line_left_out() {
    let text = "# plate 7\nline,deviation_arcsec,offset\n0,1,0\n1,2,0\n2,3,0\n\n2,4,2\n0,-5,2\n";
    let series = RotarySeries::from_csv(text, "plate.csv", Some(3)).unwrap();
    assert_eq!((series.lines(), series.offsets()), (3, vec![0, 2]));
    let arcsec = |it: &Option<Radians>| it.map(|it| (it.arcsec() * 1e9).round() / 1e9);
    let read = |at: usize| -> Vec<_> {
        series.placements()[at]
            .readings
            .iter()
            .map(arcsec)
            .collect()
    };
    assert_eq!(read(0), [Some(1.0), Some(2.0), Some(3.0)]);
    assert_eq!(read(1), [Some(-5.0), None, Some(4.0)]);
}

#[test]
fn a_number_that_is_none_is_named_with_its_place() {
    check_row(
        3,
        "0,2,NaN",
        5,
        "`deviation_arcsec` is `NaN`, not a finite number",
    );
    check_row(3, "0,2,1e300", 5, "not a finite number");
    check_row(3, "0,2,\"1,5\"", 1, "write a decimal point");
    check_row(3, "0,2,", 5, "`deviation_arcsec` is empty");
    check_row(3, "0,2.5,1", 3, "`line` is `2.5`; write a whole number");
    check_row(3, "0,,1", 3, "`line` is empty");
    check_row(5, "-1,0,1", 1, "`offset` is `-1`; write a whole number");
    check_row(5, "1,0", 4, "the row has 2 cells, the header 3");
    check_row(5, "1,0,1,5", 7, "the row has 4 cells, the header 3");
    check_row(3, "0,100000,1", 3, "0 to 99999 are possible");
}

#[test]
fn other_units_and_columns_are_named() {
    let rows = good(4).join("\n");
    check_text(
        &format!("offset,line,deviation_urad\n{rows}"),
        None,
        1,
        13,
        "name it `deviation_arcsec`",
    );
    check_text(
        &format!("offset_deg,line,deviation_arcsec\n{rows}"),
        None,
        1,
        1,
        "unknown column `offset_deg`",
    );
    check_text(&format!("offset,line\n{rows}"), None, 1, 1, "is missing");
    check_text(HEADER, None, 1, 1, "no data row");
}

#[test]
fn a_line_or_offset_that_repeats_is_named_with_its_first_place() {
    check_row(
        3,
        "0,1,9",
        3,
        "line 1 of the placement at offset 0 is already in row 3 of the file",
    );
    check_row(
        7,
        "0,2,9",
        1,
        "offset 0 appears again after another one (it began in row 2",
    );
    let again = format!("{HEADER}{0}\n{0}\n", good(4)[..4].join("\n"));
    check_text(&again, Some(4), 6, 3, "no offset is used twice");
}

#[test]
fn wrong_counts_are_refused() {
    let one = format!("{HEADER}{}\n", good(4)[..4].join("\n"));
    check_text(
        &one,
        Some(4),
        5,
        1,
        "one placement cannot separate the errors of table and plate",
    );
    let short = format!("{HEADER}{}\n", good(4)[..5].join("\n"));
    check_text(&short, Some(4), 6, 1, "ends with 1 of 4 lines");
    let whole = format!("{HEADER}{}\n", good(4).join("\n"));
    check_text(&whole, Some(3), 9, 3, "`line` is 3; the plate has 3 lines");
    let from_one = whole.replace(",3,", ",4,").replace(",0,", ",3,");
    check_text(
        &from_one,
        Some(4),
        9,
        3,
        "`line` is 4; the plate has 4 lines, so 0 to 3",
    );
    let far = whole.replace("\n1,", "\n4,");
    check_text(&far, Some(4), 6, 1, "`offset` is 4; the plate has 4 lines");
}

#[test]
fn offsets_that_cannot_part_table_and_plate_are_refused_at_the_last_of_them() {
    let whole = format!("{HEADER}{}\n", good(4).join("\n"));
    let opposite = whole.replace("\n1,", "\n2,");
    check_text(&opposite, Some(4), 6, 1, "harmonic 2 and its multiples");
}

#[test]
fn a_line_missing_everywhere_is_accepted_the_last_one_too() {
    for gone in [0, 2, 4] {
        let rows = good(5).into_iter();
        let rows = rows.filter(|row| !row.contains(&format!(",{gone},")));
        let text = format!("{HEADER}{}\n", rows.collect::<Vec<_>>().join("\n"));
        let series = RotarySeries::from_csv(&text, "plate.csv", Some(5)).unwrap();
        assert_eq!(series.lines(), 5);
        let mut placements = series.placements().iter();
        assert!(placements.all(|it| it.readings[gone].is_none()));
    }
}

#[test]
fn the_number_of_lines_is_never_guessed() {
    let whole = format!("{HEADER}{}\n", good(5).join("\n"));
    let without_last = whole.replace("0,4,0.5\n", "").replace("1,4,0.5\n", "");
    let says = "its largest line is 3, so the plate has 4 lines or more";
    check_text(&without_last, None, 9, 3, says);
    check_text(&whole, None, 11, 3, "the plate has 5 lines or more");
    check_text(&whole, None, 11, 3, "give their number (`--lines`)");
}

#[test]
fn placements_from_a_run_are_held_to_the_same_rules() {
    let placement = |offset, lines| Placement {
        offset,
        readings: vec![Some(Radians(1e-6)); lines],
    };
    let error = |lines, placements| RotarySeries::new(lines, placements).unwrap_err();
    let two = |second| vec![placement(0, 4), second];
    assert_eq!(
        error(1, two(placement(1, 4))),
        RotarySeriesError::Lines { seen: 1 }
    );
    assert_eq!(
        error(4, vec![placement(0, 4)]),
        RotarySeriesError::Placements { seen: 1 }
    );
    assert!(matches!(
        error(4, two(placement(1, 3))),
        RotarySeriesError::Readings {
            placement: 1,
            seen: 3,
            ..
        }
    ));
    assert!(matches!(
        error(4, two(placement(4, 4))),
        RotarySeriesError::OffsetRange { offset: 4, .. }
    ));
    assert!(matches!(
        error(4, two(placement(0, 4))),
        RotarySeriesError::RepeatedOffset { offset: 0, .. }
    ));
    let mut bad = placement(1, 4);
    bad.readings[2] = Some(Radians(f64::NAN));
    assert!(matches!(
        error(4, two(bad)),
        RotarySeriesError::NotFinite {
            placement: 1,
            line: 2
        }
    ));
}

proptest! {
    #[test]
    fn a_series_survives_its_own_csv(
        readings in prop::collection::vec(-50.0_f64..50.0, 24),
        gap in 1_usize..7,
    ) {
        let placements = (0..3).map(|at| Placement {
            offset: at * 3,
            readings: (0..8)
                .map(|line| (line != gap || at == 1).then(|| Radians::from_arcsec(readings[at * 8 + line])))
                .collect(),
        });
        let series = RotarySeries::new(8, placements.collect()).unwrap();
        let again = RotarySeries::from_csv(&series.to_csv(), "again", Some(8)).unwrap();
        prop_assert_eq!(series.offsets(), again.offsets());
        for (a, b) in series.placements().iter().zip(again.placements()) {
            for (a, b) in a.readings.iter().zip(&b.readings) {
                prop_assert_eq!(a.is_some(), b.is_some());
                let apart = a.unwrap_or_default() - b.unwrap_or_default();
                prop_assert!(apart.abs().value() < 1e-18);
            }
        }
    }

    #[test]
    fn no_text_makes_the_reader_panic(text in "[-+0-9.,;a-z_#\"\n ]{0,200}") {
        let _ = RotarySeries::from_csv(&text, "x", None);
        let _ = RotarySeries::from_csv(&format!("{HEADER}{text}"), "x", Some(3));
    }
}
