//! Motions of axes that move as one: a procedure between two ticks, under the contract of every motion.

use core::time::Duration;
use std::collections::BTreeMap;
use std::sync::Arc;

use machine::Machine;
use truestage::Agreed;
use truestage::runs::{Group, GroupMove, GroupMoved, Moved, Place};
use units::{AxisSpeed, Time};

use super::super::seat::{Seat, Task};
use super::super::{Job, Keeper, Mode};
use super::accept::speed_of;
use super::going::other_unit;
use super::{End, Motion, Phase, SETTLING};
use crate::coordinate::Coordinate;
use crate::problem::{Code, Problem};
use crate::request::MoveRequest;
use crate::view::{Cause, LegView};

/// How far the procedure is.
#[derive(Clone, Debug)]
enum Progress {
    /// It has not begun.
    Waiting,
    UnderWay,
    /// It has ended.
    Over {
        /// What it came to, where it was made to its end.
        moved: Option<GroupMoved>,
        /// Until when its axes must be in position.
        deadline: Time,
    },
}

/// What the axes of a group do in a motion.
#[derive(Clone, Debug)]
pub(super) struct Together {
    /// The number of the group.
    group: usize,
    /// The numbers of its axes.
    axes: Vec<usize>,
    asked: GroupMove,
    progress: Progress,
}

impl Together {
    /// It is a jog, at `speed`.
    pub(super) fn run_on(&mut self, speed: AxisSpeed) {
        self.asked.jog = Some(speed);
    }

    pub(super) const fn group(&self) -> usize {
        self.group
    }

    pub(super) fn axes(&self) -> impl Iterator<Item = usize> + Clone {
        self.axes.iter().copied()
    }

    /// Whether its procedure has the machine.
    pub(super) const fn is_under_way(&self) -> bool {
        matches!(self.progress, Progress::UnderWay)
    }

    /// Whether its procedure has ended before the move was made.
    pub(super) const fn is_broken_off(&self) -> bool {
        matches!(self.progress, Progress::Over { moved: None, .. })
    }

    /// What it came to, where it was made to its end.
    pub(super) const fn moved(&self) -> Option<&GroupMoved> {
        match &self.progress {
            Progress::Over { moved, .. } => moved.as_ref(),
            Progress::Waiting | Progress::UnderWay => None,
        }
    }

    /// Until when its axes must be in position, once it was made to its end.
    const fn deadline(&self) -> Option<Time> {
        match self.progress {
            Progress::Over {
                moved: Some(_),
                deadline,
            } => Some(deadline),
            Progress::Over { moved: None, .. } | Progress::Waiting | Progress::UnderWay => None,
        }
    }

    /// The axis of this name, where that is a part of where the group is.
    pub(super) fn axis<'s>(&self, name: &str, seats: &'s [Seat]) -> Option<&'s Seat> {
        let mut axes = self.axes.iter().map(|at| &seats[*at]);
        axes.find(|seat| *seat.name == *name)
    }

    /// Each part that was named, or all of them when they are there.
    pub(super) fn legs(&self) -> BTreeMap<String, LegView> {
        let corrected = match self.asked.agreed.uncompensated {
            true => "no",
            false => "yes",
        };
        let blank = |target: Place| LegView {
            target: Coordinate::from(target).shown(),
            set_point: None,
            speed: None,
            corrected: corrected.to_owned(),
            position: None,
            encoder: None,
            standard_uncertainty: None,
            told: None,
        };
        let Some(moved) = self.moved() else {
            let targets = self.asked.targets.iter();
            return targets.map(|(it, to)| (it.clone(), blank(*to))).collect();
        };
        let parts = moved.parts.iter().map(|part| {
            let shown = |it: Place| Coordinate::from(it).shown();
            let leg = LegView {
                set_point: part.set_point.map(shown),
                position: part.position.map(shown),
                standard_uncertainty: part
                    .standard_uncertainty
                    .map(|it| Coordinate::from(it).small()),
                ..blank(part.target)
            };
            (part.name.clone(), leg)
        });
        parts.collect()
    }
}

