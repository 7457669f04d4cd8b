//! `plan rotary` and `fit rotary`: offsets of a plate, and files of readings made elsewhere.

use std::fs;
use std::path::Path;

use serde_json::Value;
use tests::{Edit, MACHINE};

use crate::demo;
use crate::programs::{Ended, truestage};

const HEADER: &str = "offset,line,deviation_arcsec\n";

pub(crate) fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("a temporary folder can be made")
}

/// With `--lines 36`, unless `words` say otherwise.
fn fit(folder: &Path, rows: &str, words: &[&str]) -> Ended {
    let lines: &[&str] = match words.contains(&"--lines") {
        true => &[],
        false => &["--lines", "36"],
    };
    fit_as_told(folder, rows, &[lines, words].concat())
}

fn fit_as_told(folder: &Path, rows: &str, words: &[&str]) -> Ended {
    fs::write(folder.join("data.csv"), format!("{HEADER}{rows}")).expect("a file can be written");
    truestage(folder, &[&["fit", "rotary", "data.csv"], words].concat())
}

fn numbers(list: &Value) -> Vec<f64> {
    let list = list.as_array().unwrap_or_else(|| panic!("{list}"));
    list.iter()
        .map(|it| it.as_f64().expect("a number"))
        .collect()
}

#[track_caller]
fn check_near(seen: f64, expected: f64, tolerance: f64) {
    assert!(
        (seen - expected).abs() <= tolerance,
        "{seen}, not {expected}"
    );
}

const LINES: usize = 36;

/// Eccentricity, a second and a ninth harmonic; ±9″.
fn table(position: usize) -> f64 {
    let angle = core::f64::consts::TAU * (position % LINES) as f64 / LINES as f64;
    6.0 * angle.cos() + 2.0 * (2.0 * angle).sin() + (9.0 * angle + 0.3).cos()
}

/// Readings of a plate with errors of ±30″ and noise of ±0.05″, the same on every machine.
fn readings(offsets: &[usize], noise: f64) -> Vec<(usize, usize, f64)> {
    let mut state = 4711_u32;
    let mut random = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(state >> 8) / f64::from(1 << 24) - 0.5
    };
    let plate: Vec<f64> = (0..LINES).map(|_| 60.0 * random()).collect();
    let mut rows = Vec::new();
    for (placement, &offset) in offsets.iter().enumerate() {
        for (line, error) in plate.iter().enumerate() {
            let constant = 20.0 * placement as f64 - 30.0;
            let reading = table(line + offset) + error + constant + 2.0 * noise * random();
            rows.push((offset, line, reading));
        }
    }
    rows
}

fn csv(rows: &[(usize, usize, f64)]) -> String {
    rows.iter()
        .map(|(offset, line, reading)| format!("{offset},{line},{reading:.9}\n"))
        .collect()
}

#[test]
fn the_table_error_comes_out_whatever_the_plate_with_what_was_left_out() {
    let folder = folder();
    let mut rows = readings(&[0, 1, 7, 11], 0.05);
    // Line 20 is smudged; one reading is bad.
    rows.retain(|(_, line, _)| *line != 20);
    let bad = rows.iter_mut().find(|it| (it.0, it.1) == (7, 3));
    bad.expect("it was read").2 += 4.0;
    let result = fit(
        folder.path(),
        &csv(&rows),
        &["--reading-noise-arcsec", "0.029"],
    )
    .with_code(0);
    assert_eq!(
        (&result["lines"], &result["harmonic_max"]),
        (&36.into(), &17.into())
    );
    assert_eq!(result["offsets"], serde_json::json!([0, 1, 7, 11]));
    let errors = numbers(&result["table_error_arcsec"]);
    let u = numbers(&result["standard_uncertainty_arcsec"]);
    let stated = numbers(&result["propagated_uncertainty_arcsec"]);
    assert_eq!((errors.len(), u.len(), stated.len()), (36, 36, 36));
    let sum: f64 = errors.iter().sum();
    check_near(sum, 0.0, 1e-6);
    for (position, (error, u)) in errors.iter().zip(&u).enumerate() {
        assert!(*u > 0.0 && *u < 0.05, "{u}");
        check_near(*error, table(position), 4.5 * u);
    }
    // Uniform noise of ±0.05″ has a standard deviation of 0.0289″.
    check_near(
        result["reading_noise_arcsec"].as_f64().unwrap(),
        0.0289,
        0.006,
    );
    check_near(u[0] / stated[0], 1.0, 0.2);
    let amplification = result["noise_amplification"].as_f64().unwrap();
    assert!((0.5..1.0).contains(&amplification), "{amplification}");
    assert_eq!(result["plate_error_arcsec"][20], Value::Null);
    assert_eq!(result["plate_error_arcsec"].as_array().unwrap().len(), 36);
    assert_eq!(result["missing"].as_array().unwrap().len(), 4);
    let outliers = result["outliers"].as_array().unwrap();
    assert_eq!(outliers.len(), 1, "{outliers:?}");
    assert_eq!(
        (&outliers[0]["offset"], &outliers[0]["line"]),
        (&7.into(), &3.into())
    );
    check_near(outliers[0]["residual_arcsec"].as_f64().unwrap(), 4.0, 0.3);
}

