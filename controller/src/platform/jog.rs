//! A platform that runs along x or y, or turns, until its time is over or its reach ends.
//!
//! The part of the pose that is jogged changes as far as the work range; the other two stay where the screws have them.
//! Nothing corrects it, and no camera looks.

use core::time::Duration;

use compensator::platform::{Platform, Pose};
use drivers::device::AxisCommand;
use units::{Approach, AxisSpeed, Metres, MetresPerSecond, Radians};

use crate::config::MachineConfig;
use crate::correction::Correction;
use crate::failure::Failure;
use crate::handle::no_such_axis;
use crate::jogging::{along, round, run_on};
use crate::platform::PlatformConfig;
use crate::platform::config::PARTS;
use crate::platform::failure::PlatformFailure;
use crate::platform::handle::AlignmentPlatform;
use crate::platform::moves::Planned;
use crate::platform::pace::screw_speed;
use crate::runs::Place;

/// Over so much of x, y (metres) or the angle (radians) it is seen how far the screws go for it.
const A_LITTLE: f64 = 1e-6;

/// A part of the pose, and how fast it is to change.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PoseJog {
    part: usize,
    speed: AxisSpeed,
}

/// A jog of a platform that may begin.
#[derive(Clone, Debug)]
pub(super) struct PlannedJog {
    pub(super) target: Pose,
    screws: Vec<Planned>,
    /// How fast the screw with the longest way is.
    pace: MetresPerSecond,
}

/// What a platform can reach, whoever has the machine.
pub(super) struct Reach<'p> {
    pub(super) config: &'p PlatformConfig,
    pub(super) kinematics: &'p Platform,
    /// So far short of its ends a jog stays: what stands there is still within them.
    pub(super) margin: Metres,
    /// As fast as a screw may go.
    pub(super) speed: MetresPerSecond,
}

impl PoseJog {
    /// # Errors
    /// When the platform has no such part, or it does not move in what `speed` says.
    pub(crate) fn new(name: &str, speed: AxisSpeed) -> Result<Self, Failure> {
        let part = PARTS.iter().position(|it| *it == name);
        let part = part.ok_or_else(|| no_such_axis(name, &PARTS.map(String::from)))?;
        match is_angle(part) {
            true => round(name, speed).map(drop),
            false => along(name, speed).map(drop),
        }?;
        Ok(Self { part, speed })
    }

    /// Its part of `pose`.
    pub(crate) fn place(self, pose: Pose) -> Place {
        match is_angle(self.part) {
            true => Place::Angle(pose.angle),
            false => Place::Length(Metres(value(pose, self.part))),
        }
    }
}

/// Twice as far as a screw may stand from its set-point.
pub(super) fn margin(platform: &PlatformConfig, config: &MachineConfig) -> Metres {
    let screws = platform.actuator.iter();
    let windows =
        screws.filter_map(|it| Some(config.axis.get(&it.axis)?.motion.position_window_um));
    Metres::from_um(2.0 * windows.fold(0.0, f64::max))
}

/// Where the screws have the platform, by their encoders.
///
/// # Errors
/// When there is no such pose.
pub(super) fn standing(kinematics: &Platform, machine: &machine::Machine) -> Result<Pose, Failure> {
    let screws = kinematics.actuators().iter();
    let strokes = screws.map(|it| {
        let reading = machine.reading(&it.name)?;
        Ok(reading.map_or(Metres::ZERO, |it| it.position))
    });
    let strokes: Vec<_> = strokes.collect::<Result<_, Failure>>()?;
    let found = kinematics.forward(&strokes);
    Ok(found.map_err(PlatformFailure::from)?.pose)
}

