//! A figure is the same wherever it is shown: each kind of machine is calibrated and verified in virtual time, and
//! what its text, its JSON, its pages and its records say of it is read again and compared, figure by figure.

use std::path::Path;

use serde_json::Value;
use tempfile::TempDir;

use crate::emulated::Emulated;
use crate::linear::{Calibrated, Verified, Zeroed};
use crate::platform::calibrate::PlatformCalibrated;
use crate::platform::verify::PlatformVerified;
use crate::program::kind::KINDS;
use crate::program::linear::told as linear;
use crate::program::page::head::ALWAYS;
use crate::program::platform::verbs as platform;
use crate::program::report;
use crate::program::rotary::told as rotary;
use crate::program::text::{ROWS, SHOWS_NOTHING};
use crate::program::volumetric::verbs as volumetric;
use crate::rotary::{RotaryCalibrated, RotaryVerified};
use crate::volumetric::VolumetricCalibrated;
use crate::volumetric::verify::VolumetricVerified;
use crate::{Machine, config};
use machine::records::Store;

/// A machine in virtual time, and where it keeps its records.
struct Desk {
    machine: Machine,
    emulated: Emulated,
    store: Store,
    _folder: TempDir,
}

impl Desk {
    fn new([machine, emulated]: [&str; 2]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let mut loaded = config::parse(machine, "m.toml").unwrap();
        loaded.config.machine.data_dir = folder.path().to_owned();
        let emulated = Emulated::new(emulated, 20_261_125, &loaded.config).unwrap();
        Self {
            machine: Machine::new(&loaded, Box::new(emulated.transport())),
            store: loaded.config.machine.store(),
            emulated,
            _folder: folder,
        }
    }

    /// What `cal show` says of a calibration, and the calibration.
    fn shown(&self, id: &str) -> (String, Value) {
        let kind = self.store.glance(id).unwrap().kind;
        let mut shown = KINDS.iter().flat_map(|it| it.shown);
        let shown = shown.find(|it| it.kind == kind).unwrap();
        (shown.one)(&self.store, id).unwrap()
    }
}

