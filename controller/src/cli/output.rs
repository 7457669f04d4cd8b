//! stdout for results, stderr for everything else.

use std::io::Write;

use serde_json::{Value, json};

use truestage::Failure;

/// How results are printed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Output {
    json: bool,
}

impl Output {
    pub(super) const fn new(json: bool) -> Self {
        Self { json }
    }

    pub(super) const fn is_json(self) -> bool {
        self.json
    }

    /// The result: `text` for people, `value` with `--json`.
    pub(super) fn result(self, text: &str, value: &Value) {
        let line = if self.json {
            value.to_string()
        } else {
            text.to_owned()
        };
        // A closed pipe (`| head`) is the reader's right, not a failure of the machine.
        let _ = writeln!(std::io::stdout().lock(), "{line}");
    }

    /// What happens meanwhile, for people; on stderr so that stdout stays one object.
    pub(super) fn note(self, text: &str) {
        let _ = writeln!(std::io::stderr().lock(), "{text}");
    }

    /// Why there is no result.
    pub(super) fn failure(self, failure: &Failure) {
        if self.json {
            let error = json!({"error": failure.to_string(), "exit_code": failure.exit_code()});
            let _ = writeln!(std::io::stdout().lock(), "{error}");
        }
        let _ = writeln!(std::io::stderr().lock(), "error: {failure}");
    }
}
