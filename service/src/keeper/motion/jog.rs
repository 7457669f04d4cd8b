//! Jogs: an axis runs as long as somebody says so, again and again.

use core::time::Duration;

use machine::Machine;
use units::MetresPerSecond;

use super::super::Keeper;
use super::super::stop::stopped_by;
use super::accept::not_jogged;
use super::{End, Motion, Phase};
use crate::problem::{Code, Problem};
use crate::quantity::Speed;
use crate::request::{JogRequest, MoveRequest};

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

    /// As far as the soft limit on that side, by the encoder.
    fn jog_motion(
        &self,
        machine: &Machine,
        id: &str,
        by: &str,
        request: &JogRequest,
        at: usize,
    ) -> Result<Motion, Problem> {
        let (settings, _) = self.seats[at]
            .linear()
            .ok_or_else(|| not_jogged(&self.seats[at]))?;
        let speed = request.speed.0;
        let target = match speed.value() > 0.0 {
            true => settings.soft_max,
            false => settings.soft_min,
        };
        let request = MoveRequest {
            speed: Some(Speed(MetresPerSecond(speed.value().abs()))),
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
