//! Which motions are accepted, and what they become.

use core::time::Duration;

use machine::Machine;
use serde_json::json;
use truestage::Agreed;
use truestage::rotary::Way;
use units::{Approach, AxisSpeed, Time};

use super::super::seat::Task;
use super::super::stop::stopped_by;
use super::super::{Keeper, utc_now};
use super::going::{Going, Wanted};
use super::{End, Leg, LegPhase, Motion, Phase};
use crate::problem::{Code, Problem};
use crate::request::{IfMoving, MoveRequest};

/// So many may wait or be under way.
const ACTIVE_MAX: usize = 64;
/// So often a dead-man may want to be renewed.
const DEAD_MAN_MS: core::ops::RangeInclusive<u32> = 50..=60_000;

impl Keeper {
    /// Takes the motion `id`, or refuses it; nothing has moved then.
    pub(in super::super) fn accept_motion(
        &mut self,
        machine: &mut Machine,
        id: &str,
        by: &str,
        request: &MoveRequest,
    ) -> Result<(), Problem> {
        self.require_running()?;
        self.require_no_hands()?;
        let mut motion = self.motion_of(machine.now(), id, by, request)?;
        self.plan_legs(machine, &mut motion)?;
        self.clear_the_way(machine, &motion, request.if_moving)?;
        self.queue(motion);
        Ok(())
    }

    /// It begins as soon as its axes are free.
    pub(super) fn queue(&mut self, motion: Motion) {
        let data = json!({"state": "queued", "by": motion.by});
        self.events.push("motion", &motion.id, data);
        self.motions.active.push(motion);
        self.motions.published = None;
    }

    pub(super) fn motion_of(
        &self,
        now: Time,
        id: &str,
        by: &str,
        request: &MoveRequest,
    ) -> Result<Motion, Problem> {
        if request.targets.is_empty() {
            let what = "a motion without targets";
            let help = "name an axis and its target: {\"targets\": {\"x\": \"12.5mm\"}}";
            return Err(Problem::new(Code::BadRequest, what, help));
        }
        if self.motions.active.len() >= ACTIVE_MAX {
            let what = format!("{ACTIVE_MAX} motions are under way or wait");
            return Err(Problem::new(Code::Busy, what, "wait for the end of one"));
        }
        let together = self.together_of(request)?;
        if request.align && together.is_none() {
            let what = "`align` is for what a camera sees: platforms";
            return Err(Problem::new(Code::NotOffered, what, "leave it out"));
        }
        let single = request.targets.iter().filter(|_| together.is_none());
        let legs = single.map(|(axis, target)| {
            Ok(Leg {
                at: self.place(axis)?,
                target: *target,
                going: None,
                limit: Duration::ZERO,
                deadline: Time::NEVER,
                phase: LegPhase::Waiting,
            })
        });
        let legs: Vec<_> = legs.collect::<Result<_, Problem>>()?;
        let dead_man = dead_man_of(request)?;
        Ok(Motion {
            id: id.into(),
            by: by.to_owned(),
            accepted: utc_now(),
            wanted: Wanted {
                agreed: Agreed {
                    uncompensated: request.uncompensated,
                    beyond: request.beyond,
                },
                speed: speed_of(request)?,
                way: request.way.map(Way::from),
                approach: request.approach.map(Approach::from),
            },
            dead_man: dead_man.map(|it| (it, now + it)),
            jog: None,
            is_released: false,
            legs,
            together,
            phase: Phase::Queued,
        })
    }

    /// What each axis is sent, and how fast; everything is judged before anything moves.
    pub(super) fn plan_legs(&self, machine: &Machine, motion: &mut Motion) -> Result<(), Problem> {
        if let Some(together) = &motion.together {
            return self.judge_together(machine, together);
        }
        let (wanted, is_jog) = (motion.wanted, motion.jog.is_some());
        let is_round = |leg: &Leg| matches!(leg.going, Some(Going::Round(_)));
        motion.legs.iter_mut().try_for_each(|leg| {
            let seat = &self.seats[leg.at];
            let going = Going::plan(machine, seat, leg.target, wanted)?;
            if !is_jog {
                going.require_an_end(machine, seat)?;
            }
            leg.going = Some(going);
            Ok::<_, Problem>(())
        })?;
        let rounds = motion.legs.iter().filter(|it| is_round(it)).count();
        let not_offered = |what| Err(Problem::new(Code::NotOffered, what, "leave it out"));
        if wanted.way.is_some() && rounds == 0 {
            return not_offered("`way` is for axes that turn, and this motion has none");
        }
        if wanted.approach.is_some() && rounds > 0 {
            let what = "`approach` is for axes that go along a way, and this motion turns one: `way` says from where it arrives";
            return not_offered(what);
        }
        Ok(())
    }

