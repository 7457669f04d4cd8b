//! `truestage token`: one more who may ask a service over the network.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use serde_json::json;

use crate::Failure;
use crate::program::output::{Ended, Output};
use crate::run::utc_now;

/// What somebody may do; each may also do what those before it may.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum RoleName {
    /// Looks, and stops.
    Viewer,
    /// Also moves, zeroes, verifies and resets.
    Operator,
    /// Everything: also calibrates, and says which calibration is used.
    Commissioner,
}

impl RoleName {
    const fn word(self) -> &'static str {
        match self {
            Self::Viewer => "viewer",
            Self::Operator => "operator",
            Self::Commissioner => "commissioner",
        }
    }
}

/// What `truestage token` is told.
#[derive(Clone, Debug, Args)]
pub(crate) struct TokenArgs {
    /// Whose it is: events and journals say this name.
    name: String,
    /// What its owner may do.
    #[arg(long, value_enum)]
    role: RoleName,
    /// The file of tokens; it is made when it is not there.
    #[arg(long, value_name = "FILE", default_value = "tokens.toml")]
    file: PathBuf,
}

/// A token that is to be made.
#[derive(Clone, Debug)]
pub struct NewToken {
    /// Where its hash is kept.
    pub file: PathBuf,
    /// Whose it is.
    pub name: String,
    /// `viewer`, `operator` or `commissioner`.
    pub role: &'static str,
    /// When, UTC, RFC 3339.
    pub made: String,
}

/// Prints the token, which stands nowhere afterwards.
pub(crate) fn run(
    args: TokenArgs,
    output: Output,
    enrol: fn(NewToken) -> Result<String, Failure>,
) -> Ended {
    let TokenArgs { name, role, file } = args;
    let new = NewToken {
        file,
        name,
        role: role.word(),
        made: utc_now(),
    };
    let (name, role, file) = (new.name.clone(), new.role, new.file.display().to_string());
    let token = enrol(new)?;
    output.note(&format!(
        "the token of {name}, {role}, is shown only now; {file} has its hash. Verbs take it from TRUESTAGE_TOKEN in the \
         environment; to take it back, take its [[token]] out of the file"
    ));
    let value = json!({"name": name, "role": role, "token": token, "file": file});
    output.result(&token, &value)
}
