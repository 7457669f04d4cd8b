//! A seed is the same log on every computer and in every build: one log of each kind of machine is
//! pinned.
//!
//! In `systems/pinned` lies an excerpt of each log: its number, and of every stretch of lines a number and
//! its first line, so that a failure tells where two logs part. `parts.txt` has the numbers of further seeds,
//! `storms.txt` those of storms.

use std::fmt::Write as _;
use std::path::PathBuf;

use tests::cycles::{PARTS, named};

const SEED: u64 = 1;
/// The seeds whose logs have a number each.
const SEEDS: core::ops::RangeInclusive<u64> = 1..=20;
/// So many lines of a log are one stretch of the excerpt.
const STRETCH: usize = 1000;
/// Whoever means to change what happens on the buses runs the test once with this set.
const AGAIN: &str = "PIN_AGAIN";

/// The log of a machine as it is now.
struct Log {
    hash: u64,
    lines: Vec<String>,
}

/// The log of the machine that ships as `name` is the one that is pinned.
#[track_caller]
pub(super) fn check(name: &str) {
    check_text(name, &excerpt(&log_of(name)));
}

/// The file of `name` has the text `now`.
#[track_caller]
pub(super) fn check_text(name: &str, now: &str) {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("systems/pinned");
    let path = path.join(format!("{name}.txt"));
    if std::env::var_os(AGAIN).is_some() {
        std::fs::write(&path, now).expect("the excerpt can be written");
        return;
    }
    let pinned = std::fs::read_to_string(&path);
    let pinned = pinned.unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    assert!(
        pinned == now,
        "{name}: {}\nAn optimisation, or code that moved, has changed what is done. Where that is meant, note \
         it in CHANGELOG.md and pin the log again: {AGAIN}=1 cargo test -p tests --test \
         systems pinned",
        difference(&pinned, now)
    );
}

#[test]
fn further_seeds_have_the_logs_that_are_pinned() {
    let mut text = String::new();
    for part in &PARTS {
        for seed in SEEDS {
            let bench = part.run(part.bench(seed));
            let hash = bench.emulated.simulation().log_hash();
            writeln!(text, "{} {seed} {hash:016x}", part.name).expect("a text takes every line");
        }
    }
    check_text("parts", &text);
}

fn log_of(name: &str) -> Log {
    let part = named(&PARTS, name);
    let bench = part.bench(SEED);
    bench.emulated.simulation_mut().keep_log();
    let bench = part.run(bench);
    let simulation = bench.emulated.simulation();
    Log {
        hash: simulation.log_hash(),
        lines: simulation.log_lines().to_vec(),
    }
}

/// A line for the whole log, then one for each stretch: where it begins, its number, its first line.
fn excerpt(log: &Log) -> String {
    let mut text = format!("{} lines, log {:016x}\n", log.lines.len(), log.hash);
    for (at, stretch) in log.lines.chunks(STRETCH).enumerate() {
        let (begin, number) = (at * STRETCH, number_of(stretch));
        writeln!(text, "{begin:6} {number:016x} {}", stretch[0]).expect("a text takes every line");
    }
    text
}

/// FNV-1a.
fn number_of(lines: &[String]) -> u64 {
    let bytes = lines.iter().flat_map(|line| line.bytes());
    bytes.fold(0xCBF2_9CE4_8422_2325, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01B3)
    })
}

/// Where two excerpts part, in words.
fn difference(pinned: &str, now: &str) -> String {
    let (mut pinned, mut now) = (pinned.lines(), now.lines());
    let heads = [pinned.next(), now.next()].map(Option::unwrap_or_default);
    let first = pinned.zip(now).find(|(pinned, now)| pinned != now);
    let place = match first {
        None => "one of them ends earlier".to_owned(),
        Some((pinned, now)) if text_of(pinned) == text_of(now) => format!(
            "they part within the {STRETCH} lines that begin with\n  {}",
            text_of(now)
        ),
        Some((pinned, now)) => format!(
            "they have parted before this line, pinned and now:\n  {}\n  {}",
            text_of(pinned),
            text_of(now)
        ),
    };
    format!(
        "the log is another one.\n  pinned: {}\n  now:    {}\n{place}",
        heads[0], heads[1]
    )
}

/// The line of the log in a line of the excerpt.
fn text_of(line: &str) -> &str {
    line.trim_start().splitn(3, ' ').nth(2).unwrap_or_default()
}

#[test]
fn a_log_that_is_another_one_is_told_from_where() {
    let line = |at: usize| format!("{at:015} 0 > 181#{at:04X}");
    let log = |lines: Vec<String>| Log {
        hash: number_of(&lines),
        lines,
    };
    let pinned = log((0..3500).map(line).collect());
    let mut other: Vec<String> = (0..3500).map(line).collect();
    other[1234] = "something else".into();
    let told = difference(&excerpt(&pinned), &excerpt(&log(other)));
    assert!(told.contains(&line(1000)), "{told}");
    assert!(told.contains("part within the 1000 lines"), "{told}");
    let shorter = log((0..3000).map(line).collect());
    let told = difference(&excerpt(&pinned), &excerpt(&shorter));
    assert!(told.contains("ends earlier"), "{told}");
}
