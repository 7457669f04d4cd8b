//! Each verb in a process of its own, one after the other, and what goes wrong.

use std::fs;

use serde_json::Value;

use crate::programs::{Bench, check_error, check_says, live_rigs, truestage};
use tests::Edit;

fn number(value: &Value) -> f64 {
    value
        .as_f64()
        .unwrap_or_else(|| panic!("{value} is no number"))
}

fn text(value: &Value) -> &str {
    value
        .as_str()
        .unwrap_or_else(|| panic!("{value} is no text"))
}

/// What was found is who the file that is made of it expects.
fn begins_a_file(bench: &Bench, scan: &Value) {
    let found = scan.to_string();
    fs::write(bench.folder().join("found.json"), found).expect("a file can be written");
    let words = [
        "new",
        "new.toml",
        "--machine",
        "linear",
        "--found",
        "found.json",
    ];
    let made = bench.run_plainly(&words).with_code(0);
    let left = made["to_fill_in"].to_string();
    assert!(
        left.contains("soft_min_mm") && !left.contains("identity"),
        "{left}"
    );
    let again = bench.run(&["scan", "new.toml"]).with_code(0);
    assert_eq!(again["matches"], true);
}

#[test]
fn the_verbs_take_a_stage_through_its_cycle_from_process_to_process() {
    for rig in live_rigs() {
        let bench = Bench::new(rig);
        let doctor = bench.run(&["doctor"]).with_code(0);
        assert_eq!(doctor["sound"], true, "{doctor:#}");
        let scan = bench.run(&["scan"]).with_code(0);
        assert_eq!(scan["matches"], true);
        assert!(scan["devices"].as_array().is_some_and(|it| it.len() >= 2));
        begins_a_file(&bench, &scan);

        let zero = bench.run(&["zero"]).with_code(0);
        assert_eq!(zero["axis"], "x");

        let calibrated = bench.run(&["calibrate", "--verify"]).that_told();
        let calibrated = calibrated.with_code(0);
        assert_eq!(calibrated["verified"]["within_tolerance"], true);
        let id = text(&calibrated["calibration"]);
        assert!(bench.folder().join(text(&calibrated["path"])).exists());
        let list = bench.run(&["cal", "list"]).with_code(0);
        assert_eq!(list["calibrations"][0]["id"], id);
        assert_eq!(list["calibrations"][0]["active"], true);

        // Another one, to compare with: the first stays in use.
        let aside = bench.run(&["calibrate", "--no-activate"]).with_code(0);
        assert_eq!(aside["active"], false);
        let words = [
            "cal",
            "diff",
            "machine.toml",
            id,
            text(&aside["calibration"]),
            "--page",
            "diff.html",
        ];
        bench.run_plainly(&words).with_code(0);
        let page = fs::read_to_string(bench.folder().join("diff.html")).unwrap();
        check_says(&page, &["Error tables: change", "<svg", "Δ forward"]);

        let verified = bench.run(&["verify"]).with_code(0);
        let accuracy = number(&verified["as_left"]["accuracy"]["bidirectional"]);
        assert!((0.0..=2.0).contains(&accuracy), "A = {accuracy} µm");
        evaluated_again(&bench, &calibrated, &verified);

        reported(&bench, &calibrated, &verified);

        let moved = ["move", "machine.toml", "x=12.5mm", "--record", "move.log"];
        let moved = bench.run(&moved).with_code(0);
        assert_eq!(moved["moves"][0]["calibration"], id);
        let correction = number(&moved["moves"][0]["set_point_mm"]) - 12.5;
        assert!(
            correction != 0.0 && correction.abs() < 0.05,
            "{correction} mm"
        );
        let log = fs::read_to_string(bench.folder().join("move.log")).unwrap();
        assert!(log.starts_with("# truestage recording 1\n"));
        assert!(log.lines().any(|line| line.contains(" can0 601#")));
        goes_unasked_nowhere(&bench);
        out_of_tolerance(&bench);
        assert_eq!(bench.stop(), Some(0));
    }
}

/// The verification on a page, its pictures by themselves, and beside the calibration.
fn reported(bench: &Bench, calibrated: &Value, verified: &Value) {
    let journal = text(&verified["journal"]);
    let words = ["report", journal, "--output", "page.html", "--svg", "drawn"];
    let report = bench.run(&words).with_code(0);
    let page = fs::read_to_string(bench.folder().join("page.html")).unwrap();
    let pictures = report["pictures"].as_array().expect("a list");
    assert!(!pictures.is_empty() && page.matches("<svg").count() == pictures.len());
    for it in pictures {
        let svg = fs::read_to_string(bench.folder().join(text(it))).unwrap();
        assert!(svg.starts_with("<svg xmlns"), "{svg}");
    }
    let words = ["report", "--compare", text(&calibrated["journal"]), journal];
    let compared = bench.run(&words).with_code(0);
    let accuracy = &compared["figures"][0];
    assert_eq!(
        accuracy["second"],
        verified["as_left"]["accuracy"]["bidirectional"]
    );
}

