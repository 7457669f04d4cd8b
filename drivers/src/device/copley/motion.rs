//! Profile position moves, prepared and started, and halt.
//!
//! Everything that a move needs is written and read back; then `t 1` begins it. Its `ok` says that
//! it was understood, the trajectory status that something moves. When the `ok` is lost, status
//! and commanded position are read: they say whether it has begun.

use core::time::Duration;
use units::{Coordinate, Counts, Time};
use wire::copley::{EventStatus, Parameter, Trajectory, TrajectoryStatus};

use super::convert::{acceleration, amplifier_counts, out_of_range, speed};
use super::script::{Step, read};
use super::{Activity, CopleyAxis};
use crate::device::envelope::Profile;
use crate::device::{DeviceError, Urgency};

const LOADING: &str = "loading the move";
const STARTING: &str = "starting the move";
const RESOLVING: &str = "checking whether the move has begun";

/// A move, in the amplifier's units.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Plan {
    target: i64,
    /// 0.1 counts/s.
    speed: i64,
    /// 10 counts/s².
    acceleration: i64,
    /// Where the trajectory generator stood when the move was loaded.
    from: i64,
    /// Others start with it: it is not started late.
    in_company: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    Loading {
        then_start: bool,
    },
    /// `t 1` is on its way, for the so manieth time.
    Starting {
        attempts: u32,
    },
    /// Its `ok` was lost.
    Resolving {
        attempts: u32,
    },
    Running,
}

/// A move under way.
#[derive(Clone, Copy, Debug)]
pub(super) struct Motion {
    plan: Plan,
    phase: Phase,
    since: Time,
    deadline: Time,
}

impl Motion {
    pub(super) const fn deadline(&self) -> Time {
        self.deadline
    }
}

/// A halt under way.
#[derive(Clone, Copy, Debug)]
pub(super) struct Halt {
    since: Time,
    deadline: Time,
}

impl Halt {
    pub(super) const fn deadline(&self) -> Time {
        self.deadline
    }
}

impl<Q: Coordinate> CopleyAxis<Q> {
    pub(super) fn begin_move(
        &mut self,
        now: Time,
        wanted: (Q, Q::Speed, Q::Acceleration),
        then_start: bool,
    ) {
        self.started_at = None;
        let plan = match self.plan(wanted, !then_start) {
            Ok(plan) => plan,
            Err(error) => return self.finish(Err(error)),
        };
        let position = Parameter::POSITION_COMMAND;
        let mut steps = Step::check(position, plan.target, LOADING).to_vec();
        if self.profile != Some((plan.speed, plan.acceleration)) {
            // Until all is written the amplifier's values are neither old nor new.
            self.profile = None;
            for (parameter, value) in [
                (Parameter::SPEED, plan.speed),
                (Parameter::ACCELERATION, plan.acceleration),
                (Parameter::DECELERATION, plan.acceleration),
            ] {
                steps.extend(Step::check(parameter, value, LOADING));
            }
        }
        steps.push(read(Parameter::COMMANDED_POSITION, LOADING));
        self.activity = Activity::Motion(Motion {
            plan,
            phase: Phase::Loading { then_start },
            since: now,
            deadline: Time::NEVER,
        });
        self.run(now, steps, Urgency::Command);
    }

    fn plan(
        &self,
        (target, velocity, rate): (Q, Q::Speed, Q::Acceleration),
        in_company: bool,
    ) -> Result<Plan, DeviceError> {
        let settings = &self.settings;
        let parameter = Parameter::POSITION_COMMAND;
        let counts = amplifier_counts(settings, parameter, "target", target, self.origin)?;
        if let Some((low, high)) = settings.soft_limits {
            let limit = if target < low { low } else { high };
            if target < low || target > high {
                let range = (target.value(), limit.value());
                return Err(out_of_range(settings, parameter, "target", range, Q::UNIT));
            }
        }
        Ok(Plan {
            target: counts,
            speed: speed(settings, Parameter::SPEED, velocity)?,
            acceleration: acceleration(settings, Parameter::ACCELERATION, rate)?,
            from: 0,
            in_company,
        })
    }

    pub(super) fn begin_prepared(&mut self, now: Time, plan: Plan) {
        if let Some(here) = self.here() {
            let profile = Profile {
                speed: plan.speed as f64 / 10.0,
                acceleration: plan.acceleration as f64 * 10.0,
            };
            self.envelope.begin_motion(here, plan.target, profile);
        }
        self.activity = Activity::Motion(Motion {
            plan,
            phase: Phase::Starting { attempts: 1 },
            since: now,
            deadline: Time::NEVER,
        });
        let steps = vec![Step::motion(Trajectory::Move, STARTING)];
        self.run(now, steps, Urgency::Start);
    }

    pub(super) fn motion_step_done(&mut self, now: Time) {
        let Activity::Motion(Motion {
            mut plan,
            phase,
            since,
            ..
        }) = self.activity
        else {
            return;
        };
        match phase {
            Phase::Loading { then_start } => {
                plan.from = match self.script.number(Parameter::COMMANDED_POSITION) {
                    Some(from) => from,
                    None => return self.refuse(LOADING, "a commanded position that is a number"),
                };
                self.profile = Some((plan.speed, plan.acceleration));
                if then_start {
                    self.begin_prepared(now, plan);
                } else {
                    self.finish(Ok(()));
                    self.prepared = Some(plan);
                }
            }
            Phase::Starting { .. } => self.has_started(now, now, plan),
            Phase::Resolving { attempts } => self.resolve(now, since, plan, attempts),
            Phase::Running => {}
        }
    }

