//! What is in use is not changed under somebody who measures with it.

use std::fs;

use machine::records::{CalibrationRecord, Lease};
use tests::{LINEAR, UVW};
use truestage::linear::LinearContent;

use crate::programs::{check_error, text, truestage};

/// A calibration of a linear axis.
fn golden() -> CalibrationRecord<LinearContent> {
    let text = include_str!("../../controller/golden/linear.json");
    serde_json::from_str(text).expect("it is one")
}

/// Two runs of three positions, from both sides.
fn data(deviation_mm: f64) -> String {
    let mut text = "run,approach,target_mm,measured_mm\n".to_owned();
    for run in 1..=2 {
        for (approach, targets) in [("+", [0.0, 30.0, 60.0]), ("-", [60.0, 30.0, 0.0])] {
            for target in targets {
                let measured = target + deviation_mm * target;
                text += &format!("{run},{approach},{target},{measured:.7}\n");
            }
        }
    }
    text
}

#[test]
fn calibrations_are_listed_by_their_age_and_the_only_axis_need_not_be_named() {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let here = folder.path();
    fs::write(here.join("machine.toml"), LINEAR.machine).expect("there is room");
    let refused = [
        &["cal", "rollback", "machine.toml"][..],
        &["cal", "activate", "machine.toml", "0123"],
    ];
    for words in refused {
        truestage(here, words).with_code(2);
        assert!(!here.join("machine-data").exists(), "{words:?}");
    }
    let store = truestage::for_tests::store_in(&here.join("machine-data"), "linear");
    // Names are hashes: of five the order by age is the order by name hardly ever.
    for day in [3, 1, 5, 2, 4] {
        let mut record = golden();
        record.head.created = format!("2026-01-0{day}T00:00:00Z");
        store.save(&record).expect("there is room");
    }
    let listed = truestage(here, &["cal", "list", "machine.toml"]).with_code(0);
    let listed = listed["calibrations"].as_array().expect("a list").iter();
    let created: Vec<&str> = listed.map(|it| text(&it["created"])).collect();
    let days = [1, 2, 3, 4, 5].map(|day| format!("2026-01-0{day}T00:00:00Z"));
    assert_eq!(created, days);
    let show = || truestage(here, &["cal", "show", "machine.toml"]);
    check_error(
        &show().with_code(2),
        &["no calibration is in use", "cal list"],
    );
    let ids = store.list().expect("there are some");
    store.activate("x", &ids[0]).expect("there is room");
    assert_eq!(text(&show().with_code(0)["id"]), ids[0]);
    let rolled = truestage(here, &["cal", "rollback", "machine.toml"]).with_code(2);
    check_error(&rolled, &["axis x: no earlier calibration", "cal list"]);
}

#[test]
fn of_several_calibrations_in_use_each_is_named_with_what_uses_it() {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let here = folder.path();
    fs::write(here.join("machine.toml"), UVW.machine).expect("there is room");
    let store = truestage::for_tests::store_in(&here.join("machine-data"), "uvw");
    for (axis, day) in [("u", 1), ("v", 2)] {
        let mut record = golden();
        record.head.axis = axis.into();
        record.head.created = format!("2026-01-0{day}T00:00:00Z");
        let id = store.save(&record).expect("there is room");
        store.activate(axis, &id).expect("there is room");
    }
    let refused = truestage(here, &["cal", "show", "machine.toml"]).with_code(2);
    check_error(
        &refused,
        &[
            "several calibrations are in use: u ",
            ", v ",
            "add the name",
        ],
    );
}

#[test]
fn no_calibration_is_activated_or_rolled_back_while_another_program_has_the_machine() {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let here = folder.path();
    fs::write(here.join("machine.toml"), LINEAR.machine).expect("there is room");
    let ids = [1e-5, 2e-5].map(|slope| {
        fs::write(here.join("data.csv"), data(slope)).expect("there is room");
        let words = ["fit", "linear", "data.csv", "--save", "machine.toml"];
        let fitted = truestage(here, &words).with_code(0);
        text(&fitted["calibration"]).to_owned()
    });
    let [first, second] = &ids;
    let activate = |id: &str| truestage(here, &["cal", "activate", "machine.toml", id]);
    let back = || truestage(here, &["cal", "rollback", "machine.toml", "--axis", "x"]);
    activate(first).with_code(0);
    let store = truestage::for_tests::store_in(&here.join("machine-data"), "linear");
    let verify = Lease::take(&store, "verify").expect("nobody else has it");
    for refused in [activate(second), back()] {
        check_error(
            &refused.with_code(3),
            &["in use by truestage verify, process"],
        );
    }
    let active = || store.active("x").expect("it can be read").current;
    assert_eq!(active().as_ref(), Some(first));
    drop(verify);
    activate(second).with_code(0);
    assert_eq!(active().as_ref(), Some(second));
    back().with_code(0);
    assert_eq!(active().as_ref(), Some(first));
}