impl Keeper {
    /// What `request` asks of the axes that move as one; `None` where each moves by itself.
    pub(super) fn together_of(&self, request: &MoveRequest) -> Result<Option<Together>, Problem> {
        let mut groups = request
            .targets
            .keys()
            .map(|it| self.moved_with(it, request));
        let Some(first) = groups.next().flatten() else {
            // Something of a group that comes later is refused by the axis that it is not.
            return match groups.flatten().next() {
                Some(at) => Err(self.mixed(at)),
                None => Ok(None),
            };
        };
        if groups.any(|it| it != Some(first)) {
            return Err(self.mixed(first));
        }
        let grouped = &self.groups[first];
        refuse_options(request, &grouped.group)?;
        let speed = speed_of(request)?;
        Ok(Some(Together {
            group: first,
            axes: grouped.axes.clone(),
            asked: GroupMove {
                targets: targets_of(request, &grouped.group)?,
                agreed: Agreed {
                    uncompensated: request.uncompensated,
                    beyond: false,
                },
                speed,
                align: request.align,
                jog: None,
            },
            progress: Progress::Waiting,
        }))
    }

    /// The number of the group that is moved as one when `name` is a target.
    fn moved_with(&self, name: &str, request: &MoveRequest) -> Option<usize> {
        let own = self.seats.iter().find(|it| *it.name == *name);
        let is_alone = own.is_some_and(|seat| match seat.moved {
            Moved::Alone => true,
            Moved::CorrectedTogether => request.uncompensated,
            Moved::Together => false,
        });
        let mut groups = self.groups.iter();
        let found = groups.position(|it| it.group.parts.iter().any(|it| it.name == name));
        found.filter(|_| !is_alone)
    }

    fn mixed(&self, at: usize) -> Problem {
        let group = &self.groups[at].group;
        let parts: Vec<_> = group.parts.iter().map(|it| it.name.as_str()).collect();
        let what = format!(
            "{} ({}) moves as one, and nothing else in the same motion",
            group.name,
            parts.join(", ")
        );
        Problem::new(Code::NotOffered, what, "ask for two motions")
    }

    /// What can be told before anything moves.
    pub(super) fn judge_together(
        &self,
        machine: &Machine,
        together: &Together,
    ) -> Result<(), Problem> {
        for at in together.axes() {
            let name = &self.seats[at].name;
            let zeroed = machine.require_zeroed(name);
            zeroed.map_err(truestage::Failure::from)?;
        }
        self.groups[together.group].judge(machine, &together.asked)?;
        let off = together
            .axes()
            .find(|at| !self.seats[*at].is_enabled(machine));
        off.map_or(Ok(()), |at| {
            let what = format!(
                "axis {} is switched off; nothing was moved",
                self.seats[at].name
            );
            Err(Problem::new(Code::AxisDisabled, what, "enable it first"))
        })
    }

    /// The procedure begins as soon as this tick has ended.
    pub(super) fn begin_together(&mut self, motion: &mut Motion) {
        let Some(together) = &mut motion.together else {
            return;
        };
        motion.phase = Phase::Moving;
        together.progress = Progress::UnderWay;
        for at in together.axes() {
            let seat = &mut self.seats[at];
            seat.task = match motion.jog {
                None => Task::Together(Arc::clone(&motion.id)),
                Some(_) => Task::Jog(Arc::clone(&motion.id)),
            };
            seat.rests_at = None;
        }
        self.job = Some(Job::Move(Arc::clone(&motion.id)));
    }

    /// What is to be done for the motion `id`; `None` when it has ended meanwhile.
    pub(crate) fn begin_procedure_of(&mut self, id: &str) -> Option<(Arc<Group>, GroupMove)> {
        let motion = self.motions.active.iter().find(|it| *it.id == *id)?;
        let together = motion.together.as_ref()?;
        let group = Arc::clone(&self.groups[together.group].group);
        let asked = together.asked.clone();
        self.mode = Mode::Procedure;
        Some((group, asked))
    }

    /// The procedure of the motion `id` has ended.
    pub(crate) fn end_procedure_of(
        &mut self,
        machine: &Machine,
        id: &str,
        moved: Option<GroupMoved>,
    ) {
        self.mode = Mode::Idle;
        self.motions.published = None;
        let mut active = self.motions.active.iter_mut();
        let motion = active.find(|it| *it.id == *id);
        if let Some(together) = motion.and_then(|it| it.together.as_mut()) {
            let settling = settling(together, &self.seats);
            let deadline = machine.now() + machine.patience().of(settling);
            together.progress = Progress::Over { moved, deadline };
        }
    }

