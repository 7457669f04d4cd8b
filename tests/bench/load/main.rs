//! What clients and floods do to a service's machine: how late its SYNCs are, and how long a command takes to the bus.
//!
//! `load show SECONDS ROUNDS [TRUESTAGE]` keeps the linear machine, emulated behind pseudo-terminals in real time, and takes
//! these by turns, ROUNDS times, SECONDS each:
//!
//! - nothing: nobody asks;
//! - clients: ten at 100 Hz each, and a stream of events with a sample at every SYNC;
//! - flood: a thousand connections that say nothing, half a request or a request of 10 MB, streams that nobody reads, and
//!   requests as fast as they are answered;
//! - elsewhere: the same flood of a program that only answers: what the computer itself does to whoever must be punctual.
//!
//! Beside the SYNC threads one thread waits for the same deadlines by itself (`lone`).
//!
//! In each it commands short motions and notes the time from before the request to the first frame that the drive is
//! sent for it. What asks is another process (`load clients`, `load flood`); the emulated machine is in this one.
//! With TRUESTAGE, the command line's program, it also notes how long that takes from its start to such a frame, without any
//! service. It prints one JSON object.

mod askers;
mod kept;
mod lone;
mod seen;
mod today;

use core::time::Duration;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::Instant;

use serde_json::{Value, json};
use tests::flood::flood;

use kept::Kept;
use lone::Lone;
use seen::{Done, Seen, is_real_time};

/// From SYNC to SYNC.
const SYNC: Duration = Duration::from_millis(5);
/// As often as the command line moves.
const TODAY: usize = 3;

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    match words[..] {
        ["clients", socket, seconds] => askers::clients(Path::new(socket), seconds_of(seconds)),
        ["flood", address, seconds] => flood(
            address.parse().unwrap(),
            Instant::now() + seconds_of(seconds),
        ),
        ["elsewhere"] => askers::elsewhere(),
        ["show", seconds, rounds] => show(seconds_of(seconds), rounds, None),
        ["show", seconds, rounds, truestage] => {
            show(seconds_of(seconds), rounds, Some(truestage));
        }
        _ => eprintln!("load: `load show 10 9`"),
    }
}

fn seconds_of(text: &str) -> Duration {
    Duration::from_secs_f64(text.parse().unwrap())
}

/// Ends with this.
struct Asker(Child);

impl Drop for Asker {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Other computers ask: what they need of this one's processors is not the service's.
fn asker(words: &[&str]) -> Asker {
    let program = std::env::current_exe().unwrap();
    let mut command = Command::new("nice");
    command.args(["-n", "39"]).arg(program).args(words);
    Asker(command.spawn().unwrap())
}

/// A program that only answers, and where.
fn elsewhere() -> (Asker, String) {
    let program = std::env::current_exe().unwrap();
    let mut command = Command::new(program);
    let child = command.arg("elsewhere").stdout(Stdio::piped()).spawn();
    let mut child = child.unwrap();
    let mut address = String::new();
    let said = child.stdout.take().expect("it is piped");
    BufReader::new(said).read_line(&mut address).unwrap();
    (Asker(child), address.trim().to_owned())
}

fn turn(kept: &Kept, lone: &Lone, seen: &mut Seen, load: Option<&[&str]>, span: Duration) {
    let asker = load.map(asker);
    let desk = kept.service.desk();
    // Figures are taken once a second.
    thread::park_timeout(Duration::from_millis(1500));
    let before = Done::of(&desk, lone);
    seen.commands.extend(kept.commands(span));
    seen.add(&before, &Done::of(&desk, lone));
    drop(asker);
}

fn show(span: Duration, rounds: &str, truestage: Option<&str>) {
    let today = truestage.map(today);
    let kept = Kept::new();
    kept.zero();
    let lone = Lone::start(SYNC);
    let (socket, address) = (kept.unix.display().to_string(), kept.tcp.to_string());
    let (answering, nowhere) = elsewhere();
    // Longer than a turn: it is ended with it.
    let loads: [(&str, Option<&[&str]>); 4] = [
        ("nothing", None),
        ("clients", Some(&["clients", &socket, "3600"])),
        ("flood", Some(&["flood", &address, "3600"])),
        ("elsewhere", Some(&["flood", &nowhere, "3600"])),
    ];
    let mut all = loads.map(|(name, _)| Seen::of(name));
    for round in 0..rounds.parse().unwrap() {
        for (seen, (name, load)) in all.iter_mut().zip(loads) {
            turn(&kept, &lone, seen, load, span);
            eprintln!("round {round}: {name}");
        }
    }
    drop(answering);
    let is_real_time = is_real_time(&kept.service.desk());
    kept.end();
    let quiet = all[0].quiet();
    let turns: Vec<Value> = all.iter_mut().map(|seen| seen.judge(&quiet)).collect();
    let measured = json!({
        "turns": turns,
        "real_time": is_real_time,
        "command_to_frame_limit_ms": (SYNC + Duration::from_millis(1)).as_secs_f64() * 1e3,
        "second_motion": today.map(|it| second_motion(&it, &all[0])),
    });
    println!("{measured}");
}

/// How long the command line of today takes, in seconds, in order; as far as this computer lets it.
fn today(truestage: &str) -> Vec<f64> {
    let truestage = std::fs::canonicalize(truestage).unwrap();
    let mut today: Vec<f64> = (0..TODAY)
        .filter_map(|_| today::start_to_frame(&truestage))
        .map(|it| it.as_secs_f64())
        .collect();
    today.sort_by(f64::total_cmp);
    today
}

/// That beside what a service took that nobody else asks.
fn second_motion(today: &[f64], kept: &Seen) -> Value {
    let service = kept.median_command().as_secs_f64();
    json!({
        "command_line_s": today,
        "service_s": service,
        "command_line_to_service": today.get(today.len() / 2).map(|it| it / service),
    })
}
