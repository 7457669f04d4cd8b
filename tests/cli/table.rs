//! The cycle of a rotary table in processes of their own: somebody turns the plate meanwhile.

use core::fmt::Debug;
use std::fs;

use machine::records::{ReadJournal, read_journal};
use nix::sys::signal::Signal;
use tests::{Edit, ROTARY, Rig};
use truestage::rotary::PlateLog;

use crate::held::Steps;
use crate::programs::{Bench, live_rigs, number, text};

/// Three placements, and the emulator's hand that turns the plate whenever it was read: the last
/// time to where it is verified.
const OFFSETS: &str = "offsets = [0, 73, 162]";
const HAND: &str = "hand_lines = [73.0, 89.0, 38.5]";

pub(crate) fn bench(rig: Rig) -> Bench {
    let bench = Bench::of(rig, ROTARY, |text| text.edit("hand_lines = []", HAND));
    bench.configure("machine.toml", |text| {
        let text = text.edit("placements = 4 ", &format!("{OFFSETS} "));
        let text = text.edit("amplification_limit = 3.0", "amplification_limit = 5.0");
        text.edit("optimise = ", "# ")
    });
    bench
}

/// The one journal of a calibration, as far as it is written.
fn journal(bench: &Bench) -> Option<ReadJournal<PlateLog>> {
    let runs = fs::read_dir(bench.records().join("runs")).ok()?;
    let paths = runs.map(|it| it.expect("a folder can be read").path());
    let mut paths = paths.filter(|path| path.to_string_lossy().contains("-calibrate-"));
    read_journal::<PlateLog>(&paths.next()?).ok()
}

fn of_the_first(journal: &ReadJournal<PlateLog>) -> Vec<impl PartialEq + Debug + use<>> {
    let sweeps = journal.log.sweeps.iter();
    sweeps.filter(|it| it.offset == 0.0).cloned().collect()
}

#[test]
fn a_table_goes_through_its_cycle_from_process_to_process_and_outlives_one_that_is_killed() {
    for rig in live_rigs() {
        let bench = bench(rig);
        let zero = bench.run(&["zero"]).with_code(0);
        assert_eq!(zero["axis"], "c");
        refuses_without_a_person(&bench);

        let mut process = bench.start(&["calibrate", "--yes"]);
        let mut time = Steps::of(&bench);
        time.until(&mut process, || {
            journal(&bench).is_some_and(|read| read.log.placements.len() == 1)
        });
        process.signal(Signal::SIGKILL);
        drop(time);
        assert_eq!(process.end().code, None);
        let before = journal(&bench).expect("whole placements are kept");
        assert!(!before.complete);

        let resumed = bench.run(&["calibrate", "--resume", "--yes"]).that_told();
        assert!(resumed.said.contains("placement 2 of 3"), "{resumed:?}");
        assert!(!resumed.said.contains("placement 1 of 3"), "{resumed:?}");
        let calibrated = resumed.with_code(0);
        let after = journal(&bench).expect("it is the same journal");
        assert!(after.complete && after.log.placements.len() == 3);
        assert_eq!(of_the_first(&after), of_the_first(&before));
        assert_eq!(calibrated["offsets"], serde_json::json!([0, 73, 162]));
        let id = text(&calibrated["calibration"]);
        is_shown(&bench, id);
        is_fitted_again(&bench, id, text(&calibrated["journal"]));

        let verified = bench.run(&["verify", "--yes"]).with_code(0);
        assert!(number(&verified["as_found"]["largest_arcsec"]) > 8.0);
        assert!(number(&verified["as_left"]["largest_arcsec"]) < 0.3);
        for run in [&verified["journal"], &calibrated["journal"]] {
            let page = bench.run(&["report", text(run), "--output", "page.html"]);
            page.with_code(0);
            let page = fs::read_to_string(bench.folder().join("page.html")).unwrap();
            assert!(page.contains("<svg"), "a report has pictures");
        }
        moves(&bench, id);
    }
}

