//! stdout for results, stderr for everything else, in the order in which it was said.

use std::io::Write;

use serde_json::{Value, json};

use crate::Failure;
use crate::config::ConfigError;
use crate::program::progress;
use crate::runs::Told;

/// How a verb ended: well, with a result that is a failure all the same (already printed with
/// it), or with no result.
pub(crate) type Ended = Result<Option<Failure>, Failure>;

/// A result for programs, with what the devices counted on the way.
pub(crate) fn with_counters(mut value: Value, counters: Value) -> Value {
    value["counters"] = counters;
    value
}

/// How results are printed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Output {
    json: bool,
}

impl Output {
    pub(crate) const fn new(json: bool) -> Self {
        Self { json }
    }

    pub(crate) const fn is_json(self) -> bool {
        self.json
    }

    /// The result: `text` for people, `value` with `--json`.
    #[expect(clippy::unnecessary_wraps, reason = "it is how a verb ends")]
    pub(crate) fn result(self, text: &str, value: &Value) -> Ended {
        self.print(text, value);
        Ok(None)
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
        self.print(text, &value);
        Ok(Some(failure))
    }

    fn print(self, text: &str, value: &Value) {
        let line = if self.json {
            value.to_string()
        } else {
            text.to_owned()
        };
        progress::settle();
        // A closed pipe (`| head`) is the reader's right, not a failure of the machine.
        let _ = writeln!(std::io::stdout().lock(), "{line}");
    }

    /// What happens meanwhile, for people; on stderr so that stdout stays one object.
    pub(crate) fn note(self, text: &str) {
        progress::settle();
        let _ = writeln!(std::io::stderr().lock(), "{text}");
    }

    /// Why there is no result.
    pub(crate) fn failure(self, failure: &Failure) {
        if self.json {
            let mut error = json!({"error": failure.to_string(), "exit_code": failure.exit_code()});
            if let Failure::Config(ConfigError::Invalid { findings }) = failure {
                error["findings"] = json!(findings);
            }
            self.print("", &error);
        }
        self.note(&format!("error: {failure}"));
    }
}
