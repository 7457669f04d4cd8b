//! What a linear axis gave, in the words of the command line: for whoever keeps a machine for others.

use std::path::Path;

use machine::Machine;
use serde_json::Value;

use crate::failure::Failure;
use crate::linear::{Calibrated, Moved, Verified, Zeroed};

/// A result as the command line prints it.
#[derive(Clone, Debug, PartialEq)]
pub struct Told {
    /// For people.
    pub text: String,
    /// For programs: what `--json` prints.
    pub value: Value,
}

/// Who says it; [`Serving`](crate::Serving) brings one.
#[derive(Clone, Copy, Debug)]
pub struct Teller {
    /// A zero that was found.
    pub zeroed: fn(axis: &str, zeroed: &Zeroed) -> Told,
    /// A calibration that was made.
    pub calibrated: fn(calibrated: &Calibrated) -> Told,
    /// A verification, with a calibration or without one.
    pub verified: fn(axis: &str, verified: &Verified, compensated: bool) -> Told,
    /// A move, and the calibration that corrected it.
    pub moved: fn(axis: &str, moved: &Moved, calibration: Option<&str>) -> Told,
    /// What the devices have counted so far.
    pub counters: fn(machine: &Machine) -> Value,
    /// The page of a run, made of its journal.
    pub page: fn(journal: &Path) -> Result<String, Failure>,
}
