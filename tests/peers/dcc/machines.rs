//! Certificates of what is made of several numbers: screws of platforms, and three axes.

use std::fs;
use std::path::{Path, PathBuf};

use compensator::volumetric::online::StateMap;
use machine::records::CalibrationRecord;
use serde_json::{Value, json};
use tests::{Edit, UVW, VOLUMETRIC, random};
use truestage::for_tests::store_in;
use truestage::platform::ScrewContent;
use truestage::volumetric::{GeometryContent, MemoryName, StateMemoryContent};

use super::{BROKEN, ISSUER, can_judge, ended, schema, truestage};
use crate::peer::Peer;

const CERTIFICATES: u64 = 8;

/// The certificate of calibration `id`, in a file called `name`.
fn exported(folder: &Path, id: &str, name: &str) -> PathBuf {
    let words = [
        "cal",
        "export",
        "machine.toml",
        id,
        "--format",
        "dcc",
        "--out",
        name,
    ];
    truestage(folder, &[&words[..], &ISSUER].concat());
    folder.join(name)
}

/// What the judge says of each; of every one, broken in some way, that it is not valid.
fn judged(paths: &[PathBuf]) -> Vec<Value> {
    let schema = schema("3.3.0").expect("it is there");
    let broken = paths.iter().enumerate().map(|(at, path)| {
        // What both kinds of certificates have.
        let (from, to) = BROKEN[at % 6];
        let text = fs::read_to_string(path).expect("it was written");
        let broken = path.with_extension("broken.xml");
        fs::write(&broken, text.edit_first(from, to)).expect("there is room");
        broken
    });
    let all: Vec<PathBuf> = paths.iter().cloned().chain(broken).collect();
    let lines = all.iter().map(|it| format!("{}\n", it.display()));
    let mut judge = Peer::start("dcc.py", &[&schema.display().to_string()]);
    judge.feed(&lines.collect::<String>());
    let reports: Vec<Value> = all.iter().map(|_| judge.report()).collect();
    for (at, (report, path)) in reports.iter().zip(&all).enumerate() {
        let wanted = at < paths.len();
        assert_eq!(report["valid"], wanted, "{}: {report}", path.display());
    }
    for report in &reports[..paths.len()] {
        let said = report["statements"][0].to_string();
        assert!(
            said.contains("In-house") && said.contains("not accredited"),
            "{said}"
        );
    }
    reports[..paths.len()].to_vec()
}

/// Strokes of a screw of a lead of 2 mm with errors and noise of their own.
fn strokes(state: &mut u64) -> String {
    let mut text = "axis,approach,stroke_um,deviation_um\n".to_owned();
    let mut drawn = |size: f64| size * (2.0 * random(state) - 1.0);
    let (slope, lost, wave) = (drawn(2.0), 2.0 + drawn(1.0), drawn(1.5));
    for (approach, play) in [('+', 0.0), ('-', lost)] {
        for _ in 0..3 {
            for at in 0..21 {
                let mm = -2.5 + 0.25 * f64::from(at);
                let turn = core::f64::consts::TAU * mm / 2.0;
                let um = slope * mm + play + wave * turn.sin() + drawn(0.1);
                text += &format!("u,{approach},{},{um}\n", mm * 1e3);
            }
        }
    }
    text
}

#[test]
fn certificates_of_screws_are_valid_and_say_what_was_stored() {
    if !can_judge("certificates of screws by the DCC schema") {
        return;
    }
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let folder = folder.path();
    fs::write(folder.join("machine.toml"), UVW.machine).expect("there is room");
    let store = store_in(&folder.join("machine-data"), "uvw");
    let make = |seed: u64| {
        let mut state = seed ^ 0x7363_7277;
        fs::write(folder.join("u.csv"), strokes(&mut state)).expect("there is room");
        let fit = [
            "fit",
            "screw",
            "u.csv",
            "--lead-mm",
            "2",
            "--save",
            "machine.toml",
        ];
        let id = truestage(folder, &fit)["axes"]["u"]["calibration"].clone();
        let id = id.as_str().expect("a name");
        let record = store.load::<ScrewContent>(id).expect("it was stored");
        (
            exported(folder, id, &format!("screw-{seed}.xml")),
            record.content,
        )
    };
    let all: Vec<(PathBuf, ScrewContent)> = (1..=CERTIFICATES).map(make).collect();
    let paths: Vec<PathBuf> = all.iter().map(|it| it.0.clone()).collect();
    let mut periodic = 0;
    for (report, (path, content)) in judged(&paths).iter().zip(&all) {
        let parameters = report["single"].as_object().expect("results");
        let [parameters] = parameters.values().collect::<Vec<_>>()[..] else {
            panic!("{}: {report}", path.display())
        };
        check_parameters(parameters, content);
        periodic += content.harmonics.len();
        check_stops(&report["results"], content);
    }
    assert!(periodic > 0, "none has a periodic term");
}

