//! `fit screw`: files of strokes measured elsewhere.

use std::fs;
use std::path::Path;

use serde_json::Value;
use tests::{Edit, MACHINE};

use crate::programs::truestage;

const HEADER: &str = "axis,approach,stroke_um,deviation_um\n";

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("a temporary folder can be made")
}

fn fit(folder: &Path, rows: &str, words: &[&str]) -> crate::programs::Ended {
    fs::write(folder.join("data.csv"), format!("{HEADER}{rows}")).expect("a file can be written");
    truestage(folder, &[&["fit", "screw", "data.csv"], words].concat())
}

#[track_caller]
fn check(value: &Value, key: &str, expected: f64, tolerance: f64) {
    let seen = value[key].as_f64();
    let near = seen.is_some_and(|seen| (seen - expected).abs() <= tolerance);
    assert!(near, "{key}: {seen:?} instead of {expected} in {value}");
}

/// 3 × 18 rows with the patent's means 2.02, 2.23 and 2.62 µm.
fn golden(axis: &str, approach: char) -> String {
    let mut rows = String::new();
    for (stroke, mean) in [(500, 2.02), (1000, 2.23), (1500, 2.62)] {
        for k in 0..18 {
            let deviation = mean + 0.05 * (f64::from(k) - 8.5);
            rows += &format!("{axis},{approach},{stroke},{deviation:.4}\n");
        }
    }
    rows
}

#[test]
fn the_patents_figures_come_out_of_the_patents_data_whatever_the_approach() {
    let folder = folder();
    let rows = golden("u", '+') + &golden("w", '-');
    let result = fit(folder.path(), &rows, &["--method", "patent"]).with_code(0);
    assert_eq!(result["method"], "patent");
    for name in ["u", "w"] {
        let axis = &result["axes"][name];
        check(axis, "slope_um_per_mm", 0.60, 1e-9);
        check(axis, "mean_lost_motion_um", 2.29, 1e-9);
        check(axis, "mean_at_m_um", 2.02, 1e-9);
        check(axis, "mean_at_n_um", 2.62, 1e-9);
        // Offsets of 0.05 µm steps: s² = 0.05²·Σ(k − 8.5)²/17 = 0.0025·484.5/17.
        let s = (0.0025 * 484.5_f64 / 17.0).sqrt();
        check(axis, "mean_lost_motion_um_u", s / 54.0_f64.sqrt(), 1e-6);
        check(axis, "slope_um_per_mm_u", s * (2.0_f64 / 18.0).sqrt(), 1e-6);
        assert_eq!(axis["harmonics"], serde_json::json!([]));
        assert!(axis["residual_um"].as_f64().is_some());
    }
}

/// Two screws with 0.8 and −0.4 µm/mm, 2.1 and 3.0 µm of lost motion; the first with 0.7 µm per
/// turn. A made-up noise of ±0.1 µm that is the same on every machine.
fn two_screws() -> String {
    let mut rows = String::new();
    let mut state = 12345_u32;
    for (axis, slope, lost, wave) in [("x", 0.8, 2.1, 0.7), ("u", -0.4, 3.0, 0.0)] {
        for (approach, play) in [('+', 0.0), ('-', lost)] {
            for _ in 0..5 {
                for i in 0..24 {
                    state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                    let noise = 0.2 * (f64::from(state >> 8) / f64::from(1 << 24) - 0.5);
                    let mm = -6.0 + f64::from(i) * 0.55;
                    let turn = core::f64::consts::TAU * mm / 2.0;
                    let um = slope * mm + play + wave * (turn + 0.5).sin() + noise;
                    rows += &format!("{axis},{approach},{},{um:.5}\n", mm * 1e3);
                }
            }
        }
    }
    rows
}

