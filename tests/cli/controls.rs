//! Calibrations that are written for other controls, and tables of these that are read. What a control does with its
//! table, the programs in `controls/` say, by the control's own documents.

mod linuxcnc;
mod pmac;
mod sinumerik;

use std::fs;
use std::path::Path;

use compensator::error_table::{Compensation, EndPolicy, ErrorTable, Interpolation, Limits, Node};
use machine::records::Lease;
use serde_json::Value;
use tests::{Edit, LINEAR, ROTARY, random, seeds};
use units::{Approach, Metres, MetresPerSecond};

use crate::programs::{check_error, text, truestage};
use linuxcnc::Joint;
use pmac::Motor;
use sinumerik::MachineAxis;

/// Both directions, and whether coordinates grow.
const SIDES: [(Approach, bool); 2] = [(Approach::Forward, true), (Approach::Reverse, false)];
/// Counts of the encoder of the shipped machine for a millimetre.
const COUNTS_PER_MM: f64 = 1e5;

/// A stage as it was drawn: what it does, by its own encoder.
struct Stage {
    places_mm: Vec<f64>,
    /// actual − target, forward and in reverse.
    deviations_um: [Vec<f64>; 2],
    interpolation: Interpolation,
    known: Compensation,
}

impl Stage {
    /// Scale, waves, and lost motion that is not the same everywhere.
    fn draw(seed: u64, interpolation: Interpolation) -> Self {
        let mut state = seed;
        let mut draw = |low: f64, high: f64| low + (high - low) * random(&mut state);
        let (scale, wave, length) = (draw(-0.3, 0.3), draw(0.5, 3.0), draw(35.0, 90.0));
        let (phase, lost, grows, at_zero) = (
            draw(0.0, 6.3),
            draw(0.2, 3.0),
            draw(-0.01, 0.01),
            draw(-1.0, 1.0),
        );
        // Half of them are not equally spaced.
        let uneven = if seed.is_multiple_of(2) { 0.0 } else { 0.3 };
        let places_mm: Vec<f64> = (0..=20)
            .map(|it| {
                let inner = if it == 0 || it == 20 { 0.0 } else { uneven };
                let shift = (draw(-1.0, 1.0) * inner * 1e3).round() / 1e3;
                f64::from(it) * 3.0 + shift
            })
            .collect();
        let forward = |it: f64| {
            at_zero + scale * it + wave * (it / length * core::f64::consts::TAU + phase).sin()
        };
        let rounded = |it: f64| (it * 1e4).round() / 1e4;
        let column = |lag: &dyn Fn(f64) -> f64| -> Vec<f64> {
            places_mm
                .iter()
                .map(|it| rounded(forward(*it) + lag(*it)))
                .collect()
        };
        let deviations_um = [column(&|_| 0.0), column(&|it| lost + grows * it)];
        Self::new(places_mm, deviations_um, interpolation)
    }

    fn new(
        places_mm: Vec<f64>,
        deviations_um: [Vec<f64>; 2],
        interpolation: Interpolation,
    ) -> Self {
        let nodes = places_mm.iter().enumerate().map(|(at, place)| Node {
            position: Metres::from_mm(*place),
            forward: Some(Metres::from_um(deviations_um[0][at])),
            reverse: Some(Metres::from_um(deviations_um[1][at])),
            u_forward: None,
            u_reverse: None,
        });
        let table = ErrorTable::new(nodes.collect()).expect("places grow");
        let limits = Limits {
            size: Metres::from_um(50.0),
            slope: 0.01,
            rate: MetresPerSecond(1.0),
        };
        let known = Compensation::new(table, interpolation, limits, EndPolicy::Hold);
        Self {
            places_mm,
            deviations_um,
            interpolation,
            known: known.expect("what is drawn can be undone"),
        }
    }

    /// What a table of equal steps may be off at most, so that its promise is worth something: places that are not
    /// equally spaced have corners between its values.
    fn equal_steps_off_um(&self) -> f64 {
        let steps: Vec<f64> = self.places_mm.windows(2).map(|it| it[1] - it[0]).collect();
        match steps.iter().all(|it| (it - steps[0]).abs() < 1e-6) {
            true => 0.05,
            false => 0.3,
        }
    }