impl Reach<'_> {
    /// Where `jog` ends when nothing ends it before, from where the platform is at `from`: at the end of its work range,
    /// which is one that the screws can reach.
    pub(super) fn end_of(&self, jog: PoseJog, from: Pose) -> Pose {
        let from = self.within_work_range(from);
        let begin = value(from, jog.part);
        let last = self.work_range()[jog.part] - self.margin_of(jog.part);
        let end = match jog.speed.approach() {
            Approach::Forward => begin.max(last),
            Approach::Reverse => begin.min(-last),
        };
        with(from, jog.part, end)
    }

    /// The largest of the screws' ways for a little of `part`, over that.
    fn screw_ratio(&self, part: usize) -> f64 {
        let strokes = |it: f64| self.kinematics.strokes(with(Pose::default(), part, it));
        let ways = strokes(A_LITTLE).into_iter().zip(strokes(0.0));
        let longest = ways.map(|(there, here)| (there - here).abs().value());
        longest.fold(0.0, f64::max) / A_LITTLE
    }

    /// How fast `part` goes when its screws do as fast as they usually may.
    pub(super) fn usual_speed(&self, part: usize) -> f64 {
        self.speed.value() / self.screw_ratio(part)
    }

    fn margin_of(&self, part: usize) -> f64 {
        match is_angle(part) {
            // A screw goes so far for it at least, where it has a lever.
            true => self.margin.value() / self.screw_ratio(part),
            false => self.margin.value(),
        }
    }

    /// To both sides.
    fn work_range(&self) -> [f64; 3] {
        let it = self.config;
        let angle = Radians::from_degrees(it.theta_max_deg).value();
        [it.x_max_mm * 1e-3, it.y_max_mm * 1e-3, angle]
    }

    fn within_work_range(&self, pose: Pose) -> Pose {
        let parts = self.work_range().into_iter().enumerate();
        parts.fold(pose, |pose, (part, limit)| {
            with(pose, part, value(pose, part).clamp(-limit, limit))
        })
    }
}

impl AlignmentPlatform<'_> {
    fn reach(&self) -> Reach<'_> {
        Reach {
            config: self.config,
            kinematics: &self.state.kinematics,
            margin: margin(self.config, self.core.config),
            speed: screw_speed(self.config, self.core.config),
        }
    }

    /// # Errors
    /// When `jog` is faster than the platform usually moves.
    #[cfg(feature = "program")]
    pub(crate) fn check_jog(&self, jog: PoseJog) -> Result<(), Failure> {
        let usual = self.reach().usual_speed(jog.part);
        let usual: AxisSpeed = match is_angle(jog.part) {
            true => units::RadiansPerSecond(usual).into(),
            false => MetresPerSecond(usual).into(),
        };
        let name = PARTS[jog.part];
        crate::jogging::require_usual(name, (jog.speed, usual), "speed_mm_per_s")
    }

    /// Where the screws have it, by their encoders.
    ///
    /// # Errors
    /// When there is no such pose.
    pub(crate) fn standing(&self) -> Result<Pose, Failure> {
        standing(&self.state.kinematics, self.core.machine)
    }

    /// How `jog` goes from here. Asks no device, and nothing moves.
    ///
    /// # Errors
    /// Not zeroed; screws that would contradict each other.
    pub(super) fn plan_jog(&self, jog: PoseJog) -> Result<PlannedJog, Failure> {
        self.require_zeroed()?;
        let from = self.standing()?;
        let reach = self.reach();
        let target = reach.end_of(jog, from);
        let usual = reach.usual_speed(jog.part);
        let screws = self.plan(&self.strokes_to(target)?, Correction::Off)?;
        let after: Vec<_> = screws.iter().map(|it| it.after).collect();
        self.check_planned(target, &after)?;
        // The way of the part takes as long as that of the screw with the longest way.
        let way = (value(target, jog.part) - value(from, jog.part)).abs();
        let longest = screws.iter().map(|it| it.travel.abs());
        let longest = longest.fold(Metres::ZERO, Metres::max).value();
        let speed = jog.speed.value().abs().min(usual);
        let pace = speed * longest / way.max(f64::MIN_POSITIVE);
        Ok(PlannedJog {
            target,
            screws,
            pace: MetresPerSecond(pace).min(reach.speed),
        })
    }

    /// Runs on as `planned`, for so long at most; it stands afterwards. Whether it came to its end.
    ///
    /// # Errors
    /// Whatever stops the machine.
    pub(super) fn run_jog(
        &mut self,
        planned: &PlannedJog,
        duration: Option<Duration>,
    ) -> Result<bool, Failure> {
        let moving = self.prepare(&planned.screws, planned.pace)?;
        let Some((first, _)) = moving.first() else {
            return Ok(true);
        };
        self.await_next_sample(first)?;
        let axes: Vec<_> = moving.iter().map(|(axis, _)| axis.as_str()).collect();
        for axis in &axes {
            self.core.begin(axis, AxisCommand::Start)?;
        }
        let is_at_end = run_on(self.core.machine, &axes, duration)?;
        let settle = Duration::from_millis(self.config.settle_ms.into());
        for axis in axes {
            self.core.stand_still(axis, settle)?;
        }
        if is_at_end {
            self.remember(&planned.screws);
            self.state.pose = Some(planned.target);
        }
        Ok(is_at_end)
    }

    /// Runs as `jog` says, for so long at most; it stands afterwards.
    ///
    /// # Errors
    /// Before anything moves: not zeroed, screws that would contradict each other. While moving: whatever stops the
    /// machine.
    #[cfg(feature = "program")]
    pub(crate) fn jog(
        &mut self,
        jog: PoseJog,
        duration: Option<Duration>,
    ) -> Result<crate::jogging::Jogged, Failure> {
        let planned = self.plan_jog(jog)?;
        let is_at_end = self.run_jog(&planned, duration)?;
        let position = match jog.place(self.standing()?) {
            Place::Length(it) => it.into(),
            Place::Angle(it) => it.into(),
        };
        Ok(crate::jogging::Jogged {
            position,
            is_at_end,
        })
    }
}

