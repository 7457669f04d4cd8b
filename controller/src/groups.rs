//! What can be run on a machine, of all kinds: the list of what each of them runs. It is one of its own, because runs need
//! a machine, and the list of kinds is needed before there is one.

use crate::config::MachineConfig;
use crate::runs::{Group, GroupRuns};

/// What each kind runs.
const RUNS: &[&GroupRuns] = &[
    &crate::linear::RUNS,
    &crate::rotary::RUNS,
    &crate::platform::RUNS,
    &crate::volumetric::RUNS,
];

/// What can be run on a machine of this configuration: groups of axes, each of one kind. An axis that works together
/// with others is none by itself.
pub fn groups(config: &MachineConfig) -> Vec<Group> {
    let of_kinds = RUNS.iter().map(|runs| (runs.groups)(config));
    let all: Vec<Group> = of_kinds.flatten().collect();
    let works_with_others = |axis: &String| {
        let mut several = all.iter().filter(|it| it.axes.len() > 1);
        several.any(|it| it.axes.contains(axis))
    };
    let is_whole = |it: &&Group| it.axes.len() > 1 || !it.axes.iter().any(works_with_others);
    all.iter().filter(is_whole).cloned().collect()
}
