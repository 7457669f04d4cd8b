//! Homing: on the negative limit switch (method 529, or 513 when the amplifier counts against the
//! axis), on the first index pulse off it (561 or 545) and here (512).
//!
//! Either way the amplifier's coordinate becomes 0 at home; which coordinate of the axis that is,
//! the driver remembers. The software limits, which are in force once the amplifier is homed, are
//! set afterwards.

use core::time::Duration;
use units::{Coordinate, Counts, Time};
use wire::copley::{EventStatus, HomingMethod, Parameter, Trajectory, TrajectoryStatus};

use super::convert::{acceleration, amplifier_counts, speed};
use super::script::{Step, read};
use super::{Activity, CopleyAxis};
use crate::device::envelope::Profile;
use crate::device::{DeviceError, Seen, Urgency};

const PREPARING: &str = "setting the homing parameters";
const STARTING: &str = "starting the homing";
const RESOLVING: &str = "checking whether homing has begun";
const LIMITING: &str = "setting the software limits";
/// The way off the switch is so much slower than the way to it.
const SLOWER: i64 = 5;

/// Where the home is, and how fast it is looked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum HomingPlace<S> {
    /// Where the axis stands.
    Here,
    /// Where it leaves its negative limit switch.
    NegativeLimit(S),
    /// At the first index pulse off that switch.
    Index(S),
}

impl<S: Copy> HomingPlace<S> {
    /// The negative end of the axis is the amplifier's positive one when that counts against the
    /// axis.
    const fn method(&self, reversed: bool) -> HomingMethod {
        match (self, reversed) {
            (Self::Here, _) => HomingMethod::Here,
            (Self::NegativeLimit(_), false) => HomingMethod::NegativeLimit,
            (Self::NegativeLimit(_), true) => HomingMethod::PositiveLimit,
            (Self::Index(_), false) => HomingMethod::NegativeLimitToIndex,
            (Self::Index(_), true) => HomingMethod::PositiveLimitToIndex,
        }
    }

