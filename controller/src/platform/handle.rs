//! The handle of a platform.

use units::AxisSpeed;

use crate::connected::Machine;
use crate::failure::Failure;
use crate::handle::Core;
use crate::platform::PlatformConfig;
use crate::platform::failure::PlatformFailure;
use crate::platform::state::PlatformState;

/// The alignment platform of a machine: its zero, its moves, its screws' calibrations and what they
/// need to remember. [`Machine::platform`](crate::Machine::platform) gives it.
pub struct AlignmentPlatform<'m> {
    pub(crate) core: Core<'m>,
    pub(crate) config: &'m PlatformConfig,
    pub(crate) state: &'m mut PlatformState,
    /// It moves no faster than so; an angular speed is of its turning.
    pub(super) speed: Option<AxisSpeed>,
}

impl Machine {
    /// The alignment platform that the axes move.
    ///
    /// # Errors
    /// When they move none.
    pub fn platform(&mut self) -> Result<AlignmentPlatform<'_>, Failure> {
        let (core, memories) = Core::of(self);
        let config = core.config.platform.as_ref();
        let config = config.ok_or(PlatformFailure::None)?;
        let state = memories.of("platform", || PlatformState::of(config, core.config));
        Ok(AlignmentPlatform {
            core,
            config,
            state,
            speed: None,
        })
    }
}