    /// Where the stage is when its encoder shows `encoder_mm`; straight lines by hand.
    fn actual_mm(&self, encoder_mm: f64, approach: Approach) -> f64 {
        let deviation_um = match self.interpolation {
            Interpolation::Linear => {
                let side = &self.deviations_um[usize::from(approach == Approach::Reverse)];
                line(&self.places_mm, side, encoder_mm)
            }
            _ => {
                let deviation = self.known.deviation(Metres::from_mm(encoder_mm), approach);
                deviation.expect("ends hold").um()
            }
        };
        encoder_mm + deviation_um * 1e-3
    }

    /// A folder with the machine and two runs over the stage, and the calibration made of them.
    fn calibrated(&self) -> (tempfile::TempDir, String) {
        let folder = tempfile::tempdir().expect("a temporary folder can be made");
        let here = folder.path();
        let name = match self.interpolation {
            Interpolation::Linear => "\"linear\"",
            _ => "\"monotone_cubic\"",
        };
        let machine = LINEAR.machine.edit(
            "interpolation = \"monotone_cubic\"",
            &format!("interpolation = {name}"),
        );
        fs::write(here.join("machine.toml"), machine).expect("there is room");
        let mut rows = "run,approach,target_mm,measured_mm\n".to_owned();
        for run in 1..=2 {
            for (side, sign) in ["+", "-"].into_iter().enumerate() {
                let mut targets: Vec<usize> = (0..self.places_mm.len()).collect();
                if side == 1 {
                    targets.reverse();
                }
                for at in targets {
                    let (target, deviation) = (self.places_mm[at], self.deviations_um[side][at]);
                    let measured = target + deviation * 1e-3;
                    rows += &format!("{run},{sign},{target},{measured:.9}\n");
                }
            }
        }
        fs::write(here.join("data.csv"), rows).expect("there is room");
        let words = ["fit", "linear", "data.csv", "--save", "machine.toml"];
        let id = text(&truestage(here, &words).with_code(0)["calibration"]).to_owned();
        (folder, id)
    }
}

/// Straight lines; the ends hold.
fn line(places: &[f64], values: &[f64], at: f64) -> f64 {
    let last = places.len() - 1;
    if at <= places[0] {
        return values[0];
    }
    if at >= places[last] {
        return values[last];
    }
    let after = places
        .iter()
        .position(|it| *it > at)
        .expect("the last is beyond");
    let share = (at - places[after - 1]) / (places[after] - places[after - 1]);
    values[after - 1] + share * (values[after] - values[after - 1])
}

fn export(here: &Path, id: &str, words: &[&str]) -> Value {
    truestage(
        here,
        &[&["cal", "export", "machine.toml", id][..], words].concat(),
    )
    .with_code(0)
}

fn off_um(exported: &Value) -> f64 {
    exported["figures"]["straight_lines_off_um"]
        .as_f64()
        .expect("a figure")
}

/// Every control must bring the stage to its targets, within what the export says of its straight lines.
#[track_caller]
fn check_reaches(
    stage: &Stage,
    bound_um: f64,
    sides: &[(Approach, bool)],
    encoder_mm: impl Fn(f64, bool) -> f64,
) {
    // Beyond both ends, too; the targets are between all values.
    for target in (-290..=6290).step_by(7).map(|it| f64::from(it) / 100.0) {
        for (approach, is_growing) in sides {
            let actual = stage.actual_mm(encoder_mm(target, *is_growing), *approach);
            let off_um = (actual - target).abs() * 1e3;
            assert!(
                off_um <= bound_um,
                "{off_um} um off at {target} mm, {approach:?}; {bound_um} um are promised"
            );
        }
    }
}

fn drawn() -> impl Iterator<Item = Stage> {
    seeds("1..16").map(|seed| {
        let straight = seed % 4 < 2;
        Stage::draw(
            seed,
            if straight {
                Interpolation::Linear
            } else {
                Interpolation::MonotoneCubic
            },
        )
    })
}

/// Digits of the files, single precision of trims, and the slope between target and command.
const DIGITS_UM: f64 = 0.002;

