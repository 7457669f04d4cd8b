//! Enable, disable, quick stop and fault reset of a drive.

use core::time::Duration;

use units::{Coordinate, Time};
use wire::cia402::{Controlword, OperationMode, PowerState};

use super::start::CONTROLWORD;
use super::{Activity, Cia402Drive};
use crate::device::envelope::Point;
use crate::device::{DeviceError, Seen};
use crate::protocol::power_state::{Goal, PowerFailure, PowerSequence, PowerStep};
use crate::protocol::script::Step;

/// A change of the power state under way.
#[derive(Debug)]
pub(super) struct Power {
    sequence: PowerSequence,
    then: Then,
    since: Time,
    /// Where the axis was before it was enabled.
    before: Option<i64>,
    braking: Braking,
}

/// How an axis slows down in a quick stop.
#[derive(Clone, Copy, Debug, Default)]
struct Braking {
    mark: Option<Point>,
    /// Counts of the span before.
    moved: Option<i64>,
    /// So many spans in a row it was as fast as before.
    unslowed: u8,
    /// The quick stop has no effect: the drive lets go.
    lets_go: bool,
}

/// A span over which the speed of a quick stop is judged.
const BRAKING_SPAN: Duration = Duration::from_millis(80);
/// After so many spans without effect nothing else is left.
const UNSLOWED_MAX: u8 = 2;

impl Power {
    pub(super) fn poll_timeout(&self) -> Time {
        self.sequence.poll_timeout()
    }
}

/// What follows a change of the power state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Then {
    /// The command has ended.
    Tell,
    /// The drive is enabled anew.
    Enable,
    /// Nothing: no command asked for the change.
    BeSilent,
}

impl Braking {
    /// Whether the axis goes on as fast as before: a drive that brakes too softly slows down at least.
    fn lets_go(&mut self, here: Point, window: i64) -> bool {
        let mark = *self.mark.get_or_insert(here);
        if !self.lets_go && here.at.since(mark.at) >= BRAKING_SPAN {
            let span = here.at.since(mark.at).as_secs_f64() / BRAKING_SPAN.as_secs_f64();
            let moved = ((here.position - mark.position).abs() as f64 / span) as i64;
            let is_as_fast = self
                .moved
                .is_some_and(|before| moved > before - before / 10);
            self.unslowed = match is_as_fast && moved > window * 4 {
                true => self.unslowed + 1,
                false => 0,
            };
            (self.mark, self.moved) = (Some(here), Some(moved));
            self.lets_go = self.unslowed >= UNSLOWED_MAX;
        }
        self.lets_go
    }
}

const fn step_name(goal: Goal) -> &'static str {
    match goal {
        Goal::OperationEnabled => "enabling",
        Goal::SwitchOnDisabled => "disabling",
        Goal::QuickStop => "the quick stop",
        Goal::FaultReset => "the fault reset",
    }
}

const fn stops(goal: Goal) -> bool {
    match goal {
        Goal::SwitchOnDisabled | Goal::QuickStop => true,
        Goal::OperationEnabled | Goal::FaultReset => false,
    }
}

/// `step` for an axis that gravity pulls. Quick stop active gives torque: no command that lets go
/// ends that, only operation enabled again (transition 16).
const fn held_up(goal: Goal, state: PowerState, step: PowerStep, standing: bool) -> PowerStep {
    match (goal, state) {
        (Goal::OperationEnabled, PowerState::QuickStopActive) => {
            PowerStep::Command(Controlword::ENABLE_COMMAND)
        }
        (Goal::SwitchOnDisabled | Goal::QuickStop, PowerState::QuickStopActive) if standing => {
            PowerStep::Done(Controlword::QUICK_STOP_COMMAND)
        }
        (Goal::SwitchOnDisabled, PowerState::QuickStopActive) => {
            PowerStep::Command(Controlword::QUICK_STOP_COMMAND)
        }
        _ => step,
    }
}

impl<Q: Coordinate> Cia402Drive<Q> {
    /// An axis that is enabled stays as it is: nothing is sent that could set an old target free.
    pub(super) fn begin_enable(&mut self, now: Time, was_moving: bool) {
        self.was_enabled = true;
        let enabled = self.state() == Some(PowerState::OperationEnabled);
        if self.state() == Some(PowerState::Fault) && self.node.lost_master() {
            // The end of a program like this one made the drive fault, and the heartbeat runs again.
            self.begin_power(now, Goal::FaultReset, Then::Enable);
        } else if !enabled {
            self.begin_power(now, Goal::OperationEnabled, Then::Tell);
        } else if was_moving {
            self.begin_halt(now);
        } else if self.kept == Some(PowerState::OperationEnabled) && !self.waits_to_go_on() {
            self.finish(Ok(()));
        } else {
            self.begin_power(now, Goal::SwitchOnDisabled, Then::Enable);
        }
    }