/// The journals of runs, by the verbs for data measured elsewhere.
fn evaluated_again(bench: &Bench, calibrated: &Value, verified: &Value) {
    let words = ["iso230", text(&verified["journal"])];
    let again = truestage(bench.folder(), &words).with_code(0);
    assert_eq!(again["accuracy"], verified["as_left"]["accuracy"]);
    let journal = text(&calibrated["journal"]);
    let fitted = truestage(bench.folder(), &["fit", "linear", journal]).with_code(0);
    // The table without what the budget adds to its uncertainties.
    let deviations = |of: &Value| -> Vec<Value> {
        let nodes = of["nodes"].as_array().expect("a table has nodes");
        nodes.iter().map(|it| it["deviation_um"].clone()).collect()
    };
    assert_eq!(deviations(&fitted), deviations(&calibrated["fit"]));
    let words = [
        "iso230",
        journal,
        "--instrument",
        "laser",
        "--config",
        "machine.toml",
    ];
    let refused = truestage(bench.folder(), &words).with_code(2);
    check_error(&refused, &["is a journal", "leave it out"]);
}

#[test]
fn what_is_wrong_is_told_by_exit_code_and_in_one_object() {
    for rig in live_rigs() {
        let bench = Bench::new(rig);
        refuses_before_any_bus(&bench);
        refuses_on_the_bus(&bench);
    }
}

fn refuses_before_any_bus(bench: &Bench) {
    bench.configure("wrong.toml", |text| {
        text.edit("step_mm = 3.0", "step_mm = -3.0")
    });
    let checked = bench.run(&["check", "wrong.toml"]);
    assert!(checked.said.contains("wrong.toml:"), "{checked:?}");
    let error = checked.with_code(2);
    assert_eq!(error["exit_code"], 2);
    assert!(text(&error["error"]).contains("step_mm"), "{error}");

    bench.run(&["move", "machine.toml", "x=12.5"]).with_code(2);
    let far = bench.run(&["move", "machine.toml", "x=500mm"]).with_code(3);
    assert!(text(&far["error"]).contains("soft limits"), "{far}");
    let unasked = bench
        .run(&["move", "machine.toml", "x=12.5mm"])
        .with_code(3);
    assert!(
        text(&unasked["error"]).contains("--uncompensated"),
        "{unasked}"
    );
    let none = bench.run(&["cal", "rollback", "machine.toml", "--axis", "x"]);
    assert_eq!(none.with_code(2)["exit_code"], 2);
}

fn refuses_on_the_bus(bench: &Bench) {
    let other = |text: String| text.edit("product_code = 0x00420001", "product_code = 0x00420009");
    bench.configure("other.toml", other);
    let scan = bench.run(&["scan", "other.toml"]).with_code(4);
    assert_eq!(
        (&scan["matches"], &scan["exit_code"]),
        (&Value::Bool(false), &4.into())
    );
}

/// What was not measured is not trusted without a word.
fn goes_unasked_nowhere(bench: &Bench) {
    let beyond = ["move", "machine.toml", "x=62.5mm"];
    let refused = bench.run(&beyond).with_code(3);
    assert!(text(&refused["error"]).contains("--beyond"), "{refused}");
    let agreed = [&beyond[..], &["--beyond"]].concat();
    let moved = bench.run(&agreed).with_code(0);
    let said = text(&moved["moves"][0]["warning"]);
    assert!(said.contains("BEYOND THE CALIBRATED RANGE"), "{moved}");
    let alone = ["move", "machine.toml", "x=12.5mm", "--uncompensated"];
    let moved = bench.run(&alone).with_code(0);
    let one = &moved["moves"][0];
    assert_eq!(
        (&one["corrected"], &one["calibration"]),
        (&"no".into(), &Value::Null)
    );
    assert_eq!(one["set_point_mm"], one["target_mm"]);
}

/// A bad result is a result: the figures are there, and why they are bad.
fn out_of_tolerance(bench: &Bench) {
    bench.configure("strict.toml", |text| {
        text.edit(
            "accuracy_tolerance_um = 2.0",
            "accuracy_tolerance_um = 0.01",
        )
    });
    let verified = bench.run(&["verify", "strict.toml"]).with_code(5);
    assert_eq!(verified["within_tolerance"], false);
    assert_eq!(verified["exit_code"], 5);
    assert!(number(&verified["as_left"]["accuracy"]["bidirectional"]) > 0.01);
}

#[test]
fn a_port_that_is_not_there_is_named() {
    for rig in live_rigs() {
        let bench = Bench::new(rig);
        for endpoint in ["can0=slcan:nowhere", "can0=socketcan:nocan9"] {
            let (_, place) = endpoint.split_once(':').expect("KIND:PLACE");
            let failed = bench.run_plainly(&["scan", "machine.toml", "--port", endpoint]);
            let error = failed.with_code(4);
            assert!(text(&error["error"]).contains(place), "{error}");
        }
    }
}
