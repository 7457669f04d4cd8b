//! What a verb is going to do.

pub(crate) mod ago;
pub(crate) mod nowhere;

use machine::records::short;
use serde_json::{Value, json};

use crate::Failure;
use crate::config::Loaded;
use crate::program::belongs::head_of;
use crate::program::{
    AskArgs, AxisArgs, CalibrateArgs, MachineArgs, MoveArgs, VerifyArgs, ZeroArgs,
};

/// A verb and its words.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Intent<'a> {
    Zero(&'a ZeroArgs),
    Calibrate(&'a CalibrateArgs),
    Verify(&'a VerifyArgs),
    Move(&'a MoveArgs),
}

impl<'a> Intent<'a> {
    pub(crate) const fn machine(self) -> &'a MachineArgs {
        match self {
            Self::Zero(args) => &args.axis.machine,
            Self::Calibrate(args) => &args.axis.machine,
            Self::Verify(args) => &args.axis.machine,
            Self::Move(args) => &args.machine,
        }
    }

    pub(crate) const fn ask(self) -> AskArgs {
        match self {
            Self::Zero(args) => args.ask,
            Self::Calibrate(args) => args.ask,
            Self::Verify(args) => args.ask,
            Self::Move(args) => args.ask,
        }
    }

    /// The axes that it names.
    pub(crate) fn named(self) -> Vec<&'a str> {
        let one = |args: &'a AxisArgs| args.axis.as_deref().into_iter().collect();
        match self {
            Self::Zero(args) => one(&args.axis),
            Self::Calibrate(args) => one(&args.axis),
            Self::Verify(args) => one(&args.axis),
            Self::Move(args) => args.named().collect(),
        }
    }

    /// Whether what it moves goes without its calibration on purpose.
    pub(crate) const fn is_uncompensated(self) -> bool {
        match self {
            Self::Zero(_) | Self::Calibrate(_) => false,
            Self::Verify(args) => args.uncompensated,
            Self::Move(args) => args.agreed.uncompensated,
        }
    }
}

/// One thing that is going to happen, or that it depends upon.
#[derive(Clone, Debug)]
pub(crate) struct Step {
    /// `zero`, `calibration`, `calibrate`, `verify`, `move` or `jog`.
    what: &'static str,
    /// Whose: an axis, or all of them by what they are.
    whose: String,
    text: String,
}

impl Step {
    pub(crate) fn new(what: &'static str, whose: &str, text: String) -> Self {
        Self {
            what,
            whose: whose.to_owned(),
            text,
        }
    }

    /// Adds what becomes of it.
    pub(crate) fn say(&mut self, more: &str) {
        self.text += &format!("; {more}");
    }

    /// Whether something is driven.
    pub(crate) fn moves(&self) -> bool {
        matches!(self.what, "zero" | "move" | "jog")
    }

    /// For people.
    pub(crate) fn line(&self) -> String {
        format!("{}: {}: {}", self.whose, self.what, self.text)
    }

    /// For programs.
    pub(crate) fn value(&self) -> Value {
        json!({"what": self.what, "whose": self.whose, "text": self.text})
    }
}

/// What corrects `whose` moves: what the store of `loaded` says is in use under `pointer`.
///
/// # Errors
/// It belongs to another stage or configuration, or cannot be read; a calibration is made all the same.
pub(crate) fn calibration(
    loaded: &Loaded,
    (whose, pointer): (&str, &str),
    intent: Intent<'_>,
) -> Result<Step, Failure> {
    let text = match intent {
        _ if intent.is_uncompensated() => "NOT CORRECTED: --uncompensated".to_owned(),
        Intent::Calibrate(args) => {
            let until = if args.no_activate { "" } else { " until then" };
            match in_use(loaded, pointer) {
                Ok(None) => "none is in use".into(),
                Ok(Some(used)) => format!("{used} stays in use{until}"),
                Err(failure) => format!("the one in use cannot be used: {failure}"),
            }
        }
        _ => match in_use(loaded, pointer)? {
            None => "NOT CORRECTED: no calibration is in use".into(),
            Some(used) => format!("corrected by {used}"),
        },
    };
    Ok(Step::new("calibration", whose, text))
}

/// The calibration in use, for people.
fn in_use(loaded: &Loaded, pointer: &str) -> Result<Option<String>, Failure> {
    let store = loaded.config.machine.store();
    let Some(id) = store.active(pointer)?.current else {
        return Ok(None);
    };
    let created = head_of(loaded, &store, &id)?.created;
    let ago = ago::since(&created).map_or(String::new(), |it| format!(", {it}"));
    Ok(Some(format!(
        "calibration {} of {created}{ago}",
        short(&id)
    )))
}
