//! Certificates of instruments, drawn as laboratories write them: those that the schema of the PTB lets pass are read
//! with their figures, those that are wrong in whatever way are refused, and why is said.

use std::fs;
use std::path::Path;

use serde_json::Value;
use tests::certificate::{Certificate, Column, Stated, day_from_now, drawn};
use tests::{Edit, LINEAR};

use crate::dcc::{can_judge, ended, schema, truestage};
use crate::peer::Peer;

const VALID: u64 = 24;

/// The shipped machine with this certificate of `of`, in a folder of its own.
fn machine(folder: &Path, of: &str, serial_number: &str, more: &str) {
    let section = format!(
        "[instrument.laser.certificate.{of}]\nfile = \"certificate.xml\"\nserial_number = \"{serial_number}\"\n{more}\n\
         [axis.x.zero]"
    );
    let text = LINEAR.machine.edit("[axis.x.zero]", &section);
    fs::write(folder.join("machine.toml"), text).expect("there is room");
}

/// What `check` found of the only certificate.
fn figures(folder: &Path) -> Value {
    let checked = truestage(folder, &["check", "machine.toml"]);
    checked["certificates"][0]["figures"].clone()
}

#[test]
fn certificates_of_every_sort_are_valid_and_read_with_their_figures() {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let all: Vec<_> = (0..VALID).map(drawn).collect();
    for (seed, it) in all.iter().enumerate() {
        let own = folder.path().join(seed.to_string());
        fs::create_dir(&own).expect("there is room");
        fs::write(own.join("certificate.xml"), it.certificate.text()).expect("there is room");
        machine(&own, it.of, &it.certificate.serial_number, "");
        check_read(
            &format!("certificate {seed}, {}", it.of),
            &figures(&own),
            &it.points,
        );
    }
    if !can_judge("certificates of instruments by the DCC schema") {
        return;
    }
    let newest = schema("3.3.0").expect("it is there");
    let mut judge = Peer::start("dcc.py", &[&newest.display().to_string()]);
    let lines = all.iter().enumerate().map(|(seed, it)| {
        let path = folder.path().join(format!("{seed}/certificate.xml"));
        let schema = schema(it.certificate.version).expect("all versions lie there");
        format!("{}\t{}\n", path.display(), schema.display())
    });
    judge.feed(&lines.collect::<String>());
    for (seed, it) in all.iter().enumerate() {
        let report = judge.report();
        assert_eq!(
            report["valid"], true,
            "{seed} ({}): {report}",
            it.certificate.version
        );
    }
}

#[track_caller]
fn check_read(what: &str, figures: &Value, points: &[[f64; 3]]) {
    let close = |seen: &Value, expected: f64, scale: f64| {
        let seen = seen.as_f64().unwrap_or_else(|| panic!("{what}: {figures}"));
        assert!(
            (seen - expected).abs() <= 1e-9 * scale,
            "{what}: {seen}, not {expected}"
        );
    };
    if let [[value, _, u]] = points {
        close(&figures["value"], *value, *value);
        return close(&figures["standard_uncertainty"], *u, *value);
    }
    let seen = figures["points"]
        .as_array()
        .unwrap_or_else(|| panic!("{what}: {figures}"));
    assert_eq!(seen.len(), points.len(), "{what}");
    for (seen, [reading, correction, u]) in seen.iter().zip(points) {
        let scale = reading.abs().max(300.0);
        close(&seen["reading"], *reading, scale);
        close(&seen["correction"], *correction, scale);
        close(&seen["standard_uncertainty"], *u, scale);
    }
}

/// The thermometer of the cases below.
fn thermometer() -> Certificate {
    let (readings, errors) = ([15.0, 20.0, 25.0], [0.1, 0.2, -0.1]);
    Certificate::of_sensor("T-1", "\\degreecelsius", (&readings, &errors), 0.02)
}

