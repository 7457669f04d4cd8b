//! Linear axes on the command line.

pub(crate) mod demo;
pub(crate) mod elsewhere;
pub(crate) mod job;
mod moved;
mod page;
mod report;
mod shown;
#[cfg(test)]
mod stored_tests;
pub(crate) mod told;
pub(crate) mod uncertainty;
pub(crate) mod verbs;

use machine::records::Log;

use super::show::Shown;
use super::verbs::Verbs;
use crate::linear::{LinearContent, LinearLog};

/// What it does for the verbs of the cycle.
pub(crate) const VERBS: Verbs = Verbs {
    has_the_axes: |_| false,
    notes: crate::program::text::table_notes,
    pointers: |_| Vec::new(),
    made_together: |_, _| None,
    demos: demo::DEMOS,
    zero: verbs::zero,
    calibrate: verbs::calibrate,
    verify: verbs::verify,
    move_to: verbs::move_to,
    shown: &[Shown::of::<LinearContent>()],
    opened_by: LinearLog::OPENED_BY,
    page: page::html,
};
