//! Three axes seen from the command line: what was measured of them is shown, compared, evaluated
//! again and made into pages; and each verb on a machine of its own.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use machine::records::read_journal;
use tests::volume::{Volume, good, quick};
use tests::{Edit, VOLUMETRIC};
use truestage::for_tests::OpticsName;
use truestage::volumetric::GeometryContent;
use truestage::volumetric::VolumeLog;
use truestage::volumetric::{VerifyBy, WarmUp};

use crate::demo;
use crate::programs::{check_error, check_says, number, page, text, truestage};

/// A machine that was calibrated once in virtual time.
struct Calibrated {
    volume: Volume,
    id: String,
    journal: String,
}

impl Calibrated {
    fn folder(&self) -> &Path {
        self.volume.bench.folder.path()
    }

    fn run(&self, words: &[&str]) -> crate::programs::Ended {
        truestage(self.folder(), words)
    }
}

/// One that was calibrated a second time, and verified without and with that.
struct Verified {
    calibrated: Calibrated,
    again: (String, String),
    found: String,
    left: String,
}

fn calibrate(volume: &mut Volume) -> (String, String) {
    let (mut hand, store) = (volume.bench.emulated.clone(), volume.bench.store.clone());
    let mut work = volume.bench.machine.volumetric().unwrap();
    let made = good(work.calibrate(&store, WarmUp::None, None, &mut hand));
    (made.id, made.journal.display().to_string())
}

/// It can go on with its work.
fn at_work() -> Calibrated {
    let mut volume = Volume::zeroed(1, quick, |text| text);
    let (id, journal) = calibrate(&mut volume);
    let folder = volume.bench.folder.path();
    let text = quick(VOLUMETRIC.machine.to_owned());
    let text = text.edit("machine-data", &folder.display().to_string());
    fs::write(folder.join("machine.toml"), text).expect("there is room");
    Calibrated {
        volume,
        id,
        journal,
    }
}

/// It was shut down.
fn calibrated() -> Calibrated {
    let mut calibrated = at_work();
    good(calibrated.volume.bench.machine.shut_down());
    calibrated
}

/// Likewise.
fn verified() -> Verified {
    let mut calibrated = at_work();
    let volume = &mut calibrated.volume;
    let again = calibrate(volume);
    let (mut hand, store) = (volume.bench.emulated.clone(), volume.bench.store.clone());
    let machine = &mut volume.bench.machine;
    let mut verified = |by| good(machine.volumetric().unwrap().verify(&store, by, &mut hand));
    let found = verified(VerifyBy::AsFound);
    let left = verified(VerifyBy::Everything);
    good(machine.shut_down());
    Verified {
        calibrated,
        again,
        found: found.journal.display().to_string(),
        left: left.journal.display().to_string(),
    }
}

#[test]
fn what_three_axes_measured_is_listed_shown_compared_and_made_into_pages() {
    let verified = verified();
    let runs = &verified.calibrated;
    let checked = runs.run(&["check", "machine.toml"]).with_code(0);
    assert_eq!(checked["machine"], "volumetric");
    let list = runs.run(&["cal", "list"]).with_code(0);
    let list = list["calibrations"].as_array().expect("a list");
    let active = list.iter().filter(|it| it["active"] == true);
    let mut kinds: Vec<&str> = active.map(|it| text(&it["kind"])).collect();
    kinds.sort_unstable();
    assert_eq!(kinds, ["beam_references", "volumetric_geometry"]);
    let (first, (second, journal)) = (&runs.id, &verified.again);
    let shown = runs
        .run(&["cal", "show", "machine.toml", second])
        .with_code(0);
    let record = &shown["record"];
    assert_eq!(record["functions"].as_array().map(Vec::len), Some(18));
    assert!(journal.ends_with(text(&record["source"])));
    let words = ["cal", "diff", "machine.toml", first, second];
    let changes = runs.run(&words).with_code(0);
    let changes = changes["changes"].as_array().expect("a list").clone();
    assert_eq!(changes.len(), 18);
    let largest = changes.iter().map(|it| number(&it["change"]));
    let largest = largest.fold(0.0, f64::max);
    assert!(largest > 0.0 && largest < 5.0, "{largest}");

    let calibrated = page(runs.folder(), journal);
    let errors = [
        "e_xx",
        "e_yz",
        "Tilts of y",
        "Squareness",
        "<polygon",
        "tilt (″)",
    ];
    check_says(&calibrated, &errors);
    check_says(&calibrated, &["x (mm)", "°C", "Residuals", &second[..12]]);
    let (found, left) = (
        page(runs.folder(), &verified.found),
        page(runs.folder(), &verified.left),
    );
    check_says(&found, &["Line as found", "deviation (µm)", "<svg"]);
    check_says(&left, &["Line as left", "correction x, y, z (µm)", "°C"]);
}