/// A page without its markup and pictures.
fn words(html: &str) -> String {
    let mut words = String::new();
    let (mut rest, mut picture) = (html, false);
    while let Some(begin) = rest.find('<') {
        if !picture {
            words += &rest[..begin];
        }
        let end = begin + rest[begin..].find('>').unwrap();
        picture =
            (picture || rest[begin..].starts_with("<svg")) && !rest[begin..].starts_with("</svg");
        words.push(' ');
        rest = &rest[end + 1..];
    }
    words += rest;
    words.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// The page of the journal at `path`; every page says the same things first, whatever its kind.
#[track_caller]
fn page_of(path: &Path) -> String {
    let html = report::html(path).unwrap();
    let head = &html[..html.find("</table>").unwrap()];
    let mut rest = head;
    for name in ALWAYS {
        let row = format!("<th>{name}</th><td>");
        let at = rest.find(&row);
        rest = &rest[at.unwrap_or_else(|| panic!("`{name}` is not at its place in {head}"))..];
    }
    assert!(head.contains("truestage ") && head.contains("BLAKE3: journal "));
    words(&html)
}

/// The figures behind each `label` in `text`, with their decimals.
fn behind(text: &str, label: &str, count: usize) -> Vec<(f64, usize)> {
    let at = text.find(label);
    let at = at.unwrap_or_else(|| panic!("`{label}` is not in:\n{text}")) + label.len();
    let mut figures = Vec::new();
    for word in text[at..].split(|c: char| !(c.is_ascii_digit() || "+-.".contains(c))) {
        let word = word.trim_end_matches('.');
        if let Ok(figure) = word.parse::<f64>() {
            let decimals = word.split_once('.').map_or(0, |(_, it)| it.len());
            figures.push((figure, decimals));
        }
        if figures.len() == count {
            return figures;
        }
    }
    panic!("`{label}` has {figures:?} behind it and not {count} figures in:\n{text}")
}

/// Whether what is printed is `wanted`, to its last decimal.
#[track_caller]
fn check(what: &str, wanted: f64, printed: (f64, usize)) {
    let (figure, decimals) = printed;
    let last = 10_f64.powi(-i32::try_from(decimals).unwrap());
    // Half a decimal, and what JSON was rounded to.
    let is_it = (figure - wanted).abs() <= 0.5 * last + 1e-4 * last.min(1.0) + 1e-9 * wanted.abs();
    assert!(
        is_it && wanted.is_finite(),
        "{what}: {figure} printed, {wanted} meant"
    );
}

/// The number at `place` of `value`.
#[track_caller]
fn at(value: &Value, place: &str) -> f64 {
    let number = value.pointer(place).and_then(Value::as_f64);
    number.unwrap_or_else(|| panic!("{place} is no number in {value:#}"))
}

/// The figure of JSON, `wanted`, behind a label of each text.
#[track_caller]
fn everywhere(wanted: f64, shown: &[(&str, &str)]) {
    for (text, label) in shown {
        check(label, wanted, behind(text, label, 1)[0]);
    }
}

/// What JSON says and what a record says in SI.
#[track_caller]
fn stored(json: f64, record: f64, per_si: f64) {
    let (seen, tolerance) = (record * per_si, 0.51e-4);
    assert!(
        (json - seen).abs() <= tolerance,
        "{json} in JSON, {seen} stored"
    );
}

/// A budget that is kept place by place: its largest uncertainty, its shares and what they come to; `expanded` is what
/// JSON calls U, with its unit. `lines` have the whole, in `share` units; `told` one line of it.
#[track_caller]
fn check_budget(
    json: &Value,
    record: &Value,
    (expanded, per_si): (&str, f64),
    (lines, told): (&str, &[&str]),
) {
    let places = list(record, "/budget/places");
    let most = places.iter().map(|it| at(it, "/expanded_u_si"));
    let most = most.fold(0.0, f64::max);
    let worst = places.iter().find(|it| at(it, "/expanded_u_si") == most);
    let worst = worst.unwrap();
    let seen = at(json, &format!("/largest/{expanded}"));
    stored(seen, most, per_si);
    let up_to = "uncertainty U (k = 2) up to ";
    for text in told {
        check("U", seen, behind(text, up_to, 1)[0]);
    }
    // Lengths are nanometres in the table.
    let per_share = if per_si == UM { 1e9 } else { per_si };
    let whole = "U (k = 2) ";
    check(
        "U in the table",
        most * per_share,
        behind(lines, whole, 1)[0],
    );
    let u = behind(lines, "combined u ", 1)[0];
    check("u in the table", at(worst, "/u_si") * per_share, u);
    assert_eq!(json["contributions"], record["budget"]["contributions"]);
    let contributions = list(record, "/budget/contributions").iter().enumerate();
    for (number, it) in contributions {
        let share = at(it, "/value") * at(worst, &format!("/sensitivities/{number}"));
        let name = it["name"].as_str().unwrap();
        // In the list: type, value, unit, share.
        let row = &lines[lines.find(&format!("\n  {name}")).unwrap()..];
        let row = row.trim_start().split('\n').next().unwrap();
        let figures = behind(row, name, 2);
        check(name, share * per_share, figures[1]);
        let page = told.last().unwrap();
        let on_page = &page[page
            .find(&format!("{name} {} ", it["evaluation"].as_str().unwrap()))
            .unwrap()..];
        check(name, share * per_share, behind(on_page, name, 2)[1]);
    }
}

const UM: f64 = 1e6;
const ARCSEC: f64 = 180.0 * 3600.0 / core::f64::consts::PI;

fn largest<'a>(values: impl IntoIterator<Item = &'a Value>) -> f64 {
    let values = values.into_iter().filter_map(Value::as_f64);
    values.fold(0.0, |a, b| a.max(b.abs()))
}

fn list<'a>(value: &'a Value, place: &str) -> &'a Vec<Value> {
    value.pointer(place).and_then(Value::as_array).unwrap()
}

#[test]
fn a_linear_axis_is_told_by_the_same_figures_everywhere() {
    use crate::linear::VerifyOptions;
    let mut desk = Desk::new([
        include_str!("../../../configs/machines/linear.toml"),
        include_str!("../../../configs/emulated/linear.toml"),
    ]);
    let store = desk.store.clone();
    let (zeroed, calibrated, verified) = desk
        .machine
        .guarded(|machine| {
            machine.start()?;
            let zeroed = machine.linear("x")?.zero(&store)?;
            let calibrated = machine
                .linear("x")?
                .calibrate(&store, &Default::default())?;
            let options = VerifyOptions {
                compensated: true,
                calibration: Some(calibrated.id.clone()),
                resume: None,
            };
            let verified = machine.linear("x")?.verify(&store, &options)?;
            Ok((zeroed, calibrated, verified))
        })
        .unwrap();
    check_zero(&zeroed);
    check_search(&zeroed);
    check_linear_calibration(&desk, &calibrated);
    check_linear_verification(&verified);
    check_linear_comparison(&calibrated, &verified);
}

