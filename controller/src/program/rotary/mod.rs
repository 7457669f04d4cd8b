//! Rotary tables on the command line.

pub(crate) mod demo;
pub(crate) mod fit;
mod json;
mod report;
mod residuals;
#[cfg(test)]
mod stored_tests;
pub(crate) mod verbs;

use std::path::Path;

use machine::records::{Log, read_journal};

use super::made_from::made_from;
use super::show::Shown;
use super::verbs::Verbs;
use crate::Failure;
use crate::rotary::{PlateLog, RotaryContent};

/// What it does for the verbs of the cycle.
pub(crate) const VERBS: Verbs = Verbs {
    has_the_axes: |_| false,
    notes: |_| Vec::new(),
    pointers: |_| Vec::new(),
    made_together: |_, _| None,
    demos: demo::DEMOS,
    zero: verbs::zero,
    calibrate: verbs::calibrate,
    verify: verbs::verify,
    move_to: verbs::move_to,
    shown: &[Shown::of::<RotaryContent>()],
    opened_by: PlateLog::OPENED_BY,
    page: html,
};

/// The page of the journal at `path`, with what was made from it.
fn html(path: &Path) -> Result<String, Failure> {
    let journal = read_journal::<PlateLog>(path)?;
    let made = made_from::<RotaryContent>(path)?;
    Ok(report::render(&journal, &made))
}
