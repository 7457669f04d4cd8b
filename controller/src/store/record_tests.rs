use machine::records::ConfigHash;

use super::*;
use crate::linear::LinearContent;
use crate::linear::record::NodeRecord;
use crate::platform::record::{HarmonicRecord, StrokeRecord};
use crate::platform::{ScrewContent, ScrewMethodName};
use crate::rotary::RotaryContent;
use crate::rotary::record::ReadingName;
use crate::stores::store_in;

/// Written by the first program, before there were other kinds, and named by its hash then.
const EARLIER: &str = include_str!("earlier_linear.json");
const EARLIER_ID: &str = "9e34c78936a61aa45d4971e6a4bf2e81a7d2b24d48795819cae1e3a5ae244e9d";

fn hash() -> ConfigHash {
    ConfigHash::recorded("h")
}

fn record(serial: &str) -> CalibrationRecord<LinearContent> {
    let node = |position_m| NodeRecord {
        position_m,
        forward_m: Some(1e-6),
        reverse_m: Some(2e-6),
        forward_u_m: Some(1e-8),
        reverse_u_m: Some(1e-8),
    };
    let head = RecordHead {
        schema_version: SCHEMA_VERSION,
        machine: "m".into(),
        stage_serial: serial.into(),
        config_hash: "h".into(),
        axis: "x".into(),
        drive: IdentityRecord {
            vendor: 1,
            serial: 7,
            ..IdentityRecord::default()
        },
        resolution_m: Some(1e-8),
        created: "2026-01-01T00:00:00Z".into(),
        program: "test".into(),
        source: "run".into(),
        ..RecordHead::default()
    };
    let content = LinearContent {
        runs: 3,
        nodes: vec![node(0.0), node(0.003)],
        ..LinearContent::default()
    };
    CalibrationRecord { head, content }
}

fn rotary() -> CalibrationRecord<RotaryContent> {
    let mut head = record("A").head;
    head.resolution_m = None;
    head.resolution_rad = Some(1e-7);
    let content = RotaryContent {
        lines: 3,
        offsets: vec![0, 1],
        table_error_rad: vec![1e-6, -2e-6, 1e-6],
        standard_uncertainty_rad: Some(vec![0.1; 3]),
        plate_error_rad: vec![Some(0.0), None, Some(0.0)],
        plate_phase_rad: Some(0.01),
        reading_noise_rad: None,
        residual_rms_rad: 0.1,
        degrees_of_freedom: 0,
        noise_amplification: 0.7,
        budget: None,
        missing: vec![ReadingName { offset: 1, line: 2 }],
        outliers: vec![],
    };
    CalibrationRecord { head, content }
}

fn screw() -> CalibrationRecord<ScrewContent> {
    let head = record("A").head;
    let content = ScrewContent {
        rows: 54,
        offset_m: 1e-7,
        slope_m_per_m: 6e-4,
        lost_motion_m: 2.29e-6,
        lead_m: Some(2e-3),
        harmonics: vec![HarmonicRecord {
            number: 1,
            sine_m: 3e-7,
            cosine_m: -2e-7,
        }],
        first_stroke_m: 5e-4,
        last_stroke_m: 1.5e-3,
        covariance_si: Some(vec![1e-16; 25]),
        scatter_m: Some(2e-7),
        outliers: vec![StrokeRecord {
            approach: '-',
            stroke_m: 1e-3,
            deviation_m: 9e-5,
        }],
        ..ScrewContent::default()
    };
    CalibrationRecord { head, content }
}

fn store() -> (tempfile::TempDir, Store) {
    let folder = tempfile::tempdir().unwrap();
    let store = store_in(folder.path(), "m");
    (folder, store)
}

#[test]
fn a_calibration_of_the_first_program_is_read_under_its_old_name() {
    let (_folder, store) = store();
    let path = store.calibration_path(EARLIER_ID);
    std::fs::create_dir_all(path.parent().unwrap()).unwrap();
    std::fs::write(path, EARLIER).unwrap();
    assert_eq!(
        store.load::<LinearContent>(EARLIER_ID).unwrap(),
        record("A")
    );
    store.activate("x", EARLIER_ID).unwrap();
    assert_eq!(store.active("x").unwrap().current.unwrap(), EARLIER_ID);
}

#[track_caller]
fn check_stored<C: Content + PartialEq + core::fmt::Debug>(
    stored: &CalibrationRecord<C>,
    kind: &str,
    summary: &str,
) {
    let (_folder, store) = store();
    let id = store.save(stored).unwrap();
    assert_eq!(store.load::<C>(&id).unwrap(), *stored);
    let glance = store.glance(&id).unwrap();
    assert_eq!((glance.kind, &*glance.summary), (kind, summary));
    assert_eq!(glance.head, stored.head);
    let text = String::from_utf8(stored.bytes()).unwrap();
    assert!(text.contains(&format!("\"kind\": \"{kind}\"")), "{text}");
}

#[test]
fn every_kind_is_read_as_it_was_stored_and_says_what_it_is() {
    check_stored(&record("A"), "linear_error_table", "2 positions");
    check_stored(
        &rotary(),
        "rotary_error_table",
        "3 lines, 2 placements, errors up to 0.413 arcsec",
    );
    check_stored(
        &screw(),
        "screw_model",
        "slope +0.600 µm/mm, lost motion 2.290 µm, 1 harmonics, from 54 strokes by least squares",
    );
}