#[track_caller]
fn check_zero(zeroed: &Zeroed) {
    let told = linear::zeroed("x", zeroed);
    let page = words(&report::html(&zeroed.journal).unwrap());
    let u = zeroed.entry.standard_uncertainty_m;
    let expanded = at(&told.value, "/uncertainty/largest/expanded_um");
    stored(expanded, 2.0 * u, UM);
    everywhere(expanded, &[(&told.text, "uncertainty U (k = 2) up to ")]);
    check("combined u", u * 1e9, behind(&page, "combined u ", 1)[0]);
}

#[track_caller]
fn check_linear_calibration(desk: &Desk, calibrated: &Calibrated) {
    let (text, json) = (
        linear::calibrated_text(calibrated),
        linear::calibrated_value(calibrated),
    );
    let page = page_of(&calibrated.journal);
    let (lines, record) = desk.shown(&calibrated.id);
    let content = &record;

    let closure = at(&json, "/closure_um");
    stored(closure, at(content, "/closure_m"), UM);
    let datum = ("closure ", "datum after the runs closure ");
    everywhere(
        closure,
        &[
            (&text, datum.0),
            (&lines, datum.0),
            (&page, datum.0),
            (&page, datum.1),
        ],
    );
    let most = "largest deviation ";
    everywhere(
        at(&json, "/fit/largest_deviation_um"),
        &[(&text, most), (&page, most)],
    );
    let sides = content["nodes"].as_array().unwrap().iter();
    let sides = sides.flat_map(|it| [&it["forward_m"], &it["reverse_m"]]);
    stored(at(&json, "/fit/largest_deviation_um"), largest(sides), UM);
    stored(
        at(&json, "/fit/lost_motion_um"),
        at(content, "/lost_motion_m"),
        UM,
    );
    let up_to = "uncertainty U (k = 2) up to ";
    let expanded = at(&json, "/uncertainty/largest/expanded_um");
    everywhere(expanded, &[(&text, up_to), (&page, up_to)]);
    let nanometres = behind(&lines, "U (k = 2) ", 1)[0];
    check("U of the calibration", expanded * 1e3, nanometres);

    let (nodes, kept) = (list(&json, "/fit/nodes"), list(content, "/nodes"));
    let rows = behind(&page, "u ↓ (µm)", nodes.len() * 5);
    let shown = behind(&lines, "u (µm)", nodes.len() * 4);
    assert_eq!(nodes.len(), kept.len());
    let keys = [
        ("/deviation_um/forward", "/forward_m"),
        ("/deviation_um/reverse", "/reverse_m"),
        ("/standard_uncertainty_um/forward", "/forward_u_m"),
        ("/standard_uncertainty_um/reverse", "/reverse_u_m"),
    ];
    for (number, (node, kept)) in nodes.iter().zip(kept).enumerate() {
        check("position", at(node, "/position_mm"), rows[5 * number]);
        for (column, (of_json, of_record)) in keys.into_iter().enumerate() {
            let figure = at(node, of_json);
            stored(figure, at(kept, of_record), UM);
            check(of_json, figure, rows[5 * number + 1 + column]);
            if column < 3 {
                check(of_json, figure, shown[4 * number + 1 + column]);
            }
        }
    }
}

#[track_caller]
fn check_linear_verification(verified: &Verified) {
    let (text, json) = (
        linear::verified_text("as_left", verified),
        linear::verified_value("as_left", verified),
    );
    let page = page_of(&verified.journal);
    let places = [
        "accuracy/bidirectional",
        "accuracy/forward",
        "accuracy/reverse",
        "repeatability/bidirectional",
        "repeatability/forward",
        "repeatability/reverse",
        "systematic_deviation/bidirectional",
        "mean_bidirectional_deviation_range",
        "reversal_value",
        "mean_reversal_value",
    ];
    let drawn = report::html(&verified.journal).unwrap();
    for (symbol, place) in [
        ("A", "accuracy/bidirectional"),
        ("E", "systematic_deviation/bidirectional"),
        ("M", "mean_bidirectional_deviation_range"),
        ("R", "repeatability/bidirectional"),
        ("B", "reversal_value"),
    ] {
        let label = format!("data-figure=\"{symbol}\">");
        everywhere(at(&json, &format!("/as_left/{place}")), &[(&drawn, &label)]);
    }
    check_targets(&json, &page);
    let stated = page
        .find("uncertainty U (k = 2) of the corrected position")
        .unwrap();
    assert!(text.contains(&page[stated..page[stated..].find(" tolerance").unwrap() + stated]));
    everywhere(at(&json, "/tolerance_um"), &[(&page, "µm, tolerance ")]);
    assert_eq!(ROWS.len(), places.len());
    for ((name, ..), place) in ROWS.iter().zip(places) {
        let figure = at(&json, &format!("/as_left/{place}"));
        everywhere(figure, &[(&text, name), (&page, name)]);
    }
    everywhere(
        at(&json, "/closure_um"),
        &[
            (&text, "datum after the runs: closure "),
            (&page, "datum after the runs closure "),
        ],
    );
    check_unsure(verified);
}

