//! What a person at a terminal is asked of a machine that is new.

use std::collections::BTreeMap;
use std::io::{BufRead, stdin};

use clap::ValueEnum;

use super::draft::{Draft, Place};
use crate::Failure;
use crate::config::{self, ConfigError};
use crate::program::demo::which::Which;
use crate::program::output::Output;

/// Which of the machines that ship is most like his.
pub(super) fn which(output: Output) -> Result<Which, Failure> {
    output.note("Which machine is yours most like?");
    for it in Which::value_variants() {
        output.note(&format!("  {:<12} {}", it.0.name, it.0.help));
    }
    loop {
        let typed = answer()?;
        match Which::from_str(&typed, true) {
            Ok(which) => return Ok(which),
            Err(_) => output.note(&format!("`{typed}` is none of them")),
        }
    }
}

/// Asks for what every machine has another of: once, and what a scan finds not at all. Then for what does not fit
/// the answers, until all of it fits, or nobody has a better answer.
pub(super) fn ask(draft: &mut Draft, output: Output) -> Result<(), Failure> {
    output.note(
        "Enter leaves the example's value, in brackets, marked FILL IN. A CAN interface of the kernel is told by --port \
         can0=socketcan:can0.",
    );
    for place in asked(draft) {
        put(draft, &place, output)?;
    }
    while let Err(ConfigError::Invalid { findings }) = config::parse(&draft.text(), "") {
        let mut is_answered = false;
        for finding in &findings {
            output.note(&format!(
                "{}: {}; {}",
                finding.key, finding.cause, finding.help
            ));
            let place = draft.at(&finding.key);
            is_answered |= place.map_or(Ok(false), |it| put(draft, &it, output))?;
        }
        if !is_answered {
            break;
        }
    }
    Ok(())
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

/// Whether there is an answer.
fn put(draft: &mut Draft, place: &Place, output: Output) -> Result<bool, Failure> {
    let Place {
        path,
        value,
        explained,
    } = place;
    output.note(&format!("{path} [{value}]: {}", explained.text));
    loop {
        let typed = answer()?;
        if typed.is_empty() {
            return Ok(false);
        }
        let mut tried = draft.clone();
        tried.set(path, &typed);
        let wrong = match config::parse(&tried.text(), "") {
            Err(ConfigError::Invalid { findings }) => {
                findings.into_iter().find(|it| it.key == *path)
            }
            _ => None,
        };
        match wrong {
            Some(it) => output.note(&format!("{}; {}", it.cause, it.help)),
            None => {
                *draft = tried;
                return Ok(true);
            }
        }
    }
}

fn answer() -> Result<String, Failure> {
    let mut typed = String::new();
    match stdin().lock().read_line(&mut typed) {
        Ok(0) => Err(Failure::Usage {
            what: "nobody answers; nothing was written".into(),
            help: "give --machine and --set, and --yes to be asked nothing".into(),
        }),
        Ok(_) => Ok(typed.trim().to_owned()),
        Err(source) => Err(Failure::File {
            path: "the terminal".into(),
            source,
        }),
    }
}
