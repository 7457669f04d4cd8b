//! Motions: state machines that every tick carries on. Their end is a level.

mod accept;
mod going;
mod jog;
mod shown;
mod speed;
mod together;

use core::time::Duration;
use std::collections::VecDeque;
use std::sync::Arc;

use machine::{Failure, Machine};
use serde_json::json;
use truestage::linear::Corrected;
use units::Time;

use self::going::{Going, Wanted};
use self::jog::{HeldBack, Replaced};
use self::together::Together;
use super::Keeper;
use super::seat::{Seat, Task};
use super::stop::{cause_of, stopped_by};
use crate::coordinate::Coordinate;
use crate::problem::{Code, Problem};
use crate::request::{JogRequest, MoveRequest};
use crate::view::{Cause, MotionState, MotionView, Stopped};

/// So many that have ended are kept in the snapshot.
const ENDED_KEPT: usize = 256;
/// What an axis may need to come to rest once its drive has called the target reached.
const SETTLING: Duration = Duration::from_secs(2);

/// How a motion ends.
#[derive(Clone, Debug)]
pub(super) enum End {
    Done,
    Stopped(Stopped),
    Failed(Cause),
    TimedOut(Cause),
}

impl End {
    /// Of what `cause` ended.
    fn by(cause: Cause) -> Self {
        match cause.is_overdue() {
            true => Self::TimedOut(cause),
            false => Self::Failed(cause),
        }
    }
}

/// How far a motion is.
#[derive(Clone, Debug)]
enum Phase {
    Queued,
    Moving,
    /// It ends so when its axes stand.
    Stopping(End),
}

/// How far one axis of a motion is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum LegPhase {
    Waiting,
    /// On the way to where its last approach begins.
    OnTheWay,
    Moving,
    /// Its drive has called the target reached.
    Settling,
    There,
}

/// What one axis does in a motion.
#[derive(Clone, Debug)]
struct Leg {
    at: usize,
    /// Where it was asked to go.
    target: Coordinate,
    going: Option<Going>,
    /// How long it may take, and until when.
    limit: Duration,
    deadline: Time,
    phase: LegPhase,
}

impl Leg {
    fn corrected(&self) -> Corrected {
        self.going.map_or(Corrected::No, |it| it.corrected())
    }

    /// Whether it has made all of its move.
    fn has_arrived(&self) -> bool {
        self.phase == LegPhase::There
    }
}

/// A motion.
#[derive(Clone, Debug)]
pub(super) struct Motion {
    id: Arc<str>,
    by: String,
    accepted: String,
    wanted: Wanted,
    dead_man: Option<(Duration, Time)>,
    /// Whose jog it is, and how fast; a jog has no target and no time in which it has to be anywhere.
    jog: Option<JogRequest>,
    /// Whoever jogs has let go of it.
    is_released: bool,
    legs: Vec<Leg>,
    /// Its axes move as one: then it has no legs.
    together: Option<Together>,
    phase: Phase,
}

impl Motion {
    fn axes(&self) -> impl Iterator<Item = usize> + Clone {
        let as_one = self.together.iter().flat_map(Together::axes);
        self.legs.iter().map(|leg| leg.at).chain(as_one)
    }

    /// Whether a procedure of it has the machine.
    fn has_procedure(&self) -> bool {
        let together = self.together.as_ref();
        together.is_some_and(Together::is_under_way)
    }

    /// Whether its procedure has ended before it was made.
    fn is_broken_off(&self) -> bool {
        let together = self.together.as_ref();
        together.is_some_and(Together::is_broken_off)
    }
}

/// All motions.
#[derive(Debug, Default)]
pub(super) struct Motions {
    /// In the order in which they were accepted.
    active: Vec<Motion>,
    ended: VecDeque<Arc<MotionView>>,
    /// The device that the fault is about which ends them all.
    about: Option<String>,
    /// Such a fault stops their axes now.
    is_faulted: bool,
    /// Who has not let go of a jog that was ended.
    held_back: Vec<HeldBack>,
    /// Jogs that gave way to others of their callers.
    replaced: Vec<Replaced>,
    published: Option<Arc<Vec<Arc<MotionView>>>>,
}

