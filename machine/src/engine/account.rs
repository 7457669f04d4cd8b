//! What goes into the loop and what it reports: commands, states, causes, and one period for an
//! observer.

use compensator::apply::Alarm;
use compensator::volumetric::online::Spot;
use units::{Metres, MetresPerSecond, Time};

use super::PerAxis;
use super::cause::Cause;
use super::correction::{Channel, Correction, ThermometerSample, Validity};

/// What the host asks of the loop.
pub(super) enum Command {
    Stop,
    Correct(bool),
    Swap(Box<dyn Correction>),
    /// All axes together no faster than so, where that is said.
    MoveTo(PerAxis<Metres>, Option<MetresPerSecond>),
}

/// What the loop is doing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum State {
    /// The axes hold their set-points and wait for a path or a move.
    Holding,
    /// On the way to a target, or to the first point of a path.
    Moving,
    /// Along the path.
    Following,
    /// All axes together come to rest, because of this.
    Stopping(Cause),
    /// At rest, because of this: the loop ends.
    Stopped(Cause),
}

/// What makes it unsafe to go on at all: quick stop of every drive in the same period.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Trouble {
    /// No sample of an axis for so many periods.
    Missing { axis: usize, periods: u32 },
    /// An axis is not where its set-points are.
    Deviates {
        axis: usize,
        lag: Metres,
        limit: Metres,
    },
    /// No way to stop was found.
    NoStop,
}

/// What was heard after one SYNC.
#[derive(Clone, Copy, Debug)]
pub(super) struct Heard<'a> {
    pub(super) now: Time,
    /// Where each axis was; `None` when it did not answer this SYNC.
    pub(super) actual: PerAxis<Option<Metres>>,
    pub(super) channels: &'a [Option<Channel>],
    pub(super) temperatures: &'a [Option<ThermometerSample>],
    pub(super) spots: &'a [Option<Spot>],
}

/// One period of the loop, for an observer.
#[derive(Clone, Copy, Debug)]
pub struct Live {
    /// When it was decided.
    pub at: Time,
    /// The number of the SYNC.
    pub cycle: u64,
    /// What the loop is doing.
    pub state: State,
    /// Where each axis was.
    pub actual: PerAxis<Metres>,
    /// Where the path wants it next.
    pub nominal: PerAxis<Metres>,
    /// What is added to that.
    pub offset: PerAxis<Metres>,
    /// The standard uncertainty of the correction; not a number (NaN) unless it is valid, or as valid as
    /// it can be.
    pub uncertainty: PerAxis<Metres>,
    /// What the correction says of itself.
    pub validity: Validity,
    /// Whether the correction is switched on and followed.
    pub corrected: bool,
    /// What of it was cut off, or could not be followed as fast as it changed.
    pub alarms: PerAxis<Option<Alarm>>,
    /// Whether it would have led out of the soft limits, and was cut off there.
    pub clamped: PerAxis<bool>,
}

/// What the core counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// SYNC periods decided.
    pub cycles: u64,
    /// Samples that did not come; the last one was held.
    pub missing: u64,
    /// Periods in which a correction was limited in size or rate.
    pub corrections_limited: u64,
    /// Set-points that a correction would have put outside the soft limits.
    pub clamped: u64,
}