/// Less certain than its tolerance is wide, it is no pass, whatever its figure.
#[track_caller]
fn check_unsure(verified: &Verified) {
    let mut unsure = verified.clone();
    for (it, expected) in [(false, Value::Null), (true, Value::Bool(true))] {
        let (text, json) = (
            linear::verified_text("as_left", &unsure),
            linear::verified_value("as_left", &unsure),
        );
        assert_eq!(text.contains(SHOWS_NOTHING), it, "{text}");
        assert_eq!(json["within_tolerance"], true);
        let warning = json["warning"].as_str();
        assert_eq!(
            warning.map_or(Value::Null, |it| text.contains(it).into()),
            expected
        );
        let forward = unsure.uncertainty[0]
            .forward
            .as_mut()
            .expect("it is calibrated so");
        forward.standard_uncertainty = verified.tolerance;
    }
}

/// Each target's row on the page.
#[track_caller]
fn check_targets(json: &Value, page: &str) {
    let targets = list(json, "/as_left/targets");
    let uncertain = list(json, "/uncertainty");
    let rows = behind(page, "U ↓, k = 2 (µm)", targets.len() * 9);
    for ((row, target), uncertain) in rows.chunks(9).zip(targets).zip(uncertain) {
        let figures = [
            "/mean_deviation/forward",
            "/mean_deviation/reverse",
            "/standard_deviation/forward",
            "/standard_deviation/reverse",
            "/reversal_value",
            "/repeatability/bidirectional",
        ];
        check("target", at(target, "/target_mm"), row[0]);
        for (place, printed) in figures.into_iter().zip(&row[1..]) {
            check(place, at(target, place), *printed);
        }
        check("U forward", at(uncertain, "/forward/expanded_um"), row[7]);
        check("U reverse", at(uncertain, "/reverse/expanded_um"), row[8]);
    }
}

/// The calibration's run and the verification's side by side.
#[track_caller]
fn check_linear_comparison(calibrated: &Calibrated, verified: &Verified) {
    let both = [calibrated.journal.as_path(), verified.journal.as_path()];
    let (html, figures) = report::compared(both).unwrap();
    let (page, json) = (words(&html), linear::verified_value("as_left", verified));
    let figures = figures.as_array().unwrap();
    assert!(figures.len() > ROWS.len());
    for (row, (name, symbol, _)) in figures.iter().zip(ROWS) {
        assert_eq!(row["name"], format!("{symbol}, {name}"));
        let printed = behind(&page, &format!("{name} (µm)"), 3);
        for (key, printed) in ["/first", "/second", "/difference"]
            .into_iter()
            .zip(printed)
        {
            check(name, at(row, key), printed);
        }
    }
    assert_eq!(
        at(&figures[0], "/second"),
        at(&json, "/as_left/accuracy/bidirectional")
    );
    assert_eq!(
        html.matches("run: ").count(),
        4,
        "both plots, and their titles"
    );
}