#[test]
fn least_squares_tells_slope_lost_motion_and_only_the_harmonics_that_are_there() {
    let folder = folder();
    let result = fit(folder.path(), &two_screws(), &["--lead-mm", "2"]).with_code(0);
    assert_eq!(result["method"], "least-squares");
    for (name, slope, lost_motion) in [("x", 0.8, 2.1), ("u", -0.4, 3.0)] {
        let axis = &result["axes"][name];
        for (key, truth) in [("slope_um_per_mm", slope), ("lost_motion_um", lost_motion)] {
            let u = axis[format!("{key}_u")].as_f64().expect("a number");
            assert!(u > 0.0 && u < 0.02, "{key}: u = {u}");
            check(axis, key, truth, 4.0 * u);
        }
        // Uniform noise of ±0.1 µm has a standard deviation of 0.0577 µm.
        check(axis, "residual_um", 0.0577, 0.006);
    }
    let harmonics = result["axes"]["x"]["harmonics"].as_array().expect("a list");
    let [first] = harmonics.as_slice() else {
        panic!("{harmonics:?}")
    };
    assert_eq!(first["harmonic"], 1);
    check(first, "amplitude_um", 0.7, 0.03);
    check(first, "phase_deg", 0.5_f64.to_degrees(), 3.0);
    assert_eq!(result["axes"]["u"]["harmonics"], serde_json::json!([]));
}

#[test]
fn a_row_that_does_not_belong_is_named_by_its_line_and_only_the_patent_uses_it() {
    let folder = folder();
    let clean = fit(folder.path(), &two_screws(), &["--lead-mm", "2"]).with_code(0);
    // Row 30 of x, line 31 of the file: its deviation lost a digit.
    let rows: Vec<String> = two_screws().lines().map(str::to_owned).collect();
    let (head, deviation) = rows[29].rsplit_once(',').expect("four cells");
    let right: f64 = deviation.parse().expect("a number");
    let mut wrong = rows.clone();
    wrong[29] = format!("{head},{:.5}", right + 20.0);
    let wrong = wrong.join("\n") + "\n";

    let result = fit(folder.path(), &wrong, &["--lead-mm", "2"]).with_code(0);
    let outliers = result["axes"]["x"]["outliers"].as_array().expect("a list");
    let [named] = outliers.as_slice() else {
        panic!("{outliers:?}")
    };
    assert_eq!(named["line"], 31);
    assert_eq!(named["approach"], "+");
    check(named, "deviation_um", right + 20.0, 1e-4);
    check(named, "residual_um", 20.0, 0.3);
    assert_eq!(result["axes"]["u"]["outliers"], serde_json::json!([]));
    for key in ["slope_um_per_mm", "lost_motion_um"] {
        let without = clean["axes"]["x"][key].as_f64().expect("a number");
        check(&result["axes"]["x"], key, without, 0.005);
    }

    let patent = ["--method", "patent"];
    let mean = |rows: &str| {
        let result = fit(folder.path(), rows, &patent).with_code(0);
        let mean = &result["axes"]["x"]["mean_lost_motion_um"];
        mean.as_f64().expect("a number")
    };
    // 240 rows: one that is 20 µm off moves the mean of all by a 240th of that.
    let moved = mean(&wrong) - mean(&two_screws());
    assert!((moved - 20.0 / 240.0).abs() < 1e-6, "{moved}");
}

#[test]
fn nothing_is_stored_of_a_file_with_anything_wrong_in_it() {
    let folder = folder();
    let path = folder.path();
    fs::write(path.join("machine.toml"), MACHINE).expect("a file can be written");
    let rows = two_screws();
    let good: Vec<&str> = rows.lines().take(240).collect();
    let with = |row: &str| format!("{}\n{row}\n", good.join("\n"));
    let save = ["--lead-mm", "2", "--save", "machine.toml"];
    for (rows, says) in [
        (with("x,+,500"), "data.csv:242:8"),
        (with("x,+,500,NaN"), "data.csv:242:9"),
        (with("x,+,500 mm,1.0"), "data.csv:242:5"),
        (with("u,+,500,1.0"), "data.csv:242:5"),
        (with("x,+,0.5,90000"), "micrometres and millimetres"),
    ] {
        let refused = fit(path, &rows, &save).with_code(2);
        let error = refused["error"].to_string();
        assert!(error.contains(says), "`{says}` is not in {error}");
    }
    let list = truestage(path, &["cal", "list"]).with_code(0);
    assert_eq!(list["calibrations"], serde_json::json!([]));
    // The same rows without the wrong one are stored.
    let whole = format!("{}\n", good.join("\n"));
    fit(path, &whole, &save).with_code(0);
}

