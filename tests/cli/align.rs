//! Beams that somebody adjusts: what each detector sees, and that no drive hears anything meanwhile.

use std::fs;
use std::io::{BufRead, BufReader, Read};
use std::process::{Child, Command, Stdio};

use nix::pty::openpty;
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use serde_json::Value;
use tests::json_schema::check_output;
use tests::{Edit, Rig, with_emulated_spot_cameras, with_spot_cameras};

use crate::programs::{live_rigs, number, text};
use crate::volumetric_live::Live;

/// The beam of x is blocked behind the slide, that of y is too bright, that of z was knocked aside.
const TROUBLED: &str = r#"
[[faults]]
from_s = 0.0
duration_s = 1000.0
fault = { kind = "reference_beam_blocked", axis = 0, behind_slide = true }

[[faults]]
from_s = 0.0
duration_s = 1000.0
fault = { kind = "reference_beam_bright", axis = 1 }

[[faults]]
from_s = 0.0
duration_s = 1000.0
fault = { kind = "reference_beam_knocked", axis = 2, by_um = 235.0 }
"#;

/// With light so weak that a beam leaves the field before one quadrant has too much of it.
fn troubled(rig: Rig) -> Live {
    Live::of(rig, |text| {
        text.edit("\nsum_v = 8.0", "\nsum_v = 6.0") + TROUBLED
    })
}

/// Kills what a test leaves behind.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

fn start(command: &mut Command, output: Stdio) -> Running {
    let command = command.stdin(Stdio::null()).stdout(output);
    let child = command.stderr(Stdio::piped()).spawn();
    Running(child.unwrap_or_else(|error| panic!("{command:?}: {error}")))
}

/// What it printed, and its exit code.
fn ended(mut running: Running) -> (String, Option<i32>) {
    let mut printed = String::new();
    let output = running.0.stdout.take().expect("it is piped");
    let _ = BufReader::new(output).read_to_string(&mut printed);
    let code = running.0.wait().expect("a child can be waited for").code();
    (printed, code)
}

fn objects(printed: &str) -> Vec<Value> {
    let each = printed.lines().map(serde_json::from_str);
    let all: Vec<Value> = each
        .collect::<Result<_, _>>()
        .unwrap_or_else(|error| panic!("{error}: {printed}"));
    all.iter().for_each(check_output);
    all
}

fn detector<'a>(seen: &'a Value, name: &str) -> &'a Value {
    let mut all = seen["detectors"].as_array().expect("a list").iter();
    all.find(|it| it["detector"] == name)
        .unwrap_or_else(|| panic!("no {name} in {seen}"))
}

#[test]
fn each_detector_says_what_is_wrong_with_its_beam_and_which_way_it_is() {
    for rig in live_rigs() {
        let live = troubled(rig);
        let words = ["align", "machine.toml", "--once", "--instruments"];
        let (printed, code) = ended(start(&mut live.command(&words), Stdio::piped()));
        assert_eq!(code, Some(0), "{printed}");
        let seen = objects(&printed).remove(0);
        let states = [
            ("x slide", "good"),
            ("x end", "blocked"),
            ("y slide", "too_bright"),
            ("y end", "too_bright"),
            ("z slide", "beside"),
            ("z end", "beside"),
            ("x roll", "good"),
        ];
        for (name, state) in states {
            let it = detector(&seen, name);
            assert_eq!(it["state"], state, "{it}");
            assert_eq!(it["trouble"].is_null(), state == "good", "{it}");
            let reading = &it["readings"][0];
            assert_eq!(reading["place"].is_null(), state != "good", "{it}");
            assert!(reading["reference"].is_null(), "none were taken: {it}");
        }
        let good = &detector(&seen, "x slide")["readings"];
        for (reading, along) in [(&good[0], "y"), (&good[1], "z")] {
            assert_eq!(text(&reading["along"]), along);
            let place = number(&reading["from_middle"]);
            assert!(place.abs() < 100.0 && place != 0.0, "{reading}");
            assert!((number(&reading["field"][1]) - 187.998).abs() < 1e-3);
        }
        let bright = number(&detector(&seen, "y end")["sum_v"]);
        assert!(bright > 11.0, "{bright} V");
        assert_eq!(seen["signals"][0]["instrument"], "laser");
    }
}

/// A reflection beside the spot on the slide of x, as bright as half of the beam.
const REFLECTED: &str = r#"
[[faults]]
from_s = 0.0
duration_s = 1000.0
fault = { kind = "reference_beam_reflected", axis = 0, at = "slide", by_um = [80.0, 0.0], share = 0.5 }
"#;

/// The detectors of x are cameras on serial lines; its beam is blocked behind the slide.
#[test]
fn cameras_say_where_the_spot_is_or_that_there_is_none() {
    for rig in live_rigs() {
        let live = Live::shaped(
            rig,
            |text| with_spot_cameras(&text, &["x"]),
            |text| with_emulated_spot_cameras(&text, &["x"]) + TROUBLED,
        );
        let words = ["align", "machine.toml", "--for", "2s"];
        let (printed, code) = ended(start(&mut live.command(&words), Stdio::piped()));
        assert_eq!(code, Some(0), "{printed}");
        let seen = objects(&printed).pop().expect("one a second");
        let slide = detector(&seen, "x slide");
        assert_eq!(slide["state"], "good", "{slide}");
        assert!(slide["sum_v"].is_null(), "{slide}");
        for (reading, along) in slide["readings"].as_array().unwrap().iter().zip(["y", "z"]) {
            assert_eq!(text(&reading["along"]), along);
            let place = number(&reading["from_middle"]);
            assert!(place.abs() < 100.0 && place != 0.0, "{reading}");
            assert_eq!(number(&reading["field"][1]), 250.0);
        }
        let end = detector(&seen, "x end");
        assert_eq!(end["state"], "no_spot", "{end}");
        assert!(end["readings"][0]["place"].is_null(), "{end}");
    }
}