/// The zero's journal: where the steps of its search ended.
#[track_caller]
fn check_search(zeroed: &Zeroed) {
    let json = linear::zeroed("x", zeroed).value;
    let page = page_of(&zeroed.journal);
    let table = &page[page.find("place (µm) voltage (V)").unwrap()..];
    for (name, place, sensor) in [
        ("G7", "g7", "peak_v"),
        ("G1", "g1_p1", "peak_v"),
        ("G2", "g2_p2", "peak_v"),
        ("G8", "g8_p0", "peak_v"),
        ("P1", "g1_p1", "slope_v"),
        ("P2", "g2_p2", "slope_v"),
        ("P0", "g8_p0", "slope_v"),
    ] {
        let printed = behind(table, &format!("{name} "), 2);
        check(
            name,
            at(&json, &format!("/search/{place}/position_um")),
            printed[0],
        );
        check(
            name,
            at(&json, &format!("/search/{place}/{sensor}")),
            printed[1],
        );
    }
    for points in ["G7: ", "G1, G2: ", "P1, P2: ", "P0: ", "G8: "] {
        assert!(page.contains(points), "{points}is not explained: {page}");
    }
    let u = at(&json, "/zero/origin_um_u");
    everywhere(2.0 * u, &[(&page, "of the zero: U (k = 2) ")]);
}

#[test]
fn a_platform_is_told_by_the_same_figures_everywhere() {
    let mut desk = Desk::new([
        include_str!("../../../configs/machines/uvw.toml"),
        include_str!("../../../configs/emulated/uvw.toml"),
    ]);
    let store = desk.store.clone();
    let (calibrated, verified) = desk
        .machine
        .guarded(|machine| {
            machine.start()?;
            machine.platform()?.zero(&store)?;
            let calibrated = machine.platform()?.calibrate(&store)?;
            Ok((calibrated, machine.platform()?.verify(&store, true)?))
        })
        .unwrap();
    check_platform_calibration(&desk, &calibrated);
    check_platform_verification(&verified);
}

#[track_caller]
fn check_platform_calibration(desk: &Desk, calibrated: &PlatformCalibrated) {
    let (text, json) = (
        platform::calibrated_text(calibrated),
        platform::calibrated_value(calibrated),
    );
    let page = page_of(&calibrated.journal);
    let closure = at(&json, "/closure_um");
    everywhere(
        closure,
        &[(&text, "closure "), (&page, "the zero was off by ")],
    );
    let screws = list(&json, "/screws").iter();
    let most = screws.map(|it| at(it, "/uncertainty/largest/expanded_um"));
    let head = "of the least certain screw: U (k = 2) up to ";
    everywhere(most.fold(0.0, f64::max), &[(&page, head)]);
    for screw in list(&json, "/screws") {
        let axis = screw["axis"].as_str().unwrap();
        let (lines, record) = desk.shown(screw["calibration"].as_str().unwrap());
        let content = &record;
        let own_page = &page[page.find(&format!("Screw {axis}")).unwrap()..];
        let own_text = &text[text.find(&format!("\n  {axis}  ")).unwrap()..];
        let slope = at(screw, "/slope_um_per_mm");
        stored(slope, at(content, "/slope_m_per_m"), 1e3);
        everywhere(
            slope,
            &[
                (own_text, "slope "),
                (own_page, "slope (µm/mm) "),
                (&lines, "slope "),
            ],
        );
        let lost = at(screw, "/lost_motion_um");
        stored(lost, at(content, "/lost_motion_m"), UM);
        let lost_motion = "lost motion ";
        everywhere(
            lost,
            &[
                (own_text, lost_motion),
                (own_page, "lost motion (µm) "),
                (&lines, lost_motion),
            ],
        );
        let u = at(screw, "/lost_motion_um_u");
        check(
            "u of the lost motion",
            u,
            behind(own_page, "lost motion (µm) ", 2)[1],
        );
        check_budget(
            &screw["uncertainty"],
            content,
            ("expanded_um", UM),
            (&lines, &[own_text, own_page]),
        );
        let scatter = at(screw, "/scatter_um");
        stored(scatter, at(content, "/scatter_m"), UM);
        everywhere(scatter, &[(own_page, "scatters by ")]);
        let strokes = at(screw, "/strokes");
        assert_eq!(strokes, at(content, "/rows"));
        check("strokes", strokes, behind(own_page, ", ", 1)[0]);
        let harmonics = list(screw, "/harmonics").len() as f64;
        everywhere(
            harmonics,
            &[(&own_text[own_text.find("lost motion").unwrap()..], "µm, ")],
        );
        assert_eq!(list(content, "/harmonics").len() as f64, harmonics);
    }
}