const fn is_angle(part: usize) -> bool {
    part == 2
}

/// In metres or radians.
const fn value(pose: Pose, part: usize) -> f64 {
    match part {
        0 => pose.x.value(),
        1 => pose.y.value(),
        _ => pose.angle.value(),
    }
}

const fn with(pose: Pose, part: usize, value: f64) -> Pose {
    match part {
        0 => Pose {
            x: Metres(value),
            ..pose
        },
        1 => Pose {
            y: Metres(value),
            ..pose
        },
        _ => Pose {
            angle: Radians(value),
            ..pose
        },
    }
}

#[cfg(test)]
mod tests {
    use units::RadiansPerSecond;

    use super::*;
    use crate::config;
    use crate::platform::kinematics;

    const UVW: &str = include_str!("../../../configs/machines/uvw.toml");

    fn with_reach(body: impl Fn(&Reach<'_>)) {
        let config = config::parse(UVW, "m.toml").unwrap().config;
        let platform = config.platform.as_ref().unwrap();
        body(&Reach {
            config: platform,
            kinematics: &kinematics(platform, &config).unwrap(),
            margin: margin(platform, &config),
            speed: screw_speed(platform, &config),
        });
    }

    fn along_x(speed: f64) -> PoseJog {
        PoseJog::new("x", MetresPerSecond(speed).into()).unwrap()
    }

    #[test]
    fn a_jog_ends_just_short_of_the_work_range_and_never_goes_the_other_way() {
        with_reach(|reach| {
            let from = Pose {
                x: Metres::from_mm(0.2),
                y: Metres::from_mm(-0.3),
                angle: Radians(1e-3),
            };
            let end = reach.end_of(along_x(1e-3), from);
            assert!((end.x.mm() - 1.4998).abs() < 1e-9, "{end:?}");
            assert_eq!((end.y, end.angle), (from.y, from.angle));
            let back = reach.end_of(along_x(-1e-3), end);
            assert!((back.x.mm() + 1.4998).abs() < 1e-9, "{back:?}");
            // It settles within the margin, or somebody sent it to the very end.
            for beyond_um in [0.1, 0.2, 0.4] {
                let x = end.x + Metres::from_um(beyond_um);
                let on = reach.end_of(along_x(1e-3), Pose { x, ..end });
                assert!(
                    (on.x - x.min(Metres::from_mm(1.5))).abs().nm() < 1e-6,
                    "{on:?}"
                );
            }
            let turned = PoseJog::new("theta", RadiansPerSecond(-1.0).into()).unwrap();
            let turned = reach.end_of(turned, from).angle.degrees();
            assert!((-0.5..-0.4998).contains(&turned), "{turned}");
        });
    }

    #[test]
    fn its_usual_speed_is_what_the_screws_make_of_theirs() {
        with_reach(|reach| {
            assert!((reach.usual_speed(0) - 10e-3).abs() < 1e-9);
            // The screws U and V push 80 mm from the middle.
            assert!((reach.usual_speed(2) - 10.0 / 80.0).abs() < 1e-4);
        });
    }

    #[test]
    fn a_part_that_is_not_there_or_does_not_move_so_is_refused() {
        let linear = AxisSpeed::from(MetresPerSecond(1e-3));
        for (part, speed) in [
            ("u", linear),
            ("theta", linear),
            ("y", RadiansPerSecond(1.0).into()),
        ] {
            assert!(PoseJog::new(part, speed).is_err(), "{part}");
        }
    }
}