impl Motions {
    /// A fault ends them all once their axes stand; it is about `device`.
    pub(super) fn begin_fault(&mut self, device: Option<&str>) {
        self.about = device.map(str::to_owned);
        self.is_faulted = true;
        self.published = None;
    }

    /// Whether the procedure that runs is one of theirs, and has to end.
    pub(super) fn is_to_end(&self) -> bool {
        let mut active = self.active.iter();
        active.any(|it| matches!(it.phase, Phase::Stopping(_)) && it.has_procedure())
    }

    /// Whether none is under way or waits.
    pub(super) fn is_empty(&self) -> bool {
        self.active.is_empty()
    }

    /// The list for a snapshot, the same one until something changes: those that ended, then the others.
    pub(super) fn list(&mut self, seats: &[Seat]) -> Arc<Vec<Arc<MotionView>>> {
        let (active, ended) = (&self.active, &self.ended);
        let list = self.published.get_or_insert_with(|| {
            let shown = active.iter().map(|motion| {
                let mut view = shown::view(motion, seats);
                if self.is_faulted && view.state == MotionState::Moving {
                    view.state = MotionState::Stopping;
                }
                Arc::new(view)
            });
            Arc::new(ended.iter().cloned().chain(shown).collect())
        });
        Arc::clone(list)
    }
}

impl Keeper {
    /// Carries every motion on.
    pub(super) fn advance_motions(&mut self, machine: &mut Machine) -> Result<(), Failure> {
        self.watch_dead_men(machine);
        for number in 0..self.motions.active.len() {
            self.begin_queued(machine, number)?;
        }
        let mut number = 0;
        while number < self.motions.active.len() {
            match self.advance_motion(machine, number)? {
                None => number += 1,
                Some(end) => self.finish_motion(machine, number, end),
            }
        }
        Ok(())
    }

    /// Begins motion `number` when it waits and its axes are free and nobody before it waits for them.
    fn begin_queued(&mut self, machine: &mut Machine, number: usize) -> Result<(), Failure> {
        let motion = &self.motions.active[number];
        let mut earlier = self.motions.active[..number].iter();
        let is_next = !earlier.any(|it| it.axes().any(|at| motion.axes().any(|own| own == at)));
        let are_free = motion.axes().all(|at| self.seats[at].is_free());
        let can_begin = are_free && (motion.together.is_none() || self.require_no_run().is_ok());
        if !matches!(motion.phase, Phase::Queued) || !is_next || !can_begin {
            return Ok(());
        }
        let mut motion = motion.clone();
        self.motions.published = None;
        match self.plan_legs(machine, &mut motion) {
            Ok(()) => self.begin_legs(machine, &mut motion)?,
            Err(problem) => {
                motion.phase = Phase::Stopping(End::Failed(Cause {
                    code: problem.code,
                    exit_code: problem.exit_code,
                    cause: problem.detail(),
                }));
            }
        }
        self.motions.active[number] = motion;
        Ok(())
    }

    fn begin_legs(&mut self, machine: &mut Machine, motion: &mut Motion) -> Result<(), Failure> {
        motion.phase = Phase::Moving;
        self.begin_together(motion);
        for leg in &mut motion.legs {
            let Some(going) = leg.going else { continue };
            let seat = &mut self.seats[leg.at];
            let by_way_of = going.by_way_of();
            let moves = 1 + u32::from(by_way_of.is_some());
            // What a slow or long way takes is no sign that anything is wrong.
            let lasts = going.lasts(machine, seat).unwrap_or_default();
            let limit = lasts + seat.move_timeout * moves + SETTLING;
            let limit = machine.patience().of(limit) + seat.in_position;
            leg.limit = limit;
            let id = Arc::clone(&motion.id);
            (leg.deadline, seat.task) = match motion.jog {
                None => (machine.now() + limit, Task::Motion(id)),
                Some(_) => (Time::NEVER, Task::Jog(id)),
            };
            seat.target = Some(going.target(leg.target));
            seat.rests_at = None;
            let (phase, first) = match by_way_of {
                Some(from) => (LegPhase::OnTheWay, from),
                None => (LegPhase::Moving, going.set_point()),
            };
            leg.phase = phase;
            seat.set_point = Some(first);
            going.begin(machine, &seat.name, first)?;
        }
        Ok(())
    }