    pub(super) fn begin_disable(&mut self, now: Time) {
        self.begin_power(now, Goal::SwitchOnDisabled, Then::Tell);
    }

    pub(super) fn begin_reset(&mut self, now: Time) {
        match self.state() {
            Some(PowerState::OperationEnabled) => self.finish(Ok(())),
            _ => self.begin_power(now, Goal::FaultReset, Then::Tell),
        }
    }

    /// Goes out at once, whatever runs and whatever state the drive is in.
    pub(super) fn begin_quick_stop(&mut self, now: Time) {
        self.stop_at_once(now, Then::Tell);
    }

    /// The same without a command: how a command ended before that stays to be asked for.
    pub(super) fn stop_by_itself(&mut self, now: Time) {
        self.node.drop_script(now);
        self.stop_at_once(now, Then::BeSilent);
    }

    fn stop_at_once(&mut self, now: Time, then: Then) {
        self.image.plausible.watch_rest();
        self.begin_power(now, Goal::QuickStop, then);
        if !self.node.is_in_service() {
            // A node that left operational hears no RPDO, but perhaps SDO.
            let stop = Controlword::QUICK_STOP_COMMAND.bits();
            let step = Step::write(CONTROLWORD.object, stop, "stopping by SDO");
            self.node.run(now, vec![step]);
        }
    }

    fn begin_power(&mut self, now: Time, goal: Goal, then: Then) {
        self.kept = None;
        self.reached = None;
        self.envelope.release();
        let sequence = PowerSequence::new(now, goal, self.settings.timeouts.transition);
        let first = sequence.first();
        self.activity = Activity::Power(Power {
            sequence,
            then,
            since: now,
            before: None,
            braking: Braking::default(),
        });
        // Everything else waits for the next statusword: the last one may be out of date.
        if let Some(control) = first {
            self.send_control(now, self.with_halt(goal, control));
        }
    }

    /// HALT stays on the way down: a drive that is slow to stop must not go on meanwhile.
    fn with_halt(&self, goal: Goal, control: Controlword) -> Controlword {
        match goal {
            Goal::SwitchOnDisabled | Goal::QuickStop if !control.is_empty() => {
                control | self.control & Controlword::HALT
            }
            Goal::SwitchOnDisabled
            | Goal::QuickStop
            | Goal::OperationEnabled
            | Goal::FaultReset => control,
        }
    }

    pub(super) fn advance_power(&mut self, now: Time) {
        let standing = self.image.plausible.stands();
        let here = self.image.here();
        let (window, is_late) = (self.settings.tolerance_counts(), self.mode_is_late(now));
        let mode = self.mode().unwrap_or(OperationMode::None);
        let runs_by_itself = self.runs_by_itself_in(mode);
        let (Activity::Power(power), Some(sample)) = (&mut self.activity, self.image.sample())
        else {
            return;
        };
        let status = sample.status;
        let goal = power.sequence.goal();
        if status.state() != PowerState::OperationEnabled {
            power.before = here.map(|here| here.position);
        }
        let lets_go = goal == Goal::QuickStop
            && !standing
            && here.is_some_and(|here| power.braking.lets_go(here, window));
        let (since, then, timeout) = (power.since, power.then, power.poll_timeout());
        // Stopped is what the drive says after it has had the command, not what it said before.
        let fresh = sample.at.since(since) >= self.settings.common.sync_period * 2;
        let step = power.sequence.next(now, status, standing);
        let step = match self.settings.gravity {
            true => held_up(goal, status.state(), step, standing),
            false => step,
        };
        match step {
            PowerStep::Command(_) if lets_go && !self.settings.gravity => {
                if !self.control.is_empty() {
                    self.send_control(now, Controlword::empty());
                }
            }
            PowerStep::Command(Controlword::ENABLE_COMMAND) if is_late => {}
            PowerStep::Command(Controlword::ENABLE_COMMAND) if runs_by_itself => {
                self.refuse_mode(now, mode);
            }
            PowerStep::Command(control) => {
                let control = self.with_halt(goal, control);
                if control != self.control || self.repeat_at == Time::NEVER {
                    self.send_control(now, control);
                }
            }
            PowerStep::Done(_) if !fresh && stops(goal) => {
                if now >= timeout {
                    let seen = self.seen_status();
                    self.time_out(now, since, "a statusword after the command", seen);
                }
            }
            PowerStep::Done(control) => {
                if control != self.control {
                    self.send_control(now, control);
                }
                self.power_reached(now, goal, then);
            }
            PowerStep::Failed(failure) => self.power_failed(now, goal, since, failure),
        }
    }

