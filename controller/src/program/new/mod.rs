//! `truestage new`: a machine's file to begin with, from an example that ships, answers and what a scan found.

mod draft;
mod example;
mod found;
mod questions;

use std::fs::File;
use std::io::{ErrorKind, IsTerminal, Write, stdin};
use std::path::{Path, PathBuf};

use clap::Args;
use serde_json::json;

use self::draft::Draft;
use self::example::Example;
use crate::Failure;
use crate::config;
use crate::config::lines::MARK;
use crate::ports::Overrides;
use crate::program::data_text::read;
use crate::program::output::{Ended, Output};
use crate::program::streams;

/// What it is made from.
#[derive(Debug, Args)]
pub(crate) struct NewArgs {
    /// The file to write; it must not exist yet.
    #[arg(default_value = "machine.toml")]
    config: PathBuf,
    /// The machine that ships and is most like yours.
    #[arg(long)]
    machine: Option<Example>,
    /// Where a bus or a line is found: `can0=socketcan:can0`, `can0=slcan:/dev/ttyACM1`, `laser=/dev/ttyACM0`. May be
    /// given several times.
    #[arg(long = "port", value_name = "NAME=ENDPOINT")]
    ports: Vec<String>,
    /// What `truestage scan --json` printed: node numbers and identities are taken from it.
    #[arg(long, value_name = "FILE")]
    found: Option<PathBuf>,
    /// What a key says: `axis.x.soft_max_mm=250`. May be given several times.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Ask nothing, not even at a terminal.
    #[arg(long)]
    yes: bool,
}

pub(crate) fn run(args: &NewArgs, output: Output) -> Ended {
    refuse_existing(&args.config)?;
    let is_asked = !args.yes && stdin().is_terminal() && streams::is_err_terminal();
    let example = match (args.machine, is_asked) {
        (Some(which), _) => which,
        (None, true) => questions::which(output)?,
        (None, false) => return Err(no_machine()),
    };
    let text = example.text;
    let mut draft = Draft::of(text);
    let notes = fill(&mut draft, text, args)?;
    if is_asked {
        questions::ask(&mut draft, output)?;
    }
    let text = draft.text();
    let unfit = config::parse(&text, &args.config.display().to_string()).err();
    // Whoever answered at a terminal does not answer all of it twice.
    if let Some(unfit) = unfit {
        if is_asked {
            write(&args.config, &text)?;
            output.note(&unfinished(&args.config));
        }
        return Err(unfit.into());
    }
    write(&args.config, &text)?;
    tell(&args.config, &draft, &notes, output)
}

/// By what was given beside the command; says what somebody should look at.
fn fill(draft: &mut Draft, example: &str, args: &NewArgs) -> Result<Vec<String>, Failure> {
    let shipped = config::parse(example, "an example")?.config;
    for (name, endpoint) in Overrides::parse(&args.ports, &shipped)?.each() {
        draft.connect(name, endpoint);
    }
    let notes = match &args.found {
        Some(path) => found::fill(draft, &scan(path)?),
        None => Vec::new(),
    };
    for word in &args.set {
        let known = word.split_once('=');
        let is_set = known.is_some_and(|(key, value)| draft.set(key.trim(), value.trim()));
        if !is_set {
            return Err(Failure::Usage {
                what: format!("`--set {word}`: the example has no such key"),
                help: "write KEY=VALUE with a key of the file, such as axis.x.soft_max_mm=250; what it does not have is \
                       added to the file afterwards"
                    .into(),
            });
        }
    }
    Ok(notes)
}

fn scan(path: &Path) -> Result<found::Scan, Failure> {
    serde_json::from_str(&read(path)?).map_err(|error| Failure::Usage {
        what: format!(
            "--found {}: not what a scan prints: {error}",
            path.display()
        ),
        help: "`truestage scan machine.toml --json > found.json` writes it".into(),
    })
}

fn tell(path: &Path, draft: &Draft, notes: &[String], output: Output) -> Ended {
    let marked = draft.marked();
    let mut text = format!(
        "{}: written; {} still an example's and marked `{MARK}`: `truestage check` lists them",
        path.display(),
        is_are(marked.len()),
    );
    for note in notes {
        text += &format!("\n{note}");
    }
    let keys: Vec<_> = marked.iter().map(|it| &it.path).collect();
    output.result(
        &text,
        &json!({"config": path, "to_fill_in": keys, "notes": notes}),
    )
}

fn unfinished(path: &Path) -> String {
    format!(
        "{}: written with what was answered, which does not fit yet: mend it there, `truestage check` judges it",
        path.display()
    )
}

fn is_are(count: usize) -> String {
    match count {
        1 => "1 value is".into(),
        count => format!("{count} values are"),
    }
}

fn no_machine() -> Failure {
    Failure::Usage {
        what: "nothing says what the machine is like".into(),
        help: "add --machine with one that ships; `truestage new --help` lists them".into(),
    }
}

fn exists(path: &Path) -> Failure {
    Failure::Usage {
        what: format!("{}: this file already exists", path.display()),
        help: "it was not changed; give another name, or move it away".into(),
    }
}

/// Before anything is asked.
fn refuse_existing(path: &Path) -> Result<(), Failure> {
    match path.exists() {
        true => Err(exists(path)),
        false => Ok(()),
    }
}

fn write(path: &Path, text: &str) -> Result<(), Failure> {
    let written = File::create_new(path).and_then(|mut it| it.write_all(text.as_bytes()));
    written.map_err(|source| match source.kind() {
        ErrorKind::AlreadyExists => exists(path),
        _ => Failure::File {
            path: path.to_owned(),
            source,
        },
    })
}