    /// Carries on a leg whose drive has called its target reached.
    fn arrive(machine: &mut Machine, leg: &mut Leg, seat: &mut Seat) -> Result<(), Failure> {
        match leg.going {
            Some(going) if leg.phase == LegPhase::OnTheWay => {
                leg.phase = LegPhase::Moving;
                seat.set_point = Some(going.set_point());
                going.begin(machine, &seat.name, going.set_point())
            }
            _ => {
                leg.phase = LegPhase::Settling;
                Ok(())
            }
        }
    }

    /// How motion `number` ends, when it does.
    fn advance_motion(
        &mut self,
        machine: &mut Machine,
        number: usize,
    ) -> Result<Option<End>, Failure> {
        let motion = &self.motions.active[number];
        match &motion.phase {
            Phase::Queued => Ok(None),
            Phase::Stopping(end) => {
                let is_over = !self.is_stopping(motion.axes()) && !motion.has_procedure();
                Ok(is_over.then(|| end.clone()))
            }
            Phase::Moving => match &motion.together {
                Some(_) => Ok(self.advance_together(machine, number)),
                None => self.advance_legs(machine, number),
            },
        }
    }

    fn advance_legs(
        &mut self,
        machine: &mut Machine,
        number: usize,
    ) -> Result<Option<End>, Failure> {
        let now = machine.now();
        for leg in &mut self.motions.active[number].legs {
            let seat = &mut self.seats[leg.at];
            if matches!(leg.phase, LegPhase::OnTheWay | LegPhase::Moving)
                && Going::has_arrived(machine, &seat.name, seat.set_point)?
            {
                Self::arrive(machine, leg, seat)?;
            }
            if leg.phase == LegPhase::Settling && seat.is_in_position(now) {
                leg.phase = LegPhase::There;
            }
        }
        let legs = &self.motions.active[number].legs;
        if legs.iter().all(|it| it.phase == LegPhase::There) {
            return Ok(Some(End::Done));
        }
        let mut late = legs.iter();
        let late = late.find(|it| it.phase != LegPhase::There && now >= it.deadline);
        if let Some(leg) = late {
            let (at, waited) = (leg.at, leg.limit);
            let end = End::TimedOut(self.overdue(at, "move", waited));
            self.stop_motion(machine, number, end);
        }
        Ok(None)
    }

    fn overdue(&self, at: usize, step: &'static str, waited: Duration) -> Cause {
        cause_of(&truestage::Failure::from(Failure::Overdue {
            device: self.name(at).to_string(),
            step,
            waited,
        }))
    }

    /// Motion `number` ends as `end` when its axes stand.
    fn stop_motion(&mut self, machine: &mut Machine, number: usize, end: End) {
        let motion = &mut self.motions.active[number];
        if let Phase::Stopping(_) = motion.phase {
            return;
        }
        motion.phase = Phase::Stopping(end);
        let id = Arc::clone(&motion.id);
        self.motions.published = None;
        self.halt_axes_of(machine, &id);
    }

    /// Every motion is stopped.
    pub(super) fn stop_motions(&mut self, machine: &mut Machine, stopped: &Stopped) {
        for number in 0..self.motions.active.len() {
            self.stop_motion(machine, number, End::Stopped(stopped.clone()));
        }
    }

    /// Every motion is to end as stopped, without a word to its axes.
    pub(super) fn end_motions_as(&mut self, stopped: &Stopped) {
        for motion in &mut self.motions.active {
            if !matches!(motion.phase, Phase::Stopping(_)) {
                motion.phase = Phase::Stopping(End::Stopped(stopped.clone()));
            }
        }
        self.motions.published = None;
    }

    /// Every motion ends as it was to end.
    pub(super) fn finish_motions(&mut self, machine: &Machine) {
        while let Some(motion) = self.motions.active.first() {
            let Phase::Stopping(end) = motion.phase.clone() else {
                return;
            };
            self.finish_motion(machine, 0, end);
        }
    }

