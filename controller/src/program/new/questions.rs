//! What a person at a terminal is asked of a machine that is new.

use std::collections::BTreeMap;
use std::io::{BufRead, stdin};

use clap::ValueEnum;

use super::draft::{Draft, Place};
use super::example::Example;
use crate::Failure;
use crate::config::lines::key_on;
use crate::config::{self, ConfigError, Diagnostic};
use crate::program::output::Output;

/// Which of the machines that ship is most like his.
pub(super) fn which(output: Output) -> Result<Example, Failure> {
    output.must_say("Which machine is yours most like?");
    for it in Example::value_variants() {
        output.must_say(&format!("  {:<12} {}", it.name, it.help));
    }
    loop {
        let typed = answer().ok_or_else(nobody)?;
        match Example::from_str(&typed, true) {
            Ok(which) => return Ok(which),
            Err(_) => output.must_say(&format!("`{typed}` is none of them")),
        }
    }
}

/// What became of a question.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Asked {
    Answered,
    /// Left as it was.
    Left,
    /// Nobody answers any more.
    Over,
}

/// Asks for what every machine has another of: once, and what a scan finds not at all. Then for what does not fit
/// the answers, until all of it fits, or nobody has a better answer.
pub(super) fn ask(draft: &mut Draft, output: Output) -> Result<(), Failure> {
    output.must_say(
        "Enter leaves the example's value, in brackets, marked FILL IN. A CAN interface of the kernel is told by --port \
         can0=socketcan:can0.",
    );
    let mut is_answered = false;
    for place in asked(draft) {
        match put(draft, &place, output) {
            Asked::Answered => is_answered = true,
            Asked::Left => {}
            Asked::Over if is_answered => return Ok(()),
            Asked::Over => return Err(nobody()),
        }
    }
    while ask_again(draft, output) == Asked::Answered {}
    Ok(())
}

/// For what does not fit, each once.
fn ask_again(draft: &mut Draft, output: Output) -> Asked {
    let mut ended = Asked::Left;
    let text = draft.text();
    let Err(ConfigError::Invalid { findings }) = config::parse(&text, "") else {
        return ended;
    };
    for it in &findings {
        output.must_say(&format!("{}: {}; {}", it.key, it.cause, it.help));
        let place = draft.at(&it.key);
        let Some(place) = place.or_else(|| draft.at(&key_on(&text, it.line)?)) else {
            continue;
        };
        match put(draft, &place, output) {
            Asked::Answered => ended = Asked::Answered,
            Asked::Left => {}
            Asked::Over => return Asked::Over,
        }
    }
    ended
}

/// Whether a scan finds it.
fn is_found(place: &Place) -> bool {
    place.path.ends_with(".node_id") || place.path.contains(".identity.")
}

/// What several devices have alike is filled in by an editor.
fn asked(draft: &Draft) -> Vec<Place> {
    let mut places = draft.marked();
    places.retain(|it| !is_found(it));
    let mut counts: BTreeMap<String, usize> = BTreeMap::new();
    for it in &places {
        *counts.entry(it.explained.of.clone()).or_default() += 1;
    }
    places.retain(|it| counts[&it.explained.of] == 1);
    places
}

fn put(draft: &mut Draft, place: &Place, output: Output) -> Asked {
    let Place {
        path,
        value,
        explained,
    } = place;
    output.must_say(&format!("{path} [{value}]: {}", explained.text));
    loop {
        let Some(typed) = answer() else {
            return Asked::Over;
        };
        if typed.is_empty() {
            return Asked::Left;
        }
        let mut tried = draft.clone();
        tried.set(path, &typed);
        match wrong(&tried, path) {
            Some(it) => output.must_say(&format!("{}; {}", it.cause, it.help)),
            None => {
                *draft = tried;
                return Asked::Answered;
            }
        }
    }
}

/// What is found of the key at `path`, or on its line: findings may name it otherwise, or not at all.
fn wrong(draft: &Draft, path: &str) -> Option<Diagnostic> {
    let text = draft.text();
    let Err(ConfigError::Invalid { findings }) = config::parse(&text, "") else {
        return None;
    };
    let mut findings = findings.into_iter();
    findings.find(|it| it.key == path || key_on(&text, it.line).is_some_and(|it| it == path))
}

/// `None` when there is nobody any more.
fn answer() -> Option<String> {
    let mut typed = Vec::new();
    match stdin().lock().read_until(b'\n', &mut typed) {
        Ok(0) | Err(_) => None,
        Ok(_) => Some(String::from_utf8_lossy(&typed).trim().to_owned()),
    }
}

fn nobody() -> Failure {
    Failure::Usage {
        what: "nobody answers; nothing was written".into(),
        help: "give --machine and --set, and --yes to be asked nothing".into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_wrong_of_a_value_is_found_in_a_list_and_where_it_is_no_value_at_all() {
        let mut draft = Draft::of(include_str!("../../../../configs/machines/uvw.toml"));
        let path = "platform.actuator.1.direction";
        for (typed, is_wrong) in [("[0.0, 0.0]", true), ("five", true), ("[0.0, 1.0]", false)] {
            draft.set(path, typed);
            assert_eq!(wrong(&draft, path).is_some(), is_wrong, "{typed}");
            assert!(wrong(&draft, "platform.actuator.0.direction").is_none());
        }
    }
}
