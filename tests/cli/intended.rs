//! What a verb is going to do, said before anything moves. No machine is there, and none is needed.

use std::fs;
use std::io::{Read, Write};
use std::path::Path;
use std::process::{Command, Stdio};

use nix::pty::openpty;
use serde_json::Value;
use tests::certificate::{Certificate, day_from_now};
use tests::{Edit, GANTRY, LINEAR, ROTARY, Shipped, UVW, VOLUMETRIC};

use crate::programs::{check_error, check_says, program, text, truestage};

/// A folder with the configuration of a machine, after `change`.
fn desk(shipped: Shipped, change: impl Fn(&str) -> String) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let file = folder.path().join("machine.toml");
    fs::write(file, change(shipped.machine)).expect("a file can be written");
    folder
}

/// `what` of each step that `words` would do.
#[track_caller]
fn check(shipped: Shipped, words: &[&str], expected: &[(&str, &str)]) -> Value {
    let folder = desk(shipped, str::to_owned);
    let words: Vec<_> = words.iter().copied().chain(["--dry-run"]).collect();
    let said = truestage(folder.path(), &words).with_code(0);
    let steps = said["steps"].as_array().expect("a list of steps");
    let steps: Vec<_> = steps
        .iter()
        .map(|it| (text(&it["what"]), text(&it["whose"])))
        .collect();
    assert_eq!(steps, expected, "{said:#}");
    assert!(
        !folder.path().join("machine-data").exists(),
        "nothing is written"
    );
    said
}

#[test]
fn each_verb_says_what_it_is_going_to_do() {
    check(LINEAR, &["zero"], &[("zero", "x")]);
    let both = [("zero", "beam"), ("zero", "x1"), ("zero", "x2")];
    let said = check(GANTRY, &["zero"], &both);
    check_says(
        &said.to_string(),
        &["x1 and x2 together to their negative limit switches"],
    );
    let measured = [("zero", "x"), ("calibration", "x"), ("calibrate", "x")];
    let said = check(LINEAR, &["calibrate"], &measured);
    check_says(
        &said.to_string(),
        &[
            "20 mm/s",
            "21 positions from 0 to 60 mm, 3 times",
            "read by laser",
            "stored",
        ],
    );
    let then = [&measured[..], &[("verify", "x")]].concat();
    check(LINEAR, &["calibrate", "--verify"], &then);
    let said = check(LINEAR, &["calibrate", "--no-activate"], &measured);
    check_says(&said.to_string(), &["stored, and not used"]);
    let moved = [("zero", "x"), ("calibration", "x"), ("move", "x")];
    let said = check(LINEAR, &["move", "x=12.5mm", "--uncompensated"], &moved);
    check_says(
        &said.to_string(),
        &["to 12.5 mm, at 200 mm/s", "NOT CORRECTED"],
    );

    let turned = [("zero", "c"), ("calibration", "c"), ("move", "c")];
    let said = check(ROTARY, &["move", "c=400deg", "--uncompensated"], &turned);
    check_says(
        &said.to_string(),
        &["to 40°, by the shortest way", "400° is 40°"],
    );
    let measured = [("zero", "c"), ("calibration", "c"), ("calibrate", "c")];
    let said = check(ROTARY, &["calibrate"], &measured);
    check_says(&said.to_string(), &["GP-360-0001", "at the offsets [0, "]);

    let whole = ("zero", "platform");
    let screws = [
        ("calibration", "u"),
        ("calibration", "v"),
        ("calibration", "w"),
    ];
    let steps = [&[whole][..], &screws, &[("verify", "platform")]].concat();
    check(UVW, &["verify", "--uncompensated"], &steps);
    let steps = [&[whole][..], &screws, &[("move", "platform")]].concat();
    let said = check(UVW, &["move", "x=1mm", "--uncompensated"], &steps);
    check_says(
        &said.to_string(),
        &["y and theta stay where the camera sees them"],
    );

    let all = "x, y, z";
    let steps = [("zero", all), ("calibration", all), ("calibrate", all)];
    let said = check(VOLUMETRIC, &["calibrate"], &steps);
    check_says(
        &said.to_string(),
        &["z, then y, then x", "lines that somebody sets laser up for"],
    );
}