/// Nothing moves and nobody is asked: the machine was shut down.
#[test]
fn a_designed_shape_is_imported_from_a_file_and_one_that_cannot_be_is_refused_with_its_row() {
    let runs = calibrated();
    let import = |rows: &str| {
        let csv = format!("axis,along,position_mm,displacement_um\n{rows}");
        fs::write(runs.folder().join("shape.csv"), csv).expect("there is room");
        runs.run(&["memory", "import", "machine.toml", "shape.csv"])
    };
    let refused = [
        ("x,z,0,0\nx,z,900,0\n", "shape.csv:3: x = 900 mm is outside"),
        ("x,z,0,0\nx,z,250,15000\n", "beyond displacement_max_um"),
        ("x,x,0,0\nx,x,250,15\n", "across x, not along it"),
    ];
    for (rows, why) in refused {
        check_error(&import(rows).with_code(2), &[why]);
    }
    let words = [
        "memory",
        "import",
        "machine.toml",
        "shape.csv",
        "--memory",
        "second",
    ];
    check_error(&runs.run(&words).with_code(2), &["run --first-part"]);
    let kept = import("x,z,0,0\nx,z,250,15\nx,z,500,0\n").with_code(0);
    assert_eq!(kept["axes"][0]["to_mm"], 500.0, "{kept}");
    let list = runs.run(&["cal", "list"]).with_code(0);
    let list = list["calibrations"].as_array().expect("a list");
    let is_kept = |it: &&serde_json::Value| it["kind"] == "state_memory" && it["active"] == true;
    assert_eq!(list.iter().filter(is_kept).count(), 1, "{list:?}");
}

/// The references `record` as somebody might give them beforehand, `um` of them added to x along y.
fn table_of(record: &serde_json::Value, um: f64) -> String {
    let mut csv = "axis,detector,along,position_mm,value,unit\n".to_owned();
    let values = |it: &serde_json::Value| -> Vec<f64> {
        let each = it.as_array().expect("a list").iter();
        each.map(number).collect()
    };
    let rows =
        |csv: &mut String, head: &str, function: &serde_json::Value, per_si: f64, add: f64| {
            let unit = if head.contains("roll") {
                "arcsec"
            } else {
                "um"
            };
            let places = values(&function["positions_m"]).into_iter();
            for (at, value) in places.zip(values(&function["values_si"])) {
                let (mm, value) = (at * 1e3, value * per_si + add);
                let _ = writeln!(csv, "{head},{mm},{value},{unit}");
            }
        };
    for beam in record["beams"].as_array().expect("a list") {
        let axis = text(&beam["axis"]);
        let across = ["x", "y", "z"].into_iter().filter(|it| *it != axis);
        for (k, along) in across.enumerate() {
            let add = if (axis, along) == ("x", "y") { um } else { 0.0 };
            let head = format!("{axis},slide,{along}");
            rows(&mut csv, &head, &beam["slider"][k], 1e6, add);
            let end = number(&beam["end_m"][k]) * 1e6;
            let _ = writeln!(csv, "{axis},end,{along},,{end},um");
        }
    }
    let arcsec = 180.0 * 3600.0 / core::f64::consts::PI;
    rows(&mut csv, "x,roll,", &record["roll"], arcsec, 0.0);
    csv
}

/// Functions for the beams of the shipped machine, and for no roll.
fn functions_of_beams() -> String {
    let mut functions = "schema_version = 1\n".to_owned();
    for (axis, across, travel) in [
        ("x", ["y", "z"], 500),
        ("y", ["x", "z"], 400),
        ("z", ["x", "y"], 300),
    ] {
        for along in across {
            let _ = writeln!(
                functions,
                "[[function]]\naxis = '{axis}'\ndetector = 'end'\nalong = '{along}'\ncoefficients_um = [0]\n\
                 [[function]]\naxis = '{axis}'\ndetector = 'slide'\nalong = '{along}'\n\
                 coefficients_um = [1.0, 0.0, -4.0]\nscale_mm = {travel}\nfrom_mm = 0\nto_mm = {travel}"
            );
        }
    }
    functions
}

