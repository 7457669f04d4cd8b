//! Moves of a platform: pose → strokes → set-points → all screws at once.

use core::time::Duration;

use compensator::platform::{Platform, Pose};
use compensator::screw::ScrewMemory;
use drivers::device::AxisCommand;
use units::{Metres, MetresPerSecond, MetresPerSecondSquared};

use crate::correction::Correction;
use crate::failure::Failure;
use crate::memories::Memory;
use crate::platform::PlatformConfig;
use crate::platform::failure::PlatformFailure;
use crate::platform::handle::AlignmentPlatform;
use crate::platform::state::engaged_by;
use crate::platform::take_up::TakenUp;

/// Travels below this are none: the drives would not even count them.
const TRAVEL_MIN: Metres = Metres(1e-9);

/// A move of a platform that was made.
#[derive(Clone, Debug, PartialEq)]
pub struct PoseMoved {
    /// Where it was told to be.
    pub target: Pose,
    /// What each screw was commanded, in the order of the configuration.
    pub set_points: Vec<(String, Metres)>,
    /// From the start of the first screw to that of the last, where more than one moved.
    pub skew: Option<Duration>,
    /// The standard uncertainty of each screw's place, in the same order; `None` where it is not calibrated.
    pub uncertainties: Vec<Option<Metres>>,
    /// The screws whose play was taken up before, because their engagement was unknown.
    pub taken_up: Vec<TakenUp>,
}

impl PoseMoved {
    /// The largest standard uncertainty of the screws' places, where calibrated.
    pub fn standard_uncertainty(&self) -> Option<Metres> {
        let known = self.uncertainties.iter().flatten().copied();
        known.reduce(Metres::max)
    }
}

/// What one screw is to do.
#[derive(Clone, Copy, Debug)]
pub(super) struct Planned {
    set_point: Metres,
    pub(super) travel: Metres,
    pub(super) after: ScrewMemory,
    standard_uncertainty: Option<Metres>,
}

impl Planned {
    pub(super) const fn set_point(&self) -> Metres {
        self.set_point
    }
}