    /// The dead-man of motion `id` still holds.
    pub(super) fn renew(&mut self, now: Time, id: &str) -> Result<(), Problem> {
        let mut active = self.motions.active.iter_mut();
        let motion = active.find(|it| *it.id == *id).ok_or_else(|| {
            let what = format!("there is no motion {id} under way");
            Problem::new(Code::NoSuchMotion, what, "ask how it ended")
        })?;
        if let Some((span, until)) = &mut motion.dead_man {
            *until = now + *span;
        }
        Ok(())
    }

    fn watch_dead_men(&mut self, machine: &mut Machine) {
        let now = machine.now();
        for number in 0..self.motions.active.len() {
            let motion = &self.motions.active[number];
            if motion.dead_man.is_some_and(|(_, until)| now >= until) {
                let by = format!("the dead-man of {}", motion.by);
                let stopped = stopped_by(by);
                self.stop_motion(machine, number, End::Stopped(stopped));
            }
        }
    }

    /// Every motion fails. What was overdue is the one that a procedure made, or the one of the axis that was too slow:
    /// others were in time.
    pub(super) fn fail_motions(&mut self, machine: &Machine, cause: &Cause) {
        while let Some(motion) = self.motions.active.first() {
            let slow = self.motions.about.as_deref();
            let is_slow = matches!(motion.phase, Phase::Moving)
                && motion.axes().any(|at| Some(&*self.seats[at].name) == slow);
            let end = match motion.is_broken_off() || is_slow {
                true => End::by(cause.clone()),
                false => End::Failed(cause.clone()),
            };
            self.finish_motion(machine, 0, end);
        }
        self.motions.is_faulted = false;
    }

    /// The final positions are published, and then the end.
    fn finish_motion(&mut self, machine: &Machine, number: usize, end: End) {
        let motion = self.motions.active.remove(number);
        for leg in &motion.legs {
            self.settle(machine, leg);
        }
        if let Some(together) = &motion.together {
            self.settle_together(together);
        }
        let view = Arc::new(shown::ended(
            &motion,
            (&self.seats, &self.groups),
            machine,
            self.teller.as_ref(),
            end,
        ));
        for (axis, leg) in &view.axes {
            let data = json!({"position": leg.position, "encoder": leg.encoder,
                              "standard_uncertainty": leg.standard_uncertainty, "motion": view.id});
            self.events.push("position", axis, data);
        }
        // It is still under way in this snapshot, which has the positions.
        self.motions.active.insert(number, motion);
        self.motions.published = None;
        self.publish(machine);
        let motion = self.motions.active.remove(number);
        if view.state == MotionState::Stopped {
            self.hold_back(machine.now(), &motion);
        }
        let cause = view.cause.clone().map(Arc::new);
        for at in motion.axes() {
            let seat = &mut self.seats[at];
            if seat.is_of(&motion.id) {
                seat.task = Task::Free;
            }
            if cause.is_some() {
                seat.last_cause.clone_from(&cause);
            }
        }
        self.keep_end(view);
    }

    /// The motion `id`, which arrived before a stop, ends as stopped and begins nothing.
    pub(super) fn void_motion(
        &mut self,
        machine: &Machine,
        (id, by): (&str, &str),
        request: &MoveRequest,
        stopped: Stopped,
    ) -> Result<(), Problem> {
        let motion = self.motion_of(machine.now(), id, by, request)?;
        let parts = (self.seats.as_slice(), self.groups.as_slice());
        let end = End::Stopped(stopped);
        let view = shown::ended(&motion, parts, machine, self.teller.as_ref(), end);
        self.keep_end(Arc::new(view));
        Ok(())
    }

    /// Shows an end, and tells it.
    fn keep_end(&mut self, view: Arc<MotionView>) {
        self.events.push("motion", &view.id, json!(&*view));
        self.motions.ended.push_back(view);
        if self.motions.ended.len() > ENDED_KEPT {
            self.motions.ended.pop_front();
        }
        self.motions.published = None;
    }

    /// What is known of an axis at rest after a motion.
    fn settle(&mut self, machine: &Machine, leg: &Leg) {
        let seat = &mut self.seats[leg.at];
        let has_arrived = leg.has_arrived();
        let mechanics = &seat.mechanics;
        seat.standard_uncertainty =
            mechanics.standard_uncertainty(machine, &seat.name, has_arrived);
    }
}
