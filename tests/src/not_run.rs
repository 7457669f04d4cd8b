//! Tests that could not be run: said where everybody sees it, never a success by itself.

use std::ffi::OsString;
use std::io::Write;
use std::{env, fs};

/// A folder for what was not run; `tests/run` sets it and lists at its end what is in there.
const FOLDER: &str = "TRUESTAGE_NOT_RUN";

/// The computer did not let `test` prove anything, because of `why`. Where somebody collects that,
/// it is written down for them; otherwise the test fails.
///
/// # Panics
/// When nobody collects it, or it cannot be written down.
#[track_caller]
pub fn not_run(test: &str, why: &str) {
    match env::var_os(FOLDER) {
        Some(folder) => write_down(&folder, test, why),
        None => panic!("not run: {test}: {why}"),
    }
}

/// `test` needs something that is not part of the project: written down where somebody collects
/// that, printed otherwise.
///
/// # Panics
/// When it cannot be written down.
pub fn left_out(test: &str, why: &str) {
    match env::var_os(FOLDER) {
        Some(folder) => write_down(&folder, test, why),
        None => eprintln!("not run: {test}: {why}"),
    }
}

/// One file each: tests run at the same time, in processes of their own. One line each: lines are counted.
fn write_down(folder: &OsString, test: &str, why: &str) {
    fs::create_dir_all(folder).expect("the folder can be made");
    let file = tempfile::Builder::new().suffix(".txt").tempfile_in(folder);
    let mut file = file.expect("a file can be made");
    let why: Vec<&str> = why
        .lines()
        .map(str::trim)
        .filter(|it| !it.is_empty())
        .collect();
    writeln!(file, "{test}: {}", why.join(" | ")).expect("there is room");
    file.keep().expect("it can be kept");
}
