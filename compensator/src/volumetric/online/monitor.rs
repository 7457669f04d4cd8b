//! One axis watched: its detectors, reference, memories and feeds put together.
//!
//! Each part can be used alone; this is the order in which they belong together: detector at the
//! end of travel, detector of the slider, reference, the slide's tilts, memories, and the feed that
//! lets nothing jump.

use units::{Metres, Time};

use super::reference::difference;
use super::{BeamReference, Displacement, Eye, Feed, FeedStatus, Memories, Shown, Trouble};
use crate::volumetric::Axis;

/// The sideways displacement of one slider, watched by its beam.
#[derive(Clone, Debug)]
pub struct AxisMonitor {
    axis: Axis,
    slider: Eye,
    end: Option<EndOfTravel>,
    reference: BeamReference,
    feed: Feed<Metres, 2>,
    displacement: Option<Displacement>,
}

/// The detector that watches the beam itself, with a feed of its own: a beam that cannot be
/// watched is taken to stay, to fade back or to stop the machine, as that feed is set.
#[derive(Clone, Debug)]
pub struct EndOfTravel {
    /// The detector.
    pub detector: Eye,
    /// How its shift is kept from jumping.
    pub feed: Feed<Metres, 2>,
}

impl AxisMonitor {
    /// Watches `axis` by the detector of its slider and, where there is one, that at the end of
    /// travel; `feed` keeps what is given out from jumping.
    pub fn new(
        axis: Axis,
        slider: Eye,
        end: Option<EndOfTravel>,
        reference: BeamReference,
        feed: Feed<Metres, 2>,
    ) -> Self {
        Self {
            axis,
            slider,
            end,
            reference,
            feed,
            displacement: None,
        }
    }

    /// Takes what both detectors showed last at `now`, with the axis at `position` when the slider's did, and
    /// gives out its displacement less what `memories` keep: what is to be compensated. `lever` is
    /// what the detector sees of its slide's tilts ([`DetectorLever`](super::DetectorLever)), which
    /// is no displacement.
    pub fn advance(
        &mut self,
        now: Time,
        position: Metres,
        (slider, end): (Option<&Shown>, Option<&Shown>),
        lever: Displacement,
        memories: &Memories,
    ) -> Displacement {
        let shift = self.end.as_mut().map(|own| {
            let seen = own.detector.read(now, end);
            let shift = seen.map(|it| self.reference.beam_shift(it));
            passed_on(&mut own.feed, now, shift, own.detector.repeats())
        });
        let shift = shift.unwrap_or([Metres::ZERO; 2]);
        let seen = self.slider.read(now, slider);
        let seen = seen.map(|it| self.reference.displacement(position, it, shift));
        let seen = seen.map(|it| difference(it, lever));
        self.displacement = seen.ok();
        let error = seen.map(|it| memories.error(self.axis, position, it));
        passed_on(&mut self.feed, now, error, self.slider.repeats())
    }

    /// Announces that what is given out will jump although nothing moved: memories changed.
    pub fn expect_jump(&mut self) {
        self.feed.expect_jump();
    }

    /// Exchanges the reference; what is given out is blended to it.
    pub fn set_reference(&mut self, reference: BeamReference) {
        self.reference = reference;
        self.feed.expect_jump();
        if let Some(end) = &mut self.end {
            end.feed.expect_jump();
        }
    }

    /// Goes on with what `before`, which watched the same axis, has seen; another reference or other
    /// memories are blended to.
    pub fn take_over(&mut self, before: &Self) {
        self.feed.take_over(&before.feed);
        if let (Some(own), Some(before)) = (&mut self.end, &before.end) {
            own.feed.take_over(&before.feed);
        }
    }

    /// The displacement by the last samples, memories and smoothing not counted; `None` when the
    /// slider's detector had no good one.
    pub fn displacement(&self) -> Option<Displacement> {
        self.displacement
    }

    /// The same less what was given out last, to be compensated: what the machine is left with.
    /// That is what a recorder takes.
    pub fn uncompensated(&self) -> Option<Displacement> {
        let seen = self.displacement?;
        Some(difference(seen, self.feed.values()))
    }

    /// What stands behind the values given out last: of the slider's detector, and of that at the
    /// end of travel.
    pub fn status(&self) -> (FeedStatus, Option<FeedStatus>) {
        (
            self.feed.status(),
            self.end.as_ref().map(|it| it.feed.status()),
        )
    }

    /// How far the values given out last still are from what is wanted, the shift of the beam
    /// included, which counts in full.
    pub fn left(&self) -> Metres {
        let end = self.end.as_ref().map(|it| it.feed.left());
        self.feed.left() + end.unwrap_or(Metres::ZERO)
    }

    /// The feed, to switch it on or off.
    pub fn feed_mut(&mut self) -> &mut Feed<Metres, 2> {
        &mut self.feed
    }
}

/// What `feed` makes of a value, which `repeats` the one before it where nothing new has been seen.
fn passed_on(
    feed: &mut Feed<Metres, 2>,
    now: Time,
    value: Result<Displacement, Trouble>,
    repeats: bool,
) -> Displacement {
    match value {
        Ok(_) if repeats => feed.repeat(now),
        value => feed.advance(now, value),
    }
}