/// Nothing moves and nobody is asked: the machine was shut down.
#[test]
fn references_that_are_known_beforehand_are_imported_as_a_table_and_as_functions() {
    let runs = calibrated();
    let list = runs.run(&["cal", "list"]).with_code(0);
    let list = list["calibrations"].as_array().expect("a list").clone();
    let is_used = |it: &&serde_json::Value| it["kind"] == "beam_references" && it["active"] == true;
    let measured = text(&list.iter().find(is_used).expect("they were taken")["id"]).to_owned();
    let show =
        |id: &str| runs.run(&["cal", "show", "machine.toml", id]).with_code(0)["record"].clone();
    let import = |name: &str, file: &str| {
        fs::write(runs.folder().join(name), file).expect("there is room");
        runs.run(&["reference", "import", "machine.toml", name])
    };
    let changes_of = |changed: &serde_json::Value| -> Vec<(String, f64)> {
        let each = changed["changes"].as_array().expect("a list").iter();
        each.map(|it| (text(&it["reading"]).to_owned(), number(&it["change"])))
            .collect()
    };
    // What was measured, given back by hand: the same references.
    let given = import("r.csv", &table_of(&show(&measured), 0.0)).with_code(0);
    assert_eq!(
        (&given["given"], &given["source"]),
        (&"table".into(), &"r.csv".into())
    );
    let changes = changes_of(&given);
    assert_eq!(changes.len(), 13, "{changes:?}");
    assert!(changes.iter().all(|(_, it)| *it < 1e-6), "{changes:?}");
    let record = show(text(&given["references"]));
    assert_eq!(
        (&record["source"], &record["given"]),
        (&"r.csv".into(), &"table".into())
    );
    assert_eq!(record["geometry"], show(&measured)["geometry"]);

    let given = import("s.csv", &table_of(&show(&measured), 2.5)).with_code(0);
    let words = [
        "cal",
        "diff",
        "machine.toml",
        &measured,
        text(&given["references"]),
    ];
    for (reading, change) in changes_of(&runs.run(&words).with_code(0)) {
        let expected = if reading == "x, slide along y" {
            2.5
        } else {
            0.0
        };
        assert!((change - expected).abs() < 1e-6, "{reading}: {change}");
    }

    let mut functions = functions_of_beams();
    check_error(
        &import("f.toml", &functions).with_code(2),
        &["f.toml:", "nothing is given for x, roll"],
    );
    functions += "[[function]]\naxis = 'x'\ndetector = 'roll'\ncoefficients_arcsec = [0.5]\nfrom_mm = 0\nto_mm = 500\n";
    let given = import("f.toml", &functions).with_code(0);
    assert_eq!(given["given"], "functions");
    // Refused, and what was in use stays in use.
    let wrong = table_of(&show(&measured), 2500.0);
    check_error(
        &import("w.csv", &wrong).with_code(2),
        &["w.csv:2: x, slide along y", "can show"],
    );
    let list = runs.run(&["cal", "list"]).with_code(0);
    let list = list["calibrations"].as_array().expect("a list");
    let used = list.iter().find(is_used).expect("some are in use");
    assert_eq!(used["id"], given["references"]);
}

/// The readings of a run as a file that somebody else might have made.
fn csv_of(journal: &str) -> String {
    let read = read_journal::<VolumeLog>(Path::new(journal)).expect("it can be read");
    let plan = read.log.plan.expect("it has one");
    let mut csv =
        "line,reads,x_mm,y_mm,z_mm,tool_x_mm,tool_y_mm,tool_z_mm,deviation,u\n".to_owned();
    for it in &read.log.readings {
        let line = &plan.lines[it.line];
        let sees = line.sees.unwrap_or_default();
        let (reads, scale) = match line.optics {
            OpticsName::Linear => ("linear_um".to_owned(), 1e6),
            OpticsName::Straightness => (format!("straightness_{sees}_um"), 1e6),
            OpticsName::Angular => (
                format!("tilt_{sees}_arcsec"),
                180.0 * 3600.0 / core::f64::consts::PI,
            ),
        };
        let mm = |metres: [f64; 3]| metres.map(|it| (it * 1e3).to_string()).join(",");
        let (at, tool) = (mm(it.at_m), mm(it.tool_m));
        let (deviation, u) = (it.deviation_si * scale, it.u_si * scale);
        let _ = writeln!(csv, "{},{reads},{at},{tool},{deviation},{u}", it.line + 1);
    }
    csv
}

