//! What clients and floods do to a service's machine: how late its SYNCs are, and how long a command takes to the bus.
//!
//! It keeps the linear machine, emulated behind pseudo-terminals in real time, and takes these by turns, ROUNDS times,
//! SECONDS each, with a turn of nothing before and after each:
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
//! sent for it. What asks is another process (`load ask`); the emulated machine is in this one.
//!
//! - `load clients SECONDS ROUNDS`: SYNC lateness with clients against nobody, and its goal.
//! - `load flood SECONDS ROUNDS`: the same in a flood, and from a command to its frame.
//! - `load frame SECONDS ROUNDS`: from a command to its frame, whoever asks.
//! - `load second SECONDS ROUNDS TRUESTAGE`: the same against the command line without a service, from its start.
//! - `load show SECONDS ROUNDS [TRUESTAGE]`: all of it, as one JSON object.

mod askers;
mod goals;
mod kept;
mod lone;
mod measured;
mod seen;
mod today;

use core::time::Duration;
use std::path::Path;
use std::time::Instant;

use tests::flood::flood;

use goals::Figure;
use measured::{Load, Measured};

/// From SYNC to SYNC.
const SYNC: Duration = Duration::from_millis(5);

fn main() {
    // cargo puts a word of its own behind them.
    let words = std::env::args().skip(1).filter(|it| it != "--bench");
    let words: Vec<String> = words.collect();
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    match words[..] {
        ["ask", "clients", socket, seconds] => {
            askers::clients(Path::new(socket), seconds_of(seconds));
        }
        ["ask", "flood", address, seconds] => flood(
            address.parse().unwrap(),
            Instant::now() + seconds_of(seconds),
        ),
        ["elsewhere"] => askers::elsewhere(),
        ["show", seconds, rounds] => show(seconds, rounds, None),
        ["show", seconds, rounds, truestage] => show(seconds, rounds, Some(truestage)),
        [figure, seconds, rounds] => judge(figure, seconds, rounds, None),
        [figure, seconds, rounds, truestage] => judge(figure, seconds, rounds, Some(truestage)),
        _ => eprintln!("load: `load clients 8 12`, and see the beginning of bench/load/main.rs"),
    }
}

fn show(seconds: &str, rounds: &str, truestage: Option<&str>) {
    let loads = [Load::Clients, Load::Flood, Load::Elsewhere];
    let measured = Measured::take(
        &loads,
        seconds_of(seconds),
        rounds.parse().unwrap(),
        truestage,
    );
    println!("{}", measured.json());
}

/// One figure and its goal.
fn judge(figure: &str, seconds: &str, rounds: &str, truestage: Option<&str>) {
    let Some(figure) = Figure::named(figure) else {
        return eprintln!("load: no figure `{figure}`: clients, flood, frame, second");
    };
    let span = seconds_of(seconds);
    let measured = Measured::take(figure.loads(), span, rounds.parse().unwrap(), truestage);
    for line in figure.told(&measured) {
        println!("{line}");
    }
}

fn seconds_of(text: &str) -> Duration {
    Duration::from_secs_f64(text.parse().unwrap())
}
