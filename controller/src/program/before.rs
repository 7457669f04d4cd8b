//! What is said before anything moves: on a terminal it is shown and asked for, with `--dry-run` it is all that happens.

use std::io::{BufRead, IsTerminal, stdin};

use machine::records::{Lease, short};
use serde_json::{Value, json};

use crate::Failure;
use crate::config::{self, Loaded};
use crate::program::AskArgs;
use crate::program::answering::Asked;
use crate::program::intended::{Intent, Step};
use crate::program::kept::{self, Service};
use crate::program::kind::{KINDS, by_kind};
use crate::program::output::{Ended, Output};
use crate::program::streams;
use crate::program::verbs::Verbs;

/// Does what is intended, once it has been said what that is and nobody has objected: here, or by the service that
/// keeps the machine.
pub(crate) fn run(intent: Intent<'_>, output: Output) -> Ended {
    let ended = by_kind(intent.machine(), intent.named().into_iter(), |kind| {
        (kind.refuse)(intent)?;
        let loaded = config::load(&intent.machine().config)?;
        loaded.filled_in()?;
        let steps = steps(kind, &loaded, intent)?;
        let zeroes_first = !matches!(intent, Intent::Zero(_));
        match said(&loaded, &steps, (intent.ask(), zeroes_first), output)? {
            Some(ended) => ended,
            None => here(intent, kind, output),
        }
    });
    kept::or_by_its_service(ended, |service| there(intent, service, output))
}

/// Says what is going to happen, and asks whether it shall; how a verb ends that was only to say it. `zeroes_first`:
/// it finds a zero only where there is none, if a service keeps the machine.
///
/// # Errors
/// When nobody agrees.
pub(crate) fn said(
    loaded: &Loaded,
    steps: &[Step],
    (ask, zeroes_first): (AskArgs, bool),
    output: Output,
) -> Result<Option<Ended>, Failure> {
    if ask.dry_run {
        let ended = output.result(&told(loaded, steps), &value(loaded, steps));
        return Ok(Some(ended));
    }
    let is_asked = stdin().is_terminal() && streams::is_err_terminal();
    if !ask.yes && is_asked && steps.iter().any(Step::moves) {
        output.must_say(&told(loaded, steps));
        if is_kept(loaded) && zeroes_first {
            output
                .must_say("  a service keeps this machine: what has its zero is not zeroed again");
        }
        agreed_to(output)?;
    }
    Ok(None)
}

/// Whether a service has the machine.
fn is_kept(loaded: &Loaded) -> bool {
    let owner = Lease::owner(&loaded.config.machine.store());
    owner.is_some_and(|(_, places)| !places.is_empty())
}

fn steps(kind: &Verbs, loaded: &Loaded, intent: Intent<'_>) -> Result<Vec<Step>, Failure> {
    (kind.intended)(loaded, &loaded.config.machine.store(), intent)
}

fn told(loaded: &Loaded, steps: &[Step]) -> String {
    let machine = &loaded.config.machine;
    let first = format!(
        "machine {}, stage {}, configuration {}",
        machine.name,
        machine.stage_serial,
        short(loaded.hash.as_str())
    );
    let lines = steps.iter().map(Step::line);
    lines.fold(first, |text, line| format!("{text}\n  {line}"))
}

fn value(loaded: &Loaded, steps: &[Step]) -> Value {
    let machine = &loaded.config.machine;
    json!({
        "dry_run": true,
        "machine": machine.name,
        "stage_serial": machine.stage_serial,
        "hash": loaded.hash.as_str(),
        "steps": steps.iter().map(Step::value).collect::<Vec<_>>(),
    })
}

/// Waits for a yes.
fn agreed_to(output: Output) -> Result<(), Failure> {
    output.must_say("go on? y and Enter; anything else leaves everything where it is");
    let mut answer = String::new();
    let read = stdin().lock().read_line(&mut answer);
    let is_yes = matches!(answer.trim(), "y" | "Y" | "yes");
    if read.is_ok() && is_yes {
        return Ok(());
    }
    Err(Failure::Usage {
        what: "nobody agreed to that; nothing was moved".into(),
        help:
            "answer y, or write --yes to be asked nothing; --dry-run only says what would be done"
                .into(),
    })
}

fn here(intent: Intent<'_>, kind: &Verbs, output: Output) -> Ended {
    match intent {
        Intent::Zero(args) => (kind.zero)(&args.axis, output),
        Intent::Calibrate(args) => (kind.calibrate)(args, output),
        Intent::Verify(args) => (kind.verify)(args, output),
        Intent::Move(args) => (kind.move_to)(args, output),
    }
}

fn there(intent: Intent<'_>, service: &Service, output: Output) -> Ended {
    match intent {
        Intent::Zero(args) => service.zero(&args.axis, output),
        Intent::Calibrate(args) => service.calibrate(args, asked(), output),
        Intent::Verify(args) => service.verify(args, asked(), output),
        Intent::Move(args) => by_kind(intent.machine(), intent.named().into_iter(), |kind| {
            service.move_to(args, (kind.motion)(args)?, output)
        }),
    }
}

/// What a person is asked by runs of any kind.
fn asked() -> Vec<&'static Asked> {
    KINDS.iter().flat_map(|it| it.asked).collect()
}
