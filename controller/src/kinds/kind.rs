//! What is asked of each kind of machine.

use machine::records::ContentKind;

use crate::config::MachineConfig;
use crate::config::dependence::text::Place;
use crate::config::judge::Finding;
#[cfg(test)]
use crate::store::golden::Golden;

/// A kind of machine.
pub(crate) struct Kind {
    /// Which values of its part of a configuration are impossible.
    pub(crate) check: fn(&MachineConfig, &mut Vec<Finding>),
    /// What is doubtful of its part of a configuration that is sound.
    pub(crate) warnings: fn(&MachineConfig, &mut Vec<Finding>),
    /// What its calibrations depend on. The order of kinds in their list is that of the published text.
    pub(crate) depends: fn(&MachineConfig, &mut Place<'_>),
    /// What its calibrations say.
    pub(crate) contents: &'static [ContentKind],
    /// What its machines have written.
    #[cfg(test)]
    pub(crate) golden: Golden,
}