#[test]
fn linuxcnc_brings_drawn_stages_to_their_targets_from_both_sides() {
    for stage in drawn() {
        let (folder, id) = stage.calibrated();
        let exported = export(folder.path(), &id, &["--format", "linuxcnc"]);
        let joint = Joint::load(text(&exported["text"]), 1);
        assert_eq!(
            Some(joint.rows() as u64),
            exported["figures"]["values"].as_u64()
        );
        let bound = off_um(&exported);
        assert!(bound < 0.05, "{bound}");
        check_reaches(&stage, bound + DIGITS_UM, &SIDES, |target, up| {
            joint.motor(target, up)
        });
    }
}

#[test]
fn a_pmac_brings_drawn_stages_to_their_targets_from_both_sides() {
    for stage in drawn() {
        let (folder, id) = stage.calibrated();
        let exported = export(folder.path(), &id, &["--format", "pmac", "--name", "3"]);
        let motor = Motor::load(text(&exported["text"]), 3);
        assert!(motor.is_zero_at_zero());
        let bound = off_um(&exported);
        assert!(bound < stage.equal_steps_off_um(), "{bound}");
        let position =
            |target: f64, up| motor.commanded(target * COUNTS_PER_MM, up) / COUNTS_PER_MM;
        // The motor's zero has no correction: all positions are shifted by what the calibration has there.
        let zero = stage
            .known
            .set_point(Metres::ZERO, Approach::Forward)
            .expect("ends hold")
            .mm();
        let told = exported["told"].to_string();
        assert_eq!(
            told.contains("shifted by as much"),
            (zero * COUNTS_PER_MM * 16.0).round() != 0.0
        );
        check_reaches(&stage, bound + DIGITS_UM, &SIDES, |target, up| {
            position(target, up) + zero
        });
    }
}

#[test]
fn a_sinumerik_brings_drawn_stages_to_their_targets_from_the_side_that_was_asked_for() {
    for stage in drawn() {
        let (folder, id) = stage.calibrated();
        let refused = truestage(
            folder.path(),
            &[
                "cal",
                "export",
                "machine.toml",
                &id,
                "--format",
                "sinumerik-eec",
            ],
        );
        let error = refused.with_code(2)["error"].to_string();
        assert!(error.contains("one value for both directions"), "{error}");
        for (side, own) in [("forward", &SIDES[..1]), ("reverse", &SIDES[1..])] {
            let words = [
                "--format",
                "sinumerik-eec",
                "--approach",
                side,
                "--name",
                "MX1",
            ];
            let exported = export(folder.path(), &id, &words);
            let axis = MachineAxis::load(text(&exported["text"]), "MX1");
            let bound = off_um(&exported);
            assert!(bound < stage.equal_steps_off_um(), "{bound}");
            check_reaches(&stage, bound + DIGITS_UM, own, |target, _| {
                axis.encoder(target)
            });
        }
        let words = ["--format", "sinumerik-eec", "--approach", "mean"];
        let exported = export(folder.path(), &id, &words);
        let axis = MachineAxis::load(text(&exported["text"]), "X1");
        let apart =
            (0..21).map(|it| (stage.deviations_um[1][it] - stage.deviations_um[0][it]).abs());
        let half = apart.fold(0.0, f64::max) / 2.0;
        let told = exported["told"].to_string();
        let (_, told) = told
            .split_once("from either side the axis is up to ")
            .expect("it is told");
        let told: f64 = told
            .split(' ')
            .next()
            .and_then(|it| it.parse().ok())
            .expect("a number");
        assert!((told - half).abs() < 1e-3, "{told}, not {half}");
        let bound = off_um(&exported) + half + DIGITS_UM;
        check_reaches(&stage, bound, &SIDES, |target, _| axis.encoder(target));
    }
}

