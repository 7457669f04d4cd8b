//! The verbs of three axes on a machine that lives outside: each in a process of its own at a
//! terminal, where somebody sets up the lines that it asks for.

use std::fs::{self, File};
use std::io::Write;
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::MutexGuard;

use compensator::volumetric::{Axis, Point};
use machine::records::read_journal;
use nix::pty::openpty;
use nix::sys::signal::Signal;
use serde_json::Value;
use tests::volume::point_mm;
use tests::{Edit, INTERFACE, Rig, VOLUMETRIC, vcan_is_native};
use truestage::emulated::EmulatedOnPtys;
use truestage::volumetric::VolumeLog;
use truestage::volumetric::{LineOptics, LineTask};

use crate::programs::{
    Ended, Process, check_error, live_rigs, number, one_machine, program, text, truestage,
};

/// A corner of the volume, few nodes and short averages: every verb works, and none takes long.
/// What is late by some SYNC periods is no trouble.
pub(crate) fn small(machine: &str) -> String {
    let changes = [
        ("sync_period_ms = 2.0", "sync_period_ms = 60.0"),
        ("every_syncs = 10", "every_syncs = 1"),
        ("age_max_ms = 100.0", "age_max_ms = 2000.0"),
        (
            "following_error_timeout_ms = 20",
            "following_error_timeout_ms = 2000",
        ),
        (
            "following_error_limit_um = 500.0",
            "following_error_limit_um = 50000.0",
        ),
        ("deviation_limit_um = 500.0", "deviation_limit_um = 50000.0"),
        (
            "high_mm = [500.0, 400.0, 300.0]",
            "high_mm = [60.0, 40.0, 30.0]",
        ),
        (
            "step_mm = 25.0\nsamples = 50",
            "step_mm = 15.0\nsamples = 5\nwarmth_tolerance_k = 2.0",
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
    ];
    changes
        .iter()
        .fold(machine.to_owned(), |text, (from, to)| text.edit(from, to))
}

/// The machine, and where its files are.
pub(crate) struct Live {
    emulated: EmulatedOnPtys,
    folder: tempfile::TempDir,
    ports: Vec<String>,
    _turn: MutexGuard<'static, ()>,
}

impl Live {
    fn new(rig: Rig) -> Self {
        Self::of(rig, |text| text)
    }

    /// The same, its emulation after `change`.
    pub(crate) fn of(rig: Rig, change: impl Fn(String) -> String) -> Self {
        Self::shaped(rig, |text| text, change)
    }

    /// The same, its small configuration after `shape` too.
    pub(crate) fn shaped(
        rig: Rig,
        shape: impl Fn(String) -> String,
        change: impl Fn(String) -> String,
    ) -> Self {
        let turn = one_machine();
        let toml = &change(VOLUMETRIC.emulated.to_owned());
        let emulated = match rig {
            Rig::Vcan => EmulatedOnPtys::in_lockstep_on_socketcan(toml, 51, INTERFACE),
            Rig::Pty | Rig::InProcess => EmulatedOnPtys::in_lockstep(toml, 51),
        };
        let emulated = emulated.unwrap_or_else(|error| panic!("{error}"));
        let folder = tempfile::tempdir().expect("a temporary folder can be made");
        let machine = shape(small(VOLUMETRIC.machine));
        fs::write(folder.path().join("machine.toml"), machine).expect("there is room");
        let ports = ports(&emulated);
        Self {
            emulated,
            folder,
            ports,
            _turn: turn,
        }
    }

    /// Where its files are.
    pub(crate) fn folder(&self) -> &Path {
        self.folder.path()
    }

    pub(crate) fn command(&self, words: &[&str]) -> Command {
        let mut command = self.plain_command(words);
        command.arg("--json");
        command
    }

    /// Its output is for people.
    pub(crate) fn plain_command(&self, words: &[&str]) -> Command {
        self.plain_command_by(words, Path::new("ask"))
    }

    /// The same, by the hand of the emulated machine, which sets up what it is asked for.
    fn command_by_itself(&self, words: &[&str]) -> Command {
        let hand = self.emulated.clock().expect("it has one");
        self.plain_command_by(words, &hand)
    }

    fn plain_command_by(&self, words: &[&str], hand: &Path) -> Command {
        let mut command = Command::new(program("truestage"));
        command.current_dir(self.folder.path()).args(words);
        let clock = self.emulated.clock().expect("it has one");
        command.arg("--clock");
        command.arg(format!("lockstep:{}", clock.display()));
        command.arg("--hand").arg(hand);
        for port in &self.ports {
            command.args(["--port", port]);
        }
        command
    }

    /// A verb that does not use the machine itself.
    fn run_nowhere(&self, words: &[&str]) -> Ended {
        let mut command = Command::new(program("truestage"));
        command.current_dir(self.folder.path()).args(words);
        Process::start(command.arg("--json")).end()
    }

    fn run(&self, words: &[&str]) -> Ended {
        Process::start(&mut self.command(words)).end()
    }

    /// A verb that asks for lines: each is set up and Enter pressed, unless it is the one at which
    /// the person stops the program. Says which were asked for.
    fn run_with_hand(&self, words: &[&str], stops_at: Option<usize>) -> (Ended, Vec<usize>) {
        let terminal = openpty(None, None).expect("a terminal can be had");
        let mut keyboard = File::from(terminal.master);
        let process = Process::start_at(&mut self.command(words), terminal.slave.into());
        let mut asked = Vec::new();
        let mut task = None;
        let ended = process.end_heard(|process, said| {
            if let Some(line) = said.strip_prefix("> line ") {
                let read = read_task(line);
                asked.push(read.step.0);
                task = Some(read);
            } else if said.contains("Enter when it is done") {
                let task = task.take().expect("it says for what");
                if Some(task.step.0) == stops_at {
                    return process.signal(Signal::SIGINT);
                }
                let done = self.emulated.set_up_line(&task);
                done.unwrap_or_else(|error| panic!("{error}"));
                keyboard.write_all(b"\n").expect("it has a keyboard");
            }
        });
        (ended, asked)
    }

    fn path(&self, value: &Value) -> PathBuf {
        self.folder.path().join(text(value))
    }

    fn write(&self, name: &str, rows: &str) {
        let csv = format!("time_s,x_mm,y_mm,z_mm\n{rows}");
        fs::write(self.folder.path().join(name), csv).expect("there is room");
    }
}

/// `can0=slcan:/dev/pts/4` and the like for each port of the machine.
fn ports(emulated: &EmulatedOnPtys) -> Vec<String> {
    let described = emulated.description().into_iter();
    let ports = described.map(|line| {
        let words: Vec<&str> = line.split_whitespace().collect();
        match words[..] {
            [name, "SLCAN", path] => format!("{name}=slcan:{path}"),
            [name, "SocketCAN", _] => format!("{name}=socketcan:{INTERFACE}"),
            [name, _, path] => format!("{name}={path}"),
            _ => panic!("`{line}` is not NAME KIND PATH"),
        }
    });
    ports.collect()
}

/// What a person reads on the screen: `3 of 31: linear optics, … offset (0.000, 0.000, -100.000) mm;
/// beam from (0.000, 0.000, 0.000) mm (…) to (60.000, 0.000, 0.000) mm`.
fn read_task(said: &str) -> LineTask {
    let (step, what) = said.split_once(": ").expect("which line, and what");
    let (number, of) = step.split_once(" of ").expect("which of how many");
    let axis = |before: &str| {
        let (_, after) = what.split_once(before)?;
        let name = after.chars().next()?;
        Axis::ALL
            .into_iter()
            .find(|it| it.to_string().starts_with(name))
    };
    let optics = if let Some(across) = axis("straightness optics that see ") {
        LineOptics::Straightness { across }
    } else if let Some(about) = axis("angular optics that see tilts about ") {
        LineOptics::Angular { about }
    } else {
        assert!(what.starts_with("linear optics"), "{what}");
        LineOptics::Linear
    };
    let [tool, start, end] = ["at offset ", "beam from ", " to "].map(|before| {
        let (_, after) = what.split_once(before).expect("a place");
        read_place(after)
    });
    LineTask {
        optics,
        start,
        end,
        tool,
        step: [number, of].map(|it| it.parse().expect("a number")).into(),
    }
}

fn read_place(said: &str) -> Point {
    let inner = said.strip_prefix('(').and_then(|it| it.split_once(')'));
    let (numbers, _) = inner.expect("three numbers in brackets");
    let mut numbers = numbers.split(", ").map(|it| it.parse().expect("a number"));
    point_mm([(); 3].map(|()| numbers.next().expect("three numbers")))
}

#[test]
fn three_axes_are_zeroed_calibrated_verified_and_moved_from_process_to_process() {
    // Three axes and their drives on the one core of a guest: too much for minutes without a pause.
    for rig in live_rigs().filter(|rig| vcan_is_native() || *rig == Rig::Pty) {
        let live = Live::new(rig);
        refuses_before_anything_moves(&live);
        let zero = live.run(&["zero", "machine.toml"]).with_code(0);
        assert_eq!(zero["axes"], serde_json::json!(["x", "y", "z"]));
        let geometry = calibrates(&live);
        verifies(&live);
        let taken = live.run(&["reference", "machine.toml"]).with_code(0);
        assert_eq!(taken["geometry"], geometry);
        remembers(&live);
        moves(&live);
        let departure = follows(&live);
        kept(&live, &geometry, &departure);
    }
}

/// The names of what is in use.
fn in_use(live: &Live) -> Vec<Value> {
    let list = live
        .run_nowhere(&["cal", "list", "machine.toml"])
        .with_code(0);
    let list = list["calibrations"].as_array().expect("a list").clone();
    let active = list.into_iter().filter(|it| it["active"] == true);
    active.map(|it| it["id"].clone()).collect()
}

#[test]
fn three_axes_are_calibrated_and_verified_by_one_command_that_says_so_in_text_json_and_exit_code() {
    for rig in live_rigs().filter(|rig| *rig == Rig::Pty) {
        let live = Live::new(rig);
        let words = ["calibrate", "machine.toml", "--verify"];
        let made = Process::start(live.command_by_itself(&words).arg("--json")).end();
        let made = made.with_code(0);
        assert_eq!(
            (&made["schema"], &made["verb"]),
            (&1.into(), &"calibrate".into())
        );
        let verified = &made["verified"];
        assert_eq!(verified["within_tolerance"], true, "{verified:#}");
        let points = verified["points"].as_array().expect("a list");
        assert_eq!(points.len(), 3, "{verified:#}");
        let used = in_use(&live);
        assert_eq!(used.len(), 2, "{used:?}");
        for own in ["geometry", "references"] {
            assert!(used.contains(&made[own]), "{own} of {made:#}");
        }
        let journal = live.path(&verified["journal"]);
        let read = read_journal::<VolumeLog>(&journal).unwrap_or_else(|it| panic!("{it}"));
        assert_eq!(
            read.header.calibration.as_deref(),
            made["geometry"].as_str()
        );
        assert!(read.complete);

        // Nobody's machine is as good as that.
        let strict = fs::read_to_string(live.folder.path().join("machine.toml"));
        let strict = strict
            .expect("it is there")
            .edit("points = 3\nlimit_um = 3.0", "points = 3\nlimit_um = 0.001");
        fs::write(live.folder.path().join("machine.toml"), strict).expect("there is room");
        let ended = live.command_by_itself(&words).output();
        let ended = ended.expect("it can be started");
        assert_eq!(ended.status.code(), Some(5), "{ended:?}");
        let told = String::from_utf8_lossy(&ended.stdout);
        let said = String::from_utf8_lossy(&ended.stderr);
        for word in [
            "errors ",
            " are in use: ",
            "deviations along the line: range",
            "0.001 µm",
        ] {
            assert!(told.contains(word), "`{word}` is not in {told}");
        }
        assert!(said.contains("error: "), "{said}");
        let used_then = in_use(&live);
        assert!(
            used_then.iter().all(|it| !used.contains(it)),
            "{used_then:?}"
        );
        let name = used_then.iter().find(|it| told.contains(&text(it)[..12]));
        assert!(name.is_some(), "{used_then:?}: {told}");
    }
}

/// Through a service paths are followed and refused as without one, states kept, and calibrations chosen.
fn kept(live: &Live, geometry: &Value, departure: &Value) {
    let words = ["serve", "machine.toml", "--listen", "unix:truestage.sock"];
    let mut service = Process::start(&mut live.command(&words));
    let socket = live.folder.path().join("truestage.sock");
    service.wait_until(|| {
        let answers = UnixStream::connect(&socket).is_ok();
        answers && live.run_nowhere(&["status"]).code == Some(0)
    });
    assert_eq!(&follows(live), departure);
    remembers(live);
    let id = text(geometry);
    let chosen = live.run_nowhere(&["cal", "activate", "machine.toml", &id[..12]]);
    let chosen = chosen.with_code(0);
    assert_eq!(
        (&chosen["axis"], &chosen["active"]),
        (&"volume".into(), geometry)
    );
    let never = live.run_nowhere(&["cal", "rollback", "machine.toml", "--axis", "volume"]);
    check_error(&never.with_code(2), &["volume", "earlier"]);
    let words = ["calibrate", "machine.toml", "--yes", "--warm-up-min=-1"];
    check_error(&live.run(&words).with_code(2), &["warm"]);
    service.signal(Signal::SIGTERM);
    assert_eq!(service.end().code, Some(0));
}

/// Verbs that need what was never measured, and words that mean nothing.
fn refuses_before_anything_moves(live: &Live) {
    for verb in [
        &["reference"][..],
        &["memory", "record"],
        &["verify", "--yes"],
    ] {
        let refused = live.run(&[verb, &["machine.toml"]].concat()).with_code(3);
        check_error(&refused, &["never measured"]);
    }
    live.write("path.csv", "0.0,0,0,0\n1.0,0,0,0\n");
    let words = ["run", "machine.toml", "path.csv", "--first-part"];
    check_error(&live.run(&words).with_code(3), &["never measured"]);
    let words = ["calibrate", "machine.toml", "--yes", "--warm-up-min=-1"];
    check_error(&live.run(&words).with_code(2), &["--warm-up-min"]);
    let words = ["calibrate", "machine.toml", "--yes", "--resume"];
    check_error(
        &live.run(&words).with_code(2),
        &["no interrupted calibrate"],
    );
    let nobody = live.run(&["calibrate", "machine.toml"]).with_code(2);
    check_error(&nobody, &["--yes"]);
}

/// Somebody stops it before its third line, and goes on later. Returns the errors' name.
fn calibrates(live: &Live) -> Value {
    let (stopped, asked) = live.run_with_hand(&["calibrate", "machine.toml"], Some(3));
    let stopped = stopped.with_code(130);
    check_error(&stopped, &["stopped on request", "--resume"]);
    assert_eq!(asked, [1, 2, 3]);
    let (made, asked) = live.run_with_hand(&["calibrate", "machine.toml", "--resume"], None);
    assert_eq!(asked.first(), Some(&3), "{made:?}");
    let made = made.with_code(0);
    let journal =
        read_journal::<VolumeLog>(&live.path(&made["journal"])).unwrap_or_else(|it| panic!("{it}"));
    assert!(journal.complete);
    assert_eq!(number(&made["lines"]) as usize, journal.log.whole.len());
    made["geometry"].clone()
}

fn verifies(live: &Live) {
    let (verified, asked) = live.run_with_hand(&["verify", "machine.toml"], None);
    let verified = verified.with_code(0);
    assert_eq!(asked, [1]);
    assert!(number(&verified["range_um"]) < number(&verified["limit_um"]));
    let journal = live.path(&verified["journal"]);
    let read = read_journal::<VolumeLog>(&journal).unwrap_or_else(|it| panic!("{it}"));
    assert!(read.complete && read.header.calibration.is_some());
    let page = truestage(
        live.folder.path(),
        &["report", &journal.display().to_string()],
    );
    assert!(Path::new(text(&page.with_code(0)["report"])).exists());
}

fn remembers(live: &Live) {
    let shape = "axis,along,position_mm,displacement_um\nx,y,0,0\nx,y,30,2.5\nx,y,60,0\n";
    fs::write(live.folder.path().join("shape.csv"), shape).expect("there is room");
    let designed = live
        .run_nowhere(&["memory", "import", "machine.toml", "shape.csv"])
        .with_code(0);
    assert_eq!(designed["axes"][0]["to_mm"], 60.0, "{designed}");
    let first = ["memory", "clear", "machine.toml", "--memory", "first"];
    let cleared = live.run(&first).with_code(0);
    assert_eq!(cleared["cleared"], designed["memory"]);
    let kept = live.run(&["memory", "record", "machine.toml"]).with_code(0);
    let axes = kept["axes"].as_array().expect("the axes along which it is");
    assert_eq!(axes.len(), 3, "{kept}");
    let cleared = live.run(&["memory", "clear", "machine.toml"]).with_code(0);
    assert_eq!(cleared["cleared"], kept["memory"]);
    for which in ["first", "second"] {
        live.run(&["memory", "record", "machine.toml", "--memory", which])
            .with_code(0);
    }
    let cleared = live.run(&first).with_code(0);
    let foreign = text(&cleared["foreign_second"]).to_owned();
    let cleared = live.run(&["memory", "clear", "machine.toml"]).with_code(0);
    assert_eq!(
        (&cleared["cleared"], &cleared["foreign_second"]),
        (&foreign.into(), &Value::Null)
    );
}

fn moves(live: &Live) {
    let moved = live
        .run(&["move", "machine.toml", "x=30mm", "y=20mm"])
        .with_code(0);
    assert_eq!(moved["corrected"], true);
    assert!((number(&moved["axes"][0]["target_mm"]) - 30.0).abs() < 1e-9);
    assert!(number(&moved["axes"][0]["correction_um"]).abs() > 0.0);
    for target in ["x=900mm", "x=61mm"] {
        let far = live.run(&["move", "machine.toml", target]);
        assert_eq!(far.code, Some(3), "{far:?}");
        check_error(&far.json, &["axis x", "outside"]);
    }
    let unknown = live.run(&["move", "machine.toml", "w=1mm"]).with_code(2);
    check_error(&unknown, &["x, y, z"]);
}

/// Paths that all axes follow, and paths that none does. Where one departs from the joins of its rows most.
fn follows(live: &Live) -> Value {
    // From 0 to 2 mm in two seconds, without a jerk: 10 s³ - 15 s⁴ + 6 s⁵.
    let rows = (0..=50).map(|n: u32| {
        let share = f64::from(n) / 50.0;
        let at = 2.0 * share.powi(3) * (10.0 - 15.0 * share + 6.0 * share.powi(2));
        format!("{:.3},{at:.6},{at:.6},{at:.6}\n", f64::from(n) * 0.04)
    });
    live.write("path.csv", &rows.collect::<String>());
    // Two seconds of periods of 60 ms, and the last row itself.
    let points: Value = 35.into();
    let first = live
        .run(&["run", "machine.toml", "path.csv", "--first-part"])
        .with_code(0);
    assert_eq!(first["points"], points);
    assert!(first["memory"]["memory"].is_string(), "{first}");
    let words = ["run", "machine.toml", "path.csv", "--join", "spline"];
    let next = live.run(&words).with_code(0);
    assert_eq!(
        (&next["points"], &next["corrected"]),
        (&points, &true.into())
    );
    assert!(
        text(&next["thread"]).contains("memory"),
        "it did not ask for real time: {next}"
    );
    for (rows, why, code) in [
        ("0.0,0,0,0\n0.040,zero,0,0\n", "`zero` is not a number", 2),
        ("0.0,0,0,0\n9.0,900,0,0\n", "axis x: a stop from here", 3),
        ("0.0,0,0,0\n40.0,61,0,0\n", "outside the calibrated", 3),
    ] {
        live.write("wrong.csv", rows);
        let refused = live
            .run(&["run", "machine.toml", "wrong.csv"])
            .with_code(code);
        check_error(&refused, &["wrong.csv", why]);
        assert!(
            refused.get("counters").is_none(),
            "something was moved: {refused}"
        );
    }
    next["largest_departure"].clone()
}
