//! An axis in the hands of the service: who has it, and what is known of it.

use core::time::Duration;
use std::sync::Arc;

use machine::Machine;
use truestage::runs::Moved;
use units::Time;
use wire::cia402::PowerState;

use super::mechanics::Mechanics;
use super::rest::RestWatch;
use crate::coordinate::Coordinate;
use crate::order::Reply;
use crate::quantity::Quantity;
use crate::request::RunKind;
use crate::snapshot::{AxisSample, CalibrationInUse};
use crate::view::{AxisState, Cause};

/// The age of a sample that still says where an axis is: amplifiers that share a serial line are asked in turn.
const KNOWN_FOR: Duration = Duration::from_secs(1);

/// What an axis is in use for.
#[derive(Debug)]
pub(super) enum Task {
    Free,
    /// The motion of this name.
    Motion(Arc<str>),
    /// The motion of this name, as one with others.
    Together(Arc<str>),
    /// The jog of this name.
    Jog(Arc<str>),
    /// The run of this name.
    Run(Arc<str>, RunKind),
    /// It is being switched on or off for somebody who waits.
    Power(Option<Reply>),
    /// It slows down.
    Stopping,
}

/// An axis.
pub(crate) struct Seat {
    pub(super) name: Arc<str>,
    /// How it is moved outside of runs.
    pub(super) moved: Moved,
    pub(super) mechanics: Mechanics,
    /// The longest that one move may take.
    pub(super) move_timeout: Duration,
    /// How long it must have been in position.
    pub(super) in_position: Duration,
    /// Whether it moves by its samples, whatever its drive says.
    pub(super) rest: RestWatch,
    pub(super) calibration: Option<Arc<CalibrationInUse>>,
    pub(super) task: Task,
    pub(super) standing_since: Option<Time>,
    pub(super) target: Option<Coordinate>,
    pub(super) set_point: Option<Coordinate>,
    pub(super) standard_uncertainty: Option<Coordinate>,
    /// Where a move that it made as one with others has left its point; it stands there still.
    pub(super) rests_at: Option<Coordinate>,
    pub(super) last_cause: Option<Arc<Cause>>,
    pub(super) state: AxisState,
}

impl Seat {
    /// Whether nobody has it.
    pub(super) const fn is_free(&self) -> bool {
        matches!(self.task, Task::Free)
    }

    /// Whether the motion or run `id` has it.
    pub(super) fn is_of(&self, id: &str) -> bool {
        match &self.task {
            Task::Motion(of) | Task::Together(of) | Task::Jog(of) | Task::Run(of, _) => **of == *id,
            Task::Free | Task::Power(_) | Task::Stopping => false,
        }
    }

    /// Who has it, for people.
    pub(super) fn user(&self) -> String {
        match &self.task {
            Task::Free => "nobody".into(),
            Task::Motion(id) | Task::Together(id) => format!("motion {id}"),
            Task::Jog(id) => format!("jog {id}"),
            Task::Run(id, _) => format!("run {id}"),
            Task::Power(_) => "a change of its power".into(),
            Task::Stopping => "a stop that has not ended".into(),
        }
    }

    /// Takes note of whether it stands.
    pub(super) fn watch_rest(&mut self, machine: &Machine) {
        let Some(sampled) = self.mechanics.sampled(machine, &self.name) else {
            return;
        };
        match self.is_free() {
            true => self.rest.note(sampled.at, sampled.position),
            // What it moves for says how it is judged.
            false => self.rest.forget(),
        }
        match (sampled.standing, self.standing_since) {
            (false, _) => {
                self.standing_since = None;
                self.standard_uncertainty = None;
                self.rests_at = None;
            }
            (true, None) => self.standing_since = Some(sampled.at),
            (true, Some(_)) => {}
        }
        // Nothing holds it there any more: whoever pushes it need not make its drive say so.
        if !self.is_enabled(machine) {
            self.rests_at = None;
        }
    }

    /// Whether it has been in position for its time.
    pub(super) fn is_in_position(&self, now: Time) -> bool {
        let since = self.standing_since;
        since.is_some_and(|since| now.since(since) >= self.in_position)
    }

    /// Whether it is in position, or is one that a loop has left where it does not move: a drive need not say of a
    /// target that it was sent period by period that it has been reached.
    pub(super) fn rests(&self, machine: &Machine) -> bool {
        let left_by_a_loop = self.moved == Moved::CorrectedTogether;
        self.is_in_position(machine.now())
            || left_by_a_loop && self.mechanics.is_at_rest(machine, &self.name)
    }

    /// What it does.
    pub(super) fn state_now(&self, machine: &Machine, is_faulted: bool) -> AxisState {
        let power = machine.power_state(&self.name).ok().flatten();
        match &self.task {
            _ if is_faulted => AxisState::ErrorStop,
            Task::Stopping => AxisState::Stopping,
            Task::Jog(_) => AxisState::ContinuousMotion,
            Task::Together(_) | Task::Run(_, RunKind::Path | RunKind::FirstPart) => {
                AxisState::SynchronizedMotion
            }
            Task::Run(_, RunKind::Zero) => AxisState::Homing,
            // Its run waits for a person with his hands in the machine.
            Task::Run(..) if power != Some(PowerState::OperationEnabled) => AxisState::Disabled,
            Task::Run(..) | Task::Motion(_) => AxisState::DiscreteMotion,
            Task::Free | Task::Power(_) => match power {
                Some(PowerState::OperationEnabled) if self.rest.moves() => {
                    AxisState::ContinuousMotion
                }
                Some(PowerState::OperationEnabled) => AxisState::Standstill,
                Some(PowerState::Fault | PowerState::FaultReactionActive) => AxisState::ErrorStop,
                _ => AxisState::Disabled,
            },
        }
    }

    /// Whether its drive is on.
    pub(super) fn is_enabled(&self, machine: &Machine) -> bool {
        let power = machine.power_state(&self.name).ok().flatten();
        power == Some(PowerState::OperationEnabled)
    }

    /// Where it is now, corrected where something corrects it, and by its encoder.
    pub(super) fn place_shown(&self, machine: &Machine) -> (Option<Quantity>, Option<Quantity>) {
        let sample = self.sample(machine);
        let place = sample.place.or(sample.encoder);
        let shown = |it: Option<Coordinate>| it.map(Coordinate::shown);
        (shown(place), shown(sample.encoder))
    }

    /// What is published of it.
    pub(super) fn sample(&self, machine: &Machine) -> AxisSample {
        let sampled = self.mechanics.sampled(machine, &self.name);
        // After a freeze of this computer, or of its drive, its place is not known.
        let known = sampled.filter(|sampled| machine.now().since(sampled.at) <= KNOWN_FOR);
        let encoder = known.map(|sampled| sampled.position);
        let homed = machine.is_zeroed(&self.name);
        let place = encoder.filter(|_| homed).and_then(|it| {
            self.mechanics
                .place(machine, &self.name, it)
                .or(self.rests_at)
        });
        AxisSample {
            state: self.state,
            encoder,
            place,
            standard_uncertainty: place.and(self.standard_uncertainty),
            target: self.target,
            set_point: self.set_point,
            homed,
            calibration: self.calibration.clone(),
            used_by: match &self.task {
                Task::Motion(id) | Task::Together(id) | Task::Jog(id) | Task::Run(id, _) => {
                    Some(Arc::clone(id))
                }
                Task::Free | Task::Power(_) | Task::Stopping => None,
            },
            last_cause: self.last_cause.clone(),
        }
    }
}
