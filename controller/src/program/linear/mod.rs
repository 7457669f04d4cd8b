//! Linear axes on the command line.

mod compare;
pub(crate) mod demo;
pub(crate) mod elsewhere;
mod gantry;
mod intended;
pub(crate) mod job;
mod moved;
mod page;
pub(crate) mod plan;
mod printed;
mod report;
mod shown;
#[cfg(test)]
mod stored_tests;
pub(crate) mod told;
pub(crate) mod uncertainty;
pub(crate) mod verbs;

use machine::records::Log;

use super::jogs::Jogs;
use super::show::Shown;
use super::targets::axis_motion;
use super::text::table_notes;
use super::verbs::Verbs;
use crate::config::MachineConfig;
use crate::linear::check::gantry_notes;
use crate::linear::{LinearContent, LinearLog};

/// What an operator should know of linear axes and gantries that are sound.
fn notes(config: &MachineConfig) -> Vec<String> {
    let mut notes = table_notes(config);
    notes.extend(gantry_notes(config));
    notes
}

/// What it does for the verbs of the cycle.
pub(crate) const VERBS: Verbs = Verbs {
    has_the_axes: |_| false,
    notes,
    demos: demo::DEMOS,
    refuse: intended::refuse,
    intended: intended::intended,
    zero: verbs::zero,
    calibrate: verbs::calibrate,
    verify: verbs::verify,
    move_to: verbs::move_to,
    jog: Jogs::OF_A_LINEAR_AXIS,
    motion: axis_motion,
    asked: &[],
    words: &told::TELLER,
    printed: printed::printed,
    shown: &[Shown::of::<LinearContent>()],
    opened_by: LinearLog::OPENED_BY,
    page: page::html,
    compare: compare::compared,
};