    /// Makes the axes of a new motion free, lets it wait, or refuses it.
    fn clear_the_way(
        &mut self,
        machine: &mut Machine,
        motion: &Motion,
        if_moving: IfMoving,
    ) -> Result<(), Problem> {
        match if_moving {
            IfMoving::Queue => Ok(()),
            IfMoving::Refuse => self.require_free_for(motion),
            IfMoving::Supersede => {
                for at in motion.axes() {
                    if let Task::Run(..) | Task::Power(_) = self.seats[at].task {
                        self.require_free(at)?;
                    }
                }
                if motion.together.is_some() && !self.supersedes_a_procedure(motion) {
                    self.require_no_run()?;
                }
                self.supersede(machine, motion);
                Ok(())
            }
        }
    }

    /// Refuses `motion` where something else has what it needs.
    pub(super) fn require_free_for(&self, motion: &Motion) -> Result<(), Problem> {
        motion.axes().try_for_each(|at| self.require_free(at))?;
        self.require_unclaimed(motion)?;
        match motion.together {
            Some(_) => self.require_no_run(),
            None => Ok(()),
        }
    }

    /// Whether the procedure that has the machine is that of a motion that the new one stops.
    fn supersedes_a_procedure(&self, motion: &Motion) -> bool {
        let mut active = self.motions.active.iter();
        active.any(|it| it.has_procedure() && shares_an_axis(it, motion))
    }

    /// Another motion may wait for an axis that is free.
    fn require_unclaimed(&self, motion: &Motion) -> Result<(), Problem> {
        let mut others = self.motions.active.iter();
        let other = others.find(|it| shares_an_axis(it, motion));
        other.map_or(Ok(()), |other| {
            Err(Problem::new(
                Code::AxisBusy,
                format!("motion {} waits for an axis of this one", other.id),
                "wait for its end or stop it; a motion can be asked for with if_moving queue or \
                 supersede",
            ))
        })
    }

    /// Stops the motions that have or want an axis of the new one.
    fn supersede(&mut self, machine: &mut Machine, motion: &Motion) {
        for number in 0..self.motions.active.len() {
            let other = &self.motions.active[number];
            if shares_an_axis(other, motion) {
                let by = format!("{} (superseded by {})", motion.by, motion.id);
                let stopped = stopped_by(by);
                self.stop_motion(machine, number, End::Stopped(stopped));
            }
        }
    }
}

fn shares_an_axis(other: &Motion, motion: &Motion) -> bool {
    let mut axes = other.axes();
    axes.any(|at| motion.axes().any(|own| own == at))
}

fn dead_man_of(request: &MoveRequest) -> Result<Option<Duration>, Problem> {
    match request.dead_man_ms {
        Some(it) if !DEAD_MAN_MS.contains(&it) => Err(Problem::new(
            Code::BadRequest,
            format!("dead_man_ms = {it} is no time for a dead-man"),
            format!("give {} to {}", DEAD_MAN_MS.start(), DEAD_MAN_MS.end()),
        )),
        other => Ok(other.map(|it| Duration::from_millis(it.into()))),
    }
}

pub(super) fn speed_of(request: &MoveRequest) -> Result<Option<AxisSpeed>, Problem> {
    match request.speed {
        // Written so that NaN is refused too.
        Some(speed) if speed.0.value() > 0.0 => Ok(Some(speed.0)),
        // One that is written as a positive number may still be none in metres or radians per second.
        Some(_) => Err(Problem::new(
            Code::NotOffered,
            "a speed that is not positive",
            "give a positive one, or leave it out for the usual speed",
        )),
        None => Ok(None),
    }
}
