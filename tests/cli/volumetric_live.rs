//! The verbs of three axes on a machine that lives on pseudo-terminals, each in a process of its own;
//! the emulator's hand sets up what they ask for.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::MutexGuard;

use compensator::volumetric::identify::Optics;
use nix::sys::signal::Signal;
use serde_json::Value;
use tests::volume::point_mm;
use tests::{Rig, VOLUMETRIC};
use truestage::config;
use truestage::cycle::volumetric::{LineOptics, LineTask, volume_plan};
use truestage::emulated::EmulatedOnPtys;
use truestage::store::{ReadJournal, read_journal};

use crate::programs::{Ended, Process, live_rigs, one_machine, program};

/// How much faster than the wall's clock the machine lives: its drives ask for a set-point every
/// 10 ms of the wall, and no more of a computer.
const SPEED: f64 = 2.0;

/// A corner of the volume, few nodes and short averages: every verb works, and none takes long.
fn small(text: &str) -> String {
    let changes = [
        (
            "high_mm = [500.0, 400.0, 300.0]",
            "high_mm = [60.0, 40.0, 30.0]",
        ),
        (
            "step_mm = 25.0\nsamples = 50",
            "step_mm = 15.0\nsamples = 5",
        ),
        (
            "step_mm = 50.0\nsettle_ms = 100.0",
            "step_mm = 30.0\nsettle_ms = 50.0",
        ),
        ("average_samples = 60", "average_samples = 20"),
        ("from_mm = [0.0, 0.0, 150.0]", "from_mm = [0.0, 0.0, 15.0]"),
        (
            "to_mm = [500.0, 400.0, 150.0]",
            "to_mm = [60.0, 40.0, 15.0]",
        ),
        ("points = 11", "points = 3"),
        (
            "search_speed_mm_per_s = 20.0",
            "search_speed_mm_per_s = 60.0",
        ),
        // So slow that a computer with other work to do is in time.
        ("sync_period_ms = 2.0", "sync_period_ms = 20.0"),
        ("every_syncs = 10", "every_syncs = 1"),
    ];
    changes.iter().fold(text.to_owned(), |text, (from, to)| {
        assert!(text.contains(from), "`{from}` is not in the text");
        text.replace(from, to)
    })
}

/// The machine, and where its files are.
struct Live {
    emulated: EmulatedOnPtys,
    folder: tempfile::TempDir,
    _turn: MutexGuard<'static, ()>,
}

impl Live {
    fn new() -> Self {
        let turn = one_machine();
        let emulated = EmulatedOnPtys::start(VOLUMETRIC.emulated, 51, SPEED);
        let folder = tempfile::tempdir().expect("a temporary folder can be made");
        let text = small(VOLUMETRIC.machine);
        fs::write(folder.path().join("machine.toml"), text).expect("there is room");
        Self {
            emulated: emulated.unwrap_or_else(|error| panic!("{error}")),
            folder,
            _turn: turn,
        }
    }

    fn start(&self, words: &[&str]) -> Process {
        let mut command = Command::new(program("truestage"));
        command.current_dir(self.folder.path()).arg("--json");
        command
            .args(words)
            .args(["--clock-speed", &SPEED.to_string()]);
        for line in self.emulated.description() {
            let mut words = line.split_whitespace();
            let mut next = || words.next().expect("NAME KIND PATH");
            let (name, kind, path) = (next(), next(), next());
            let kind = if kind == "SLCAN" { "slcan:" } else { "" };
            command.args(["--port", &format!("{name}={kind}{path}")]);
        }
        Process::start(&mut command)
    }

    fn run(&self, words: &[&str]) -> Ended {
        self.start(words).end()
    }

    /// A verb that asks for lines: each is set up as soon as it is asked for, unless it is the one
    /// at which the person stops the program.
    fn run_with_hand(&self, words: &[&str], stops_at: Option<usize>) -> (Ended, Vec<usize>) {
        let mut asked = Vec::new();
        let ended = self.start(words).end_heard(|process, said| {
            let Some(task) = self.asked(said) else { return };
            asked.push(task.step.0);
            if Some(task.step.0) == stops_at {
                return process.signal(Signal::SIGINT);
            }
            let done = self.emulated.set_up_line(&task);
            done.unwrap_or_else(|error| panic!("{error}"));
        });
        (ended, asked)
    }

    /// The line that `> line 3 of 31: …` asks for.
    fn asked(&self, said: &str) -> Option<LineTask> {
        let (step, _) = said.strip_prefix("> line ")?.split_once(':')?;
        let (number, of) = step.split_once(" of ")?;
        let step = (number.parse().ok()?, of.parse().ok()?);
        let text = small(VOLUMETRIC.machine);
        let config = config::parse(&text, "machine.toml")
            .expect("it is sound")
            .config;
        let config = config.volumetric.expect("it has three axes");
        let tool = point_mm(config.tool_offset_mm);
        if step == (1, 1) {
            let verify = config.verify.expect("it has one");
            return Some(LineTask {
                optics: LineOptics::Linear,
                start: point_mm(verify.from_mm),
                end: point_mm(verify.to_mm),
                tool,
                step,
            });
        }
        let (_, lines) = volume_plan(&config, false, Vec::new()).expect("it is configured");
        assert_eq!(lines.len(), step.1);
        let line = lines[step.0 - 1];
        Some(LineTask {
            optics: match line.optics {
                Optics::Linear => LineOptics::Linear,
                Optics::Straightness(across) => LineOptics::Straightness { across },
                Optics::Angle(about) => LineOptics::Angular { about },
            },
            start: line.from,
            end: line.to,
            tool: line.tool,
            step,
        })
    }

