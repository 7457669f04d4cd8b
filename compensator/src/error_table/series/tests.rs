use proptest::prelude::*;

use super::*;

const HEADER: &str = "run,approach,target_mm,measured_mm\n";

fn check_fault(text: &str, line: usize, column: usize, says: &str) {
    let error = LinearSeries::from_csv(text, "axis.csv").unwrap_err();
    let message = error.to_string();
    assert_eq!((error.line, error.column), (line, column), "{message}");
    assert!(
        message.starts_with(&format!("axis.csv:{line}:{column}: ")),
        "{message}"
    );
    assert!(message.contains(says), "{message}");
}

fn check_rows(rows: &str, line: usize, column: usize, says: &str) {
    check_fault(&format!("{HEADER}{rows}"), line, column, says);
}

#[test]
fn a_good_file_is_read_with_columns_in_any_order_and_comments() {
    let text = "# stage 7\nmeasured_mm, run ,approach,target_mm\n\n10.002,1,+,10\n# turn\n9.998,1,-,10\r\n";
    let series = LinearSeries::from_csv(text, "axis.csv").unwrap();
    let [forward, reverse] = series.measurements() else {
        panic!("two rows")
    };
    assert_eq!(forward.approach, Approach::Forward);
    assert_eq!(reverse.approach, Approach::Reverse);
    assert!((forward.deviation().um() - 2.0).abs() < 1e-9);
    assert!((reverse.deviation().um() + 2.0).abs() < 1e-9);
    assert_eq!(series.targets(), [Metres::from_mm(10.0)]);
    assert_eq!(series.runs(), [1]);
}

#[test]
fn what_spreadsheets_do_to_numbers_is_named() {
    check_rows(
        "1,+,10,NaN\n",
        2,
        8,
        "`measured_mm` is `NaN`, not a finite number",
    );
    check_rows("1,+,-inf,10\n", 2, 5, "not a finite number");
    check_rows("1,+,10,1e308\n", 2, 8, "not a finite number");
    check_rows("1,+,10,10,002\n", 2, 11, "decimal commas?");
    check_rows(
        "1,+,10,\"10,002\"\n",
        2,
        1,
        "write a decimal point, not a comma",
    );
    check_rows("1,+,10,\n", 2, 8, "`measured_mm` is empty");
    check_rows("1,+,10,ten\n", 2, 8, "`ten`, not a number");
    check_rows("1,+,10,10 mm\n", 2, 8, "without units");
    check_rows("1,+,10\n", 2, 7, "the row has 3 cells, the header 4");
    check_fault(
        "run;approach;target_mm;measured_mm\n1;+;1;1\n",
        1,
        1,
        "separated by `;`",
    );
}

#[test]
fn a_wrong_header_says_what_it_must_be() {
    check_fault("", 1, 1, "`run,approach,target_mm,measured_mm`");
    check_fault(HEADER, 1, 1, "no data row");
    check_fault(
        "run,approach,target_um,measured_mm\n",
        1,
        14,
        "name it `target_mm`",
    );
    check_fault(
        "run,approach,target_mm\n",
        1,
        1,
        "column `measured_mm` is missing",
    );
    check_fault(
        "run,run,approach,target_mm,measured_mm\n",
        1,
        5,
        "`run` appears twice",
    );
    check_fault(
        "run,approach,target_mm,measured_mm,note\n",
        1,
        36,
        "unknown column `note`",
    );
}

#[test]
fn an_approach_or_run_that_is_none_is_named() {
    check_rows("1,up,10,10\n", 2, 3, "`approach` is `up`; write +");
    check_rows("-1,+,10,10\n", 2, 1, "`run` is `-1`");
    check_rows("1.0,+,10,10\n", 2, 1, "`run` is `1.0`");
    check_rows("99999999999,+,10,10\n", 2, 1, "number the runs");
}

#[test]
fn rows_out_of_order_are_an_error_not_sorted() {
    check_rows("2,+,10,10\n1,+,10,10\n", 3, 1, "run 1 comes after run 2");
    check_rows(
        "1,+,20,20\n1,+,10,10\n",
        3,
        5,
        "target 10 mm comes after 20 mm",
    );
    check_rows("1,-,10,10\n1,-,20,20\n", 3, 5, "not approach `-`");
    check_rows(
        "1,+,10,10\n1,-,10,10\n1,+,10,10.1\n",
        4,
        5,
        "already in the file",
    );
    check_rows("1,+,0,0\n1,-,5,5\n1,+,-0,0\n", 4, 5, "already in the file");
}

#[test]
fn measurements_from_a_run_are_held_to_the_same_rules() {
    let m = |run, mm| Measurement {
        run,
        approach: Approach::Forward,
        target: Metres::from_mm(mm),
        measured: Metres::from_mm(mm),
    };
    assert_eq!(LinearSeries::new(vec![]), Err(SeriesError::Empty));
    assert!(matches!(
        LinearSeries::new(vec![m(1, 0.0), m(1, f64::NAN)]),
        Err(SeriesError::NotFinite { index: 1 })
    ));
    assert!(matches!(
        LinearSeries::new(vec![m(1, 0.0), m(2, 5.0), m(1, 9.0)]),
        Err(SeriesError::RunOrder { index: 2, .. })
    ));
}

proptest! {
    #[test]
    fn a_series_survives_its_own_csv_bit_for_bit(
        deviations in prop::collection::vec(-1e-5_f64..1e-5, 1..20),
        // Shorter steps give two points a slope that the reader rightly takes for another unit: 10 % and more.
        step in 1e-3_f64..1e-2,
    ) {
        let measurements = deviations.iter().enumerate().map(|(i, d)| Measurement {
            run: 3,
            approach: Approach::Forward,
            target: Metres(i as f64 * step),
            measured: Metres(i as f64 * step + d),
        }).collect();
        let series = LinearSeries::new(measurements).unwrap();
        let again = LinearSeries::from_csv(&series.to_csv(), "again").unwrap();
        for (a, b) in series.measurements().iter().zip(again.measurements()) {
            prop_assert!((a.target - b.target).abs().value() <= a.target.value() * 3e-16);
            prop_assert!((a.measured - b.measured).abs().value() <= 3e-17);
        }
    }

    #[test]
    fn no_text_makes_the_reader_panic(text in "[-+0-9.,;a-z_#\"\n ]{0,200}") {
        let _ = LinearSeries::from_csv(&text, "x");
        let _ = LinearSeries::from_csv(&format!("{HEADER}{text}"), "x");
    }
}