#[track_caller]
fn check_parameters(said: &Value, content: &ScrewContent) {
    let model = content.model();
    let count = 3 + 2 * content.harmonics.len();
    let covariance = content.covariance_si.as_deref().expect("it is known");
    let mut at = 0;
    let mut check = |name: &str, value: f64, unit: &str| {
        assert_eq!(said[name]["value"], value, "{name}: {said}");
        assert_eq!(said[name]["unit"], unit, "{name}");
        let u = said[name]["u"].as_f64().expect("it is stated");
        let stored = covariance[at * count + at].sqrt();
        assert!((u / stored - 1.0).abs() < 1e-12, "{name}: {u} and {stored}");
        at += 1;
    };
    check("offset", content.offset_m, "\\metre");
    check("slope", content.slope_m_per_m, "\\one");
    check("lost motion", content.lost_motion_m, "\\metre");
    for it in &content.harmonics {
        check(
            &format!("sine of number {}", it.number),
            it.sine_m,
            "\\metre",
        );
        check(
            &format!("cosine of number {}", it.number),
            it.cosine_m,
            "\\metre",
        );
    }
    assert_eq!(
        said["lead, nominal"]["value"].as_f64(),
        model.lead.map(units::Metres::value)
    );
}

/// Of both approaches the strokes and uncertainties of the budget, and the deviations that follow from the parameters.
#[track_caller]
fn check_stops(said: &Value, content: &ScrewContent) {
    let budget = content.budget.as_ref().expect("strokes were repeated");
    let lead = content.lead_m.expect("it was given");
    let results = said.as_array().expect("a list");
    assert_eq!(results.len(), 2);
    for (result, (side, lost)) in results
        .iter()
        .zip([('+', 0.0), ('-', content.lost_motion_m)])
    {
        let places: Vec<_> = budget
            .places
            .iter()
            .filter(|it| it.approach == Some(side))
            .collect();
        let strokes: Vec<f64> = places.iter().map(|it| it.at_si[0]).collect();
        let u: Vec<f64> = places.iter().map(|it| it.u_si).collect();
        assert_eq!(result["positions"], json!(strokes));
        assert_eq!(result["uncertainties"], json!(u));
        let deviations = result["deviations"].as_array().expect("numbers");
        assert_eq!(deviations.len(), strokes.len());
        for (stroke, seen) in strokes.iter().zip(deviations) {
            let turn = core::f64::consts::TAU * stroke / lead;
            let wave: f64 = content
                .harmonics
                .iter()
                .map(|it| {
                    let turn = f64::from(it.number) * turn;
                    it.sine_m * turn.sin() + it.cosine_m * turn.cos()
                })
                .sum();
            let wanted = content.offset_m + content.slope_m_per_m * stroke + wave + lost;
            let seen = seen.as_f64().expect("a number");
            assert!(
                (seen - wanted).abs() < 1e-15,
                "{stroke}: {seen} and {wanted}"
            );
        }
    }
}

const GEOMETRY: &str = include_str!("../../../controller/golden/volumetric.json");

/// A calibration of three axes like one that was published, each of its figures another one.
fn geometry(state: &mut u64) -> CalibrationRecord<GeometryContent> {
    let mut record: CalibrationRecord<GeometryContent> =
        serde_json::from_str(GEOMETRY).expect("a golden file is read");
    let mut other = |it: &mut f64| *it *= 0.5 + random(state);
    let content = &mut record.content;
    for function in &mut content.functions {
        function.values_si.iter_mut().for_each(&mut other);
        let u = function
            .standard_uncertainties_si
            .as_mut()
            .expect("it is known");
        u.iter_mut().for_each(&mut other);
        let middles = vec![3e-8; function.positions_m.len() - 1];
        function.between_standard_uncertainties_si = Some(middles);
    }
    content.squareness_rad.iter_mut().for_each(&mut other);
    content.squareness_u_rad.iter_mut().for_each(&mut other);
    content.temperatures_c.iter_mut().for_each(&mut other);
    record
}

