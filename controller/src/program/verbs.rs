//! What each kind of machine does for the verbs of the command.

use std::path::Path;

use machine::records::Store;

use super::answering::Asked;
use super::demo::stand::Demo;
use super::intended::{Intent, Step};
use super::jogs::Jogs;
use super::output::{Ended, Output};
use super::page::compare::Comparison;
use super::schema::form::Printed;
use super::show::Shown;
use super::targets::AskedMotion;
use super::{AxisArgs, CalibrateArgs, MoveArgs, VerifyArgs};
use crate::Failure;
use crate::config::{Loaded, MachineConfig};
use crate::runs::Words;

/// The verbs of one kind: those of the cycle, and how what they leave is shown.
pub(crate) struct Verbs {
    /// Whether it moves the linear axes of a machine, so that nobody moves them by themselves.
    pub(crate) has_the_axes: fn(&MachineConfig) -> bool,
    /// What an operator should know of a configuration that is sound.
    pub(crate) notes: fn(&MachineConfig) -> Vec<String>,
    /// Its demonstrations.
    pub(crate) demos: &'static [Demo],
    /// Words that it has no use for.
    pub(crate) refuse: fn(Intent<'_>) -> Result<(), Failure>,
    /// What a verb is going to do; refuses what can be told before the machine is connected.
    pub(crate) intended: fn(&Loaded, &Store, Intent<'_>) -> Result<Vec<Step>, Failure>,
    pub(crate) zero: fn(&AxisArgs, Output) -> Ended,
    pub(crate) calibrate: fn(&CalibrateArgs, Output) -> Ended,
    pub(crate) verify: fn(&VerifyArgs, Output) -> Ended,
    pub(crate) move_to: fn(&MoveArgs, Output) -> Ended,
    pub(crate) jog: Jogs,
    /// A move as a service is asked for it.
    pub(crate) motion: fn(&MoveArgs) -> Result<AskedMotion, Failure>,
    /// What a person is asked by its runs, when a service does them.
    pub(crate) asked: &'static [Asked],
    /// What its runs and moves gave, for whoever keeps a machine: a teller of its own.
    pub(crate) words: Words,
    /// What its verbs print for programs.
    pub(crate) printed: fn() -> Printed,
    /// What its calibrations say.
    pub(crate) shown: &'static [Shown],
    /// By what its journals are known.
    pub(crate) opened_by: &'static [&'static str],
    /// The page of the journal at a path.
    pub(crate) page: fn(&Path) -> Result<String, Failure>,
    /// Two of its journals side by side.
    pub(crate) compare: fn([&Path; 2]) -> Result<Comparison, Failure>,
}