#[test]
fn errors_follow_again_from_a_journal_and_from_a_file_of_its_readings() {
    let runs = calibrated();
    let (id, journal) = (&runs.id, &runs.journal);
    let fit = |words: &[&str]| runs.run(&[&["fit", "volumetric"], words].concat());
    let config = ["--config", "machine.toml"];
    let from_journal = fit(&[&[journal.as_str()], &config[..], &["--save"]].concat()).with_code(0);
    let stored = runs.volume.bench.store.load::<GeometryContent>(id);
    let stored = serde_json::to_value(stored.expect("it was stored").content).expect("plain");
    assert_eq!(from_journal["functions"], stored["functions"]);
    let again = text(&from_journal["calibration"]).to_owned();
    let words = ["cal", "diff", "machine.toml", id, &again];
    let changes = runs.run(&words).with_code(0);
    let changes = changes["changes"].as_array().expect("a list").clone();
    assert!(changes.iter().all(|it| number(&it["change"]) == 0.0));
    for name in ["calibration", "references"] {
        let words = ["cal", "activate", "machine.toml", text(&from_journal[name])];
        runs.run(&words).with_code(0);
    }

    let file = runs.folder().join("lines.csv");
    let csv = csv_of(journal);
    fs::write(&file, &csv).expect("there is room");
    let from_file = fit(&[&["lines.csv"], &config[..]].concat()).with_code(0);
    assert_eq!(from_file["readings"], from_journal["readings"]);
    // What all readings share of their uncertainty a file does not say: squarenesses are as they were within a tenth of
    // what is stated, and stated no surer.
    for k in 0..3 {
        let of = |fitted: &serde_json::Value, key: &str| number(&fitted[key][k]);
        let [file, own] = [&from_file, &from_journal].map(|it| of(it, "squareness_arcsec"));
        let [file_u, own_u] = [&from_file, &from_journal].map(|it| of(it, "squareness_u_arcsec"));
        assert!((file - own).abs() < 0.1 * own_u, "{file}, {own}, {own_u}");
        assert!(file_u > 0.999 * own_u, "{file_u}, {own_u}");
    }
    let unsaved = fit(&[&["lines.csv"], &config[..], &["--save"]].concat()).with_code(2);
    check_error(&unsaved, &["6", "--temperatures-c"]);
    let warm = ["--save", "--temperatures-c", "20,20,20,20,20,20"];
    let saved = fit(&[&["lines.csv"], &config[..], &warm].concat()).with_code(0);
    assert!(saved["references"].is_null() && saved["calibration"].is_string());

    refuses_files(&runs, &csv);
}

fn refuses_files(runs: &Calibrated, csv: &str) {
    let refused = |csv: &str, words: &[&str]| {
        fs::write(runs.folder().join("wrong.csv"), csv).expect("there is room");
        let fit = ["fit", "volumetric", "wrong.csv", "--config", "machine.toml"];
        runs.run(&[&fit, words].concat())
    };
    let cells = |line: &str| line.split(',').map(str::to_owned).collect::<Vec<_>>();
    let is_diagonal = |cells: &[String]| {
        let away = cells[2..5].iter().filter(|it| *it != "0");
        cells[1] == "linear_um" && away.count() > 1
    };
    let diagonals = csv.lines().map(cells).filter(|it| is_diagonal(it));
    let diagonals: Vec<String> = diagonals.map(|it| it[0].clone()).collect();
    let others = csv.lines().filter(|it| !diagonals.contains(&cells(it)[0]));
    let no_diagonals: String = others.map(|line| format!("{line}\n")).collect();
    let error = refused(&no_diagonals, &[]).with_code(3);
    check_error(&error, &["do not determine", "squareness of y to x"]);
    let error = refused(&csv.edit_first("linear_um", "linear_mm"), &[]).with_code(2);
    check_error(&error, &["wrong.csv:2:3", "linear_um"]);
    let error = refused(
        &format!("{csv}99,linear_um,0,0,0,0,0,0,0,1\n99,linear_um,900,0,0,0,0,0,0,1\n"),
        &[],
    );
    check_error(&error.with_code(2), &["wrong.csv:", "900"]);
    let error = refused(csv, &["--without", "e_dx"]).with_code(2);
    check_error(&error, &["e_dx", "e_xx"]);
    let linear = fs::write(runs.folder().join("linear.toml"), tests::MACHINE);
    linear.expect("there is room");
    let words = ["fit", "volumetric", "lines.csv", "--config", "linear.toml"];
    runs.run(&words).with_code(2);
}

/// The errors of the machine and their drift by far exceed what is left of them when it is corrected
/// by what it sees; its tables alone drift away.
#[test]
fn three_axes_show_their_day() {
    let Some((said, page)) = demo::shown("volumetric") else {
        return;
    };
    let hours = said["hours"].as_array().expect("a list");
    assert_eq!(hours.len(), 5);
    let of = |at: usize, state: &str| demo::number(&said, &format!("/hours/{at}/{state}"));
    for at in 0..5 {
        let (found, live) = (of(at, "as_found_um"), of(at, "corrected_um"));
        assert!(
            live < found / 3.0 && live < 2.0,
            "reading {at}: {found}, {live}"
        );
    }
    let (morning, evening) = (of(0, "by_tables_um"), of(4, "by_tables_um"));
    assert!(
        evening > 3.0 * of(4, "corrected_um"),
        "{morning}, {evening}"
    );
    assert!(evening > morning, "{morning}, {evening}");
    let parts = [
        "hour (h)",
        "as found",
        "tables alone",
        "corrected live",
        "e_xx",
        "Squareness",
    ];
    for part in parts.into_iter().chain(["<polygon", "thermometer (°C)"]) {
        assert!(page.contains(part), "`{part}` is not on the page");
    }
}