/// By hand: 10 µm too far at 60 mm, so the axis must be sent less far.
#[test]
fn a_stage_that_goes_too_far_is_sent_less_far() {
    let places = vec![0.0, 30.0, 60.0];
    let both = [vec![0.0, 5.0, 10.0], vec![0.0, 5.0, 10.0]];
    let stage = Stage::new(places, both, Interpolation::Linear);
    let (folder, id) = stage.calibrated();
    let of = |words: &[&str]| text(&export(folder.path(), &id, words)["text"]).to_owned();
    let near =
        |seen: f64, expected: f64| assert!((seen - expected).abs() < 1e-5, "{seen} {expected}");
    let linuxcnc = of(&["--format", "linuxcnc"]);
    assert!(linuxcnc.contains("\n60.000000 -0.0099983"), "{linuxcnc}");
    near(Joint::load(&linuxcnc, 1).motor(60.0, true), 59.990);
    let sinumerik = of(&["--format", "sinumerik-eec", "--approach", "forward"]);
    assert!(
        sinumerik.contains("$AA_ENC_COMP[0,2,X1]=0.010000000\n"),
        "{sinumerik}"
    );
    near(MachineAxis::load(&sinumerik, "X1").encoder(60.0), 59.990);
    let pmac = of(&["--format", "pmac"]);
    near(Motor::load(&pmac, 1).commanded(60e5, true) / 1e5, 59.990);
    let csv = of(&["--format", "csv"]);
    assert!(
        csv.contains("reverse_um,u_forward_um,u_reverse_um\n0,0,0,0,0\n30,5.0"),
        "{csv}"
    );
}

/// The same table, read back.
fn shown(here: &Path, id: &str) -> Value {
    let shown = truestage(here, &["cal", "show", "machine.toml", id]).with_code(0);
    shown["record"]["nodes"].clone()
}

fn import(here: &Path, words: &[&str]) -> crate::programs::Ended {
    truestage(
        here,
        &[&["cal", "import", "machine.toml"][..], words].concat(),
    )
}

#[test]
fn what_was_exported_is_imported_as_it_was() {
    for stage in drawn() {
        let (folder, id) = stage.calibrated();
        let here = folder.path();
        export(here, &id, &["--format", "csv", "--out", "x.csv"]);
        let read = import(here, &["x.csv", "--format", "csv"]).with_code(0);
        let before = shown(here, &id);
        assert_eq!(
            shown(here, text(&read["calibration"])),
            before,
            "to the last bit"
        );

        export(here, &id, &["--format", "linuxcnc", "--out", "x.comp"]);
        let words = ["x.comp", "--format", "linuxcnc", "--comp-file-type", "1"];
        let read = import(here, &words).with_code(0);
        let after = shown(here, text(&read["calibration"]));
        let rows = after.as_array().expect("nodes");
        for node in before.as_array().expect("nodes") {
            let number = |node: &Value, key: &str| node[key].as_f64().expect("a number");
            let same =
                |it: &&Value| (number(it, "position_m") - number(node, "position_m")).abs() < 1e-9;
            let read = rows
                .iter()
                .find(same)
                .expect("every calibrated position is there");
            for key in ["forward_m", "reverse_m"] {
                let off = (number(read, key) - number(node, key)).abs();
                assert!(
                    off < 20e-9,
                    "{off} m: a corner of the curve lies beside its position by the deviation"
                );
            }
        }
    }
}

/// What an export is asked with, and what is told: nothing is written.
const REFUSED: &[(&[&str], &str)] = &[
    (
        &["--format", "pmac", "--name", "x"],
        "motors of a Turbo PMAC have the numbers 1 to 32",
    ),
    (
        &["--format", "linuxcnc", "--name", "x"],
        "joints of LinuxCNC have numbers",
    ),
    (
        &[
            "--format",
            "sinumerik-eec",
            "--approach",
            "mean",
            "--name",
            "X 1",
        ],
        "no name of a machine axis",
    ),
    (
        &["--format", "linuxcnc", "--step", "0"],
        "--step 0: it must be above zero",
    ),
    (
        &["--format", "linuxcnc", "--step", "0.01"],
        "more than 256 values",
    ),
    (
        &["--format", "linuxcnc", "--step", "1e-9"],
        "more than 256 values",
    ),
    (
        &["--format", "linuxcnc", "--step", "1e-300"],
        "say --step 0.236 (mm)",
    ),
    (
        &[
            "--format",
            "sinumerik-eec",
            "--approach",
            "mean",
            "--step",
            "1e-9",
        ],
        "more than 5000 values",
    ),
    (
        &["--format", "pmac", "--step", "1e-300"],
        "more than 4000 values",
    ),
    (
        &["--format", "pmac", "--counts", "0.001"],
        "the axis is better without it",
    ),
    (
        &["--format", "pmac", "--counts", "1e300"],
        "is the most that is written",
    ),
    (
        &["--format", "csv", "--step", "1"],
        "writes the calibration as it is",
    ),
    (
        &["--format", "csv", "--laboratory", "zzz"],
        "--laboratory: --format csv writes the calibration as it is",
    ),
    (
        &["--format", "dcc", "--approach", "mean", "--step", "3"],
        "--approach: --format dcc has no use for it",
    ),
    (
        &["--format", "dcc", "--name", "Q"],
        "this format takes --laboratory, --country, --person",
    ),
    (
        &["--format", "linuxcnc", "--laboratory", "zzz"],
        "--laboratory: --format linuxcnc has no use for it",
    ),
    (
        &["--format", "sinumerik-eec", "--counts", "3"],
        "this format takes --approach, --step, --name",
    ),
];