    fn path(&self, value: &Value) -> PathBuf {
        let path = value
            .as_str()
            .unwrap_or_else(|| panic!("{value} is no path"));
        self.folder.path().join(path)
    }
}

fn read(path: &Path) -> ReadJournal {
    read_journal(path).unwrap_or_else(|error| panic!("{error}"))
}

#[track_caller]
fn check_error(said: &Value, parts: &[&str]) {
    let error = said["error"].as_str().expect("it says why");
    for part in parts {
        assert!(error.contains(part), "`{part}` is not in {error}");
    }
}

fn number(value: &Value) -> f64 {
    value
        .as_f64()
        .unwrap_or_else(|| panic!("{value} is no number"))
}

#[test]
fn three_axes_are_zeroed_calibrated_verified_and_moved_from_process_to_process() {
    // On CAN it would be the same machine again.
    if !live_rigs().any(|rig| rig == Rig::Pty) {
        return;
    }
    let live = Live::new();
    refuses_without_errors(&live);
    let zero = live.run(&["zero", "machine.toml"]).with_code(0);
    assert_eq!(zero["axes"], serde_json::json!(["x", "y", "z"]));

    // Somebody stops it before its third line, and goes on later.
    let words = ["calibrate", "machine.toml", "--yes"];
    let (stopped, asked) = live.run_with_hand(&words, Some(3));
    stopped.with_code(4);
    assert_eq!(asked, [1, 2, 3]);
    let words = ["calibrate", "machine.toml", "--yes", "--resume"];
    let (made, asked) = live.run_with_hand(&words, None);
    assert_eq!(asked.first(), Some(&3), "{made:?}");
    let made = made.with_code(0);
    let journal = read(&live.path(&made["journal"]));
    assert!(journal.complete);
    assert_eq!(number(&made["lines"]) as usize, journal.volume.whole.len());

    let words = ["verify", "machine.toml", "--yes"];
    let (verified, asked) = live.run_with_hand(&words, None);
    let verified = verified.with_code(0);
    assert_eq!(asked, [1]);
    assert!(number(&verified["range_um"]) < 3.0, "{verified}");
    let journal = read(&live.path(&verified["journal"]));
    assert!(journal.complete && journal.header.calibration.is_some());
    let page = live.path(&verified["journal"]).display().to_string();
    let report = crate::programs::truestage(live.folder.path(), &["report", &page]).with_code(0);
    assert!(live.path(&report["report"]).exists());

    let geometry = &made["geometry"];
    let taken = live.run(&["reference", "machine.toml"]).with_code(0);
    assert_eq!(&taken["geometry"], geometry);
    let kept = live.run(&["memory", "record", "machine.toml"]).with_code(0);
    assert_eq!(kept["axes"], serde_json::json!(["x", "y", "z"]));
    let moved = live
        .run(&["move", "machine.toml", "x=30mm", "y=20mm"])
        .with_code(0);
    assert_eq!(moved["corrected"], true);
    assert_eq!(number(&moved["axes"][0]["target_mm"]), 30.0);
    assert!(number(&moved["axes"][0]["correction_um"]).abs() > 0.0);
    let cleared = live.run(&["memory", "clear", "machine.toml"]).with_code(0);
    assert_eq!(cleared["cleared"], kept["memory"]);
    follows(&live);
}

fn refuses_without_errors(live: &Live) {
    for verb in [
        &["reference"][..],
        &["memory", "record"],
        &["verify", "--yes"],
    ] {
        let refused = live.run(&[verb, &["machine.toml"]].concat()).with_code(3);
        check_error(&refused, &["never measured"]);
    }
    let words = ["calibrate", "machine.toml", "--yes", "--warm-up-min=-1"];
    check_error(&live.run(&words).with_code(2), &["--warm-up-min"]);
    let words = ["calibrate", "machine.toml", "--yes", "--resume"];
    check_error(
        &live.run(&words).with_code(2),
        &["no interrupted calibrate"],
    );
    check_error(
        &live.run(&["calibrate", "machine.toml"]).with_code(2),
        &["--yes"],
    );
}

/// A path that all axes follow, and paths that none does.
fn follows(live: &Live) {
    let run = |rows: &str| {
        let csv = format!("time_s,x_mm,y_mm,z_mm\n{rows}");
        fs::write(live.folder.path().join("path.csv"), csv).expect("there is room");
        live.run(&["run", "machine.toml", "path.csv"])
    };
    // From 0 to 2 mm in two seconds, without a jerk: 10 s³ - 15 s⁴ + 6 s⁵.
    let rows = (0..=100).map(|n: u32| {
        let share = f64::from(n) / 100.0;
        let at = 2.0 * share.powi(3) * (10.0 - 15.0 * share + 6.0 * share.powi(2));
        format!("{:.3},{at:.6},{at:.6},{at:.6}\n", f64::from(n) * 0.02)
    });
    let rows: String = rows.collect();
    let followed = run(&rows).with_code(0);
    assert_eq!(
        (&followed["points"], &followed["corrected"]),
        (&101.into(), &true.into())
    );
    check_error(
        &run("0.0,0,0,0\n0.020,zero,0,0\n").with_code(2),
        &["path.csv"],
    );
    let far = run("0.0,0,0,0\n0.020,900,0,0\n");
    assert!(matches!(far.code, Some(2 | 3)), "{far:?}");
    check_error(&far.json, &["x"]);
    let far = live.run(&["move", "machine.toml", "x=900mm"]).with_code(3);
    check_error(&far, &["soft limits"]);
    let unknown = live.run(&["move", "machine.toml", "w=1mm"]).with_code(2);
    check_error(&unknown, &["x, y, z"]);
}