/// With the code and the words of the verb itself.
#[test]
fn what_the_verb_would_refuse_is_refused() {
    let refused = |shipped, words: &[&str], code, said: &str| {
        let folder = desk(shipped, str::to_owned);
        let error = truestage(folder.path(), words).with_code(code);
        assert!(text(&error["error"]).contains(said), "{error}");
    };
    refused(
        LINEAR,
        &["move", "x=12.5mm", "--dry-run"],
        3,
        "no calibration",
    );
    let words = ["move", "x=99mm", "--uncompensated", "--dry-run"];
    refused(LINEAR, &words, 3, "soft limits");
    refused(LINEAR, &["move", "y=1mm", "--dry-run"], 2, "no axis `y`");
    let words = ["move", "c=5deg", "--approach", "forward", "--dry-run"];
    refused(ROTARY, &words, 2, "--approach is for linear axes");
    let words = ["zero", "--axis", "x1", "--dry-run"];
    refused(GANTRY, &words, 2, "a side of the gantry beam");
    let words = ["calibrate", "--axis", "u", "--dry-run"];
    refused(UVW, &words, 2, "part of a platform");
    refused(UVW, &["verify", "--dry-run"], 3, "without a calibration");
    refused(
        VOLUMETRIC,
        &["verify", "--resume", "--dry-run"],
        2,
        "cannot be resumed",
    );
    let words = ["calibrate", "--warm-up-min=-5", "--dry-run"];
    refused(VOLUMETRIC, &words, 2, "--warm-up-min is -5");
    let words = ["move", "x=1mm", "--way", "forward", "--dry-run"];
    refused(LINEAR, &words, 2, "--way is for rotary axes");
    refused(LINEAR, &["verify", "--dry-run"], 2, "no active calibration");
    refused(
        ROTARY,
        &["move", "c=1deg", "--dry-run"],
        3,
        "no calibration",
    );
    refused(
        UVW,
        &["move", "x=1mm", "--dry-run"],
        3,
        "without a calibration",
    );
    refused(
        VOLUMETRIC,
        &["move", "x=1mm", "--dry-run"],
        3,
        "never measured",
    );
    let words = ["move", "x=9999mm", "--uncompensated", "--dry-run"];
    refused(VOLUMETRIC, &words, 3, "x");
}

#[test]
fn a_path_is_judged_without_a_machine() {
    let folder = desk(VOLUMETRIC, str::to_owned);
    let path = "time_s,x_mm,y_mm,z_mm\n0,0,0,0\n2,10,10,10\n4,20,0,10\n";
    fs::write(folder.path().join("path.csv"), path).expect("a file can be written");
    let words = ["run", "path.csv", "--uncompensated", "--dry-run"];
    let said = truestage(folder.path(), &words).with_code(0);
    assert_eq!(
        (&said["dry_run"], &said["points"]),
        (&true.into(), &2001.into())
    );
    fs::write(
        folder.path().join("path.csv"),
        path.edit("4,20,0,10", "2.01,200,0,10"),
    )
    .expect("a file can be written");
    truestage(folder.path(), &words).with_code(3);
}

/// What `truestage` says at a terminal where `answer` is typed, and its exit code.
pub(crate) fn at_a_terminal(folder: &Path, words: &[&str], answer: &str) -> (String, Option<i32>) {
    // Plain, whatever terminal the tests are started in.
    at_a_terminal_of(folder, words, answer, &[("NO_COLOR", "1")])
}

