//! Data that were measured elsewhere, as somebody at a desk evaluates them.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

use tests::LINEAR;

use crate::programs::{Process, check_error, program, text, truestage};

/// Runs of three positions from both sides; `environment` goes behind each row.
fn data(runs: u32, scale: f64, environment: Option<&str>) -> String {
    let mut text = "run,approach,target_mm,measured_mm".to_owned();
    if environment.is_some() {
        text += ",air_temperature_c,pressure_hpa,humidity_percent,material_temperature_c";
    }
    for run in 1..=runs {
        for (approach, targets) in [("+", [0.0, 30.0, 60.0]), ("-", [60.0, 30.0, 0.0])] {
            for target in targets {
                let lag_mm = if approach == "+" { -0.5e-3 } else { 0.5e-3 };
                let measured = target * scale + lag_mm + 0.01e-3 * f64::from(run);
                text += &format!("\n{run},{approach},{target},{measured:.7}");
                text += &environment.map_or(String::new(), |it| format!(",{it}"));
            }
        }
    }
    text + "\n"
}

fn folder(data: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    fs::write(folder.path().join("machine.toml"), LINEAR.machine).expect("there is room");
    fs::write(folder.path().join("data.csv"), data).expect("there is room");
    folder
}

/// micrometres at a place of what is printed.
fn um(value: &serde_json::Value, place: &str) -> f64 {
    value
        .pointer(place)
        .and_then(serde_json::Value::as_f64)
        .unwrap_or_else(|| panic!("no number at {place} in {value}"))
}

#[test]
fn a_single_run_has_the_figures_that_need_no_scatter_and_no_others() {
    let folder = folder(&data(1, 1.0 + 1e-4, None));
    let figures = truestage(folder.path(), &["iso230", "data.csv"]).with_code(0);
    // From -0.49 at the zero to 6.51 at 60 mm; 1 apart.
    assert!((um(&figures, "/systematic_deviation/bidirectional") - 7.0).abs() < 1e-3);
    assert!((um(&figures, "/reversal_value") - 1.0).abs() < 1e-3);
    for absent in ["accuracy", "repeatability"] {
        assert_eq!(figures.get(absent), None, "{figures}");
    }
    assert!(text(&figures["not_stated"]).contains("only once"), "{figures}");
    assert_eq!(figures["conforms_to_iso_230_2"], false);
}

/// Whatever a spreadsheet makes of the file, and from wherever it comes.
#[test]
fn the_same_data_give_the_same_figures_from_a_pipe_and_from_any_spreadsheet() {
    let plain = data(3, 1.0 + 1e-4, None);
    let folder = folder(&plain);
    let expected = truestage(folder.path(), &["iso230", "data.csv"]).with_code(0);
    let wide: Vec<u8> = plain.encode_utf16().flat_map(u16::to_le_bytes).collect();
    let marked = [
        ["\u{feff}".as_bytes(), plain.as_bytes()].concat(),
        ["\u{feff}# by hand\n".as_bytes(), plain.as_bytes()].concat(),
        [&[0xFF, 0xFE], &wide[..]].concat(),
    ];
    for bytes in marked {
        let path = folder.path().join("marked.csv");
        fs::write(&path, bytes).expect("there is room");
        let input = fs::File::open(&path).expect("it was written");
        for (words, input) in [
            (["iso230", "marked.csv"], Stdio::null()),
            (["iso230", "-"], input.into()),
        ] {
            let mut command = Command::new(program("truestage"));
            let command = command.arg("--json").args(words).current_dir(folder.path());
            let seen = Process::start_at(command, input).end().with_code(0);
            assert_eq!(seen, expected, "{words:?}");
        }
    }
    fs::write(folder.path().join("data.csv"), b"run,approach\n1,\xB5").expect("there is room");
    let refused = truestage(folder.path(), &["iso230", "data.csv"]).with_code(2);
    check_error(&refused, &["data.csv", "line 2 is not UTF-8", "save the file as CSV"]);
}

