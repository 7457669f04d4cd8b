//! Turns of whoever asks, each between two of nobody.

use core::time::Duration;
use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};
use std::thread;

use serde_json::{Value, json};

use crate::SYNC;
use crate::kept::Kept;
use crate::lone::Lone;
use crate::seen::{Done, Seen, is_real_time};
use crate::today;

/// As often as the command line moves.
const TODAY: usize = 3;
/// How whoever asks becomes a program that gives way: Linux shares processors between sessions first, and `nice` counts within
/// one. In the session of what is measured it would be the kernel's workers that wait.
const GIVES_WAY: &str =
    r#"{ echo 10 >/proc/self/autogroup; } 2>/dev/null; exec nice -n 39 "$0" "$@""#;
/// Figures are taken once a second.
const SETTLED: Duration = Duration::from_millis(1500);

/// Who asks meanwhile.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Load {
    Clients,
    Flood,
    /// A flood, of another program.
    Elsewhere,
}

impl Load {
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Clients => "clients",
            Self::Flood => "flood",
            Self::Elsewhere => "elsewhere",
        }
    }

    /// Other computers ask: what they need of this one's processors is not the service's. It would ask for longer than
    /// a turn, and is ended with it.
    fn begin(self, kept: &Kept, nowhere: &str) -> Ending {
        let place = match self {
            Self::Clients => kept.unix.display().to_string(),
            Self::Flood => kept.tcp.to_string(),
            Self::Elsewhere => nowhere.to_owned(),
        };
        let what = match self {
            Self::Clients => "clients",
            Self::Flood | Self::Elsewhere => "flood",
        };
        let program = std::env::current_exe().unwrap();
        // Each becomes the next: it is ended as one.
        let mut command = Command::new("setsid");
        command.args(["sh", "-c", GIVES_WAY]).arg(program);
        command.args(["ask", what, &place, "3600"]);
        Ending(command.spawn().unwrap())
    }
}

/// Ends with this.
struct Ending(Child);

impl Drop for Ending {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// A program that only answers, and where.
fn elsewhere() -> (Ending, String) {
    let program = std::env::current_exe().unwrap();
    let mut command = Command::new(program);
    let child = command.arg("elsewhere").stdout(Stdio::piped()).spawn();
    let mut child = child.unwrap();
    let mut address = String::new();
    let said = child.stdout.take().expect("it is piped");
    BufReader::new(said).read_line(&mut address).unwrap();
    (Ending(child), address.trim().to_owned())
}

/// What was seen.
pub(crate) struct Measured {
    pub(crate) quiet: Seen,
    pub(crate) loaded: Vec<Seen>,
    pub(crate) is_real_time: bool,
    /// How long the command line of today takes, in seconds, in order; as far as this computer lets it.
    pub(crate) today_s: Option<Vec<f64>>,
}

impl Measured {
    /// By turns of `span` each, so that what disturbs the computer for longer than a turn disturbs all alike.
    pub(crate) fn take(
        loads: &[Load],
        span: Duration,
        rounds: usize,
        truestage: Option<&str>,
    ) -> Self {
        let today_s = truestage.map(today_s);
        let kept = Kept::new();
        kept.zero();
        let lone = Lone::start(SYNC);
        let (answering, nowhere) = elsewhere();
        let mut quiet = Seen::of("nothing");
        let mut loaded: Vec<Seen> = loads.iter().map(|it| Seen::of(it.name())).collect();
        let mut before = turn(&kept, &lone, &mut quiet, span);
        for round in 1..=rounds {
            for (seen, load) in loaded.iter_mut().zip(loads) {
                let asker = load.begin(&kept, &nowhere);
                let during = turn(&kept, &lone, seen, span);
                drop(asker);
                let after = turn(&kept, &lone, &mut quiet, span);
                seen.compare(during, (before * after).sqrt());
                quiet.compare(after, before);
                before = after;
                eprintln!("round {round} of {rounds}: {}", load.name());
            }
        }
        drop(answering);
        let is_real_time = is_real_time(&kept.service.desk());
        kept.end();
        Self {
            quiet,
            loaded,
            is_real_time,
            today_s,
        }
    }

    /// What was seen while `load` asked.
    pub(crate) fn of(&self, load: Load) -> &Seen {
        let mut loaded = self.loaded.iter();
        let seen = loaded.find(|it| it.name == load.name());
        seen.expect("it was measured")
    }

    pub(crate) fn json(&self) -> Value {
        let all = [&self.quiet].into_iter().chain(&self.loaded);
        json!({
            "turns": all.map(Seen::json).collect::<Vec<_>>(),
            "real_time": self.is_real_time,
            "command_to_frame_limit_ms": (SYNC + Duration::from_millis(1)).as_secs_f64() * 1e3,
            "second_motion": self.today_s.as_ref().map(|it| self.second_motion(it)),
        })
    }

    /// The command line beside what a service took that nobody else asks.
    fn second_motion(&self, today_s: &[f64]) -> Value {
        let service = self.quiet.command(0.5).as_secs_f64();
        json!({
            "command_line_s": today_s,
            "service_s": service,
            "command_line_to_service": today_s.get(today_s.len() / 2).map(|it| it / service),
        })
    }
}

/// The 99th percentile of SYNC lateness in this turn, in µs.
fn turn(kept: &Kept, lone: &Lone, seen: &mut Seen, span: Duration) -> f64 {
    let desk = kept.service.desk();
    thread::park_timeout(SETTLED);
    let before = Done::of(&desk, lone);
    seen.commands.extend(kept.commands(span));
    seen.add(&before, &Done::of(&desk, lone))
}

fn today_s(truestage: &str) -> Vec<f64> {
    let truestage = std::fs::canonicalize(truestage).unwrap();
    let mut today: Vec<f64> = (0..TODAY)
        .filter_map(|_| today::start_to_frame(&truestage))
        .map(|it| it.as_secs_f64())
        .collect();
    today.sort_by(f64::total_cmp);
    today
}