#[test]
fn the_patents_two_placements_give_its_recursion_and_no_uncertainty_of_their_own() {
    let folder = folder();
    let rows = readings(&[0, 1], 0.05);
    let result = fit(folder.path(), &csv(&rows), &[]).with_code(0);
    let (first, second) = rows.split_at(LINES);
    let mean = |rows: &[(usize, usize, f64)]| rows.iter().map(|it| it.2).sum::<f64>() / 36.0;
    let mut sums = vec![0.0];
    for (a, b) in first.iter().zip(&second[..LINES - 1]) {
        let last = sums[sums.len() - 1];
        sums.push(last + (b.2 - mean(second)) - (a.2 - mean(first)));
    }
    let zero = sums.iter().sum::<f64>() / 36.0;
    for (seen, sum) in numbers(&result["table_error_arcsec"]).iter().zip(&sums) {
        check_near(*seen, sum - zero, 1e-7);
    }
    check_near(
        result["noise_amplification"].as_f64().unwrap(),
        (1295.0_f64 / 216.0).sqrt(),
        1e-9,
    );
    let u = result["standard_uncertainty_arcsec"].as_array().unwrap();
    assert!(u.len() == 36 && u.iter().all(Value::is_null));
    let words = ["--reading-noise-arcsec", "0.1"];
    let result = fit(folder.path(), &csv(&rows), &words).with_code(0);
    let u = numbers(&result["standard_uncertainty_arcsec"]);
    check_near(u[5], 0.1 * (1295.0_f64 / 216.0).sqrt(), 1e-9);
}

#[test]
fn a_plate_whose_last_line_was_never_read_is_evaluated_with_all_its_lines_or_not_at_all() {
    let folder = folder();
    let mut rows = readings(&[0, 1, 7, 11], 0.05);
    rows.retain(|(_, line, _)| *line != LINES - 1);
    let refused = fit_as_told(folder.path(), &csv(&rows), &[]).with_code(2);
    let refused = refused["error"].to_string();
    for says in [
        "data.csv:141:4",
        "the plate has 35 lines or more",
        "`--lines`",
    ] {
        assert!(refused.contains(says), "`{says}` is not in {refused}");
    }
    let result = fit(folder.path(), &csv(&rows), &[]).with_code(0);
    let errors = numbers(&result["table_error_arcsec"]);
    let u = numbers(&result["standard_uncertainty_arcsec"]);
    assert_eq!(errors.len(), LINES);
    for (position, (error, u)) in errors.iter().zip(&u).enumerate() {
        check_near(*error, table(position), 4.5 * u);
    }
    assert_eq!(result["plate_error_arcsec"][LINES - 1], Value::Null);
}

#[track_caller]
fn check_refused(rows: &str, words: &[&str], says: &[&str]) {
    let folder = folder();
    fs::write(folder.path().join("machine.toml"), MACHINE).expect("a file can be written");
    let words = [words, &["--save", "machine.toml"]].concat();
    let error = fit(folder.path(), rows, &words).with_code(2)["error"].to_string();
    for word in says {
        assert!(error.contains(word), "`{word}` is not in {error}");
    }
    let left: Vec<_> = fs::read_dir(folder.path()).unwrap().collect();
    assert_eq!(left.len(), 2, "something was stored: {left:?}");
}