    fn power_reached(&mut self, now: Time, goal: Goal, then: Then) {
        match (goal, then) {
            (Goal::OperationEnabled, _) => self.enabled(now),
            (Goal::QuickStop, Then::Tell) if self.has_let_go() => {
                let device = self.node.name();
                self.finish(Err(DeviceError::NoQuickStop { device }));
            }
            (_, Then::Enable) => self.begin_power(now, Goal::OperationEnabled, Then::Tell),
            (_, Then::BeSilent) => {
                self.activity = Activity::Idle;
                self.repeat_at = Time::NEVER;
            }
            (Goal::SwitchOnDisabled | Goal::QuickStop | Goal::FaultReset, Then::Tell) => {
                self.finish(Ok(()));
            }
        }
    }

    /// Whether the quick stop under way had no effect, so that the drive was switched off in motion.
    const fn has_let_go(&self) -> bool {
        match &self.activity {
            Activity::Power(power) => power.braking.lets_go,
            _ => false,
        }
    }

    /// Whether the mode display may still follow before the drive is enabled.
    fn mode_is_late(&self, now: Time) -> bool {
        let Activity::Power(power) = &self.activity else {
            return false;
        };
        let is_other = self.commanded_mode.is_some() && self.mode() != self.commanded_mode;
        is_other && now.since(power.since) < self.settings.timeouts.mode
    }

    /// The drive is enabled: from now on its axis is watched.
    fn enabled(&mut self, now: Time) {
        let before = match &self.activity {
            Activity::Power(power) => power.before,
            _ => None,
        };
        self.kept = Some(PowerState::OperationEnabled);
        self.open_target = false;
        self.other_mode = 0;
        match (self.commanded_mode, self.mode()) {
            (Some(expected), Some(seen)) if expected != seen => {
                let node = self.node.id();
                let (expected, seen) = (expected.raw(), seen.raw());
                self.finish(Err(DeviceError::WrongMode {
                    node,
                    expected,
                    seen,
                }));
                self.stop_by_itself(now);
            }
            (Some(OperationMode::CyclicSynchronousPosition), _) => {
                self.watch_set_points();
                self.finish(Ok(()));
            }
            _ => {
                self.envelope.take_hold(before);
                // A drive that sets off by itself shows so within some samples.
                self.settle(now);
            }
        }
    }

    /// Whether a drive that is enabled in `mode` may move at once, by what was left in it.
    fn runs_by_itself_in(&self, mode: OperationMode) -> bool {
        let needs_an_edge = matches!(
            mode,
            OperationMode::None | OperationMode::ProfilePosition | OperationMode::Homing
        );
        // Its target is where the axis stands.
        let is_cyclic = mode == OperationMode::CyclicSynchronousPosition;
        !(needs_an_edge || is_cyclic || self.commanded_mode == Some(mode))
    }

    fn refuse_mode(&mut self, now: Time, seen: OperationMode) {
        let expected = self.commanded_mode.map_or(0, OperationMode::raw);
        self.send_control(now, Controlword::empty());
        self.finish(Err(DeviceError::WrongMode {
            node: self.node.id(),
            expected,
            seen: seen.raw(),
        }));
    }

    fn power_failed(&mut self, now: Time, goal: Goal, since: Time, failure: PowerFailure) {
        let step = step_name(goal);
        match goal {
            // Bit 7 goes back, so that the next reset has an edge.
            Goal::FaultReset => self.send_control(now, Controlword::empty()),
            // A drive that is slow to be enabled must not become so later.
            Goal::OperationEnabled if self.control == Controlword::ENABLE_COMMAND => {
                self.send_control(now, Controlword::empty());
            }
            // What keeps it enabled is told now; that it is so is no news.
            Goal::SwitchOnDisabled | Goal::QuickStop => self.told_unasked = true,
            Goal::OperationEnabled => {}
        }
        match failure {
            PowerFailure::Faulted { state } | PowerFailure::Wanders { state } => {
                let node = self.node.id();
                self.finish(Err(DeviceError::DriveRefused { node, step, state }));
            }
            PowerFailure::TimedOut { awaited, .. } => {
                let seen = self.seen_status();
                self.time_out(now, since, awaited, seen);
            }
        }
    }

    pub(super) fn power_timeout(&mut self, now: Time) {
        let Activity::Power(power) = &self.activity else {
            return;
        };
        if now < power.poll_timeout() {
            return;
        }
        if self.image.sample().is_some() {
            self.advance_power(now);
        } else {
            let since = power.since;
            self.time_out(now, since, "a statusword", Seen::Nothing);
        }
    }
}
