//! Jogs: an axis runs as long as somebody says so, again and again.

use core::time::Duration;

use machine::Machine;
use truestage::Failure;
use truestage::runs::Moved;
use units::{Approach, AxisSpeed, Radians, Time};

use super::super::Keeper;
use super::super::mechanics::Mechanics;
use super::super::seat::Seat;
use super::super::stop::stopped_by;
use super::{End, Motion, Phase, speed};
use crate::coordinate::Coordinate;
use crate::problem::{Code, Problem};
use crate::request::{JogRequest, MoveRequest, WayName};

/// A jog that was not renewed for so long stops.
const DEAD_MAN: Duration = Duration::from_millis(200);

/// Whoever asks for no jog for so long has let go of the key: two renewals that did not come.
const LET_GO: Duration = Duration::from_millis(400);

/// What is jogged.
#[derive(Clone, Copy)]
enum Subject {
    /// The axis of this number.
    Axis(usize),
    /// A part of where the group of this number is, whose axes move as one.
    Part(usize),
}

impl Keeper {
    /// Begins the jog `id`, renews the one that goes on, or ends it; the name of the one that it is about.
    pub(in super::super) fn jog(
        &mut self,
        machine: &mut Machine,
        id: &str,
        by: &str,
        request: &JogRequest,
    ) -> Result<String, Problem> {
        self.require_running()?;
        let subject = self.subject(&request.axis)?;
        let going = self.jog_of(subject);
        if request.speed.0.value() == 0.0 {
            return self.end_jog(machine, going, by, &request.axis);
        }
        if let Some(number) = going {
            self.require_own(machine.now(), number, by)?;
            let running = &self.motions.active[number];
            if running.jog.as_ref() == Some(request) {
                let renewed = running.id.to_string();
                return self.renew(machine.now(), &renewed).map(|()| renewed);
            }
            self.require_one_hand(machine, number, by, request)?;
        }
        self.require_let_go(machine.now(), by, &request.axis)?;
        self.require_no_hands()?;
        let motion = self.jog_motion(machine, (id, by), request, subject)?;
        match going {
            // The other way, or at another speed: from rest.
            Some(number) => self.replace_jog(machine, number, by),
            None => self.require_free_for(&motion)?,
        }
        self.queue(motion);
        Ok(id.to_owned())
    }

    /// Refuses a jog beside that of another caller, who need not let go for whoever asks later.
    fn require_own(&self, now: Time, number: usize, by: &str) -> Result<(), Problem> {
        let running = &self.motions.active[number];
        // Only the holder of a lease gets here while there is one: others are refused before, and their jogs run out.
        if running.by == by || self.holder(now).is_some() {
            return Ok(());
        }
        let (axis, speed) = match &running.jog {
            Some(jog) => (jog.axis.as_str(), jog.speed.0),
            None => return Ok(()),
        };
        let what = format!(
            "axis {axis} is jogged by {} at {speed:.3} since {} (motion {})",
            running.by, running.accepted, running.id
        );
        let help = "wait until the key is let go of, or stop the machine; a lease keeps others from jogging";
        Err(Problem::new(Code::AxisBusy, what, help))
    }

    /// Ends the jog `number` where `request` renews the one before it: two hands under one name hold two keys.
    fn require_one_hand(
        &mut self,
        machine: &mut Machine,
        number: usize,
        by: &str,
        request: &JogRequest,
    ) -> Result<(), Problem> {
        let now = machine.now();
        self.motions.replaced.retain(|jog| now < jog.until);
        let mut replaced = self.motions.replaced.iter();
        if !replaced.any(|jog| jog.by == by && jog.request == *request) {
            return Ok(());
        }
        self.stop_motion(machine, number, End::Stopped(stopped_by(by)));
        let what = format!(
            "jogs of axis {} at different speeds are asked for under the name {by} at one time; it is stopped",
            request.axis
        );
        let help =
            "let one client jog it, or give each a name of its own (the header Truestage-Client)";
        Err(Problem::new(Code::AxisBusy, what, help))
    }

    /// Ends the jog `number` for the sake of another one by the same caller.
    fn replace_jog(&mut self, machine: &mut Machine, number: usize, by: &str) {
        if let Some(request) = self.motions.active[number].jog.clone() {
            self.motions.replaced.push(Replaced {
                request,
                by: by.to_owned(),
                until: machine.now() + LET_GO,
            });
        }
        self.stop_jog(machine, number, by);
    }

    /// What `name` is: axes that never move by themselves are jogged by the parts of where they are together.
    fn subject(&self, name: &str) -> Result<Subject, Problem> {
        let mut groups = self.groups.iter();
        let of = groups.position(|it| {
            let group = &it.group;
            group.moved == Moved::Together && group.parts.iter().any(|part| part.name == name)
        });
        match of {
            Some(group) => Ok(Subject::Part(group)),
            None => self.place(name).map(Subject::Axis),
        }
    }

    /// The jog of `subject` that goes on, or is about to begin.
    fn jog_of(&self, subject: Subject) -> Option<usize> {
        let is_of = |motion: &Motion| match subject {
            Subject::Axis(at) => motion.axes().any(|of| of == at),
            Subject::Part(group) => {
                let together = motion.together.as_ref();
                together.is_some_and(|it| it.group() == group)
            }
        };
        let mut active = self.motions.active.iter();
        active.position(|it| {
            let goes_on = !matches!(it.phase, Phase::Stopping(_));
            it.jog.is_some() && goes_on && is_of(it)
        })
    }