impl AlignmentPlatform<'_> {
    /// Whether the platform may be told to be at `target`: by its work range and its screws'
    /// reach, without their calibrations. Asks no device.
    ///
    /// # Errors
    /// When it may not.
    pub fn check_pose(&self, target: Pose) -> Result<(), Failure> {
        check_pose_of((self.config, &self.state.kinematics), target)
    }

    pub(super) fn strokes_to(&self, target: Pose) -> Result<Vec<Metres>, Failure> {
        let strokes = self.state.kinematics.check(target);
        Ok(strokes.map_err(PlatformFailure::from)?)
    }

    /// Moves the platform to `target`, compensated where screws have a calibration.
    ///
    /// # Errors
    /// Before anything moves: not zeroed, outside the work range, a screw's reach or
    /// calibration, or a way there that leaves them. While moving: whatever stops the machine.
    pub fn move_to(&mut self, target: Pose) -> Result<PoseMoved, Failure> {
        self.move_by(target, Correction::On)
    }

    /// The same with the screws' calibrations or without them.
    pub(super) fn move_by(
        &mut self,
        target: Pose,
        correction: Correction,
    ) -> Result<PoseMoved, Failure> {
        self.require_zeroed()?;
        self.check_pose(target)?;
        self.plan(&self.strokes_to(target)?, correction)?;
        if correction == Correction::Off {
            let mut moved = self.go_to_pose(target, correction)?;
            // What is known of the screws is not made use of.
            moved.uncertainties.fill(None);
            return Ok(moved);
        }
        let taken_up = self.take_up()?;
        let moved = self.go_to_pose(target, correction)?;
        Ok(PoseMoved { taken_up, ..moved })
    }

    pub(super) fn go_to_pose(
        &mut self,
        target: Pose,
        correction: Correction,
    ) -> Result<PoseMoved, Failure> {
        let strokes = self.strokes_to(target)?;
        let state = &self.state;
        if let Some(from) = state.pose {
            let path = state.kinematics.check_path(from, target);
            path.map_err(PlatformFailure::from)?;
        }
        let planned = self.plan(&strokes, correction)?;
        let moved = self.go_agreed(&planned, target)?;
        self.state.pose = Some(target);
        Ok(PoseMoved { target, ..moved })
    }

    /// Brings each screw to its stroke, all at once.
    ///
    /// # Errors
    /// Before anything moves: a screw's reach or calibration, four screws that would contradict
    /// each other there. After it: the same by their encoders. While moving: whatever stops the
    /// machine.
    pub(super) fn go_to_strokes(
        &mut self,
        strokes: &[Metres],
        correction: Correction,
    ) -> Result<PoseMoved, Failure> {
        let near = self.state.pose.unwrap_or_default();
        let planned = self.plan(strokes, correction)?;
        self.go_agreed(&planned, near)
    }

    /// Moves all screws, which must agree about a pose near `near`, there and then.
    fn go_agreed(&mut self, planned: &[Planned], near: Pose) -> Result<PoseMoved, Failure> {
        let after: Vec<_> = planned.iter().map(|it| it.after).collect();
        self.check_planned(near, &after)?;
        let moved = self.go(planned)?;
        self.check_standing(near)?;
        Ok(moved)
    }

    fn go(&mut self, planned: &[Planned]) -> Result<PoseMoved, Failure> {
        let target = self.state.pose.unwrap_or_default();
        let skew = self.launch(planned)?;
        self.remember(planned);
        let state = &mut *self.state;
        state.pose = None;
        let names = state.screws.iter().map(|screw| screw.axis.clone());
        Ok(PoseMoved {
            target,
            set_points: names.zip(planned.iter().map(|it| it.set_point)).collect(),
            skew,
            uncertainties: planned.iter().map(|it| it.standard_uncertainty).collect(),
            taken_up: Vec::new(),
        })
    }

    /// The screws stand as `planned`.
    pub(super) fn remember(&mut self, planned: &[Planned]) {
        for (screw, planned) in self.state.screws.iter_mut().zip(planned) {
            screw.memory = Some(planned.after);
        }
    }

    pub(super) fn plan(
        &self,
        strokes: &[Metres],
        correction: Correction,
    ) -> Result<Vec<Planned>, Failure> {
        let state = &self.state;
        let lost_motion_max = self.lost_motion_max()?;
        let mut planned = Vec::new();
        for (screw, stroke) in state.screws.iter().zip(strokes) {
            let memory = self.screw_memory(&screw.axis, screw.memory)?;
            let expected = match (&screw.compensation, correction) {
                (Some(compensation), Correction::On) => {
                    let corrected = compensation.correct(*stroke, &memory);
                    Some(
                        corrected.map_err(|source| PlatformFailure::OutOfCalibration {
                            axis: screw.axis.clone(),
                            source,
                        })?,
                    )
                }
                (Some(compensation), Correction::Off) => {
                    Some(compensation.expected(*stroke, &memory))
                }
                (None, _) => None,
            };
            let set_point = expected.map_or(*stroke, |it| it.set_point);
            self.core.check_soft_limits(&screw.axis, set_point)?;
            let travel = set_point - memory.set_point;
            let engagement = engaged_by(travel, lost_motion_max, memory.engagement);
            let uncalibrated = ScrewMemory {
                set_point,
                engagement,
            };
            planned.push(Planned {
                set_point,
                travel,
                after: expected.map_or(uncalibrated, |it| it.after),
                standard_uncertainty: expected.and_then(|it| it.standard_uncertainty),
            });
        }
        Ok(planned)
    }

    /// What is remembered of a screw, or that nothing is but where it stands.
    pub(super) fn screw_memory(
        &self,
        axis: &str,
        memory: Option<ScrewMemory>,
    ) -> Result<ScrewMemory, Failure> {
        if let Some(memory) = memory {
            return Ok(memory);
        }
        let here = self.core.reading(axis)?.map(|reading| reading.position);
        Ok(ScrewMemory::unknown_at(here.unwrap_or(Metres::ZERO)))
    }

    /// Prepares every screw that has to travel, then starts all of them together; their speeds
    /// are such that they arrive together too.
    fn launch(&mut self, planned: &[Planned]) -> Result<Option<Duration>, Failure> {
        let speed = self.pace(planned)?;
        let settle = Duration::from_millis(self.config.settle_ms.into());
        let moving = self.prepare(planned, speed)?;
        if moving.is_empty() {
            return Ok(None);
        }
        self.start_together(&moving)?;
        let skew = self.start_skew(&moving)?;
        for (axis, _) in &moving {
            self.core.stand_still(axis, settle)?;
        }
        Ok(skew)
    }

    /// Prepares every screw that has to travel, the one with the longest way at `speed`, and says which these are:
    /// their names and numbers.
    pub(super) fn prepare(
        &mut self,
        planned: &[Planned],
        speed: MetresPerSecond,
    ) -> Result<Vec<(String, usize)>, Failure> {
        let longest = planned
            .iter()
            .map(|it| it.travel.abs())
            .fold(Metres::ZERO, Metres::max);
        if longest < TRAVEL_MIN {
            return Ok(Vec::new());
        }
        let acceleration = MetresPerSecondSquared(self.config.acceleration_mm_per_s2 * 1e-3);
        let moving = self.moving_axes(planned)?;
        self.state.interrupted_before_it_ends();
        for (axis, at) in &moving {
            let planned = &planned[*at];
            let share = planned.travel.abs() / longest;
            let command = AxisCommand::Prepare {
                target: planned.set_point,
                speed: speed * share,
                acceleration: acceleration * share,
            };
            let limit = self.move_limit(axis)?;
            self.core.command(axis, command, "prepare", limit)?;
        }
        Ok(moving)
    }

    fn moving_axes(&self, planned: &[Planned]) -> Result<Vec<(String, usize)>, Failure> {
        let screws = &self.state.screws;
        Ok(planned
            .iter()
            .zip(screws)
            .enumerate()
            .filter(|(_, (planned, _))| planned.travel.abs() >= TRAVEL_MIN)
            .map(|(at, (_, screw))| (screw.axis.clone(), at))
            .collect())
    }

    fn start_together(&mut self, moving: &[(String, usize)]) -> Result<(), Failure> {
        self.await_next_sample(&moving[0].0)?;
        let axes: Vec<_> = moving.iter().map(|(axis, _)| axis.as_str()).collect();
        Ok(self.core.start_together(&axes)?)
    }

    /// Right after a sample there is the most time until the next SYNC: what is sent now
    /// reaches all drives before it. A sample that was read late is no such moment. On a line
    /// without SYNC there is nothing to wait for.
    pub(super) fn await_next_sample(&mut self, axis: &str) -> Result<(), Failure> {
        let Some(period) = self.sync_period(axis)? else {
            return Ok(());
        };
        let deadline = self.core.now() + self.move_limit(axis)?;
        let before = self.core.reading(axis)?.map(|reading| reading.at);
        loop {
            let sample = self.core.reading(axis)?.map(|reading| reading.at);
            let is_new = sample != before;
            let is_fresh = sample.is_some_and(|at| self.core.now().since(at) * 2 <= period);
            if is_new && is_fresh || self.core.now() >= deadline {
                return Ok(());
            }
            self.core.tick(deadline)?;
        }
    }

    fn sync_period(&self, axis: &str) -> Result<Option<Duration>, Failure> {
        let drive = self.core.config.axis[axis].node();
        let bus = drive.and_then(|it| self.core.config.can.get(&it.bus));
        Ok(bus.map(|bus| bus.sync_period()))
    }

    fn start_skew(&self, moving: &[(String, usize)]) -> Result<Option<Duration>, Failure> {
        let mut times = Vec::new();
        for (axis, _) in moving {
            times.extend(self.core.started_at(axis)?);
        }
        let (first, last) = (times.iter().min(), times.iter().max());
        Ok(match (first, last) {
            (Some(first), Some(last)) if times.len() > 1 => Some(last.since(*first)),
            _ => None,
        })
    }

    fn move_limit(&self, axis: &str) -> Result<Duration, Failure> {
        Ok(self.core.axis_settings(axis)?.move_timeout)
    }

    /// The travel after which a screw is engaged whatever it was before.
    pub(super) fn lost_motion_max(&self) -> Result<Metres, Failure> {
        let compensation = self.config.compensation.as_ref();
        Ok(compensation.map_or(LOST_MOTION_MAX, |it| Metres::from_um(it.lost_motion_max_um)))
    }

    pub(super) fn require_zeroed(&self) -> Result<(), Failure> {
        let state = &self.state;
        let zeroed = state.screws.iter().all(|it| self.core.is_zeroed(&it.axis));
        if zeroed && state.datum.is_some() {
            return Ok(());
        }
        Err(PlatformFailure::NotZeroed.into())
    }
}

/// More lost motion than a screw of a precision platform has.
const LOST_MOTION_MAX: Metres = Metres(50e-6);

/// Whether a platform may be told to be at `target`: by its work range and its screws' reach.
pub(super) fn check_pose_of(
    (config, kinematics): (&PlatformConfig, &Platform),
    target: Pose,
) -> Result<(), Failure> {
    check_work_range(config, target)?;
    let strokes = kinematics.check(target);
    Ok(strokes.map(drop).map_err(PlatformFailure::from)?)
}

fn check_work_range(config: &PlatformConfig, target: Pose) -> Result<(), PlatformFailure> {
    let degrees = target.angle.value().to_degrees();
    for (what, seen, unit, limit) in [
        ("x", target.x.mm(), "mm", config.x_max_mm),
        ("y", target.y.mm(), "mm", config.y_max_mm),
        ("theta", degrees, "deg", config.theta_max_deg),
    ] {
        // A comparison with NaN is false, so that it is refused too.
        let is_within = seen.abs() <= limit;
        if !is_within {
            return Err(PlatformFailure::OutOfRange {
                what,
                seen,
                unit,
                limit,
            });
        }
    }
    Ok(())
}
