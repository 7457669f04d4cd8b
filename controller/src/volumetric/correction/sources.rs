//! All that a correction is computed from: how it stands, how one correction goes on with what
//! another has seen, and what is seen without being corrected.

use core::any::Any;
use core::time::Duration;

use compensator::volumetric::online::{FeedStatus, StateRecorder};
use compensator::volumetric::{Axis, Point};
use units::Time;

use crate::volumetric::correction::VolumetricCorrection;
use crate::volumetric::thermometers::Thermometers;
use machine::engine::Source;

impl VolumetricCorrection {
    /// Watches displacements and rolls without compensating them from now on: the machine is made to be
    /// as it is this hour. Tables and temperatures go on. To be said before it is in use.
    #[must_use]
    pub fn leaving_the_state(mut self) -> Self {
        let now = Time::ZERO;
        for beam in self.beams.iter_mut().flatten() {
            beam.monitor.feed_mut().disable(now, Duration::ZERO);
        }
        for roll in self.rolls.iter_mut().flatten() {
            roll.monitor.leave(now);
        }
        self
    }

    /// Tells `recorder` what displacements and rolls the machine was left with in the last period at
    /// `actual`, beyond what the first memory keeps. Allocates nothing.
    pub(in crate::volumetric) fn record(&self, actual: Point, recorder: &mut StateRecorder) {
        for axis in Axis::ALL {
            let Some(beam) = &self.beams[axis.index()] else {
                continue;
            };
            if let Some(left) = beam.monitor.uncompensated() {
                let beyond = self.memories.beyond_first(axis, beam.position, left);
                recorder.record(axis, beam.position, beyond);
            }
        }
        for roll in self.rolls.iter().flatten() {
            let (axis, Some(left)) = (roll.axis, roll.monitor.uncompensated()) else {
                continue;
            };
            let position = actual.along(axis);
            let beyond = self.memories.roll_beyond_first(axis, position, left);
            recorder.record_roll(axis, position, beyond);
        }
    }

    /// What stands behind each value that is used.
    pub(super) fn statuses(&self) -> impl Iterator<Item = (Source, FeedStatus)> {
        let beams = Axis::ALL.into_iter().zip(&self.beams);
        let beams = beams.filter_map(|(axis, it)| Some((axis, it.as_ref()?)));
        let beams = beams.flat_map(|(axis, it)| {
            let (slider, end) = it.monitor.status();
            let end = end.map(|it| (Source::EndOfTravel(axis), it));
            core::iter::once((Source::Slide(axis), slider)).chain(end)
        });
        let roll = self.rolls.iter().flatten();
        let roll = roll.map(|it| (Source::Roll(it.axis), it.monitor.status()));
        let thermometers = self.thermometers.iter().flat_map(Thermometers::statuses);
        let thermometers = thermometers.enumerate();
        let thermometers = thermometers.map(|(at, it)| (Source::Thermometer(at), it));
        beams.chain(roll).chain(thermometers)
    }

    /// Every source that both know goes on where it was. References and memories may be others:
    /// what is wanted now is blended to from what was given out last.
    pub(super) fn go_on_from(&mut self, before: &dyn Any) {
        let Some(before) = before.downcast_ref::<Self>() else {
            return;
        };
        self.trail = before.trail.clone();
        for (own, before) in self.beams.iter_mut().zip(&before.beams) {
            if let (Some(own), Some(before)) = (own, before) {
                own.monitor.take_over(&before.monitor);
            }
        }
        for (own, before) in self.rolls.iter_mut().zip(&before.rolls) {
            if let (Some(own), Some(before)) = (own, before) {
                own.monitor.take_over(&before.monitor);
            }
        }
        if let (Some(own), Some(before)) = (&mut self.thermometers, &before.thermometers) {
            own.take_over(before);
        }
    }
}
