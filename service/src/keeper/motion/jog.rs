//! Jogs: an axis runs as long as somebody says so, again and again.

use core::time::Duration;

use machine::Machine;
use truestage::Failure;
use units::{Approach, AxisSpeed, Radians};

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
        let at = self.place(&request.axis)?;
        let speed = request.speed.0;
        let going = self.jog_of(at);
        if let Some(number) = going
            && self.motions.active[number].jog == Some(speed)
        {
            let renewed = self.motions.active[number].id.to_string();
            return self.renew(machine.now(), &renewed).map(|()| renewed);
        }
        if speed.value() == 0.0 {
            return self.end_jog(machine, going, by, &request.axis);
        }
        self.require_no_hands()?;
        let motion = self.jog_motion(machine, id, by, request, at)?;
        match going {
            // The other way, or at another speed: from rest.
            Some(number) => self.stop_jog(machine, number, by),
            None => {
                self.require_free(at)?;
                self.require_unclaimed(&motion)?;
            }
        }
        self.queue(motion);
        Ok(id.to_owned())
    }

    /// The jog of axis `at` that goes on, or is about to begin.
    fn jog_of(&self, at: usize) -> Option<usize> {
        let mut active = self.motions.active.iter();
        active.position(|it| {
            let goes_on = !matches!(it.phase, Phase::Stopping(_));
            it.jog.is_some() && goes_on && it.axes().any(|of| of == at)
        })
    }

    /// As far as the axis goes on that side, by the encoder.
    fn jog_motion(
        &self,
        machine: &Machine,
        id: &str,
        by: &str,
        request: &JogRequest,
        at: usize,
    ) -> Result<Motion, Problem> {
        let speed = request.speed.0;
        let (target, way) = end_of(machine, &self.seats[at], speed)?;
        let request = MoveRequest {
            speed: Some(speed.abs().into()),
            way,
            uncompensated: true,
            ..MoveRequest::of(&request.axis, target)
        };
        let now = machine.now();
        let mut motion = self.motion_of(now, id, by, &request)?;
        motion.jog = Some(speed);
        motion.dead_man = Some((DEAD_MAN, now + DEAD_MAN));
        self.plan_legs(machine, &mut motion)?;
        Ok(motion)
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
        self.stop_motion(machine, number, End::Stopped(stopped));
    }
}

/// Where a jog at `wanted` ends when nothing ends it before: at the soft limit, or where the drive of an axis that turns
/// counts no further.
fn end_of(
    machine: &Machine,
    seat: &Seat,
    wanted: AxisSpeed,
) -> Result<(Coordinate, Option<WayName>), Problem> {
    match &seat.mechanics {
        Mechanics::Linear(own) => {
            speed::along(&seat.name, wanted)?;
            let limit = match wanted.approach() {
                Approach::Forward => own.settings.soft_max,
                Approach::Reverse => own.settings.soft_min,
            };
            Ok((limit.into(), None))
        }
        Mechanics::Turning(_) => {
            speed::round(&seat.name, wanted)?;
            let last = last_angle(machine, &seat.name, wanted.approach());
            Ok((last.map_err(Failure::from)?.into(), Some(WayName::Turns)))
        }
    }
}

fn last_angle(machine: &Machine, axis: &str, way: Approach) -> Result<Radians, machine::Failure> {
    machine.require_zeroed(axis)?;
    let last = machine.devices().rotary_last_position(axis, way)?;
    Ok(last.expect("an axis that was zeroed has been read"))
}
