//! The newest process data of a drive, and whether they are plausible.

use core::time::Duration;
use units::{Counts, Time};
use wire::canopen::pdo::extract;
use wire::cia402::{OperationMode, PowerState, Statusword};

use super::modulo::Modulo;
use super::start::{MODE_DISPLAY, POSITION_ACTUAL, STATUSWORD};
use crate::device::envelope::Point;
use crate::device::plausible::{Judgement, Plausible};

/// Bytes of TPDO 1: statusword, position, mode.
pub(super) const SAMPLE_BYTES: usize = 7;

/// One sample, decoded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Sample {
    pub(super) at: Time,
    pub(super) status: Statusword,
    /// As the drive shows it; it may wrap.
    pub(super) shown: i32,
    /// The same, counting on.
    pub(super) position: Counts,
    pub(super) mode: OperationMode,
}

impl Sample {
    pub(super) fn parse(at: Time, payload: &[u8]) -> Option<Self> {
        let status_bits = STATUSWORD.bits;
        let position_at = usize::from(status_bits);
        let mode_at = position_at + usize::from(POSITION_ACTUAL.bits);
        let status = extract(payload, 0, status_bits)? as u16;
        let shown = extract(payload, position_at, POSITION_ACTUAL.bits)? as u32;
        let shown = shown.cast_signed();
        let mode = extract(payload, mode_at, MODE_DISPLAY.bits)? as u8;
        Some(Self {
            at,
            status: Statusword::from_bits_retain(status),
            shown,
            position: Counts(i64::from(shown)),
            mode: OperationMode::from_raw(mode.cast_signed()),
        })
    }

    pub(super) const fn state(&self) -> PowerState {
        self.status.state()
    }
}

#[derive(Debug)]
pub(super) struct Image {
    sample: Option<Sample>,
    following_error: Option<Counts>,
    modulo: Option<Modulo>,
    sync_period: Duration,
    stall_max: Duration,
    pub(super) plausible: Plausible,
}

impl Image {
    /// Samples may lie `stall_max` further apart than their arrivals say.
    pub(super) const fn new(
        modulo: Option<Modulo>,
        plausible: Plausible,
        sync_period: Duration,
        stall_max: Duration,
    ) -> Self {
        Self {
            sample: None,
            following_error: None,
            modulo,
            sync_period,
            stall_max,
            plausible,
        }
    }

    pub(super) const fn sample(&self) -> Option<&Sample> {
        self.sample.as_ref()
    }

    /// Where the axis is, and since when that is known.
    pub(super) fn here(&self) -> Option<Point> {
        let sample = self.sample.as_ref()?;
        Some(Point {
            at: sample.at,
            position: sample.position.0,
        })
    }

    pub(super) const fn following_error(&self) -> Option<Counts> {
        self.following_error
    }

    pub(super) const fn clear(&mut self) {
        self.sample = None;
        self.following_error = None;
        self.plausible.forget();
        self.plausible.allow_jumps(false);
    }

    pub(super) fn take_following_error(&mut self, payload: &[u8]) {
        if let Some(raw) = extract(payload, 0, 32) {
            self.following_error = Some(Counts(i64::from((raw as u32).cast_signed())));
        }
    }

    /// How far the position that counts on is from the one that the drive shows.
    pub(super) fn wrapped_away(&self) -> i64 {
        self.sample
            .as_ref()
            .map_or(0, |sample| sample.position.0 - i64::from(sample.shown))
    }

    /// What the drive shows as `shown`, near where the axis is.
    pub(super) fn counting_on(&self, shown: i32) -> Counts {
        let shown = i64::from(shown);
        Counts(match (self.modulo, &self.sample) {
            (Some(modulo), Some(near)) => modulo.nearest(shown, near.position.0),
            (Some(_) | None, _) => shown,
        })
    }

    /// From now on the axis is counted from near `position`, the turns that it shows or not.
    pub(super) fn count_from(&mut self, position: i64) {
        if let (Some(modulo), Some(sample)) = (self.modulo, &mut self.sample) {
            sample.position = Counts(modulo.nearest(i64::from(sample.shown), position));
            self.plausible.watch_rest();
        }
    }

    pub(super) fn take(&mut self, mut sample: Sample) -> Judgement {
        sample.position = self.counting_on(sample.shown);
        // Frames that queued up in a stall arrive together: at least a period lies between.
        let old = self.sample.map(|old| {
            let apart = sample.at.since(old.at).max(self.sync_period) + self.stall_max;
            (old.position, apart)
        });
        let judgement = self.plausible.take(sample.position, old);
        match (&mut self.sample, judgement) {
            // The statusword has its own checks; only the position is not believed.
            (Some(old), Judgement::Doubted) => {
                old.status = sample.status;
                old.mode = sample.mode;
            }
            (None, Judgement::Doubted) => {}
            (
                newest,
                Judgement::Believed | Judgement::Jumped { .. } | Judgement::TooFast { .. },
            ) => *newest = Some(sample),
        }
        judgement
    }
}
