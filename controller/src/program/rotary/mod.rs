//! Rotary tables on the command line.

pub(crate) mod demo;
pub(crate) mod fit;
pub(crate) mod verbs;

use std::path::Path;

use truestage::Failure;
use truestage::rotary::{PlateLog, RotaryContent};
use truestage::store::{Log, read_journal};

use super::made_from::made_from;
use super::show::Shown;
use super::verbs::Verbs;

/// What it does for the verbs of the cycle.
pub(crate) const VERBS: Verbs = Verbs {
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
    Ok(truestage::rotary::report::render(&journal, &made))
}