#[test]
fn certificates_of_three_axes_are_valid_and_say_what_was_stored() {
    if !can_judge("certificates of three axes by the DCC schema") {
        return;
    }
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let folder = folder.path();
    fs::write(folder.join("machine.toml"), VOLUMETRIC.machine).expect("there is room");
    let store = store_in(&folder.join("machine-data"), "volumetric");
    let make = |seed: u64| {
        let record = geometry(&mut (seed ^ 0x766f_6c75));
        let id = store.save(&record).expect("there is room");
        (exported(folder, &id, &format!("volume-{seed}.xml")), record)
    };
    let all: Vec<_> = (1..=CERTIFICATES).map(make).collect();
    let paths: Vec<PathBuf> = all.iter().map(|it| it.0.clone()).collect();
    for (report, (_, record)) in judged(&paths).iter().zip(&all) {
        check_geometry(report, &record.content);
    }
}

#[track_caller]
fn check_geometry(report: &Value, content: &GeometryContent) {
    let results = report["results"].as_array().expect("a list");
    assert_eq!(results.len(), 2 * content.functions.len());
    for (pair, own) in results.chunks(2).zip(&content.functions) {
        let (said, between) = (&pair[0], &pair[1]);
        let name = said["name"].as_str().expect("a text");
        assert!(name.starts_with(&own.name), "{name}");
        let is_length = own.name.as_bytes()[2] >= b'x';
        let unit = if is_length { "\\metre" } else { "\\radian" };
        assert_eq!(said["units"], json!(["\\metre", unit]), "{name}");
        assert_eq!(said["positions"], json!(own.positions_m), "{name}");
        assert_eq!(said["deviations"], json!(own.values_si), "{name}");
        assert_eq!(
            said["uncertainties"],
            json!(own.standard_uncertainties_si),
            "{name}"
        );
        assert_eq!(
            between["deviations"],
            json!(own.between_standard_uncertainties_si)
        );
    }
    let squareness = &report["single"]["squarenesses"];
    let names = ["y to x", "z to x", "z to y"].map(|it| format!("squareness of {it}"));
    for (at, name) in names.iter().enumerate() {
        assert_eq!(squareness[name]["value"], content.squareness_rad[at]);
        assert_eq!(squareness[name]["u"], content.squareness_u_rad[at]);
    }
    for (it, axis) in content.bends.iter().zip(["x", "y", "z"]) {
        let name = format!(
            "bow of guide {} towards {} for each kelvin",
            it.axis, it.towards
        );
        let said = &report["single"]["what warmth does"][&name];
        assert_eq!(said["value"], it.bow_m_per_k, "{axis}: {report}");
        assert_eq!(said["u"], it.standard_uncertainty_m_per_k);
    }
    let items = report["items"].to_string();
    for drive in &content.drives {
        assert!(items.contains(&format!("\"{}\"", drive.serial)), "{items}");
    }
}

#[test]
fn what_states_no_uncertainty_or_is_no_calibration_gets_no_certificate() {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let folder = folder.path();
    fs::write(folder.join("machine.toml"), VOLUMETRIC.machine).expect("there is room");
    let store = store_in(&folder.join("machine-data"), "volumetric");
    let mut record = geometry(&mut 5);
    record.content.functions[3].standard_uncertainties_si = None;
    record.content.functions[3].between_standard_uncertainties_si = None;
    let id = store.save(&record).expect("there is room");
    let refused = |id: &str, why: &str| {
        let words = ["cal", "export", "machine.toml", id, "--format", "dcc"];
        let ended = ended(folder, &[&words[..], &ISSUER].concat());
        let said = String::from_utf8_lossy(&ended.stderr).into_owned();
        assert_eq!(ended.status.code(), Some(2), "{said}");
        assert!(said.contains(why), "{said}");
    };
    refused(&id, "states the uncertainty of every value");
    let content = StateMemoryContent::new(MemoryName::First, "none", &StateMap::default());
    let mut head = record.head;
    head.axis = "volume-first-memory".into();
    let memory = CalibrationRecord { head, content };
    let id = store.save(&memory).expect("there is room");
    refused(&id, "which certifies nothing");
}