#[test]
fn what_no_table_can_say_is_refused_or_told_and_no_file_is_written_over() {
    let stage = Stage::draw(3, Interpolation::Linear);
    let (folder, id) = stage.calibrated();
    let here = folder.path();
    let export = |words: &[&str]| {
        truestage(
            here,
            &[&["cal", "export", "machine.toml", &id][..], words].concat(),
        )
    };
    for format in ["aerotech", "aerotech2d", "acs", "sinumerik-cec", "etalon"] {
        let refused = export(&["--format", format]).with_code(2);
        check_error(
            &refused,
            &["the wrong sign doubles the error", "what would settle it"],
        );
    }
    fs::write(here.join("x.csv"), "mine").expect("there is room");
    let refused = export(&["--format", "csv", "--out", "x.csv"]).with_code(2);
    check_error(
        &refused,
        &["x.csv: this file already exists", "it was not changed"],
    );
    assert_eq!(
        fs::read_to_string(here.join("x.csv")).expect("it is there"),
        "mine"
    );
    for (words, expected) in REFUSED {
        check_error(&export(words).with_code(2), &[expected]);
    }
}

#[test]
fn what_was_measured_from_one_side_is_told_and_what_pmac_cannot_hold_is_refused() {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let here = folder.path();
    fs::write(here.join("machine.toml"), LINEAR.machine).expect("there is room");
    fs::write(
        here.join("one.csv"),
        "position_mm,forward_um\n0,0\n30,3\n60,-2\n",
    )
    .expect("there is room");
    let one = import(here, &["one.csv", "--format", "csv"]).with_code(0);
    let one = text(&one["calibration"]);
    for format in ["linuxcnc", "sinumerik-eec", "pmac"] {
        let told = truestage(
            here,
            &["cal", "export", "machine.toml", one, "--format", format],
        );
        let told = told.with_code(0)["told"].to_string();
        assert!(told.contains("measured forward only"), "{told}");
    }
    // A stage that comes farther forward than in reverse has no Ixx86.
    let wrong = "position_mm,forward_um,reverse_um\n0,1,0\n30,1,0\n60,1,0\n";
    fs::write(here.join("wrong.csv"), wrong).expect("there is room");
    let read = import(here, &["wrong.csv", "--format", "csv"]).with_code(0);
    let words = [
        "cal",
        "export",
        "machine.toml",
        text(&read["calibration"]),
        "--format",
        "pmac",
    ];
    check_error(
        &truestage(here, &words).with_code(2),
        &["Ixx86 cannot be negative"],
    );
}

