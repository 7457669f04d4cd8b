//! The command `truestage`.

use std::process::ExitCode;

fn main() -> ExitCode {
    truestage::main()
}