    const fn speed(&self) -> Option<S> {
        match self {
            Self::Here => None,
            Self::NegativeLimit(speed) | Self::Index(speed) => Some(*speed),
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    Preparing,
    Starting,
    /// The `ok` to `t 2` was lost.
    Resolving,
    Running,
    /// The software limits are set.
    Limiting,
}

/// A homing under way.
#[derive(Clone, Copy, Debug)]
pub(super) struct Homing {
    phase: Phase,
    /// The coordinate at home, in counts.
    position: Counts,
    here: bool,
    /// The search; `None`: homed where it stands.
    search: Option<Profile>,
    /// How far from its home the axis may stand afterwards.
    beside: i64,
    /// Whether bits are about this homing: the reference was seen to be gone, or a search to run.
    begun: bool,
    /// Whether the axis was elsewhere than its home before.
    was_far: bool,
    /// Since when the axis stands elsewhere, and the amplifier calls it referenced.
    done_since: Option<Time>,
    since: Time,
    deadline: Time,
}

impl Homing {
    pub(super) const fn deadline(&self) -> Time {
        self.deadline
    }
}

impl<Q: Coordinate> CopleyAxis<Q> {
    pub(super) fn begin_homing(&mut self, now: Time, position: Q, place: HomingPlace<Q::Speed>) {
        let search = place.speed();
        if search.is_none() && self.image.events.contains(EventStatus::IN_MOTION) {
            self.refuse("homing here", "an axis that stands still");
            return;
        }
        let steps = self.homing_steps(position, place);
        match steps {
            Err(error) => self.finish(Err(error)),
            Ok((position, steps)) => {
                self.homed = false;
                self.started_at = None;
                let search = search.map(|speed| self.settings.search_profile(speed));
                let beside = self.beside_home(search);
                let far = self.here().is_some_and(|here| here.position.abs() > beside);
                self.activity = Activity::Homing(Homing {
                    phase: Phase::Preparing,
                    position,
                    here: search.is_none(),
                    search,
                    beside,
                    begun: false,
                    was_far: far,
                    done_since: None,
                    since: now,
                    deadline: Time::NEVER,
                });
                self.run(now, steps, Urgency::Command);
            }
        }
    }

    fn homing_steps(
        &self,
        position: Q,
        place: HomingPlace<Q::Speed>,
    ) -> Result<(Counts, Vec<Step>), DeviceError> {
        let settings = &self.settings;
        let method = place.method(settings.scale.resolution() < Q::ZERO);
        let parameter = Parameter::HOME_OFFSET;
        let origin = Counts(0);
        let home = amplifier_counts(settings, parameter, "home position", position, origin)?;
        let mut steps = Step::check(Parameter::HOMING_METHOD, method.raw(), PREPARING).to_vec();
        // Amplifiers move by the offset.
        steps.extend(Step::check(parameter, 0, PREPARING));
        if let Some(search) = place.speed() {
            let fast = speed(settings, Parameter::HOMING_SPEED_FAST, search)?;
            let parameter = Parameter::HOMING_ACCELERATION;
            let rate = acceleration(settings, parameter, settings.homing_acceleration)?;
            for (parameter, value) in [
                (Parameter::HOMING_SPEED_FAST, fast),
                (Parameter::HOMING_SPEED_SLOW, (fast / SLOWER).max(1)),
                (parameter, rate),
            ] {
                steps.extend(Step::check(parameter, value, PREPARING));
            }
        }
        Ok((Counts(home), steps))
    }

    fn enter_homing(&mut self, phase: Phase, patience: Option<Duration>, now: Time) {
        if let Activity::Homing(homing) = &mut self.activity {
            homing.phase = phase;
            homing.deadline = patience.map_or(Time::NEVER, |patience| now + patience);
        }
    }

    pub(super) fn homing_step_done(&mut self, now: Time) {
        let Activity::Homing(Homing { phase, .. }) = self.activity else {
            return;
        };
        match phase {
            Phase::Preparing => {
                self.enter_homing(Phase::Starting, None, now);
                let steps = vec![Step::motion(Trajectory::Home, STARTING)];
                self.run(now, steps, Urgency::Command);
            }
            Phase::Starting => self.homing_runs(now),
            Phase::Resolving => {
                let status = self.script.number(Parameter::TRAJECTORY_STATUS);
                let status = TrajectoryStatus::from_bits_retain(status.unwrap_or(0) as u16);
                // A homing takes the reference away before it gives another; one that has
                // ended without being seen looks like one that never began.
                if status.intersects(TrajectoryStatus::HOMING | TrajectoryStatus::HOMING_ERROR) {
                    self.homing_runs(now);
                } else {
                    let error = self.unanswered(STARTING, 1);
                    self.finish(Err(error));
                }
            }
            Phase::Limiting => self.finish(Ok(())),
            Phase::Running => {}
        }
    }

    fn homing_runs(&mut self, now: Time) {
        self.started_at = Some(now);
        let patience = Some(self.settings.timeouts.homing);
        self.enter_homing(Phase::Running, patience, now);
        self.image.plausible.allow_jumps(true);
        self.watch_search();
        self.image.plausible.watch_rest();
        self.look_anew(now);
    }

    fn watch_search(&mut self) {
        let (Activity::Homing(homing), Some(here)) = (&self.activity, self.here()) else {
            return;
        };
        match homing.search {
            Some(profile) => {
                let reach = self.settings.search_reach();
                self.envelope.begin_homing(here, reach, profile);
            }
            // Nothing moves, and the coordinates change.
            None => self.envelope.release(),
        }
    }

    /// How far from its home the axis may stand after a homing.
    fn beside_home(&self, search: Option<Profile>) -> i64 {
        search.map_or_else(
            || self.settings.tolerance_counts(),
            |profile| {
                let (speed, acceleration) = (profile.speed, profile.acceleration);
                let way = self.envelope.stopping_way(speed, acceleration);
                way as i64 + self.settings.figures().lag
            },
        )
    }

    pub(super) fn homing_unanswered(&mut self, now: Time) {
        let Activity::Homing(Homing { here, .. }) = self.activity else {
            return;
        };
        if here {
            // Nothing moves, and the second time changes nothing.
            let mut again = Step::motion(Trajectory::Home, STARTING);
            again.repeatable = true;
            self.run(now, vec![again], Urgency::Command);
            return;
        }
        self.enter_homing(Phase::Resolving, None, now);
        let steps = vec![read(Parameter::TRAJECTORY_STATUS, RESOLVING)];
        self.run(now, steps, Urgency::Command);
    }

    /// After each whole look.
    pub(super) fn advance_homing(&mut self, now: Time) {
        let status = self.image.trajectory;
        let Some(at) = self.image.position().map(|(_, at)| at.0.abs()) else {
            return;
        };
        let stands = self.image.plausible.stands();
        let Activity::Homing(homing) = &mut self.activity else {
            return;
        };
        if homing.phase != Phase::Running {
            return;
        }
        if status.contains(TrajectoryStatus::HOMING_ERROR) {
            let error = DeviceError::Aborted {
                device: self.name(),
                step: "homing",
                seen: self.seen_events(),
            };
            self.finish(Err(error));
            return;
        }
        let busy = status.intersects(TrajectoryStatus::HOMING | TrajectoryStatus::RUNNING);
        let referenced = status.contains(TrajectoryStatus::REFERENCED);
        homing.begun |= busy || !referenced;
        let is_home = at <= homing.beside;
        // In between it may still settle.
        let settled = homing.here || stands;
        if busy || !referenced || !settled {
            homing.done_since = None;
            return;
        }
        if is_home && (homing.begun || homing.was_far || homing.here) {
            let position = homing.position;
            self.take_reference(now, position);
            return;
        }
        let since = *homing.done_since.get_or_insert(now);
        let begun = homing.begun;
        if begun && !is_home && now.since(since) >= self.settings.timeouts.standing {
            let seen = self.seen_position();
            self.time_out(
                now,
                since,
                "the place shown to become the home coordinate",
                seen,
            );
        }
    }

    fn take_reference(&mut self, now: Time, position: Counts) {
        self.origin = position;
        self.homed = true;
        self.envelope.settle();
        self.enter_homing(Phase::Limiting, None, now);
        match self.limit_steps() {
            Err(error) => self.finish(Err(error)),
            Ok(steps) if steps.is_empty() => self.finish(Ok(())),
            Ok(steps) => self.run(now, steps, Urgency::Command),
        }
    }

    fn limit_steps(&self) -> Result<Vec<Step>, DeviceError> {
        let Some((low, high)) = self.settings.soft_limits else {
            return Ok(Vec::new());
        };
        let counts = |parameter, limit| {
            amplifier_counts(&self.settings, parameter, "soft limit", limit, self.origin)
        };
        let first = counts(Parameter::SOFT_LIMIT_NEGATIVE, low)?;
        let second = counts(Parameter::SOFT_LIMIT_POSITIVE, high)?;
        // A negative scale turns the lower end into the higher count.
        let (low, high) = (first.min(second), first.max(second));
        let mut steps = Step::check(Parameter::SOFT_LIMIT_POSITIVE, high, LIMITING).to_vec();
        steps.extend(Step::check(Parameter::SOFT_LIMIT_NEGATIVE, low, LIMITING));
        Ok(steps)
    }

    pub(super) fn homing_timeout(&mut self, now: Time) {
        let Activity::Homing(homing) = &self.activity else {
            return;
        };
        if now < homing.deadline {
            return;
        }
        let (since, here) = (homing.since, homing.here);
        let (awaited, seen): (_, Seen) = if here {
            ("the new position after homing", self.seen_position())
        } else {
            ("the end of homing", self.seen_events())
        };
        self.time_out(now, since, awaited, seen);
    }
}