#[test]
fn a_table_measured_elsewhere_is_stored_for_the_rotary_axis_it_belongs_to() {
    let folder = folder();
    let machine = folder.path().join("machine.toml");
    fs::write(&machine, tests::ROTARY.machine).expect("a file can be written");
    let rows = csv(&readings(&[0, 1, 7, 11], 0.05));
    let save = ["--save", "machine.toml"];
    let stored = fit(folder.path(), &rows, &save).with_code(0);
    let id = stored["calibration"].as_str().expect("it was stored");
    let activated = truestage(
        folder.path(),
        &["cal", "activate", "machine.toml", &id[..8]],
    );
    assert_eq!(activated.with_code(0)["axis"], "c");
    let list = truestage(folder.path(), &["cal", "list", "machine.toml"]).with_code(0);
    assert_eq!(list["calibrations"][0]["kind"], "rotary_error_table");
    assert_eq!(list["calibrations"][0]["active"], true);
    let other = [&save[..], &["--axis", "x"]].concat();
    let refused = fit(folder.path(), &rows, &other).with_code(2);
    assert!(
        refused["error"].to_string().contains("known: c"),
        "{refused}"
    );
    // A table beyond the limits of the axis is not stored.
    let strict = tests::ROTARY
        .machine
        .edit("size_limit_arcsec = 60.0", "size_limit_arcsec = 5.0");
    fs::write(&machine, strict).expect("a file can be written");
    let refused = fit(folder.path(), &rows, &save).with_code(3);
    assert!(refused["error"].to_string().contains("axis c"), "{refused}");
    let list = truestage(folder.path(), &["cal", "list", "machine.toml"]).with_code(0);
    assert_eq!(list["calibrations"].as_array().map(Vec::len), Some(1));
}

#[test]
fn what_cannot_be_used_is_told_with_file_line_and_cause_and_nothing_is_stored() {
    let rows = readings(&[0, 1, 7], 0.05);
    let good = csv(&rows);
    let with = |row: &str| format!("{good}{row}\n");
    check_refused(
        &with("7,5,nan"),
        &[],
        &["data.csv:110:5", "not a finite number"],
    );
    check_refused(&with("7,5"), &[], &["data.csv:110:4", "2 cells"]);
    check_refused(
        &with("7,5,1.0"),
        &[],
        &["data.csv:110:3", "line 5 of the placement at offset 7"],
    );
    check_refused(
        &with("1,5,1.0"),
        &[],
        &["data.csv:110:1", "offset 1 appears again"],
    );
    check_refused(
        &with("36,5,1.0"),
        &[],
        &["data.csv:110:1", "`offset` is 36"],
    );
    check_refused(&with("7,36,1.0"), &[], &["data.csv:110:3", "has 36 lines"]);
    check_refused(
        &csv(&rows[..LINES]),
        &[],
        &["data.csv:37:1", "one placement cannot separate"],
    );
    check_refused(&csv(&rows[..90]), &[], &["data.csv:91:1", "18 of 36 lines"]);
}

#[test]
fn placements_and_options_of_no_use_are_told_and_nothing_is_stored() {
    let good = csv(&readings(&[0, 1, 7], 0.05));
    let opposite = csv(&readings(&[0, 18], 0.05));
    check_refused(&opposite, &[], &["data.csv:38:1", "harmonic 2"]);
    let gap = csv(&readings(&[0, 1], 0.05)).edit_first("0,9,", "#0,9,");
    check_refused(
        &gap,
        &[],
        &["data.csv: ", "line 9 at plate offset 0 is needed"],
    );
    let turned = csv(&readings(&[0, 1, 9, 11], 0.05)).edit("\n9,", "\n7,");
    check_refused(&turned, &[], &["plate offset 7 fits offset 9 far better"]);
    check_refused(&good, &["--reading-noise-arcsec=-1"], &["above zero"]);
    check_refused(
        &good,
        &["--amplification-limit", "1"],
        &["is amplified", "the limit is 1.0"],
    );
    check_refused(&good, &[], &["this machine has no rotary axis"]);
    let urad = folder();
    fs::write(
        urad.path().join("u.csv"),
        "offset,line,deviation_urad\n0,0,1\n",
    )
    .unwrap();
    let error = truestage(urad.path(), &["fit", "rotary", "u.csv"]).with_code(2);
    let error = error["error"].to_string();
    assert!(
        error.contains("u.csv:1:13") && error.contains("deviation_arcsec"),
        "{error}"
    );
}

