//! What was measured on a platform, seen from the command line: calibrations and pages.

use std::fs;
use std::path::Path;

use serde_json::Value;
use tests::{Bench, Edit, Rig, UVW, UVW_COPLEY};
use truestage::config;
use truestage::platform::Pose;

use crate::demo;
use crate::programs::{self, check_error, check_says, live_rigs, number, page, truestage};

/// A platform that was calibrated twice, verified before and after, and its runs.
struct Runs {
    bench: Bench,
    found: String,
    calibrated: String,
    left: String,
    zeroed: String,
}

fn runs() -> Runs {
    let mut bench = Bench::of(&UVW, 2, |text| {
        text.edit("step_mm = 0.25", "step_mm = 0.625")
            .edit("poses = 20", "poses = 6")
    });
    let store = bench.store.clone();
    let machine = &mut bench.machine;
    machine.start().unwrap();
    let zeroed = machine.platform().unwrap().zero(&store).unwrap();
    let found = machine.platform().unwrap().verify(&store, false).unwrap();
    machine
        .platform()
        .unwrap()
        .move_to(Pose::default())
        .unwrap();
    machine.platform().unwrap().calibrate(&store).unwrap();
    machine
        .platform()
        .unwrap()
        .move_to(Pose::default())
        .unwrap();
    let calibrated = machine.platform().unwrap().calibrate(&store).unwrap();
    let left = machine.platform().unwrap().verify(&store, true).unwrap();
    machine.shut_down().unwrap();
    let folder = bench.folder.path().display().to_string();
    let text = UVW.machine.edit("machine-data", &folder);
    fs::write(bench.folder.path().join("machine.toml"), text).unwrap();
    let place = |path: &Path| path.display().to_string();
    Runs {
        found: place(&found.journal),
        calibrated: place(&calibrated.journal),
        left: place(&left.journal),
        zeroed: place(&zeroed.journal),
        bench,
    }
}

fn in_use(folder: &Path) -> Vec<(String, String)> {
    let list = truestage(folder, &["cal", "list"]).with_code(0);
    let all = list["calibrations"].as_array().expect("a list").clone();
    let text = |value: &Value| value.as_str().expect("a text").to_owned();
    all.iter()
        .filter(|it| it["active"] == true)
        .map(|it| (text(&it["axis"]), text(&it["id"])))
        .collect()
}

#[test]
fn what_a_platform_measured_is_listed_rolled_back_and_made_into_pages() {
    let runs = runs();
    let folder = runs.bench.folder.path();

    let newest = in_use(folder);
    let axes: Vec<&str> = newest.iter().map(|(axis, _)| axis.as_str()).collect();
    assert_eq!(axes.len(), 3);
    let shown = truestage(folder, &["cal", "show", "machine.toml", &newest[0].1]).with_code(0);
    assert_eq!(shown["record"]["method"], "least_squares");
    let outliers = &shown["record"]["outliers"];
    assert_eq!(outliers, &serde_json::json!([]));

    // All screws go back together; a second time there is nothing to go back to.
    let rollback = ["cal", "rollback", "machine.toml", "--axis"];
    let with = |axis: &'static str| [&rollback[..], &[axis]].concat();
    let back = truestage(folder, &with("platform")).with_code(0);
    let earlier = in_use(folder);
    assert_eq!(earlier.len(), 3);
    for (axis, id) in &earlier {
        assert_eq!(back["active"][axis].as_str(), Some(id.as_str()));
        assert!(newest.iter().all(|(_, other)| other != id));
    }
    truestage(folder, &with("platform")).with_code(2);
    assert_eq!(in_use(folder), earlier);
    let unknown = truestage(folder, &with("z")).with_code(2);
    assert!(
        unknown["error"].to_string().contains("u, v, w"),
        "{unknown}"
    );
    let words = ["cal", "activate", "machine.toml", &newest[1].1];
    let again = truestage(folder, &words).with_code(0);
    assert_eq!(again["active"].as_str(), Some(newest[1].1.as_str()));

    let found = page(folder, &runs.found);
    check_says(
        &found,
        &["Error of each pose as found", "tolerance (µm)", "skew"],
    );
    assert!(!found.contains("as left"));
    let left = page(folder, &runs.left);
    check_says(&left, &["Error of each pose as left", &newest[0].1[..12]]);
    let calibrated = page(folder, &runs.calibrated);
    check_says(
        &calibrated,
        &["closure", "lost motion", "What the model of screw u leaves"],
    );
    for (axis, id) in &newest {
        check_says(&calibrated, &[&format!("<h2>Screw {axis}</h2>"), &id[..12]]);
    }
    check_says(&page(folder, &runs.zeroed), &["<h2>Zero</h2>"]);
    is_fitted_again(folder, &runs, &newest);
}