/// The same in an environment that is otherwise that of an ordinary terminal.
fn at_a_terminal_of(
    folder: &Path,
    words: &[&str],
    answer: &str,
    environment: &[(&str, &str)],
) -> (String, Option<i32>) {
    let terminal = openpty(None, None).expect("a terminal can be had");
    let slave = || {
        Stdio::from(
            terminal
                .slave
                .try_clone()
                .expect("a terminal can be shared"),
        )
    };
    let mut command = Command::new(program("truestage"));
    command.current_dir(folder).args(words);
    command.env_remove("NO_COLOR").env("TERM", "xterm");
    command.envs(environment.iter().copied());
    let mut running = command
        .stdin(slave())
        .stderr(slave())
        .stdout(Stdio::null())
        .spawn()
        .expect("it is there");
    drop((command, terminal.slave));
    let mut master = fs::File::from(terminal.master);
    master.write_all(answer.as_bytes()).expect("somebody types");
    let mut seen = Vec::new();
    let _ = master.read_to_end(&mut seen);
    let code = running.wait().expect("a child can be waited for").code();
    (String::from_utf8_lossy(&seen).into_owned(), code)
}

/// An adapter that is not there.
fn without_adapter() -> tempfile::TempDir {
    let absent = "path = \"/dev/no-such-adapter\"";
    desk(LINEAR, |text| text.edit("path = \"/dev/ttyACM1\"", absent))
}

#[test]
fn what_is_missing_is_told_with_what_to_do() {
    let folder = without_adapter();
    let said = truestage(folder.path(), &["doctor"]).with_code(4);
    assert_eq!(said["sound"], false);
    let checks = said["checks"].as_array().expect("a list of checks");
    let bus = checks.iter().find(|it| it["subject"] == "can0");
    let bus = bus.expect("the bus is checked");
    assert_eq!(bus["verdict"], "bad", "{said:#}");
    check_says(text(&bus["seen"]), &["no-such-adapter"]);
    check_says(text(&bus["fix"]), &["plug it in"]);
    assert!(
        !folder.path().join("machine-data").exists(),
        "nothing is written"
    );
}

#[test]
fn a_person_is_asked_and_a_script_is_not() {
    let folder = without_adapter();
    let (seen, code) = at_a_terminal(folder.path(), &["zero"], "n\n");
    check_says(
        &seen,
        &[
            "stage TS-LIN-0001",
            "x: zero: to its negative limit",
            "go on?",
        ],
    );
    check_says(&seen, &["nothing was moved", "--yes"]);
    assert_eq!(code, Some(2));
    // It goes on, and finds that nothing is connected.
    let (seen, code) = at_a_terminal(folder.path(), &["zero"], "y\n");
    check_says(&seen, &["go on?", "no-such-adapter"]);
    assert_eq!(code, Some(4));
    let (seen, code) = at_a_terminal(folder.path(), &["zero", "--yes"], "");
    assert!(!seen.contains("go on?"), "{seen}");
    assert_eq!(code, Some(4));
    assert_eq!(truestage(folder.path(), &["zero"]).code, Some(4));
}

#[test]
fn a_terminal_has_colours_unless_it_is_asked_for_none() {
    let folder = without_adapter();
    let seen = |words: &[&str], environment: &[(&str, &str)]| {
        at_a_terminal_of(folder.path(), words, "", environment).0
    };
    let red = "\u{1b}[31merror:\u{1b}[0m";
    check_says(&seen(&["scan"], &[]), &[red, "no-such-adapter"]);
    check_says(&seen(&["scan"], &[("NO_COLOR", "")]), &[red]);
    for plain in [("NO_COLOR", "1"), ("TERM", "dumb")] {
        let seen = seen(&["scan"], &[plain]);
        assert!(
            seen.contains("error:") && !seen.contains('\u{1b}'),
            "{seen:?}"
        );
    }
    assert!(!seen(&["scan", "--json"], &[]).contains('\u{1b}'));
}

#[test]
fn what_was_read_is_said_to_who_wants_to_know_all() {
    let folder = without_adapter();
    let said = |words: &[&str]| truestage(folder.path(), words).said;
    let read = "machine.toml was read; records are in ";
    assert!(!said(&["scan"]).contains(read));
    for words in [["scan", "-v"], ["--verbose", "scan"]] {
        check_says(&said(&words), &[read, "error:", "no-such-adapter"]);
    }
    let both = truestage(folder.path(), &["scan", "-v", "-q"]).with_code(2);
    check_error(&both, &["cannot be used with"]);
}