#[test]
fn a_plan_says_what_it_makes_of_noise_and_what_others_would() {
    let folder = folder();
    let plan = |words: &[&str]| truestage(folder.path(), &[&["plan", "rotary"], words].concat());
    for (criterion, worst) in [("worst", 1.36), ("rms", 2.0)] {
        let words = [
            "--lines",
            "360",
            "--placements",
            "4",
            "--criterion",
            criterion,
        ];
        let planned = plan(&words).with_code(0);
        assert_eq!(planned["criterion"], criterion);
        let amplification = numbers(&planned["amplification"]);
        assert_eq!(
            (numbers(&planned["offsets"]).len(), amplification.len()),
            (4, 180)
        );
        let largest = amplification.iter().copied().fold(0.0, f64::max);
        check_near(
            planned["worst_amplification"].as_f64().unwrap(),
            largest,
            1e-12,
        );
        assert!(largest < worst, "{largest}");
        assert!(planned["rms_amplification"].as_f64().unwrap() < 0.631);
        let pair = &planned["patent_pair"];
        let theory = planned["theory"]["pair_one_line_apart_rms"]
            .as_f64()
            .unwrap();
        check_near(pair["rms_amplification"].as_f64().unwrap(), theory, 1e-9);
        check_near(theory, 7.7459, 1e-4);
        let all = planned["theory"]["placement_at_every_line_rms"]
            .as_f64()
            .unwrap();
        check_near(all, 359.0_f64.sqrt() / 360.0, 1e-12);
    }
    let judged = plan(&["--lines", "360", "--offsets", "0,1"]).with_code(0);
    assert_eq!(judged["worst_harmonic"], 1);
    let words = ["--lines", "360", "--offsets", "0,120,240"];
    let refused = plan(&words).with_code(2)["error"].to_string();
    assert!(
        refused.contains("harmonic 3 and its multiples"),
        "{refused}"
    );
    plan(&["--lines", "360", "--placements", "1"]).with_code(2);
    plan(&["--lines", "3", "--placements", "4"]).with_code(2);
    plan(&["--lines", "360"]).with_code(2);
}

#[test]
fn the_rotary_table_shows_its_cycle() {
    let left = [
        "/verified/as_left/largest_arcsec",
        "/verified_after_power_cycle/as_left/largest_arcsec",
    ];
    demo::check("rotary", "/verified/as_found/largest_arcsec", left, 0.3);
}

/// The rotary machine with a plate of 36 lines that a person reads.
pub(crate) fn sighted_machine(folder: &Path, value: &str) {
    let sighting = format!("[rotary.c.sighting]\nvalue = \"{value}\"\nrange_arcsec = 120.0");
    let text = tests::ROTARY
        .machine
        .edit(
            "[rotary.c.line_detector]       # at the drive's touch probe 1\nedge = \"positive\"",
            &sighting,
        )
        .edit("lines = 360", "lines = 36")
        .edit("offset_lines = 200.5", "offset_lines = 20.0")
        .edit("placements = 4 ", "offsets = [0, 1, 7, 11] ")
        .edit("optimise = ", "# ")
        .edit("amplification_limit = 3.0", "amplification_limit = 10.0");
    fs::write(folder.join("machine.toml"), text).expect("a file can be written");
}

/// The placement at `offset` in a file: each line in three passes, which differ by a little.
pub(crate) fn placement_file(folder: &Path, offset: usize) -> String {
    let mut text = String::from("offset,pass,approach,line,deviation_arcsec\n");
    for (at, pass) in ["1,+", "1,-", "2,+"].iter().enumerate() {
        for (_, line, reading) in readings(&[offset], 0.05) {
            let apart = 0.02 * ((7 * line + 3 * at) % 5) as f64 - 0.04;
            text += &format!("{offset},{pass},{line},{:.6}\n", reading + apart);
        }
    }
    let name = format!("at-{offset}.csv");
    fs::write(folder.join(&name), text).expect("a file can be written");
    name
}

