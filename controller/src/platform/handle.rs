//! The handle of a platform.

use crate::handle::Core;
use crate::platform::PlatformConfig;
use crate::platform::state::PlatformState;

/// The alignment platform of a machine: its zero, its moves, its screws' calibrations and what they
/// need to remember. [`Machine::platform`](crate::Machine::platform) gives it.
pub struct AlignmentPlatform<'m> {
    pub(crate) core: Core<'m>,
    pub(crate) config: &'m PlatformConfig,
    pub(crate) state: &'m mut PlatformState,
}