    /// As far as it goes on that side, by the encoders.
    fn jog_motion(
        &self,
        machine: &Machine,
        (id, by): (&str, &str),
        request: &JogRequest,
        subject: Subject,
    ) -> Result<Motion, Problem> {
        let wanted = request.speed.0;
        let asked = MoveRequest {
            uncompensated: true,
            ..match subject {
                Subject::Axis(at) => alone(machine, &self.seats[at], wanted)?,
                Subject::Part(group) => self.as_one(machine, group, request)?,
            }
        };
        let now = machine.now();
        let mut motion = self.motion_of(now, id, by, &asked)?;
        if let Some(together) = &mut motion.together {
            together.run_on(wanted);
        }
        motion.jog = Some(request.clone());
        motion.dead_man = Some((DEAD_MAN, now + DEAD_MAN));
        self.plan_legs(machine, &mut motion)?;
        Ok(motion)
    }

    /// The motion of a part of where the group of this number is, to the end of its reach.
    fn as_one(
        &self,
        machine: &Machine,
        group: usize,
        request: &JogRequest,
    ) -> Result<MoveRequest, Problem> {
        let (grouped, axis) = (&self.groups[group], &request.axis);
        let turns = grouped
            .group
            .parts
            .iter()
            .any(|it| it.turns && it.name == *axis);
        match turns {
            true => speed::round(axis, request.speed.0).map(drop),
            false => speed::along(axis, request.speed.0).map(drop),
        }?;
        for at in &grouped.axes {
            let zeroed = machine.require_zeroed(&self.seats[*at].name);
            zeroed.map_err(Failure::from)?;
        }
        let end = grouped.end_of_jog(machine, axis, request.speed.0)?;
        Ok(MoveRequest::of(axis, Coordinate::from(end)))
    }

    fn end_jog(
        &mut self,
        machine: &mut Machine,
        going: Option<usize>,
        by: &str,
        axis: &str,
    ) -> Result<String, Problem> {
        let number = going.ok_or_else(|| {
            let what = format!("axis {axis} is not jogged");
            Problem::new(
                Code::NoSuchMotion,
                what,
                "a speed other than 0 begins a jog",
            )
        })?;
        let id = self.motions.active[number].id.to_string();
        self.stop_jog(machine, number, by);
        Ok(id)
    }

    fn stop_jog(&mut self, machine: &mut Machine, number: usize, by: &str) {
        let stopped = stopped_by(by);
        self.motions.active[number].is_released = true;
        self.stop_motion(machine, number, End::Stopped(stopped));
    }

    /// A jog that ended although its key is still held does not begin again by itself: neither after a stop, whoever made it,
    /// nor after a dead-man that was renewed too late.
    pub(super) fn hold_back(&mut self, now: Time, motion: &Motion) {
        if let Some(jog) = motion.jog.as_ref().filter(|_| !motion.is_released) {
            self.motions.held_back.push(HeldBack {
                axis: jog.axis.clone(),
                by: motion.by.clone(),
                until: now + LET_GO,
            });
        }
    }

    /// # Errors
    /// As long as `by` asks for a jog of `axis` that was ended, again and again.
    fn require_let_go(&mut self, now: Time, by: &str, axis: &str) -> Result<(), Problem> {
        let held_back = &mut self.motions.held_back;
        held_back.retain(|it| now < it.until);
        let held = held_back.iter_mut();
        let Some(held) = held.rev().find(|it| it.axis == axis && it.by == by) else {
            return Ok(());
        };
        held.until = now + LET_GO;
        let what = format!("the jog of axis {axis} was ended while its key was held");
        let help = format!(
            "let go of it: ask for none for {} ms, and then anew",
            LET_GO.as_millis()
        );
        Err(Problem::new(Code::AxisBusy, what, help))
    }
}

/// Whose jog was ended while he held its key, and until when he has not let go of it.
#[derive(Debug)]
pub(super) struct HeldBack {
    axis: String,
    by: String,
    until: Time,
}

/// A jog that gave way to another one of its caller, and until when a renewal of it is of a key that is still held.
#[derive(Debug)]
pub(super) struct Replaced {
    request: JogRequest,
    by: String,
    until: Time,
}

/// The motion of an axis by itself, to its soft limit, or where the drive of one that turns counts no further.
fn alone(machine: &Machine, seat: &Seat, wanted: AxisSpeed) -> Result<MoveRequest, Problem> {
    let (target, way) = match &seat.mechanics {
        Mechanics::Linear(own) => {
            speed::along(&seat.name, wanted)?;
            let limit = match wanted.approach() {
                Approach::Forward => own.settings.soft_max,
                Approach::Reverse => own.settings.soft_min,
            };
            (Coordinate::from(limit), None)
        }
        Mechanics::Turning(_) => {
            speed::round(&seat.name, wanted)?;
            let last = last_angle(machine, &seat.name, wanted.approach());
            let last = last.map_err(Failure::from)?;
            (last.into(), Some(WayName::Turns))
        }
    };
    Ok(MoveRequest {
        speed: Some(wanted.abs().into()),
        way,
        ..MoveRequest::of(&seat.name, target)
    })
}

fn last_angle(machine: &Machine, axis: &str, way: Approach) -> Result<Radians, machine::Failure> {
    machine.require_zeroed(axis)?;
    let last = machine.devices().rotary_last_position(axis, way)?;
    Ok(last.expect("an axis that was zeroed has been read"))
}