    fn has_started(&mut self, now: Time, at: Time, plan: Plan) {
        self.started_at = Some(at);
        self.activity = Activity::Motion(Motion {
            plan,
            phase: Phase::Running,
            since: now,
            deadline: now + self.travel_time(plan),
        });
        self.look_anew(now);
    }

    /// The `ok` to `t 1` is lost: what has become of it is read.
    pub(super) fn start_unanswered(&mut self, now: Time) {
        let Activity::Motion(motion) = &mut self.activity else {
            return;
        };
        let Phase::Starting { attempts } = motion.phase else {
            return;
        };
        motion.phase = Phase::Resolving { attempts };
        let steps = vec![
            read(Parameter::TRAJECTORY_STATUS, RESOLVING),
            read(Parameter::COMMANDED_POSITION, RESOLVING),
        ];
        self.run(now, steps, Urgency::Start);
    }

    /// `told`: when it was to start. It has, if at all, since then.
    fn resolve(&mut self, now: Time, told: Time, plan: Plan, attempts: u32) {
        let status = self
            .script
            .number(Parameter::TRAJECTORY_STATUS)
            .unwrap_or(0);
        let commanded = self.script.number(Parameter::COMMANDED_POSITION);
        let runs = status & i64::from(TrajectoryStatus::RUNNING.bits()) != 0;
        let has_moved = commanded.is_some_and(|at| at != plan.from);
        if runs || has_moved || plan.from == plan.target {
            self.has_started(now, told, plan);
        } else if attempts < 2 && !plan.in_company {
            // It is known to stand where it stood: nothing was begun.
            self.begin_prepared(now, plan);
            if let Activity::Motion(motion) = &mut self.activity {
                motion.phase = Phase::Starting {
                    attempts: attempts + 1,
                };
            }
        } else {
            let error = self.unanswered(STARTING, attempts);
            self.finish(Err(error));
        }
    }

    /// Half as much again as a trapezoidal profile takes, and the settling.
    fn travel_time(&self, plan: Plan) -> Duration {
        let way = (plan.target - plan.from).unsigned_abs() as f64;
        let speed = plan.speed as f64 / 10.0;
        let rate = plan.acceleration as f64 * 10.0;
        // A superseded move may first have to come back from the other direction.
        let profile_s = way / speed + 3.0 * speed / rate;
        let profile = Duration::try_from_secs_f64(profile_s * 1.5).unwrap_or(Duration::MAX);
        profile.saturating_add(self.settings.timeouts.settling)
    }

    /// After each whole look.
    pub(super) fn advance_motion(&mut self, now: Time) {
        let Activity::Motion(Motion {
            plan,
            phase: Phase::Running,
            since,
            ..
        }) = self.activity
        else {
            return;
        };
        let Some((_, position)) = self.image.position() else {
            return;
        };
        let runs = self.image.events.contains(EventStatus::IN_MOTION)
            || self.image.trajectory.contains(TrajectoryStatus::RUNNING);
        let away = (position - Counts(plan.target)).0.abs();
        if runs {
            return;
        }
        if away <= self.settings.tolerance_counts() {
            self.envelope.hold(plan.target);
            self.finish(Ok(()));
        } else if self.image.trajectory.contains(TrajectoryStatus::ABORTED) {
            let error = DeviceError::Aborted {
                device: self.name(),
                step: "the move",
                seen: self.seen_position(),
            };
            self.finish(Err(error));
        } else if now.since(since) >= self.settings.timeouts.motion {
            let seen = self.seen_position();
            self.time_out(now, since, "the motion after its start", seen);
        }
    }

    pub(super) fn motion_timeout(&mut self, now: Time) {
        let Activity::Motion(motion) = &self.activity else {
            return;
        };
        if now >= motion.deadline {
            let since = motion.since;
            let seen = self.seen_position();
            self.time_out(now, since, "the target to be reached", seen);
        }
    }

    pub(super) fn begin_halt(&mut self, now: Time) {
        self.image.plausible.watch_rest();
        if let Some(here) = self.here() {
            self.envelope.begin_stop(here);
        }
        self.activity = Activity::Halt(Halt {
            since: now,
            deadline: now + self.settings.timeouts.standing,
        });
        self.run(now, vec![Step::abort("the halt")], Urgency::Stop);
    }

    pub(super) fn halt_sent(&mut self, now: Time) {
        self.look_anew(now);
    }

    /// After each whole look.
    pub(super) fn advance_halt(&mut self) {
        let sent = self.script.steps.is_empty();
        let in_motion = self.image.events.contains(EventStatus::IN_MOTION);
        if sent && (!in_motion || self.image.plausible.stands()) {
            self.envelope.settle();
            self.finish(Ok(()));
        }
    }

    pub(super) fn halt_timeout(&mut self, now: Time) {
        let Activity::Halt(halt) = &self.activity else {
            return;
        };
        if now >= halt.deadline {
            let since = halt.since;
            let seen = self.seen_events();
            self.time_out(now, since, "the axis to stand still after a halt", seen);
        }
    }
}