#[track_caller]
fn check_platform_verification(verified: &PlatformVerified) {
    let (text, json) = (
        platform::verified_text("as left", verified),
        platform::verified_value(verified),
    );
    let page = page_of(&verified.journal);
    everywhere(
        at(&json, "/largest_um"),
        &[(&text, "largest error "), (&page, "largest error (µm) ")],
    );
    everywhere(
        at(&json, "/rms_um"),
        &[(&text, "rms "), (&page, "rms error (µm) ")],
    );
    everywhere(
        at(&json, "/tolerance_um"),
        &[(&text, "tolerance "), (&page, "tolerance (µm) ")],
    );
    let skew = at(&json, "/skew_max_ms");
    everywhere(
        skew,
        &[
            (&text, "started within "),
            (&page, "skew of the starts (ms) "),
        ],
    );
    check_seen(&page, &verified.journal);
    let poses = list(&json, "/poses");
    everywhere(poses.len() as f64, &[(&text, " over "), (&page, " poses ")]);
    let rows = behind(&page, "skew (ms)", poses.len() * 9);
    for (row, pose) in rows.chunks(9).zip(poses) {
        check("error of a pose", at(pose, "/error_um"), row[7]);
        check("skew of a pose", at(pose, "/skew_ms"), row[8]);
    }
}

/// What the page states of the errors of poses: the largest of what the journal says of each, and its two parts.
#[track_caller]
fn check_seen(page: &str, journal: &Path) {
    let text = std::fs::read_to_string(journal).unwrap();
    let entries = text.lines().map(|it| serde_json::from_str(it).unwrap());
    let entries: Vec<Value> = entries.collect();
    let arrangement = entries.iter().find(|it| it["entry"] == "arrangement");
    let arrangement = arrangement.unwrap();
    let edge = at(arrangement, "/edge_m");
    let parts = |of: &Value, place: &str| {
        let part = |name: &str| at(of, &format!("{place}/{name}"));
        [part("x_m"), part("y_m"), part("angle_rad") * edge]
    };
    let camera = parts(arrangement, "/camera_u");
    let poses = entries.iter().filter(|it| it["entry"] == "pose");
    let (mut most, mut scatter) = (0.0_f64, 0.0_f64);
    for seen in poses.map(|it| parts(it, "/seen_u")) {
        for (u, own) in seen.into_iter().zip(camera) {
            assert!(u > own && own > 0.0, "{u} with the camera's {own}");
            most = most.max(2.0 * u);
            scatter = scatter.max((u * u - own * own).sqrt());
        }
    }
    assert!(!page.contains("NOT STATED"), "{page}");
    everywhere(
        most * UM,
        &[(page, "of the error of a pose: U (k = 2) up to ")],
    );
    everywhere(camera[0] * UM, &[(page, "as configured, u ")]);
    everywhere(camera[2] * UM, &[(page, "″ (")]);
    everywhere(
        scatter * UM,
        &[(page, "those of the zero included, u up to ")],
    );
}

struct Hand {
    emulated: Emulated,
    lies_at: f64,
}

impl crate::rotary::Operator for Hand {
    fn ask(&mut self, task: &crate::rotary::PlateTask) -> Result<(), crate::Failure> {
        self.emulated.turn_plate(task.offset - self.lies_at);
        self.lies_at = task.offset;
        Ok(())
    }

    fn is_done(&mut self) -> Result<bool, crate::Failure> {
        Ok(true)
    }
}

#[test]
fn a_rotary_table_is_told_by_the_same_figures_everywhere() {
    let mut desk = Desk::new([
        include_str!("../../../configs/machines/rotary.toml"),
        include_str!("../../../configs/emulated/rotary.toml"),
    ]);
    let store = desk.store.clone();
    let mut hand = Hand {
        emulated: desk.emulated.clone(),
        lies_at: 0.0,
    };
    let (calibrated, verified) = desk
        .machine
        .guarded(|machine| {
            machine.start()?;
            machine.rotary("c")?.zero()?;
            let options = Default::default();
            let calibrated = machine
                .rotary("c")?
                .calibrate(&store, &options, &mut hand)?;
            Ok((
                calibrated,
                machine.rotary("c")?.verify(&store, true, &mut hand)?,
            ))
        })
        .unwrap();
    check_rotary_calibration(&desk, &calibrated);
    check_rotary_verification(&verified);
}