/// A file, the words it is imported with, the exit code and what is told.
type Unread = (&'static str, &'static [&'static str], i32, &'static str);

const CSV: &[&str] = &["--format", "csv"];
const COMP: &[&str] = &["--format", "linuxcnc", "--comp-file-type", "1"];

const UNREAD: &[Unread] = &[
    (
        "position_mm,forward_um\n0,0\n30,x\n",
        CSV,
        2,
        "t:3:4: `forward_um` is `x`",
    ),
    (
        "position_mm,forward_mm\n0,0\n",
        CSV,
        2,
        "t:1:13: column `forward_mm` is in the wrong unit",
    ),
    ("0 0 0\n30 0\n", COMP, 2, "t:2:5: the row has 2 numbers"),
    (
        "# mine\n0 0 0\n30 0 0\n",
        COMP,
        2,
        "t:2:1: LinuxCNC ends reading a COMP_FILE at line 1",
    ),
    (
        "0 0 0\n30 0 0\n",
        &["--format", "linuxcnc"],
        2,
        "positions or trims",
    ),
    (
        "100 0 0\n160 0 0\n",
        COMP,
        2,
        "its positions reach from 100 to 160 mm",
    ),
    (
        "0 0 0\n60 -9 0\n",
        COMP,
        3,
        "millimetres taken for micrometres",
    ),
    (
        "position_mm,forward_um\n0,0\n30,400\n60,1\n",
        CSV,
        3,
        "the limit 50.000 um",
    ),
    (
        "position_mm,forward_um\n0,0\n60,1\n",
        &["--format", "csv", "--unit", "inch"],
        2,
        "--unit is for --format linuxcnc",
    ),
    (
        "position_mm,forward_um,u_forward_um\n0,0,1\n60,1,1\n",
        &["--format", "csv", "--uncertainty-um", "1"],
        2,
        "the file states the uncertainty",
    ),
    (
        "position_mm,forward_um\n0,0\n60,1\n",
        &["--format", "csv", "--axis", "q"],
        2,
        "q",
    ),
    (
        "",
        &["--format", "aerotech"],
        2,
        "the wrong sign doubles the error",
    ),
    (
        "",
        &["--format", "pmac"],
        2,
        "such tables are written, not read",
    ),
];

#[test]
fn a_table_that_cannot_be_read_is_told_by_line_and_column_and_nothing_is_stored() {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let here = folder.path();
    fs::write(here.join("machine.toml"), LINEAR.machine).expect("there is room");
    for (file, words, code, expected) in UNREAD {
        fs::write(here.join("t"), file).expect("there is room");
        let refused = import(here, &[&["t"], *words].concat()).with_code(*code);
        check_error(&refused, &[expected]);
        let listed = truestage(here, &["cal", "list", "machine.toml"]).with_code(0);
        assert_eq!(
            listed["calibrations"].as_array().map(Vec::len),
            Some(0),
            "{file}"
        );
    }
}

#[test]
fn an_imported_table_says_where_it_comes_from_and_is_in_use_only_when_asked() {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let here = folder.path();
    fs::write(here.join("machine.toml"), LINEAR.machine).expect("there is room");
    fs::write(
        here.join("old.comp"),
        "0 0 0\n30 29.99 29.989\n60 59.985 59.984\n",
    )
    .expect("there is room");
    let comp = ["old.comp", "--format", "linuxcnc", "--comp-file-type", "0"];
    let first = import(here, &[&comp[..], &["--uncertainty-um", "0.5"]].concat()).with_code(0);
    let active = || {
        let listed = truestage(here, &["cal", "list", "machine.toml"]).with_code(0);
        let all = listed["calibrations"].as_array().expect("a list").clone();
        all.iter()
            .filter(|it| it["active"] == true)
            .map(|it| text(&it["id"]).to_owned())
            .next()
    };
    assert_eq!((first["active"].as_bool(), active()), (Some(false), None));
    let id = text(&first["calibration"]);
    let record =
        truestage(here, &["cal", "show", "machine.toml", id]).with_code(0)["record"].clone();
    assert_eq!(
        (&record["source"], &record["runs"]),
        (&"old.comp".into(), &0.into())
    );
    assert!(
        record["instrument"]["name"]
            .to_string()
            .contains("LinuxCNC"),
        "{record}"
    );
    assert_eq!(record["nodes"][1]["forward_u_m"], 5e-7);
    // Commanded to 30 mm it is at 29.990 mm: too short.
    let deviation = record["nodes"][1]["forward_m"].as_f64().expect("a number");
    assert!((deviation + 10e-6).abs() < 0.02e-6, "{deviation}");
    // Under somebody who has the machine it is stored, and said to be.
    let store = truestage::for_tests::store_in(&here.join("machine-data"), "linear");
    let verify = Lease::take(&store, "verify").expect("nobody else has it");
    let activated = [&comp[..], &["--uncertainty-um", "1", "--activate"]].concat();
    let refused = import(here, &activated).with_code(3);
    check_error(&refused, &["in use by truestage verify"]);
    assert_eq!((refused["active"].as_bool(), active()), (Some(false), None));
    drop(verify);
    let second = import(here, &[&comp[..], &["--activate"]].concat()).with_code(0);
    assert_eq!(active().as_deref(), Some(text(&second["calibration"])));
    // A calibration of another stage is not for this one's controls.
    let other = LINEAR.machine.edit("TS-LIN-0001", "TS-LIN-0002");
    fs::write(here.join("machine.toml"), other).expect("there is room");
    let words = ["cal", "export", "machine.toml", id, "--format", "linuxcnc"];
    check_error(
        &truestage(here, &words).with_code(3),
        &["the stage's serial number"],
    );
}

const LINES: usize = 36;

/// A rotary table, and its error: reading − true angle, arcsec, at each line.
fn rotary() -> (tempfile::TempDir, String, Vec<f64>) {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let here = folder.path();
    fs::write(here.join("machine.toml"), ROTARY.machine).expect("there is room");
    let error = |line: usize| {
        let angle = line as f64 / LINES as f64 * core::f64::consts::TAU;
        6.0 * angle.cos() + 2.0 * (2.0 * angle + 1.0).sin() + 0.5 * (5.0 * angle).cos()
    };
    let plate = |line: usize| 3.0 * (line as f64 * 1.7).sin();
    let mut rows = "offset,line,deviation_arcsec\n".to_owned();
    for offset in [0, 1, 4, 13] {
        for line in 0..LINES {
            rows += &format!(
                "{offset},{line},{}\n",
                error((line + offset) % LINES) + plate(line)
            );
        }
    }
    fs::write(here.join("data.csv"), rows).expect("there is room");
    let words = [
        "fit",
        "rotary",
        "data.csv",
        "--lines",
        "36",
        "--save",
        "machine.toml",
    ];
    let id = text(&truestage(here, &words).with_code(0)["calibration"]).to_owned();
    let record =
        truestage(here, &["cal", "show", "machine.toml", &id]).with_code(0)["record"].clone();
    let errors = record["table_error_rad"].as_array().expect("a list");
    let arcsec = |it: &Value| it.as_f64().expect("a number").to_degrees() * 3600.0;
    (folder, id.clone(), errors.iter().map(arcsec).collect())
}

#[test]
fn rotary_tables_go_round_on_a_sinumerik_and_a_pmac() {
    let (folder, id, errors) = rotary();
    let here = folder.path();
    let sinumerik = export(here, &id, &["--format", "sinumerik-eec"]);
    let axis = MachineAxis::load(text(&sinumerik["text"]), "C1");
    let pmac = export(here, &id, &["--format", "pmac", "--counts", "360000"]);
    let motor = Motor::load(text(&pmac["text"]), 1);
    assert!(motor.is_zero_at_zero());
    let turn = 360_000.0;
    for exported in [&sinumerik, &pmac] {
        let off = exported["figures"]["straight_lines_off_arcsec"]
            .as_f64()
            .expect("a figure");
        assert!(off < 0.35, "{off}");
    }
    // Where the reading of the table is that of a line, the table is off by that line's error, on any turn.
    for turns in [-1.0, 0.0, 2.0] {
        for (line, error) in errors.iter().enumerate() {
            let reading = 360.0 * (turns + line as f64 / LINES as f64);
            let truth = reading - error / 3600.0;
            let near = |seen: f64, within: f64, what: &str| {
                let off = (seen - reading) * 3600.0;
                assert!(off.abs() < within, "{what}: {off} arcsec at {reading}");
            };
            near(axis.encoder(truth), 0.02, "sinumerik");
            let zero = errors[0] / 3600.0;
            let sent = motor.commanded(truth / 360.0 * turn, true) / turn * 360.0;
            near(sent + zero, 0.35, "pmac");
        }
    }
    let refused = truestage(
        here,
        &["cal", "export", "machine.toml", &id, "--format", "linuxcnc"],
    );
    check_error(
        &refused.with_code(2),
        &["does not begin again after a turn"],
    );
    let csv = export(here, &id, &["--format", "csv"]);
    let rows = text(&csv["text"])
        .lines()
        .filter(|it| !it.starts_with('#'))
        .count();
    assert_eq!(rows, LINES + 1);
}