/// What `fit` makes of the journal is what the calibration has made of it.
fn is_fitted_again(bench: &Bench, id: &str, journal: &str) {
    let fitted = bench.run_plainly(&["fit", "rotary", journal, "--amplification-limit", "5"]);
    let fitted = fitted.with_code(0);
    let shown = bench
        .run_plainly(&["cal", "show", "machine.toml", id])
        .with_code(0);
    let of = |list: &serde_json::Value| -> Vec<f64> {
        list.as_array()
            .expect("a list")
            .iter()
            .map(number)
            .collect()
    };
    let stored = of(&shown["record"]["table_error_rad"]);
    let again = of(&fitted["table_error_arcsec"]);
    assert_eq!((again.len(), stored.len()), (360, 360));
    for (again, stored) in again.iter().zip(stored) {
        let stored = stored.to_degrees() * 3600.0;
        assert!((again - stored).abs() < 1e-6, "{again}, stored {stored}");
    }
    let saved = bench.run_plainly(&[
        "fit",
        "rotary",
        journal,
        "--amplification-limit",
        "5",
        "--save",
        "machine.toml",
    ]);
    let saved = saved.with_code(0);
    let shown = bench.run_plainly(&["cal", "show", "machine.toml", text(&saved["calibration"])]);
    let instrument = &shown.with_code(0)["record"]["instrument"];
    assert!(
        instrument["name"].to_string().contains("GP-360"),
        "{instrument}"
    );
    let refused = bench.run_plainly(&["fit", "rotary", journal, "--lines", "360"]);
    assert!(
        refused.said.contains("a journal has its own"),
        "{refused:?}"
    );
    assert_eq!(refused.code, Some(2));
}

/// Nobody is there to turn the plate: nothing moves, nothing is written.
fn refuses_without_a_person(bench: &Bench) {
    for verb in ["calibrate", "verify"] {
        let refused = bench.run(&[verb, "--hand", "ask"]).with_code(2);
        let error = text(&refused["error"]);
        assert!(
            error.contains("turn the plate") && error.contains("--yes"),
            "{error}"
        );
    }
    assert!(journal(bench).is_none());
}

fn is_shown(bench: &Bench, id: &str) {
    let list = bench.run(&["cal", "list"]).with_code(0);
    let listed = &list["calibrations"][0];
    assert_eq!(
        (&listed["id"], &listed["kind"]),
        (&id.into(), &"rotary_error_table".into())
    );
    assert_eq!(listed["active"], true);
    let shown = bench
        .run(&["cal", "show", "machine.toml", &id[..8]])
        .with_code(0);
    assert_eq!(shown["record"]["lines"], 360);
    assert_eq!(shown["record"]["instrument"]["name"], "GP-360-0001");
    let active = bench.run(&["cal", "activate", "machine.toml", &id[..8]]);
    active.with_code(0);
}

fn moves(bench: &Bench, id: &str) {
    let far = ["move", "machine.toml", "c=770.5deg", "--way", "turns"];
    let moved = bench.run(&far).with_code(0);
    let it = &moved["moves"][0];
    assert_eq!((&it["axis"], &it["calibration"]), (&"c".into(), &id.into()));
    assert!((number(&it["target_deg"]) - 770.5).abs() < 1e-9);
    assert!((number(&it["expected_deg"]) - 770.5).abs() * 3600.0 < 0.3);
    let corrected = (number(&it["set_point_deg"]) - 770.5) * 3600.0;
    assert!(corrected != 0.0 && corrected.abs() < 15.0, "{corrected}");
    for words in [
        ["c=90", "--way=turns"],
        ["x=90deg", "--way=turns"],
        ["c=1mm", "--way=turns"],
    ] {
        bench
            .run(&["move", "machine.toml", words[0], words[1]])
            .with_code(2);
    }
}