#[track_caller]
fn check_rotary_calibration(desk: &Desk, calibrated: &RotaryCalibrated) {
    let (text, json) = (
        rotary::calibrated_text(calibrated),
        rotary::calibrated_value(calibrated),
    );
    let page = page_of(&calibrated.journal);
    let (lines, record) = desk.shown(&calibrated.id);
    let content = &record;
    let most = at(&json, "/largest_deviation_arcsec");
    stored(most, largest(list(content, "/table_error_rad")), ARCSEC);
    stored(most, largest(list(&json, "/table_error_arcsec")), 1.0);
    everywhere(
        most,
        &[(&text, "table error up to "), (&page, "Table error Up to ")],
    );
    let plate = largest(list(&json, "/plate_error_arcsec"));
    stored(plate, largest(list(content, "/plate_error_rad")), ARCSEC);
    everywhere(
        plate,
        &[(&text, "plate up to "), (&page, "Plate error Up to ")],
    );
    let u = largest(list(&json, "/standard_uncertainty_arcsec"));
    stored(
        u,
        largest(list(content, "/standard_uncertainty_rad")),
        ARCSEC,
    );
    everywhere(
        u,
        &[
            (&text, "standard uncertainty "),
            (&page, "standard uncertainty "),
        ],
    );
    check_harmonics(&json, &page);
    let closure = at(&json, "/closure_arcsec");
    everywhere(
        closure,
        &[
            (&text, "the plate moved by "),
            (&page, "The plate moved by "),
        ],
    );
    let residual = at(&json, "/residual_rms_arcsec");
    stored(residual, at(content, "/residual_rms_rad"), ARCSEC);
    everywhere(
        residual,
        &[(&page, "residuals "), (&lines, "residual rms ")],
    );
    check_budget(
        &json["uncertainty"],
        content,
        ("expanded_arcsec", ARCSEC),
        (&lines, &[&text, &page]),
    );
    for (key, label) in [
        ("degrees_of_freedom", "rms with "),
        ("noise_amplification", "amplified "),
    ] {
        let figure = at(&json, &format!("/{key}"));
        stored(figure, at(content, &format!("/{key}")), 1.0);
        everywhere(figure, &[(&page, label)]);
    }
}

#[track_caller]
fn check_rotary_verification(verified: &RotaryVerified) {
    let (text, json) = (
        rotary::verified_text(verified),
        rotary::verified_value(verified),
    );
    let page = page_of(&verified.journal);
    for (state, name) in [("as_found", "as found"), ("as_left", "as left")] {
        let own_text = &text[text.find(name).unwrap()..];
        let table = &page[page.find("largest (″)").unwrap()..];
        let in_table = behind(table, name, 2);
        for (at_place, (key, label)) in [("largest", "largest deviation "), ("rms", "rms ")]
            .into_iter()
            .enumerate()
        {
            let figure = at(&json, &format!("/{state}/{key}_arcsec"));
            everywhere(figure, &[(own_text, label)]);
            check(key, figure, in_table[at_place]);
        }
    }
    everywhere(
        at(&json, "/tolerance_arcsec"),
        &[(&text, "tolerance "), (&page, "″, tolerance ")],
    );
    check_bidirectional(&json, &page);
    let closure = at(&json, "/closure_arcsec");
    everywhere(closure, &[(&text, "it moved by ")]);
    // Offset, passes, readings, not read, moved meanwhile.
    let row = behind(&page, "moved meanwhile (″)", 5);
    check("moved meanwhile", closure, row[4]);
    check(
        "moved at most",
        closure.abs(),
        behind(&page, "The plate moved by ", 1)[0],
    );
}

#[track_caller]
fn check_harmonics(json: &Value, page: &str) {
    let all = list(json, "/harmonics");
    let significant = all.iter().filter(|it| it["significant"] == true);
    let mut largest: Vec<&Value> = significant.collect();
    largest.sort_by(|a, b| at(b, "/amplitude_arcsec").total_cmp(&at(a, "/amplitude_arcsec")));
    let rows = behind(page, "U, k = 2 (″) phase (°)", 4 * largest.len());
    for (row, it) in rows.chunks(4).zip(&largest) {
        check("number", at(it, "/number"), row[0]);
        check("amplitude", at(it, "/amplitude_arcsec"), row[1]);
        check("U", 2.0 * at(it, "/standard_uncertainty_arcsec"), row[2]);
        check("phase", at(it, "/phase_deg"), row[3]);
    }
    everywhere(largest.len() as f64, &[(page, "Harmonics ")]);
}

#[track_caller]
fn check_bidirectional(json: &Value, page: &str) {
    for (key, label) in [
        ("mean_reversal", "is late by included B̄ "),
        ("reversal_variation", "largest difference from it "),
    ] {
        let figure = at(json, &format!("/bidirectional/{key}_arcsec"));
        everywhere(figure, &[(page, label)]);
    }
}

