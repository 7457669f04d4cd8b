//! Pace of a platform: how fast the screw with the longest way goes, while all arrive together.

use compensator::platform::Pose;
use units::portable::hypot;
use units::{AxisSpeed, Metres, MetresPerSecond};

use crate::config::MachineConfig;
use crate::failure::Failure;
use crate::platform::PlatformConfig;
use crate::platform::failure::PlatformFailure;
use crate::platform::handle::AlignmentPlatform;
use crate::platform::moves::Planned;

/// Returns the greatest speed of a screw: that of the platform, or of its slowest axis.
pub(super) fn screw_speed(platform: &PlatformConfig, config: &MachineConfig) -> MetresPerSecond {
    let screws = platform.actuator.iter();
    let axes = screws.filter_map(|screw| config.axis.get(&screw.axis));
    let speeds = axes.map(|axis| axis.motion.speed_mm_per_s);
    MetresPerSecond(speeds.fold(platform.speed_mm_per_s, f64::min) * 1e-3)
}

impl AlignmentPlatform<'_> {
    /// Returns the pace of a move to what is `planned`.
    ///
    /// # Errors
    /// No pose has the strokes of its beginning or of its end.
    pub(super) fn pace(&self, planned: &[Planned]) -> Result<MetresPerSecond, Failure> {
        let usual = screw_speed(self.config, self.core.config);
        let Some(speed) = self.speed else {
            return Ok(usual);
        };
        let ways = planned.iter().map(|screw| screw.travel.abs());
        let longest = ways.fold(Metres::ZERO, Metres::max).value();
        let from = self.pose_at(planned.iter().map(|screw| screw.set_point() - screw.travel))?;
        let to = self.pose_at(planned.iter().map(Planned::set_point))?;
        // Each part of the pose takes as long as the screw with the longest way.
        let shared = |way: f64, speed: f64| speed * longest / way.max(f64::MIN_POSITIVE);
        let asked = match speed {
            AxisSpeed::Linear(speed) => {
                let way = hypot((to.x - from.x).value(), (to.y - from.y).value());
                shared(way, speed.value()).min(speed.value())
            }
            AxisSpeed::Angular(speed) => {
                let way = (to.angle - from.angle).value().abs();
                shared(way, speed.value())
            }
        };
        Ok(usual.min(MetresPerSecond(asked)))
    }

    fn pose_at(&self, strokes: impl Iterator<Item = Metres>) -> Result<Pose, Failure> {
        let strokes: Vec<_> = strokes.collect();
        let near = self.state.pose.unwrap_or_default();
        let found = self.state.kinematics.forward_near(&strokes, near);
        Ok(found.map_err(PlatformFailure::from)?.pose)
    }
}