#[test]
fn a_calibration_of_another_kind_is_refused_by_name() {
    let (_folder, store) = store();
    let id = store.save(&rotary()).unwrap();
    let error = store.load::<LinearContent>(&id).unwrap_err();
    assert_eq!(
        error.to_string(),
        format!(
            "calibration {} of axis x is of the kind `rotary_error_table`, but \
             `linear_error_table` is needed here; calibrate the axis again, or roll back to a \
             calibration of that kind",
            short(&id)
        )
    );
    assert!(store.load::<ScrewContent>(&id).is_err());
    assert!(store.load::<RotaryContent>(&id).is_ok());
}

#[test]
fn a_screws_model_comes_back_to_the_last_bit() {
    let mut content = screw().content;
    // What was left out is not part of the model.
    content.outliers.clear();
    let model = content.model();
    assert_eq!(
        ScrewContent::new(&model, ScrewMethodName::LeastSquares, 54),
        content
    );
}

#[track_caller]
fn check_unreadable(change: impl Fn(String) -> String, says: &str) {
    let text = change(EARLIER.to_owned());
    assert_ne!(text, EARLIER);
    let error = serde_json::from_str::<CalibrationRecord<LinearContent>>(&text).unwrap_err();
    assert!(error.to_string().contains(says), "{error}");
}

#[test]
fn a_key_that_is_unknown_or_missing_in_head_or_content_is_refused() {
    let replace = |from: &'static str, to: &'static str| move |it: String| it.replace(from, to);
    check_unreadable(replace("\"runs\"", "\"walks\""), "unknown field `walks`");
    check_unreadable(replace("\"axis\"", "\"axes\""), "missing field `axis`");
    check_unreadable(
        replace("\"machine\": \"m\"", "\"machine\": \"m\", \"more\": 1"),
        "unknown field `more`",
    );
    check_unreadable(
        replace("\"runs\": 3,", "\"runs\": 3, \"lines\": 3,"),
        "unknown field `lines`",
    );
    check_unreadable(
        replace("linear_error_table", "tea_leaves"),
        "the kind is `tea_leaves`, expected `linear_error_table`",
    );
}

#[test]
fn a_calibration_of_another_stage_or_drive_is_foreign() {
    let mine = record("A").head;
    let mut other = record("B").head;
    assert!(mine.belongs_to("id", &mine, &hash()).is_ok());
    let error = mine
        .belongs_to("id", &other, &hash())
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("serial number") && error.contains("`A`"),
        "{error}"
    );
    other = record("A").head;
    other.drive.serial = 8;
    let error = mine
        .belongs_to("id", &other, &hash())
        .unwrap_err()
        .to_string();
    assert!(error.contains("the drive"), "{error}");
    other = record("A").head;
    other.resolution_m = Some(2e-8);
    let error = mine
        .belongs_to("id", &other, &hash())
        .unwrap_err()
        .to_string();
    assert!(error.contains("encoder count"), "{error}");
}

#[test]
fn a_table_measured_elsewhere_fits_the_drive_whose_serial_number_nobody_wrote_down() {
    let machine = record("A").head;
    let mut elsewhere = record("A").head;
    elsewhere.drive.serial = 0;
    assert!(elsewhere.belongs_to("id", &machine, &hash()).is_ok());
    elsewhere.drive.vendor = 2;
    assert!(elsewhere.belongs_to("id", &machine, &hash()).is_err());
}

/// Three lines with table errors 2, −1, −1″ and plate errors 1, 0, −1″, placed at 0 and 1.
fn solution() -> compensator::rotary::Solution {
    use compensator::rotary::{Placement, RotarySeries};
    use units::Radians;

    let placement = |offset, readings: [f64; 3]| Placement {
        offset,
        readings: readings.map(|it| Some(Radians::from_arcsec(it))).to_vec(),
    };
    let placements = vec![
        placement(0, [3.0, -1.0, -2.0]),
        placement(1, [0.0, -1.0, 1.0]),
    ];
    let series = RotarySeries::new(3, placements).unwrap();
    compensator::rotary::solve(&series, &Default::default()).unwrap()
}

#[test]
fn a_rotary_table_is_compensated_by_what_was_stored_with_the_sign_of_a_deviation() {
    let content = RotaryContent::new(&solution());
    assert_eq!((content.lines, &content.offsets[..]), (3, &[0, 1][..]));
    assert_eq!(content.standard_uncertainty_rad, None);
    let table = content.table("id").unwrap();
    // Where the table reads 2″ too much it has stopped 2″ short: actual − target = −2″.
    let deviations: Vec<f64> = table.deviations().iter().map(|it| it.arcsec()).collect();
    for (seen, expected) in deviations.iter().zip([-2.0, 1.0, 1.0]) {
        assert!((seen - expected).abs() < 1e-9, "{deviations:?}");
    }
    let bad = RotaryContent {
        table_error_rad: vec![0.0, f64::NAN],
        ..RotaryContent::default()
    };
    let error = bad.table("0123456789abcdef").unwrap_err().to_string();
    assert!(
        error.starts_with("calibration 0123456789ab: rotary"),
        "{error}"
    );
}