/// What `fit` makes of the journal is what the calibration has made of it, but for what the camera does not repeat, which the
/// strokes alone do not tell.
fn is_fitted_again(folder: &Path, runs: &Runs, newest: &[(String, String)]) {
    let words = ["fit", "screw", &runs.calibrated, "--lead-mm", "2"];
    let fitted = truestage(folder, &words).with_code(0);
    for (axis, id) in newest {
        let shown = truestage(folder, &["cal", "show", "machine.toml", id]).with_code(0);
        let stored = &shown["record"];
        let fitted = &fitted["axes"][axis];
        for (seen, key, per_si) in [
            ("slope_um_per_mm", "slope_m_per_m", 1e3),
            ("lost_motion_um", "lost_motion_m", 1e6),
        ] {
            let (again, stored) = (number(&fitted[seen]), number(&stored[key]) * per_si);
            assert!(
                (again - stored).abs() < 0.05,
                "{axis} {seen}: {again}, stored {stored}"
            );
        }
    }
    let no_strokes = truestage(folder, &["fit", "screw", &runs.zeroed]);
    assert_eq!(no_strokes.code, Some(2), "{no_strokes:?}");
    assert!(
        no_strokes.said.contains("a platform's `calibrate`"),
        "{no_strokes:?}"
    );
}

#[test]
fn a_page_of_a_journal_that_was_taken_elsewhere_shows_its_strokes_without_models() {
    let runs = runs();
    let elsewhere = tempfile::tempdir().unwrap();
    let copy = elsewhere.path().join("run.jsonl");
    fs::copy(&runs.calibrated, &copy).unwrap();
    let html = page(elsewhere.path(), &copy.display().to_string());
    check_says(
        &html,
        &[
            "Deviation of screw w",
            "No calibration was made from this run",
        ],
    );
}

#[test]
fn the_platform_shows_its_cycle() {
    let left = [
        "/as_left/largest_um",
        "/as_left_after_power_cycle/largest_um",
    ];
    demo::check("uvw", "/as_found/largest_um", left, 2.0);
}

/// Two machines are shown: what the second one stores is none of the first one's business.
#[test]
fn both_platforms_shown_in_one_folder_keep_their_calibrations() {
    if !live_rigs().any(|rig| rig == Rig::Pty) {
        return;
    }
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let words = ["demo", "--data-dir", ".", "--machine"];
    // How one on CAN is shown through terminals is another test's.
    for machine in [&["uvw", "--in-process"][..], &["uvw-copley"]] {
        truestage(folder.path(), &[&words[..], machine].concat()).with_code(0);
    }
    for shipped in [&UVW, &UVW_COPLEY] {
        let here = format!("data_dir = {:?}", folder.path());
        let text = shipped
            .machine
            .to_owned()
            .edit("data_dir = \"machine-data\"", &here);
        let machine = config::parse(&text, "machine.toml");
        let machine = machine.unwrap_or_else(|error| panic!("{error}"));
        let machine = machine.config.machine;
        let store = machine.store();
        for screw in ["u", "v", "w"] {
            let active = store.active(screw).expect("it can be read").current;
            let id = active.unwrap_or_else(|| panic!("{}: {screw} has none", machine.name));
            let head = store.glance(&id).expect("it is whole").head;
            assert_eq!(
                (head.machine, head.stage_serial),
                (machine.name.clone(), machine.stage_serial.clone())
            );
        }
    }
}

/// Whoever names only x does not move y.
#[test]
fn what_nobody_names_stays_where_it_is() {
    for rig in live_rigs() {
        let bench = programs::Bench::of(rig, UVW, |text| text);
        let unasked = [
            "move",
            "machine.toml",
            "x=0.5mm",
            "y=0.3mm",
            "theta=60arcsec",
        ];
        let refused = bench.run(&unasked).with_code(3);
        check_error(&refused, &["(u, v, w)", "--uncompensated"]);
        bench
            .run(&[&unasked[..], &["--uncompensated"]].concat())
            .with_code(0);
        let one = ["move", "machine.toml", "x=-0.2mm", "--uncompensated"];
        let moved = bench.run(&one).with_code(0);
        assert_eq!(moved["unnamed"], serde_json::json!(["y", "theta"]));
        // The screws go by their encoders alone, to where the camera saw the platform.
        for place in ["target", "seen"] {
            let at = |name: &str| number(&moved[place][name]);
            assert!((at("x_mm") + 0.2).abs() < 0.05, "{moved}");
            assert!((at("y_mm") - 0.3).abs() < 0.05, "{moved}");
            assert!((at("theta_arcsec") - 60.0).abs() < 20.0, "{moved}");
        }
        assert_eq!(bench.stop(), Some(0));
    }
}