#[test]
fn a_plate_read_elsewhere_calibrates_the_table_placement_by_placement_without_its_machine() {
    let folder = folder();
    let folder = folder.path();
    sighted_machine(folder, "deviation");
    let checked = truestage(folder, &["check", "machine.toml"]).with_code(0);
    let note = checked["notes"][0].to_string();
    assert!(
        note.contains("108 readings in each of 4 placements")
            && note.contains("offset,pass,approach,line,deviation_arcsec"),
        "{note}"
    );
    // Nine lines a part: 0.06″ √2 × 1.15 / 3.
    let note = checked["notes"][1].to_string();
    assert!(
        note.contains("0.1 is 3.1 standard deviations") && note.contains("with 0.130"),
        "{note}"
    );
    let run = |words: &[&str]| truestage(folder, &[&["calibrate", "machine.toml"], words].concat());
    for words in [&["--yes"][..], &[]] {
        let refused = run(words).with_code(2)["error"].to_string();
        assert!(refused.contains("--readings"), "{refused}");
    }
    let later = placement_file(folder, 7);
    let refused = run(&["--readings", &later]).with_code(2)["error"].to_string();
    assert!(refused.contains("at-7.csv:2:1: `offset` is 7"), "{refused}");
    assert!(
        !folder.join("machine-data/rotary/runs").exists(),
        "a run was begun"
    );

    let first = placement_file(folder, 0);
    let begun = run(&["--readings", &first]).with_code(0);
    assert_eq!(
        (&begun["complete"], &begun["due"]["offset"]),
        (&false.into(), &1.0.into())
    );
    assert!(
        begun["due"]["task"].to_string().contains("by 1 lines"),
        "{begun}"
    );
    assert_eq!(begun["placements_read"].as_array().map(Vec::len), Some(1));
    let rest: Vec<String> = [1, 7, 11]
        .map(|offset| placement_file(folder, offset))
        .into();
    let mut words = vec!["--resume"];
    rest.iter()
        .for_each(|it| words.extend(["--readings", it.as_str()]));
    let done = run(&words).with_code(0);
    assert_eq!(
        (&done["complete"], &done["axis"]),
        (&true.into(), &"c".into())
    );
    for (position, error) in numbers(&done["table_error_arcsec"]).iter().enumerate() {
        check_near(*error, table(position), 0.2);
    }
    let list = truestage(folder, &["cal", "list", "machine.toml"]).with_code(0);
    assert_eq!(list["calibrations"][0]["active"], true);

    let between = placement_file(folder, 20);
    let words = ["verify", "machine.toml", "--readings", &between];
    let verified = truestage(folder, &words).with_code(0);
    assert_eq!(verified["within_tolerance"], true);
    let journal = done["journal"].as_str().expect("a path");
    let page = truestage(folder, &["report", journal, "--output", "page.html"]);
    page.with_code(0);
    let page = fs::read_to_string(folder.join("page.html")).expect("it was written");
    assert!(page.contains("by a person, with each line under the cross-hair"));
}

#[test]
fn files_of_readings_are_for_a_plate_that_a_person_reads() {
    let folder = folder();
    fs::write(folder.path().join("machine.toml"), tests::ROTARY.machine)
        .expect("it can be written");
    let refused = truestage(
        folder.path(),
        &["calibrate", "machine.toml", "--readings", "a.csv"],
    );
    let refused = refused.with_code(2)["error"].to_string();
    assert!(
        refused.contains("[rotary.c.sighting] in place of"),
        "{refused}"
    );
    fs::write(folder.path().join("machine.toml"), MACHINE).expect("it can be written");
    for verb in ["calibrate", "verify"] {
        let refused = truestage(
            folder.path(),
            &[verb, "machine.toml", "--readings", "a.csv"],
        );
        let refused = refused.with_code(2)["error"].to_string();
        assert!(refused.contains("the plate of a rotary axis"), "{refused}");
    }
}

/// A configuration must say once, and plainly, who reads the lines.
#[test]
fn who_reads_the_lines_is_said_once_and_within_reason() {
    let folder = folder();
    let check = |text: String, says: &str| {
        fs::write(folder.path().join("machine.toml"), text).expect("a file can be written");
        let refused = truestage(folder.path(), &["check", "machine.toml"]).with_code(2);
        assert!(refused["error"].to_string().contains(says), "{refused}");
    };
    sighted_machine(folder.path(), "angle");
    let sound = fs::read_to_string(folder.path().join("machine.toml")).expect("it was written");
    let both = sound.edit(
        "[rotary.c.sighting]",
        "[rotary.c.line_detector]\n[rotary.c.sighting]",
    );
    check(both, "only one of them can read the lines");
    check(
        sound.edit("range_arcsec = 120.0", "range_arcsec = 9001.0"),
        "give at most 9000.000",
    );
    check(sound.edit("\"angle\"", "\"angel\""), "angel");
    let none = sound.edit(
        "[rotary.c.sighting]\nvalue = \"angle\"\nrange_arcsec = 120.0",
        "",
    );
    check(none, "`line_signal` or `sighting`");
}
