//! The command line of today, without a service: a start, a zero and a move each time.

use core::time::Duration;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

use tests::{Edit, LINEAR};
use truestage::emulated::EmulatedOnPtys;
use units::Time;
use wire::candump::{Content, Record};

/// The same machine, anywhere but where it is.
const TARGET: &str = "x=11mm";
/// That in counts of 10 nm.
const COUNTS: i32 = 1_100_000;

/// So often it is tried: on a busy computer an emulated drive may be silent for too long, which ends a move.
const TRIES: u32 = 5;

/// From the begin of the recording of one `truestage move` to the frame that tells the drive where to go; nothing when it
/// never moves, which is said.
pub(crate) fn start_to_frame(program: &Path) -> Option<Duration> {
    let mut tries = (0..TRIES).map(|_| try_to_move(program));
    tries.find_map(|it| it.inspect_err(|said| eprintln!("not moved: {said}")).ok())
}

/// Once; or what it said.
fn try_to_move(program: &Path) -> Result<Duration, String> {
    let folder = tempfile::tempdir().unwrap();
    let patient = LINEAR
        .machine
        .edit("move_timeout_s = 10.0", "move_timeout_s = 60.0");
    fs::write(folder.path().join("machine.toml"), patient).unwrap();
    let emulated = EmulatedOnPtys::start(LINEAR.emulated, 1, 1.0).unwrap();
    let mut command = Command::new(program);
    command.current_dir(folder.path());
    command.args(["move", "machine.toml", TARGET, "--yes", "--uncompensated"]);
    // The emulated drives are waited for as long as a service waits here.
    command.args(["--record", "bus.log", "--clock-speed", "1.001"]);
    for port in emulated.description().iter().filter_map(|it| endpoint(it)) {
        command.args(["--port", &port]);
    }
    let ended = command.stdin(Stdio::null()).output().unwrap();
    if !ended.status.success() {
        return Err(String::from_utf8_lossy(&ended.stderr).into_owned());
    }
    let recording = fs::read_to_string(folder.path().join("bus.log"));
    Ok(first_told(&recording.unwrap()))
}

/// `can0     SLCAN  /dev/pts/4` becomes `can0=slcan:/dev/pts/4`, if the configuration has it.
fn endpoint(line: &str) -> Option<String> {
    let words: Vec<&str> = line.split_whitespace().collect();
    let [name, kind, place] = words[..] else {
        panic!("expected NAME KIND PLACE, seen: {line}")
    };
    let is_configured = LINEAR.machine.contains(&format!(".{name}]"));
    is_configured.then(|| match kind {
        "SLCAN" => format!("{name}=slcan:{place}"),
        _ => format!("{name}={place}"),
    })
}

/// When the drive was told to go there.
fn first_told(recording: &str) -> Duration {
    let is_told = |record: &Record| match &record.content {
        Content::Frame(frame) => {
            let is_to_drive = frame.standard_id() == Some(0x201);
            is_to_drive && frame.data().get(2..6) == Some(&COUNTS.to_le_bytes()[..])
        }
        _ => false,
    };
    let mut records = recording.lines().filter_map(Record::parse);
    let told = records.find(is_told).expect("the drive is told");
    told.at.since(Time::ZERO)
}