/// The hand of the emulated machine turns the plate and reads its lines; a person would type the same.
#[test]
fn a_plate_is_read_through_a_microscope_at_each_line_that_the_table_is_driven_to() {
    for rig in live_rigs() {
        let bench = Bench::of(rig, ROTARY, |text| {
            text.edit("lines = 360", "lines = 24")
                .edit("    { order = 18, amplitude_arcsec = 0.3 },\n", "")
                .edit("    { order = 36, amplitude_arcsec = 0.4 },\n", "")
                .edit("    { order = 72, amplitude_arcsec = 0.2 },\n", "")
        });
        bench.configure("machine.toml", |text| {
            text.edit(
                "[rotary.c.line_detector]       # at the drive's touch probe 1\nedge = \"positive\"",
                "[rotary.c.sighting]\nvalue = \"to_line\"\nrange_arcsec = 200.0",
            )
            .edit("lines = 360", "lines = 24")
            .edit("closure_limit_arcsec = 0.1 ", "closure_limit_arcsec = 0.15 ")
            .edit("offset_lines = 200.5", "offset_lines = 12.5")
        });
        let refused = bench.run(&["calibrate", "--yes"]).with_code(2);
        let error = text(&refused["error"]);
        assert!(error.contains("a person reads the lines"), "{error}");
        let calibrated = bench.run(&["calibrate"]);
        for says in [
            "line 0 lies under the cross-hair at the table's angle 0.0000°",
            "pass 1+, line 0 at 0.0000° (0 of 72 read)",
            "pass 1-, line 23 at 345.0000° (24 of 72 read)",
            "the placement at offset 0 is read: the plate moved by",
        ] {
            assert!(calibrated.said.contains(says), "`{says}`: {calibrated:?}");
        }
        let calibrated = calibrated.with_code(0);
        let log = journal(&bench).expect("it was written").log;
        assert_eq!((log.placements.len(), log.sweeps.len()), (4, 12));
        let verified = bench.run(&["verify"]).with_code(0);
        assert!(number(&verified["as_found"]["largest_arcsec"]) > 5.0);
        assert!(number(&verified["as_left"]["largest_arcsec"]) < 0.3);
        let page = [
            "report",
            text(&calibrated["journal"]),
            "--output",
            "page.html",
        ];
        bench.run(&page).with_code(0);
        let page = fs::read_to_string(bench.folder().join("page.html")).unwrap();
        assert!(page.contains("by a person, with the table at each line's nominal angle"));
    }
}

/// Two placements have nothing left over by which a plate that was turned wrongly would show: its verification tells.
#[test]
fn a_calibration_that_is_verified_at_once_is_used_if_it_is_good_and_not_if_it_is_worse() {
    // The second time by a line the wrong way; it is verified where it should lie.
    const TURNS: &str = "hand_lines = [1.0, 199.5, -200.5, -1.0, 201.5]";
    for rig in live_rigs() {
        let bench = Bench::of(rig, ROTARY, |text| text.edit("hand_lines = []", TURNS));
        bench.configure("machine.toml", |text| {
            text.edit("placements = 4 ", "offsets = [0, 1] ")
                .edit("optimise = ", "# ")
                .edit("amplification_limit = 3.0", "amplification_limit = 100.0")
                .edit("tolerance_arcsec = 0.3", "tolerance_arcsec = 3.0")
        });
        let words = ["calibrate", "--verify", "--yes"];
        let good = bench.run(&words).with_code(0);
        assert_eq!(good["verified"]["within_tolerance"], true, "{good}");
        let bad = bench.run(&words).with_code(5);
        let told = text(&bad["error"]);
        let id = text(&good["calibration"]);
        for word in ["MAKES THE TABLE WORSE", "turned the other way", &id[..12]] {
            assert!(told.contains(word), "`{word}` is not in: {told}");
        }
        let list = bench.run(&["cal", "list"]).with_code(0);
        let list = list["calibrations"].as_array().expect("a list");
        let used: Vec<_> = list.iter().filter(|it| it["active"] == true).collect();
        assert_eq!((list.len(), used.len()), (2, 1), "{list:?}");
        assert_eq!(used[0]["id"], id);
    }
}
