//! Histories by chance: drives with quirks, requests at any moment, judged by the plant's truth alone.
//!
//! No motion outside what was asked by more than the following-error limit and the stopping way, none
//! faster than asked by more than a tenth, no "Standstill" of an axis that moves, no zero that is none,
//! and no motion that begins after a stop was answered.
//!
//! `HISTORIES` is how many are played from the seed `FROM` on, `HISTORY` the only one that is played, with
//! its story.

mod draw;
mod healthy;
mod judge;
mod kind;
mod player;
mod stage;

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

use mock_bus::config::MachineConfig as EmulatedConfig;
use tests::shipped_config;

use draw::draw_steps;
pub(super) use draw::{Dice, draw_quirks};
use judge::{Judge, Violation, Wrong};
use kind::{Kind, LINEAR_STAGE, ROTARY_TABLE, THREE_AXES};
use player::Player;
use stage::Stage;

/// So many in every run.
const USUAL: u64 = 500;
/// So many are told with their stories.
const TOLD: usize = 5;

/// How a history was.
struct Played {
    seed: u64,
    kind: &'static str,
    quirks: Vec<String>,
    story: Vec<String>,
    violation: Option<Violation>,
}

fn play(seed: u64) -> Played {
    let mut dice = Dice::new(seed);
    let kind: &Kind = match dice.share() {
        ..0.35 => &LINEAR_STAGE,
        ..0.43 => &THREE_AXES,
        _ => &ROTARY_TABLE,
    };
    let mut emulated = EmulatedConfig::parse(kind.shipped.emulated).expect("it ships");
    let quirks = draw_quirks(&mut dice, &mut emulated);
    let steps = draw_steps(&mut dice, kind);
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let loaded = shipped_config(&kind.shipped, folder.path(), |text| kind.edited(text));
    let judges = kind.axes.iter().copied().map(Judge::new).collect();
    let stage = Stage::new(&emulated, seed, &loaded, judges);
    let mut player = Player::new(kind, loaded, stage);
    let violation = player.play(&steps);
    Played {
        seed,
        kind: kind.name,
        quirks,
        story: player.story,
        violation,
    }
}

impl Played {
    /// Its number, its quirks and its verdict in one line.
    fn line(&self) -> String {
        let verdict = self.violation.as_ref().map(Violation::to_string);
        let verdict = verdict.unwrap_or_default();
        format!(
            "{:6} {} {:?}: {verdict}\n",
            self.seed, self.kind, self.quirks
        )
    }

    fn text(&self) -> String {
        let mut text = format!("history {}, {}, {:?}\n", self.seed, self.kind, self.quirks);
        for line in &self.story {
            writeln!(text, "  {line}").expect("a text takes every line");
        }
        match &self.violation {
            Some(violation) => writeln!(text, "  {violation}"),
            None => writeln!(text, "  nothing was wrong"),
        }
        .expect("a text takes every line");
        let again = "cargo test -p tests --test systems histories -- --nocapture";
        writeln!(text, "  again: HISTORY={} {again}", self.seed).expect("a text takes every line");
        text
    }
}

/// The whole number in the variable `name` of the environment, if there is one.
fn number(name: &str) -> Option<u64> {
    let text = std::env::var(name).ok()?;
    Some(text.parse().expect("a whole number"))
}

/// The first of the seeds that are drawn; another one draws machines that no run has seen.
fn first_seed() -> u64 {
    number("FROM").unwrap_or(1)
}

/// Plays `count` histories, several at once; returns those that are wrong.
fn play_all(count: u64) -> Vec<Played> {
    let next = AtomicU64::new(first_seed());
    let end = first_seed() + count;
    let wrong = Mutex::new(vec![]);
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    // A history is two threads, of which one waits.
    let players = 4 * cores;
    std::thread::scope(|scope| {
        for _ in 0..players {
            scope.spawn(|| {
                loop {
                    let seed = next.fetch_add(1, Ordering::Relaxed);
                    if seed >= end {
                        return;
                    }
                    let played = play(seed);
                    if played.violation.is_some() {
                        println!("{}", played.line().trim_end());
                        wrong.lock().expect("no history panics").push(played);
                    }
                }
            });
        }
    });
    let mut wrong = wrong.into_inner().expect("no history panics");
    wrong.sort_by_key(|played| played.seed);
    wrong
}

#[test]
fn no_history_moves_an_axis_unasked() {
    if let Some(seed) = number("HISTORY") {
        let played = play(seed);
        println!("{}", played.text());
        assert!(played.violation.is_none(), "{}", played.text());
        return;
    }
    let count = number("HISTORIES").unwrap_or(USUAL);
    let wrong = play_all(count);
    let mut kinds: BTreeMap<Wrong, usize> = BTreeMap::new();
    for played in &wrong {
        let violation = played.violation.as_ref().expect("only those are kept");
        *kinds.entry(violation.wrong).or_default() += 1;
    }
    let stories: String = wrong.iter().take(TOLD).map(Played::text).collect();
    let lines: String = wrong.iter().map(Played::line).collect();
    assert!(
        wrong.is_empty(),
        "{} of {count} histories are wrong, {kinds:?}:\n{lines}\n{stories}",
        wrong.len()
    );
}