    /// It was not made to its end, because somebody stopped it: its axes stand soon.
    pub(crate) fn motion_interrupted(&mut self, machine: &mut Machine, id: &str) {
        self.halt_axes_of(machine, id);
    }

    /// It was refused, and the axes stand and are supervised.
    pub(crate) fn motion_refused(&mut self, machine: &mut Machine, id: &str, cause: Cause) {
        let mut active = self.motions.active.iter();
        if let Some(number) = active.position(|it| *it.id == *id) {
            self.stop_motion(machine, number, End::by(cause));
        }
    }

    /// How motion `number` ends, when its procedure has been made to its end and the axes stand.
    pub(super) fn advance_together(&mut self, machine: &mut Machine, number: usize) -> Option<End> {
        let together = self.motions.active[number].together.as_ref()?;
        let deadline = together.deadline()?;
        let now = machine.now();
        let stands = |at: usize| self.seats[at].is_in_position(now);
        if together.axes().all(stands) {
            return Some(End::Done);
        }
        if now < deadline {
            return None;
        }
        let late = together.axes().find(|at| !self.seats[*at].rests(machine));
        let Some(at) = late else {
            return Some(End::Done);
        };
        let end = End::TimedOut(self.overdue(at, "settle", settling(together, &self.seats)));
        self.stop_motion(machine, number, end);
        None
    }

    /// What is known of the axes at rest after a motion that was made to its end.
    pub(super) fn settle_together(&mut self, together: &Together) {
        for part in together.moved().into_iter().flat_map(|it| &it.parts) {
            let mut axes = together.axes();
            let Some(at) = axes.find(|at| *self.seats[*at].name == *part.name) else {
                continue;
            };
            let seat = &mut self.seats[at];
            seat.target = Some(part.target.into());
            seat.set_point = part.set_point.map(Coordinate::from);
            seat.rests_at = part.position.map(Coordinate::from);
            seat.standard_uncertainty = part.standard_uncertainty.map(Coordinate::from);
        }
    }
}

/// What its axes may need to be in position once the procedure has ended.
fn settling(together: &Together, seats: &[Seat]) -> Duration {
    let in_position = together.axes().map(|at| seats[at].in_position);
    SETTLING + in_position.max().unwrap_or_default()
}

/// What a procedure has no use for.
fn refuse_options(request: &MoveRequest, group: &Group) -> Result<(), Problem> {
    let given = [
        ("way", request.way.is_some()),
        ("approach", request.approach.is_some()),
        ("beyond", request.beyond),
    ];
    let Some((option, _)) = given.into_iter().find(|it| it.1) else {
        return Ok(());
    };
    let what = format!(
        "`{option}` is for axes that move by themselves, and {} moves as one",
        group.name
    );
    Err(Problem::new(Code::NotOffered, what, "leave it out"))
}

fn targets_of(request: &MoveRequest, group: &Group) -> Result<Vec<(String, Place)>, Problem> {
    let named = group.parts.iter().filter_map(|part| {
        let target = request.targets.get(&part.name)?;
        Some((part, *target))
    });
    let targets = named.map(|(part, target)| match (target, part.turns) {
        (Coordinate::Length(it), false) => Ok((part.name.clone(), Place::Length(it))),
        (Coordinate::Angle(it), true) => Ok((part.name.clone(), Place::Angle(it))),
        (Coordinate::Length(_), true) => Err(other_unit(&part.name, true)),
        (Coordinate::Angle(_), false) => Err(other_unit(&part.name, false)),
    });
    targets.collect()
}

/// Each part as it ended; `standing` is where the encoders have those that are not axes.
pub(super) fn ended(
    together: &Together,
    seats: &[Seat],
    machine: &Machine,
    standing: &[(String, Place)],
) -> BTreeMap<String, LegView> {
    let mut legs = together.legs();
    for (name, place) in standing {
        if let Some(leg) = legs.get_mut(name) {
            leg.encoder = Some(Coordinate::from(*place).shown());
        }
    }
    for (name, leg) in &mut legs {
        if let Some(seat) = together.axis(name, seats) {
            let (position, encoder) = seat.place_shown(machine);
            leg.position = leg.position.take().or(position);
            leg.encoder = encoder;
        }
    }
    legs
}
