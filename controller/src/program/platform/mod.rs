//! Alignment platforms on the command line.

mod compare;
pub(crate) mod demo;
pub(crate) mod fit;
mod intended;
mod json;
pub(crate) mod plan;
mod printed;
mod report;
#[cfg(test)]
mod stored_tests;
mod target;
mod told;
mod uncertainty;
pub(crate) mod verbs;

use std::path::Path;

use machine::records::{Log, read_journal};
use report::PlatformPage;

use super::jogs::Jogs;
use super::made_from::made_from;
use super::show::Shown;
use super::verbs::Verbs;
use crate::Failure;
use crate::platform::{PlatformLog, ScrewContent};
use crate::ports::Use;

/// What it does for the verbs of the cycle.
pub(crate) const VERBS: Verbs = Verbs {
    has_the_axes: |config| config.platform.is_some(),
    notes: plan::notes,
    demos: demo::DEMOS,
    refuse: intended::refuse,
    intended: intended::intended,
    zero: verbs::zero,
    calibrate: verbs::calibrate,
    verify: verbs::verify,
    move_to: verbs::move_to,
    jog: Jogs {
        check: verbs::check_jog,
        run: verbs::jog,
        purpose: Use::Measurement,
        zeroed: Some(PLATFORM),
        by: "the encoders of the screws",
        end: ("at the end of its reach", "at_end_of_reach"),
    },
    motion: target::motion,
    asked: &[],
    words: &told::TELLER,
    printed: printed::printed,
    shown: &[Shown::of::<ScrewContent>()],
    opened_by: PlatformLog::OPENED_BY,
    page: html,
    compare: compare::compared,
};

/// The page of the journal at `path`, with what was made from it.
fn html(path: &Path) -> Result<String, Failure> {
    let journal = read_journal::<PlatformLog>(path)?;
    let page = PlatformPage::of(&journal, made_from::<ScrewContent>(path)?);
    Ok(report::render(&page))
}

/// What `--axis` calls all screws of a platform.
const PLATFORM: &str = "platform";
