//! Three axes that are corrected throughout their volume, on the command line.

mod asked;
mod compare;
pub(crate) mod demo;
pub(crate) mod fit;
mod intended;
pub(crate) mod memory;
pub(crate) mod memory_args;
pub(crate) mod moved;
pub(crate) mod part;
mod printed;
pub(crate) mod reference;
mod report;
pub(crate) mod shown;
#[cfg(test)]
mod stored_tests;
mod told;
mod uncertainty;
pub(crate) mod verbs;

use std::path::Path;

use machine::records::{Log, read_journal};
use report::Made;

use super::jogs::Jogs;
use super::made_from::source;
use super::show::Shown;
use super::targets::{AskedMotion, axis_motion};
use super::verbs::Verbs;
use crate::Failure;
use crate::program::MoveArgs;
use crate::volumetric::{BeamReferencesContent, GeometryContent, StateMemoryContent, VolumeLog};

/// What it does for the verbs of the cycle.
pub(crate) const VERBS: Verbs = Verbs {
    has_the_axes: |config| config.volumetric.is_some(),
    notes: |_| Vec::new(),
    demos: demo::DEMOS,
    refuse: intended::refuse,
    intended: intended::intended,
    zero: verbs::zero,
    calibrate: verbs::calibrate,
    verify: verbs::verify,
    move_to: verbs::move_to,
    jog: Jogs::OF_A_LINEAR_AXIS,
    motion,
    asked: asked::ASKED,
    words: &told::TELLER,
    printed: printed::printed,
    shown: &[
        Shown::of::<GeometryContent>(),
        Shown::of::<BeamReferencesContent>(),
        Shown::of::<StateMemoryContent>(),
    ],
    opened_by: VolumeLog::OPENED_BY,
    page: html,
    compare: compare::compared,
};

/// The page of the journal at `path`, with what was made from it.
fn html(path: &Path) -> Result<String, Failure> {
    let journal = read_journal::<VolumeLog>(path)?;
    Ok(report::render(&journal, &made_from(path)?))
}

/// What was made from the journal at `path`.
fn made_from(path: &Path) -> Result<Made, Failure> {
    Ok(match source(path) {
        Some((store, name)) => Made::of(&store, &name)?,
        None => Made::default(),
    })
}

/// The move of three axes as a service is asked for it; they are zeroed together.
fn motion(args: &MoveArgs) -> Result<AskedMotion, Failure> {
    Ok(AskedMotion {
        zeroed: vec!["volume".to_owned()],
        ..axis_motion(args)?
    })
}
