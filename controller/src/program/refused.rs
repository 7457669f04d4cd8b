//! A command line that is not understood.

use std::process::ExitCode;

use super::output::{NO_VERB, Output};
use super::streams;

/// What such a command line ends with.
const USAGE: u8 = 2;

/// Help that was asked for, or words that were refused: with `--json` these are an object like every failure.
pub(super) fn not_understood(refused: &clap::Error) -> ExitCode {
    let text = refused.render().to_string();
    if !refused.use_stderr() {
        return match streams::print(text.into_bytes()) {
            Ok(_) => ExitCode::SUCCESS,
            Err(failure) => {
                Output::new(false, NO_VERB).must_say(&format!("error: {failure}"));
                ExitCode::from(failure.exit_code())
            }
        };
    }
    if std::env::args_os().any(|word| word == "--json") {
        let why = text.strip_prefix("error: ").unwrap_or(&text);
        Output::new(true, NO_VERB).refused(why.trim_end(), USAGE);
    }
    streams::say(text.trim_end());
    ExitCode::from(USAGE)
}
