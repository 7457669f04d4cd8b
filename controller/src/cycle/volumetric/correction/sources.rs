//! All that a correction is computed from: how it stands, and how one correction goes on with what
//! another has seen.

use core::any::Any;

use compensator::volumetric::Axis;
use compensator::volumetric::online::FeedStatus;

use super::VolumetricCorrection;
use crate::engine::Source;

impl VolumetricCorrection {
    /// What stands behind each value that is used.
    pub(super) fn statuses(&self) -> impl Iterator<Item = (Source, FeedStatus)> {
        let beams = Axis::ALL.into_iter().zip(&self.beams);
        let beams = beams.filter_map(|(axis, it)| Some((axis, it.as_ref()?)));
        let beams = beams.flat_map(|(axis, it)| {
            let (slider, end) = it.monitor.status();
            let end = end.map(|it| (Source::EndOfTravel(axis), it));
            core::iter::once((Source::Slide(axis), slider)).chain(end)
        });
        let roll = self.roll.iter();
        let roll = roll.map(|it| (Source::Roll(it.axis), it.feed.status()));
        let thermometers = self.thermometers.iter().enumerate();
        let thermometers = thermometers.map(|(at, it)| (Source::Thermometer(at + 1), it.status()));
        beams.chain(roll).chain(thermometers)
    }

    /// Every source that both know goes on where it was. References and memories may be others:
    /// what is wanted now is blended to from what was given out last.
    pub(super) fn go_on_from(&mut self, before: &dyn Any) {
        let Some(before) = before.downcast_ref::<Self>() else {
            return;
        };
        for (own, before) in self.beams.iter_mut().zip(&before.beams) {
            if let (Some(own), Some(before)) = (own, before) {
                own.monitor.take_over(&before.monitor);
            }
        }
        if let (Some(own), Some(before)) = (&mut self.roll, &before.roll)
            && own.axis == before.axis
        {
            own.feed.take_over(&before.feed);
        }
        for own in &mut self.thermometers {
            let same = before.thermometers.iter().find(|it| it.is_of(own));
            if let Some(before) = same {
                own.take_over(before);
            }
        }
    }
}
