//! Alignment platforms on the command line.

pub(crate) mod demo;
pub(crate) mod fit;
pub(crate) mod verbs;

use std::path::Path;

use truestage::Failure;
use truestage::platform::report::PlatformPage;
use truestage::platform::{PlatformLog, ScrewContent};
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
    shown: &[Shown::of::<ScrewContent>()],
    opened_by: PlatformLog::OPENED_BY,
    page: html,
};

/// The page of the journal at `path`, with what was made from it.
fn html(path: &Path) -> Result<String, Failure> {
    let journal = read_journal::<PlatformLog>(path)?;
    let page = PlatformPage::of(&journal, made_from::<ScrewContent>(path)?);
    Ok(truestage::platform::report::render(&page))
}
