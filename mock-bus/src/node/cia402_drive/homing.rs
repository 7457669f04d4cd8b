//! Homing mode: methods 1, 2 (limit switch and index pulse), 17, 18 (limit switch), 33, 34
//! (index pulse), 35 and 37 (here) (CiA 402-2, 10.2).
//!
//! The position of the home is 0x607C afterwards. A limit-switch run searches the switch at
//! 0x6099:01, leaves it at 0x6099:02, and the edge at which it is released is the home; with an
//! index pulse, the first pulse behind that edge is. The encoder latches the count of the pulse,
//! so its place does not depend on the speed.

use units::Time;
use wire::cia402::{Controlword, HomingStatus};

use super::Drive;
use super::homing_run::{HomingRun, Step};
use super::mechanism::Mechanism;
use super::motion::{Activity, After};
use crate::node::profile::{MotionLimits, Profile};

/// Farther than any axis, in counts.
const FAR: f64 = 1e12;

impl Drive {
    /// A new controlword in operation enabled: bit 4 starts and, falling, interrupts.
    pub(super) fn control_homing(
        &mut self,
        now: Time,
        old: Controlword,
        new: Controlword,
        m: &mut impl Mechanism,
    ) {
        let rose = |bit| new.contains(bit) && !old.contains(bit);
        let start = rose(Controlword::MODE_4) && !new.contains(Controlword::HALT);
        let dropped = old.contains(Controlword::MODE_4) && !new.contains(Controlword::MODE_4);
        if start {
            self.start_homing(now, m);
        } else if (dropped || rose(Controlword::HALT))
            && matches!(self.activity, Activity::Homing(_))
        {
            self.homing = HomingStatus::NotStarted;
            self.ramp(now, self.acceleration(0x609A), After::Stay);
        }
    }

    fn start_homing(&mut self, now: Time, m: &mut impl Mechanism) {
        self.homed = false;
        self.homings.begun += 1;
        self.begin_stale_bits(now);
        self.homing = HomingStatus::InProgress;
        match self.get(0x6098) {
            35 | 37 => {
                self.set_home(self.actual(m));
                self.homing = HomingStatus::Done;
            }
            1 => self.search(now, -1.0, true, m),
            2 => self.search(now, 1.0, true, m),
            17 => self.search(now, -1.0, false, m),
            18 => self.search(now, 1.0, false, m),
            // Backing off from nowhere: in the negative direction, as if off the positive switch.
            33 => self.search_index(now, 1.0, m),
            34 => self.search_index(now, -1.0, m),
            _ => self.fail_homing(now),
        }
    }

    fn search(&mut self, now: Time, direction: f64, to_index: bool, m: &mut impl Mechanism) {
        let on_switch = switch(direction, self.limits(m));
        let step = if on_switch { Step::BackOff } else { Step::Seek };
        self.run(now, direction, to_index, step);
    }

    fn search_index(&mut self, now: Time, direction: f64, m: &mut impl Mechanism) {
        let after = pulses(m);
        self.run(now, direction, true, Step::Index { after });
    }

    fn run(&mut self, now: Time, direction: f64, to_index: bool, step: Step) {
        let run = HomingRun {
            direction,
            to_index,
            step,
            started_at: self.demand(now).position,
        };
        self.enter(now, run, step);
    }

    /// Plans the motion of a step.
    fn enter(&mut self, now: Time, run: HomingRun, step: Step) {
        let from = self.demand(now);
        let acceleration = self.acceleration(0x609A);
        let towards = |direction: f64, velocity: f64| {
            let limits = MotionLimits {
                velocity,
                acceleration,
                deceleration: acceleration,
            };
            Profile::to_target(now, from, from.position + direction * FAR, limits)
        };
        self.profile = match step {
            Step::Seek => towards(run.direction, self.homing_speed(1)),
            Step::BackOff | Step::Index { .. } => towards(-run.direction, self.homing_speed(2)),
            Step::Stop | Step::Settle => Profile::stopping(now, from, acceleration),
        };
        self.activity = Activity::Homing(HomingRun { step, ..run });
        self.count_units();
        self.look_now();
    }

    /// One look at the switches during a run.
    pub(super) fn home_on(&mut self, now: Time, run: HomingRun, m: &mut impl Mechanism) {
        let limits = self.limits(m);
        let pressed = switch(run.direction, limits);
        let opposite = switch(-run.direction, limits);
        let travelled = (self.demand(now).position - run.started_at).abs();
        let lost = travelled > self.config.power_on().homing_search_limit as f64;
        match run.step {
            Step::Seek if pressed && opposite => self.fail_homing(now),
            Step::Seek if pressed => self.enter(now, run, Step::Stop),
            Step::Seek if lost || self.runs_into(opposite, travelled) => {
                self.fail_homing(now);
            }
            Step::BackOff | Step::Index { .. } if lost || opposite => self.fail_homing(now),
            Step::Index { after } => {
                if let Some(pulse) = m.index_pulse().filter(|pulse| pulse.number > after) {
                    self.set_home(self.position_of(pulse.count));
                    self.homing = HomingStatus::Attained;
                    self.enter(now, run, Step::Settle);
                }
            }
            Step::BackOff if !pressed && run.to_index => {
                let after = pulses(m);
                self.enter(now, run, Step::Index { after });
            }
            Step::BackOff if !pressed => {
                self.set_home(self.actual(m));
                self.homing = HomingStatus::Attained;
                self.enter(now, run, Step::Settle);
            }
            Step::Stop if self.profile.is_done(now) => self.enter(now, run, Step::BackOff),
            Step::Settle if self.profile.is_done(now) => {
                self.activity = Activity::Standing;
                self.homing = HomingStatus::Done;
            }
            Step::Seek | Step::Stop | Step::BackOff | Step::Settle => {}
        }
    }

    /// The opposite switch, on which a run may begin but which it must leave soon.
    fn runs_into(&self, opposite: bool, travelled: f64) -> bool {
        opposite && travelled > self.config.power_on().homing_may_begin_within as f64
    }

    /// The zero moves so that `position` becomes 0x607C.
    fn set_home(&mut self, position: i64) {
        self.shift(self.get(0x607C) - position);
        self.homed = true;
        self.homings.attained += 1;
        self.leave_homing_bits();
    }

    pub(super) fn fail_homing(&mut self, now: Time) {
        self.homing = HomingStatus::ErrorMoving;
        self.ramp(now, self.acceleration(0x609A), After::HomingError);
    }

    pub(super) fn homing_error_stopped(&mut self) {
        self.homing = HomingStatus::ErrorStopped;
    }
}

/// The switch in `direction`.
fn switch(direction: f64, (negative, positive): (bool, bool)) -> bool {
    if direction < 0.0 { negative } else { positive }
}

/// How many index pulses there have been.
fn pulses(m: &impl Mechanism) -> u64 {
    m.index_pulse().map_or(0, |pulse| pulse.number)
}