#[test]
fn three_axes_are_told_by_the_same_figures_everywhere() {
    use crate::edit::with_rare_heartbeats;
    use crate::volumetric::{VerifyBy, WarmUp};
    let machine = with_rare_heartbeats(include_str!("../../../configs/machines/volumetric.toml"));
    let mut desk = Desk::new([
        &machine,
        include_str!("../../../configs/emulated/volumetric.toml"),
    ]);
    let store = desk.store.clone();
    let mut hand = desk.emulated.clone();
    let (made, verified) = desk
        .machine
        .guarded(|machine| {
            machine.start()?;
            machine.volumetric()?.zero()?;
            let made = machine
                .volumetric()?
                .calibrate(&store, WarmUp::None, None, &mut hand)?;
            let by = VerifyBy::Everything;
            Ok((made, machine.volumetric()?.verify(&store, by, &mut hand)?))
        })
        .unwrap();
    check_volumetric_calibration(&desk, &made);
    check_volumetric_verification(&verified);
}

#[track_caller]
fn check_volumetric_calibration(desk: &Desk, made: &VolumetricCalibrated) {
    let (text, json) = (
        volumetric::calibrated_text(made),
        volumetric::calibrated_value(made),
    );
    let page = page_of(&made.journal);
    let (lines, record) = desk.shown(&made.id);
    let content = &record;
    let all = [text.as_str(), &page, &lines];
    let u = at(&json, "/u_tool_max_um");
    stored(u, at(content, "/agreement/tool_u_max_m"), UM);
    let freedom = at(&json, "/degrees_of_freedom");
    assert_eq!(freedom, at(content, "/agreement/degrees_of_freedom"));
    let ratio = at(&json, "/birge_ratio");
    stored(ratio, at(content, "/agreement/scatter_ratio"), 1.0);
    for text in all {
        everywhere(u, &[(text, "tool: standard uncertainty ")]);
        everywhere(freedom, &[(text, " readings, ")]);
        everywhere(ratio, &[(text, "scatter ")]);
    }
    let (of_json, expanded) = (&json["uncertainty"], ("expanded_um", UM));
    check_budget(of_json, content, expanded, (&lines, &[&text, &page]));
    let functions = list(content, "/functions");
    let table = &page[page.find("u (largest)").unwrap()..];
    for function in functions {
        let name = function["name"].as_str().unwrap();
        let per_si = if "abc".contains(name.chars().nth(2).unwrap()) {
            ARCSEC
        } else {
            UM
        };
        let most = largest(list(function, "/values_si")) * per_si;
        let u = largest(list(function, "/standard_uncertainties_si")) * per_si;
        for text in [table, lines.as_str()] {
            let figures = behind(text, name, 3);
            check(name, most, figures[1]);
            check(name, u, figures[2]);
        }
    }
    let squareness = ["y to x", "z to x", "z to y"].into_iter().enumerate();
    for (number, name) in squareness {
        let value = at(content, &format!("/squareness_rad/{number}")) * ARCSEC;
        let u = at(content, &format!("/squareness_u_rad/{number}")) * ARCSEC;
        let section = &page[page.rfind("Squareness").unwrap()..];
        check(name, value, behind(section, name, 1)[0]);
        check(name, value, behind(&lines, name, 1)[0]);
        check(name, u, behind(section, name, 2)[1]);
        check(name, u, behind(&lines, name, 2)[1]);
    }
}

#[track_caller]
fn check_volumetric_verification(verified: &VolumetricVerified) {
    let (text, json) = (
        volumetric::verified_text(verified),
        volumetric::verified_value(verified),
    );
    let page = page_of(&verified.journal);
    for (key, label) in [("range_um", "range "), ("limit_um", "tolerance ")] {
        everywhere(
            at(&json, &format!("/{key}")),
            &[
                (&text, label),
                (&page[page.find("Line as left").unwrap()..], label),
            ],
        );
    }
    let points = list(&json, "/points");
    let in_text = behind(&text, "u (µm)", points.len() * 5);
    let on_page = behind(&page, "correction x, y, z (µm)", points.len() * 8);
    for (number, point) in points.iter().enumerate() {
        for (key, column) in [("deviation_um", 3), ("u_um", 4)] {
            let figure = at(point, &format!("/{key}"));
            check(key, figure, in_text[5 * number + column]);
            check(key, figure, on_page[8 * number + column]);
        }
    }
}