#[track_caller]
fn check_refused(rows: &str, words: &[&str], says: &[&str]) {
    let folder = folder();
    let refused = fit(folder.path(), rows, words);
    let error = refused.with_code(2)["error"].to_string();
    for word in says {
        assert!(error.contains(word), "`{word}` is not in {error}");
    }
}

#[test]
fn what_cannot_be_estimated_is_told_with_file_line_and_cause() {
    let good = golden("u", '+');
    check_refused(
        &(good.clone() + "u,+,500\n"),
        &[],
        &["data.csv:56:8", "3 cells"],
    );
    let patent = ["--method", "patent"];
    check_refused(
        &(good.clone() + "u,+,500,nan\n"),
        &patent,
        &["data.csv:56:9", "finite"],
    );
    check_refused(
        &(good.clone() + "w,+,500,1\n"),
        &patent,
        &["data.csv:56:5", "axis w"],
    );
    check_refused(
        &(good.clone() + "u,x,500,1\n"),
        &patent,
        &["data.csv:56:3", "approach"],
    );
    check_refused(
        "u,+,0.5,2.0\nu,+,1.5,2.6\n",
        &patent,
        &["data.csv:2:9", "mixed"],
    );
    check_refused(
        &good,
        &[],
        &["data.csv:2", "axis u", "lost motion is not observable"],
    );
    let both = good.clone() + &golden("u", '-');
    let periodic = "periodic error is not observable";
    check_refused(&both, &["--lead-mm", "2"], &["data.csv:2", periodic]);
    check_refused(&both, &["--lead-mm=-2"], &["the lead is -2 mm"]);
}

#[test]
fn a_fit_is_stored_for_every_axis_or_for_none() {
    let folder = folder();
    let path = folder.path();
    fs::write(path.join("machine.toml"), MACHINE).expect("a file can be written");
    let save = ["--lead-mm", "2", "--save", "machine.toml"];
    // The machine has an axis x, and none called u.
    let error = fit(path, &two_screws(), &save).with_code(2);
    assert!(error["error"].to_string().contains("`u`"), "{error}");
    let list = truestage(path, &["cal", "list"]).with_code(0);
    assert_eq!(list["calibrations"], serde_json::json!([]));

    let rows = two_screws();
    let rows: String = rows
        .lines()
        .take(240)
        .map(|row| format!("{row}\n"))
        .collect();
    let stored = fit(path, &rows, &save).with_code(0);
    let id = stored["axes"]["x"]["calibration"].as_str().expect("a name");
    let shown = truestage(path, &["cal", "show", "machine.toml", id]).with_code(0);
    let record = &shown["record"];
    assert_eq!(record["kind"], "screw_model");
    check(record, "slope_m_per_m", 0.8e-3, 1e-5);
    check(record, "lost_motion_m", 2.1e-6, 1e-7);
    let list = truestage(path, &["cal", "list"]).with_code(0);
    assert_eq!(list["calibrations"][0]["kind"], "screw_model");

    // Approaches swapped: the lost motion comes out negative, and no screw has that.
    let swapped = rows
        .edit(",+,", ",#,")
        .edit(",-,", ",+,")
        .edit(",#,", ",-,");
    let refused = fit(path, &swapped, &save).with_code(3);
    assert!(
        refused["error"].to_string().contains("approaches swapped"),
        "{refused}"
    );
    let patent = fit(
        path,
        &rows,
        &["--method", "patent", "--save", "machine.toml"],
    )
    .with_code(0);
    let other = patent["axes"]["x"]["calibration"].as_str().expect("a name");
    let words = ["cal", "diff", "machine.toml", id, other];
    let changes = truestage(path, &words).with_code(0);
    assert_eq!(changes["changes"][0]["term"], "slope");
}
