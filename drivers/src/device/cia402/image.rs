//! The newest process data of a drive, and whether they are plausible.

use core::time::Duration;
use units::{Counts, Time};
use wire::canopen::pdo::extract;
use wire::cia402::{OperationMode, PowerState, Statusword};

use super::modulo::Modulo;
use super::start::{MODE_DISPLAY, POSITION_ACTUAL, STATUSWORD};

/// Bytes of TPDO 1: statusword, position, mode.
pub(super) const SAMPLE_BYTES: usize = 7;

/// An axis stands when so many samples in a row lie within the tolerance.
const STANDING_SAMPLES: u8 = 3;

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

/// What a sample is worth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Judgement {
    Believed,
    /// Too far from where the axis can be: not taken.
    Doubted,
    /// Doubted twice running: the position did jump. Taken, but to be told.
    Jumped {
        by: Counts,
        limit: Counts,
    },
}

#[derive(Debug)]
pub(super) struct Image {
    sample: Option<Sample>,
    following_error: Option<Counts>,
    modulo: Option<Modulo>,
    speed_max: f64,
    margin: i64,
    tolerance: i64,
    sync_period: Duration,
    stall_max: Duration,
    /// Where the axis was when it last seemed to come to rest.
    rest: Counts,
    standing: u8,
    doubted: bool,
    /// While homing the coordinates may change.
    jumps_allowed: bool,
    rejected: u64,
}

impl Image {
    /// `speed_max` in counts per second, `margin` and `tolerance` in counts; samples may lie
    /// `stall_max` further apart than their arrivals say.
    pub(super) const fn new(
        modulo: Option<Modulo>,
        speed_max: f64,
        margin: i64,
        tolerance: i64,
        sync_period: Duration,
        stall_max: Duration,
    ) -> Self {
        Self {
            sample: None,
            following_error: None,
            modulo,
            speed_max,
            margin,
            tolerance,
            sync_period,
            stall_max,
            rest: Counts(0),
            standing: 0,
            doubted: false,
            jumps_allowed: false,
            rejected: 0,
        }
    }

    pub(super) const fn sample(&self) -> Option<&Sample> {
        self.sample.as_ref()
    }

    pub(super) const fn following_error(&self) -> Option<Counts> {
        self.following_error
    }

    /// How far two honest positions of one moment may be apart.
    pub(super) const fn margin(&self) -> i64 {
        self.margin
    }

    pub(super) const fn rejected(&self) -> u64 {
        self.rejected
    }

    /// Whether the last samples lie together.
    pub(super) const fn stands(&self) -> bool {
        self.standing >= STANDING_SAMPLES
    }

    /// From now on samples begin a new count of standing still.
    pub(super) const fn watch_rest(&mut self) {
        self.standing = 0;
    }

    pub(super) const fn allow_jumps(&mut self, allowed: bool) {
        self.jumps_allowed = allowed;
        self.doubted = false;
    }

    pub(super) const fn clear(&mut self) {
        self.sample = None;
        self.following_error = None;
        self.standing = 0;
        self.doubted = false;
        self.jumps_allowed = false;
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
            self.standing = 0;
        }
    }

    pub(super) fn take(&mut self, mut sample: Sample) -> Judgement {
        sample.position = self.counting_on(sample.shown);
        let judgement = self.judge(&sample);
        match judgement {
            Judgement::Doubted => {
                self.rejected += 1;
                self.doubted = true;
                // The statusword has its own checks; only the position is not believed.
                let Some(old) = &mut self.sample else {
                    return judgement;
                };
                old.status = sample.status;
                old.mode = sample.mode;
                return judgement;
            }
            Judgement::Believed | Judgement::Jumped { .. } => self.doubted = false,
        }
        if (sample.position - self.rest).0.abs() <= self.tolerance {
            self.standing = self.standing.saturating_add(1);
        } else {
            self.rest = sample.position;
            self.standing = 0;
        }
        self.sample = Some(sample);
        judgement
    }

    fn judge(&self, sample: &Sample) -> Judgement {
        let Some(old) = self.sample.filter(|_| !self.jumps_allowed) else {
            return Judgement::Believed;
        };
        // Frames that queued up in a stall arrive together: at least a period lies between.
        let apart = sample.at.since(old.at).max(self.sync_period) + self.stall_max;
        let limit = (self.speed_max * 1.2 * apart.as_secs_f64()) as i64 + self.margin;
        let by = sample.position - old.position;
        if by.0.abs() <= limit {
            Judgement::Believed
        } else if self.doubted {
            Judgement::Jumped {
                by,
                limit: Counts(limit),
            }
        } else {
            Judgement::Doubted
        }
    }
}