#[test]
fn a_reflection_beside_the_spot_is_told_and_taken_for_no_place() {
    let live = Live::shaped(
        Rig::Pty,
        |text| with_spot_cameras(&text, &["x"]),
        |text| with_emulated_spot_cameras(&text, &["x"]) + REFLECTED,
    );
    let words = ["align", "machine.toml", "--for", "2s"];
    let (printed, code) = ended(start(&mut live.command(&words), Stdio::piped()));
    assert_eq!(code, Some(0), "{printed}");
    let seen = objects(&printed).pop().expect("one a second");
    let slide = detector(&seen, "x slide");
    assert_eq!(slide["state"], "several_spots", "{slide}");
    assert!(text(&slide["trouble"]).contains("2 spots"), "{slide}");
    assert!(slide["readings"][0]["place"].is_null(), "{slide}");
    assert_eq!(detector(&seen, "x end")["state"], "good", "{seen}");
}

/// One object a second; Ctrl-C and the end of the time are both a good end.
#[test]
fn it_goes_on_until_it_is_told_to_end_and_that_is_no_failure() {
    let live = troubled(Rig::Pty);
    let words = ["align", "machine.toml", "--for", "3s"];
    let (printed, code) = ended(start(&mut live.command(&words), Stdio::piped()));
    assert_eq!(code, Some(0), "{printed}");
    let times: Vec<f64> = objects(&printed)
        .iter()
        .map(|it| number(&it["at_s"]))
        .collect();
    assert_eq!(times.len(), 3, "{times:?}");
    assert!(
        times.windows(2).all(|it| (it[1] - it[0] - 1.0).abs() < 0.1),
        "{times:?}"
    );

    let mut running = start(&mut live.command(&words[..2]), Stdio::piped());
    let mut output = BufReader::new(running.0.stdout.take().expect("it is piped"));
    let mut line = String::new();
    output.read_line(&mut line).expect("it prints a line");
    assert!(line.contains("x slide"), "{line}");
    let id = i32::try_from(running.0.id()).expect("process numbers are positive");
    kill(Pid::from_raw(id), Signal::SIGINT).expect("it has not been waited for");
    let _ = output.read_to_string(&mut line);
    let code = running.0.wait().expect("a child can be waited for").code();
    assert_eq!(code, Some(0));
}

#[test]
fn at_a_terminal_it_is_a_picture() {
    let live = troubled(Rig::Pty);
    let terminal = openpty(None, None).expect("a terminal can be had");
    let mut command = live.plain_command(&["align", "machine.toml", "--for", "1s"]);
    let mut running = start(&mut command, terminal.slave.into());
    // The terminal is gone with whoever writes to it.
    drop(command);
    let mut seen = Vec::new();
    let _ = fs::File::from(terminal.master).read_to_end(&mut seen);
    let code = running.0.wait().expect("a child can be waited for").code();
    assert_eq!(code, Some(0));
    let seen = String::from_utf8_lossy(&seen);
    assert_eq!(seen.matches("\x1b[2J").count(), 1, "{seen}");
    assert!(seen.matches("\x1b[H").count() >= 3, "{seen}");
    for word in ["x slide y", "BLOCKED", "TOO BRIGHT", "BESIDE", "x roll"] {
        assert!(seen.contains(word), "{word}: {seen}");
    }
}

/// Neither an SDO, a command, a set-point nor a change of state goes to a drive (nodes 1 to 3).
#[test]
fn a_drive_hears_nothing_while_hands_are_in_the_machine() {
    let live = troubled(Rig::Pty);
    let words = ["align", "machine.toml", "--once", "--record", "bus.log"];
    let (_, code) = ended(start(&mut live.command(&words), Stdio::piped()));
    assert_eq!(code, Some(0));
    let log = fs::read_to_string(live.folder().join("bus.log")).expect("it was recorded");
    let frames: Vec<(&str, &str)> = log
        .lines()
        .filter_map(|line| line.split_whitespace().nth(2)?.split_once('#'))
        .collect();
    let asked = frames.iter().filter(|(id, _)| *id == "60B");
    assert!(asked.count() > 0, "the modules were set up");
    for (id, data) in frames {
        let is_told = id == "000" && ["00", "01", "02", "03"].contains(&&data[2..4]);
        let [base, node] = [&id[..id.len() - 1], &id[id.len() - 1..]];
        let is_for_a_drive = ["20", "30", "40", "50", "60"].contains(&base);
        let is_for_a_drive = is_for_a_drive && ["1", "2", "3"].contains(&node);
        assert!(!is_told && !is_for_a_drive, "{id}#{data}");
    }
}
