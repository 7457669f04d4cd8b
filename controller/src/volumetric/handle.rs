//! The handle of a work volume.

use units::{Metres, MetresPerSecond};

use crate::connected::Machine;
use crate::failure::Failure;
use crate::handle::Core;
use crate::memories::Memories;
use crate::volumetric::VolumetricConfig;
use crate::volumetric::failure::VolumetricFailure;

/// The work volume of three axes: its zero, its moves, its calibration and its references.
/// [`Machine::volumetric`](crate::Machine::volumetric) gives it.
pub struct WorkVolume<'m> {
    pub(crate) core: Core<'m>,
    pub(crate) config: &'m VolumetricConfig,
    pub(crate) memories: &'m mut Memories,
    /// The tool goes no faster than so where it follows no path.
    pub(super) speed: Option<MetresPerSecond>,
}

impl Machine {
    /// The work volume of the three axes.
    ///
    /// # Errors
    /// When its errors are not corrected.
    pub fn volumetric(&mut self) -> Result<WorkVolume<'_>, Failure> {
        let (core, memories) = Core::of(self);
        let config = core.config.volumetric.as_ref();
        let config = config.ok_or(VolumetricFailure::None)?;
        Ok(WorkVolume {
            core,
            config,
            memories,
            speed: None,
        })
    }
}

impl<'m> WorkVolume<'m> {
    /// Its section of the configuration.
    pub const fn config(&self) -> &'m VolumetricConfig {
        self.config
    }
}

impl WorkVolume<'_> {
    /// Moves one axis to `target` as its drive counts, within its soft limits.
    pub(super) fn go(&mut self, axis: &str, target: Metres) -> Result<(), Failure> {
        self.core.require_zeroed(axis)?;
        self.core.check_soft_limits(axis, target)?;
        let speed = self.core.axis_settings(axis)?.speed;
        Ok(self.core.profile_move(axis, target, speed)?)
    }
}