/// Whoever names µm as mm has all numbers a thousand times too large, and they agree with one another.
#[test]
fn both_columns_in_a_wrong_unit_are_no_stage() {
    let rows = |per_mm: f64| {
        let mut text = "\u{feff}# by hand\nrun,approach,target_mm,measured_mm\n".to_owned();
        for run in 1..=2 {
            for at in 0..=20 {
                let target = 3.0 * f64::from(at);
                let measured = target + 0.01 * (target / 6.0).sin();
                text += &format!("{run},+,{:.6},{:.6}\n", target * per_mm, measured * per_mm);
            }
        }
        text
    };
    let folder = folder(&rows(1000.0));
    for words in [&["iso230", "data.csv"][..], &["fit", "linear", "data.csv"]] {
        let refused = truestage(folder.path(), words).with_code(2);
        let parts = ["data.csv:12:18: ", "expected deviations within 5 mm", "to mm"];
        check_error(&refused, &parts);
    }
    fs::write(folder.path().join("data.csv"), rows(1.0)).expect("there is room");
    truestage(folder.path(), &["iso230", "data.csv"]).with_code(0);
    // What is only doubtful is said, unless somebody wants to hear of errors alone.
    fs::write(folder.path().join("data.csv"), rows(200.0)).expect("there is room");
    let said = |words: &[&str]| truestage(folder.path(), words).said;
    let usual = said(&["iso230", "data.csv"]);
    assert!(usual.contains("warning: data.csv: its places lie 12 m apart"), "{usual}");
    assert_eq!(said(&["iso230", "data.csv", "--quiet"]), "");
}

fn saved(folder: &Path, words: &[&str]) -> serde_json::Value {
    let fit = ["fit", "linear", "data.csv", "--save", "machine.toml"];
    truestage(folder, &[&fit, words].concat()).with_code(0)
}

#[test]
fn a_table_that_is_stored_has_a_budget_where_its_instrument_is_named() {
    let folder = folder(&data(3, 1.0 + 1e-4, None));
    assert!(saved(folder.path(), &[])["uncertainty"].is_null());
    let stored = saved(folder.path(), &["--instrument", "laser"]);
    let lines = &stored["uncertainty"]["contributions"];
    let lines = lines.as_array().expect("a list of contributions");
    let named = |name: &str| lines.iter().any(|it| it["name"] == name);
    for name in ["instrument", "run to run", "datum", "drift", "curve between positions"] {
        assert!(named(name), "{name}: {lines:?}");
    }
    let id = text(&stored["calibration"]);
    let shown = truestage(folder.path(), &["cal", "show", "machine.toml", id]).with_code(0);
    assert!(shown.to_string().contains("run to run"), "{shown}");
    let wrong = saved_wrongly(folder.path(), &["--instrument", "ruler"]);
    check_error(&wrong, &["no [instrument.ruler]", "laser"]);
}

fn saved_wrongly(folder: &Path, words: &[&str]) -> serde_json::Value {
    let fit = ["fit", "linear", "data.csv", "--save", "machine.toml"];
    truestage(folder, &[&fit, words].concat()).with_code(2)
}

/// Air of 0.27 per mille, and a stage of 24 °C that is 46 ppm longer than at 20 °C.
#[test]
fn readings_are_corrected_by_the_environment_beside_them_or_the_file_is_refused() {
    let vacuum = 1.000_271_373 * (1.0 + 11.5e-6 * 4.0);
    let folder = folder(&data(2, vacuum, Some("20,1013.25,50,24")));
    for words in [["iso230", "data.csv"].as_slice(), &["fit", "linear", "data.csv"]] {
        let refused = truestage(folder.path(), words).with_code(2);
        check_error(&refused, &["nothing says what to correct by it", "--instrument NAME"]);
        let alone = truestage(folder.path(), &[words, &["--instrument", "laser"]].concat());
        check_error(&alone.with_code(2), &["add --config CONFIG"]);
    }
    let with = ["iso230", "data.csv", "--instrument", "laser", "--config", "machine.toml"];
    let figures = truestage(folder.path(), &with).with_code(0);
    let off = um(&figures, "/systematic_deviation/forward");
    assert!(off < 0.01, "{off} um are left of 19: {figures}");
}