/// A jog says what it will do and asks, like each verb that moves something.
#[test]
fn a_jog_is_said_and_asked_for_before_anything_moves() {
    let jog = ["jog", "x=-2.5mm/s", "--for", "1.5s"];
    let said = check(LINEAR, &jog, &[("zero", "x"), ("jog", "x")]);
    check_says(
        &said.to_string(),
        &["at -2.5 mm/s for 1.5s", "to its negative limit switch"],
    );
    let said = check(ROTARY, &["jog", "c=5deg/s"], &[("zero", "c"), ("jog", "c")]);
    check_says(&said.to_string(), &["at 5 °/s until Ctrl-C"]);
    check(
        UVW,
        &["jog", "y=1mm/s"],
        &[("zero", "platform"), ("jog", "y")],
    );
    let all = ("zero", "x, y, z");
    check(VOLUMETRIC, &["jog", "y=1mm/s"], &[all, ("jog", "y")]);
    let folder = without_adapter();
    let (seen, code) = at_a_terminal(folder.path(), &jog, "n\n");
    check_says(
        &seen,
        &[
            "x: jog: at -2.5 mm/s for 1.5s",
            "go on?",
            "nothing was moved",
        ],
    );
    assert_eq!(code, Some(2));
    let (seen, code) = at_a_terminal(folder.path(), &[&jog[..], &["--yes"]].concat(), "");
    assert!(!seen.contains("go on?"), "{seen}");
    assert_eq!(code, Some(4));
}

/// What has expired is told before a port is opened, let alone anything is zeroed.
#[test]
fn nothing_is_moved_for_a_measurement_by_what_has_an_expired_certificate() {
    let laser = |text: &str, file: &str| {
        let section = format!(
            "[instrument.laser.certificate.wavelength]\nfile = {file:?}\nserial_number = \"L\"\n\n[axis.x.zero]"
        );
        text.edit("[axis.x.zero]", &section)
    };
    let thermometer = |text: &str, file: &str| {
        let last = "expansion_ppm_per_k = [5.0, 0.0, 0.0]\n";
        let section = format!(
            "{last}\n[volumetric.temperature.certificate]\nfile = {file:?}\nserial_number = \"T\"\n"
        );
        text.edit_first(last, &section)
    };
    let of_laser = Certificate::of_laser("L", 632.991_372, 1e-6);
    let (readings, errors) = ([10.0, 30.0], [0.1; 2]);
    let of_thermometer = Certificate::of_sensor("T", "\\degreecelsius", (&readings, &errors), 0.01);
    let check = |shipped: Shipped, text: &dyn Fn(&str) -> String, verbs: &[&[&str]], key: &str| {
        let folder = desk(shipped, text);
        for verb in verbs {
            let refused = truestage(folder.path(), verb).with_code(2);
            check_error(&refused, &[key, "it has ended on"]);
        }
        assert!(
            !folder.path().join("machine-data").exists(),
            "nothing is written"
        );
    };
    let certificates = tempfile::tempdir().expect("a temporary folder can be made");
    let written = |certificate: Certificate| {
        let days = (day_from_now(-800), day_from_now(-799));
        let expired = Certificate {
            days,
            ..certificate
        };
        let path = expired.written(certificates.path());
        path.display().to_string()
    };
    let (of_laser, of_thermometer) = (written(of_laser), written(of_thermometer));
    check(
        LINEAR,
        &|text| laser(text, &of_laser),
        &[
            &["calibrate", "machine.toml"],
            &["verify", "machine.toml", "--uncompensated"],
            &["calibrate", "machine.toml", "--dry-run"],
        ],
        "instrument.laser.certificate.wavelength",
    );
    check(
        VOLUMETRIC,
        &|text| thermometer(text, &of_thermometer),
        &[
            &["calibrate", "machine.toml"],
            &["verify", "machine.toml", "--uncompensated"],
            &["reference", "machine.toml"],
        ],
        "volumetric.temperature.0.certificate",
    );
}
