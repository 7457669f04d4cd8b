//! Zero of three axes: each on the first index pulse off its negative limit switch, one after the
//! other, in the order that clears the workpiece.

use core::time::Duration;

use drivers::device::AxisCommand;
use units::{Metres, MetresPerSecond};

use crate::failure::Failure;
use crate::volumetric::handle::WorkVolume;
use crate::volumetric::settings::volume_axis;
use machine::Stage;

/// What it is called where progress is told.
const WHOLE: &str = "volume";
/// How long each axis is seen at rest before the zero is done.
const REST: Duration = Duration::from_millis(50);

impl WorkVolume<'_> {
    /// Finds the index pulses of all three axes, and brings each axis back to its pulse, in the same
    /// order.
    ///
    /// # Errors
    /// Whatever stops the machine; axes that were not reached are not zeroed then.
    pub fn zero(&mut self) -> Result<(), Failure> {
        let config = self.config.clone();
        let zero = &config.zero;
        let speed = MetresPerSecond(zero.search_speed_mm_per_s * 1e-3);
        let limit = Duration::from_secs_f64(zero.time_limit_s);
        for axis in &config.axes {
            self.core.set_zeroed(axis, false)?;
            self.core.enable(axis)?;
        }
        let steps = zero.order.len() as u64;
        for (done, name) in (0..).zip(zero.order) {
            self.core
                .observer()
                .progress(Stage::Zero, WHOLE, done, steps);
            let at = volume_axis(name).index();
            let (axis, position) = (&config.axes[at], Metres::from_mm(zero.index_mm[at]));
            let command = AxisCommand::HomeIndex { position, speed };
            self.core
                .command(axis, command, "home on the index", limit)?;
            self.core.set_zeroed(axis, true)?;
        }
        // Each ran past its pulse before it stopped: whoever goes on finds all of them at rest.
        for name in zero.order {
            let at = volume_axis(name).index();
            let axis = &config.axes[at];
            self.go(axis, Metres::from_mm(zero.index_mm[at]))?;
            self.core.stand_still(axis, REST)?;
        }
        self.core
            .observer()
            .progress(Stage::Zero, WHOLE, steps, steps);
        Ok(())
    }
}
