//! A command line that is not understood.

use std::io::{ErrorKind, Write as _, stdout};
use std::process::ExitCode;

use super::output::{NO_VERB, Output, unprinted};

/// What such a command line ends with.
const USAGE: u8 = 2;

/// Help that was asked for, or words that were refused: with `--json` these are an object like every failure.
pub(super) fn not_understood(refused: &clap::Error) -> ExitCode {
    let wants_json = || std::env::args_os().any(|it| it == "--json");
    if refused.use_stderr() && wants_json() {
        let why = refused.to_string();
        let why = why.strip_prefix("error: ").unwrap_or(&why);
        Output::new(true, NO_VERB).refused(why.trim_end(), USAGE);
    }
    let shown = refused.print().and_then(|()| stdout().flush());
    match (refused.use_stderr(), shown) {
        (true, _) => ExitCode::from(USAGE),
        // A closed pipe is the reader's right.
        (false, Err(error)) if error.kind() != ErrorKind::BrokenPipe => {
            let failure = unprinted(&error);
            Output::new(false, NO_VERB).must_say(&format!("error: {failure}"));
            ExitCode::from(failure.exit_code())
        }
        (false, _) => ExitCode::SUCCESS,
    }
}