/// What is refused: of what, the certificate's text, more keys, and what is said of it.
type Broken = (&'static str, Vec<u8>, &'static str, &'static str);

fn edited(from: &str, to: &str, says: &'static str) -> Broken {
    let text = thermometer().text().edit_first(from, to);
    ("air_temperature", text.into_bytes(), "", says)
}

fn with(change: impl Fn(&mut Certificate), says: &'static str) -> Broken {
    let mut certificate = thermometer();
    change(&mut certificate);
    ("air_temperature", certificate.text().into_bytes(), "", says)
}

fn columns(columns: &[Column], says: &'static str) -> Broken {
    with(
        |it| it.results = vec![("calibration", columns.to_vec())],
        says,
    )
}

/// What is replaced in a text, by what, and what is said of it.
const EDITS: [(&str, &str, &str); 15] = [
    ("</dcc:digitalCalibrationCertificate>", "", "it is no XML"),
    (
        "<dcc:digitalCalibrationCertificate",
        "<!DOCTYPE a [<!ENTITY b \"20\">]>\n<dcc:digitalCalibrationCertificate",
        "it is no XML",
    ),
    (
        "https://ptb.de/dcc",
        "https://ptb.de/ccd",
        "no Digital Calibration Certificate",
    ),
    (
        "schemaVersion=\"3.3.0\"",
        "schemaVersion=\"2.4.0\"",
        "DCC schema 2.4.0",
    ),
    (
        "<dcc:uniqueIdentifier>K-T-1</dcc:uniqueIdentifier>",
        "",
        "no uniqueIdentifier",
    ),
    ("Laboratory of the test", "", "which laboratory"),
    (
        "<dcc:value>T-1",
        "<dcc:value>T-2",
        "of another item: its identifications are T-2",
    ),
    (
        "</dcc:item></dcc:items>",
        "</dcc:item><dcc:item/></dcc:items>",
        "it certifies 2 items",
    ),
    (
        "<dcc:valid>true",
        "<dcc:valid>false",
        "says of itself that it does not hold",
    ),
    (
        "<dcc:period>P2Y",
        "<dcc:period>two years",
        "its period `two years`",
    ),
    (
        "<dcc:endPerformanceDate>",
        "<dcc:endPerformanceDate>on ",
        "which is no day",
    ),
    (
        "<si:coverageFactorXMLList>2 2 2</si:coverageFactorXMLList>",
        "",
        "no coverage factor",
    ),
    (
        "<si:valueXMLList>15 ",
        "<si:valueXMLList>much ",
        "`much` is no number",
    ),
    (
        "<si:valueXMLList>15 ",
        "<si:valueXMLList>15 16 ",
        "different numbers of values",
    ),
    (
        "0.04 0.04 0.04",
        "0.04 -0.04 0.04",
        "an uncertainty is -0.04",
    ),
];

/// Too large, too deep, too many elements.
fn beyond_limits() -> Vec<Broken> {
    let deep = format!("{}{}", "<dcc:list>".repeat(100), "</dcc:list>".repeat(100));
    let much = format!("<!--{}-->", "x".repeat(5 << 20));
    let many = "<dcc:list/>".repeat(250_000);
    vec![
        edited(
            "<dcc:results>",
            &format!("<dcc:results>{deep}"),
            "nested deeper",
        ),
        edited("<!-- a comment -->", &much, "larger than 4 MiB"),
        edited(
            "<dcc:results>",
            &format!("<dcc:results>{many}"),
            "it is no XML",
        ),
    ]
}

/// Days that are in the wrong order, past or to come.
fn out_of_time() -> Vec<Broken> {
    vec![
        with(
            |it| it.days = (day_from_now(-3), day_from_now(-5)),
            "before it began",
        ),
        with(|it| it.period = None, "how long it holds"),
        with(|it| it.days.1 = day_from_now(3), "which is yet to come"),
        with(
            |it| it.days = (day_from_now(-800), day_from_now(-799)),
            "it has ended on",
        ),
    ]
}

/// Values that no thermometer has, or that contradict each other.
fn out_of_sense() -> Vec<Broken> {
    let celsius = |role, values: &[f64]| Column::new(role, "\\degreecelsius", values);
    let known = |it: Column, u: &[f64]| it.with_u(u, Stated::Expanded);
    let (measured, error) = ("basic_measuredValue", "basic_measurementError");
    let both = |values: &[f64], errors: &[f64], says| {
        let u = vec![0.02; errors.len()];
        columns(
            &[celsius(measured, values), known(celsius(error, errors), &u)],
            says,
        )
    };
    let reference = celsius("basic_referenceValue", &[20.0, 25.0]);
    let volts = |role, value| Column::new(role, "\\volt", &[value]);
    vec![
        columns(
            &[celsius(measured, &[15.0]), celsius(error, &[0.1])],
            "states no uncertainty",
        ),
        columns(
            &[
                reference,
                celsius(measured, &[20.2, 25.1]),
                known(celsius(error, &[-0.2, -0.1]), &[0.02, 0.02]),
            ],
            "its error is not measured - reference",
        ),
        both(&[20.0, 20.0], &[0.1, 0.1], "stands there twice"),
        both(&[288.0, 293.0], &[0.1, 0.1], "a reading of 288"),
        both(&[15.0], &[15.2], "is more than 5"),
        columns(
            &[volts(measured, 15.0), known(volts(error, 0.1), &[0.02])],
            "no result of it is a calibration of temperature",
        ),
        with(
            |it| it.results.push(("again", it.results[0].1.clone())),
            "2 of its results could be meant",
        ),
    ]
}

/// Certificates of something else.
fn of_others() -> Vec<Broken> {
    let laser = |nm: f64| Certificate::of_laser("T-1", nm, 1e-6).text().into_bytes();
    let whole = || thermometer().text().into_bytes();
    let other_text = [b"\xff\xfe".to_vec(), whole()].concat();
    let is_none = "no result of it is a calibration of pressure";
    vec![
        (
            "wavelength",
            laser(632.991_212 / 1.000_271),
            "",
            "is no vacuum wavelength",
        ),
        ("wavelength", laser(543.5), "", "is no vacuum wavelength"),
        ("pressure", whole(), "", is_none),
        (
            "air_temperature",
            whole(),
            "result = \"before\"",
            "no result of it",
        ),
        ("air_temperature", other_text, "", "not written in UTF-8"),
    ]
}

/// Each in a way of its own.
fn broken() -> Vec<Broken> {
    let edits = EDITS.map(|(from, to, says)| edited(from, to, says));
    let more = [beyond_limits(), out_of_time(), out_of_sense(), of_others()];
    edits
        .into_iter()
        .chain(more.into_iter().flatten())
        .collect()
}

#[test]
fn certificates_that_are_broken_in_one_way_or_another_are_refused_and_the_way_is_said() {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let check = |(of, text, more, says): &Broken| {
        fs::write(folder.path().join("certificate.xml"), text).expect("there is room");
        machine(folder.path(), of, "T-1", more);
        let ended = ended(folder.path(), &["check", "machine.toml"]);
        let said = String::from_utf8_lossy(&ended.stderr).into_owned()
            + &String::from_utf8_lossy(&ended.stdout);
        assert_eq!(ended.status.code(), Some(2), "{says}: {said}");
        assert!(said.contains(says), "{says}: {said}");
        assert!(
            said.contains(&format!("instrument.laser.certificate.{of}")),
            "{said}"
        );
    };
    broken().iter().for_each(check);
    fs::remove_file(folder.path().join("certificate.xml")).expect("it is there");
    let ended = ended(folder.path(), &["check", "machine.toml"]);
    assert_eq!(ended.status.code(), Some(2), "a file that is not there");
}

/// Before it ends it is warned of, as early as somebody wants; it ends in between by `valid_months`.
#[test]
fn a_certificate_that_ends_soon_is_warned_of() {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let mut certificate = thermometer();
    certificate.days = (day_from_now(-340), day_from_now(-340));
    fs::write(folder.path().join("certificate.xml"), certificate.text()).expect("there is room");
    let warnings = |more: &str| {
        machine(folder.path(), "air_temperature", "T-1", more);
        let checked = truestage(folder.path(), &["check", "machine.toml"]);
        let all = checked["warnings"].as_array().cloned().unwrap_or_default();
        all.iter()
            .map(|it| it["cause"].to_string())
            .collect::<Vec<_>>()
    };
    assert_eq!(
        warnings(""),
        Vec::<String>::new(),
        "it says that it holds for two years"
    );
    assert_eq!(warnings("valid_months = 24"), Vec::<String>::new());
    let soon = warnings("valid_months = 12");
    assert!(
        soon.len() == 1 && soon[0].contains("it ends in 2"),
        "{soon:?}"
    );
    assert_eq!(
        warnings("valid_months = 12\nremind_days = 5"),
        Vec::<String>::new()
    );
}
