//! stdout for results, stderr for everything else, in the order in which it was said.

use std::sync::OnceLock;

use serde_json::{Map, Value, json};

use crate::Failure;
use crate::config::ConfigError;
use crate::program::paint;
use crate::program::plain::plain;
use crate::program::progress::Bars;
use crate::program::streams;
use crate::runs::Told;

/// How a verb ended: well, with a result that is a failure all the same (already printed with
/// it), or with no result.
pub(crate) type Ended = Result<Option<Failure>, Failure>;

/// A result for programs, with what the devices counted on the way.
pub(crate) fn with_counters(mut value: Value, counters: Value) -> Value {
    value["counters"] = counters;
    value
}

/// The version of the schema that every object of `--json` keeps to (docs/json.md): members are added within a version,
/// and none is renamed, taken away or given another meaning.
pub(crate) const SCHEMA: u32 = 1;

/// What stands for the verb where the words of the command line name none that can be run.
pub(crate) const NO_VERB: &str = "";

/// How much is said on standard error.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Said {
    /// Errors and questions alone.
    Least,
    /// Warnings and what happens, too.
    #[default]
    Usual,
    /// And what is read, opened and written for it.
    Most,
}

/// The words of the command line for it.
#[derive(Clone, Copy, Debug, clap::Args)]
pub(crate) struct SaidArgs {
    /// Say nothing on standard error but errors and questions.
    #[arg(long, short, global = true, conflicts_with = "verbose")]
    quiet: bool,
    /// Say on standard error, too, what is read and opened.
    #[arg(long, short, global = true)]
    verbose: bool,
}

impl SaidArgs {
    pub(crate) const fn said(self) -> Said {
        match (self.quiet, self.verbose) {
            (true, _) => Said::Least,
            (_, true) => Said::Most,
            _ => Said::Usual,
        }
    }
}

/// How results are printed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Output {
    json: bool,
    said: Said,
    /// Whose, in full: `cal list`.
    verb: &'static str,
}

impl Output {
    pub(crate) const fn new(json: bool, verb: &'static str) -> Self {
        Self {
            json,
            said: Said::Usual,
            verb,
        }
    }

    pub(crate) const fn saying(self, said: Said) -> Self {
        Self { said, ..self }
    }

    /// What is shown of a procedure that runs; `made` is told whether bars are hidden.
    pub(crate) fn bars(self, made: fn(bool) -> Bars) -> Bars {
        match self.said {
            Said::Least => Bars::none(),
            Said::Usual | Said::Most => made(self.json),
        }
    }

    pub(crate) const fn is_json(self) -> bool {
        self.json
    }

    /// The result: `text` for people, `value` with `--json`.
    #[expect(clippy::unnecessary_wraps, reason = "it is how a verb ends")]
    pub(crate) fn result(self, text: &str, value: &Value) -> Ended {
        // Not the failure of what was done, which may have moved and stored: nothing is undone or told for it.
        Ok(self.print(text, value).err())
    }

    /// The result, with what the devices counted on the way.
    pub(crate) fn told(self, told: Told, counters: Value) -> Ended {
        self.result(&told.text, &with_counters(told.value, counters))
    }

    /// A result that is a failure all the same: with `--json` still one object, the failure in
    /// it beside the result.
    #[expect(clippy::unnecessary_wraps, reason = "it is how a verb ends")]
    pub(crate) fn bad_result(self, text: &str, mut value: Value, failure: Failure) -> Ended {
        value["error"] = json!(failure.to_string());
        value["exit_code"] = json!(failure.exit_code());
        self.print_failed(text, &value);
        Ok(Some(failure))
    }

    fn print(self, text: &str, value: &Value) -> Result<(), Failure> {
        let line = match self.json {
            true => self.object(value),
            false if streams::is_out_terminal() && paint::is_wanted() => {
                paint::painted(&plain(text))
            }
            false => plain(text),
        };
        streams::print((line + "\n").into_bytes()).map(drop)
    }

    /// What goes with a failure: that one decides how the command ends, and what is not printed is said beside it.
    fn print_failed(self, text: &str, value: &Value) {
        if let Err(unprinted) = self.print(text, value) {
            self.must_say(&format!("error: {unprinted}"));
        }
    }

    /// `value` in one line, as everything is that `--json` prints: it says which version of the schema it keeps to, and
    /// whose it is.
    pub(crate) fn object(self, value: &Value) -> String {
        let mut members = match value {
            Value::Object(members) => members.clone(),
            Value::Null => Map::new(),
            // Of a service, whose answers are not known here.
            other => Map::from_iter([("result".to_owned(), other.clone())]),
        };
        members.insert("schema".into(), json!(SCHEMA));
        members.insert("verb".into(), json!(self.verb));
        Value::Object(members).to_string()
    }

    /// What happens meanwhile, for people; on stderr so that stdout stays one object.
    pub(crate) fn note(self, text: &str) {
        if self.said != Said::Least {
            self.must_say(text);
        }
    }

    /// What is done for it, for who wants to know all.
    pub(crate) fn detail(self, text: impl FnOnce() -> String) {
        if self.said == Said::Most {
            self.must_say(&text());
        }
    }

    /// Errors, and questions with what must be known to answer them.
    pub(crate) fn must_say(self, text: &str) {
        let is_painted = !self.json && streams::is_err_terminal() && paint::is_wanted();
        let text = plain(text);
        streams::say(&match is_painted {
            true => paint::painted(&text),
            false => text,
        });
    }

    /// Why the command line was refused, for programs.
    pub(crate) fn refused(self, why: &str, exit_code: u8) {
        self.print_failed("", &json!({"error": why, "exit_code": exit_code}));
    }

    /// Why there is no result.
    pub(crate) fn failure(self, failure: &Failure) {
        if self.json {
            let mut error = json!({"error": failure.to_string(), "exit_code": failure.exit_code()});
            if let Failure::Config(ConfigError::Invalid { findings }) = failure {
                error["findings"] = json!(findings);
            }
            describe(failure, &mut error);
            self.print_failed("", &error);
        }
        self.must_say(&format!("error: {failure}"));
    }
}

/// The kind of a failure, as a service names it.
static CODE_OF: OnceLock<fn(&Failure) -> String> = OnceLock::new();

/// Names failures by `code_of` from now on.
pub(super) fn name_failures_by(code_of: fn(&Failure) -> String) {
    // A program has one main function.
    let _ = CODE_OF.set(code_of);
}

/// Adds to the object of `failure` what a program that reads it acts upon.
fn describe(failure: &Failure, object: &mut Value) {
    let source = match failure {
        Failure::Resumable { source, journal } => {
            object["journal"] = json!(journal);
            object["can_resume"] = json!(true);
            source
        }
        other => other,
    };
    if let Failure::Machine(failure) = source
        && let Some(device) = failure.device()
    {
        object["device"] = json!(device);
    }
    if let Some(code_of) = CODE_OF.get() {
        object["code"] = json!(code_of(source));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_object_says_its_version_and_its_verb() {
        let output = Output::new(true, "cal list");
        let of = |value: Value| -> Value {
            serde_json::from_str(&output.object(&value)).expect("it is JSON")
        };
        let expected = json!({"schema": 1, "verb": "cal list", "a": 2});
        assert_eq!(of(json!({"a": 2})), expected);
        let empty = json!({"schema": 1, "verb": "cal list"});
        assert_eq!(of(Value::Null), empty);
        assert_eq!(of(json!([1]))["result"], json!([1]));
    }
}
