//! What the loop is asked and what it says: orders, states, causes, one period for whoever watches.

use compensator::apply::Alarm;
use units::{Metres, Time};

use super::correction::{Channel, Correction, ThermometerSample, Validity};
use super::motion::MotionError;
use super::{Lack, PerAxis};

/// What the host asks of the loop.
pub(super) enum Command {
    Stop,
    Correct(bool),
    Swap(Box<dyn Correction>),
    MoveTo(PerAxis<Metres>),
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

/// Why the loop came to rest in a controlled way.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum Cause {
    /// The path came to its end.
    #[error("the path is done")]
    PathDone,
    /// The host asked for it.
    #[error("stopped as asked")]
    Asked,
    /// The queue was empty before the path was finished.
    #[error(
        "the path queue ran dry and all axes were stopped together; write further ahead, or \
         finish the path"
    )]
    RanDry,
    /// Whoever writes the path is gone.
    #[error("whoever writes the path is gone; all axes were stopped together")]
    HostGone,
    /// A point was outside the limits, although it had been checked.
    #[error("a point for axis number {axis} is outside the limits; all axes were stopped")]
    PathRefused {
        /// Which axis, in the order of the engine's axes.
        axis: usize,
    },
    /// There is no way to a target, although it is within the limits.
    #[error(
        "no motion within the limits of speed, acceleration and jerk leads to the target; all axes \
         were stopped together"
    )]
    NoWay,
    /// The points that came belong to a path that an earlier stop had put an end to.
    #[error("the path had been given up before, nothing of it was driven; begin another one")]
    GivenUp,
    /// The computer was late by more than a period; what was queued is not replayed.
    #[error(
        "the loop was late by {periods} periods (the computer was held up): the queued path was \
         dropped, all axes were stopped together"
    )]
    Overrun {
        /// How many SYNCs were missed.
        periods: u32,
    },
    /// The correction cannot be known, and nothing may be done without it.
    #[error("the correction failed: {reason}; all axes were stopped together")]
    Correction {
        /// Why.
        reason: &'static str,
    },
    /// What the correction is computed from is lost, and nothing may be done without it.
    #[error("the correction failed: {lack}; all axes were stopped together")]
    CorrectionLost {
        /// What, and why.
        lack: Lack,
    },
}

impl Cause {
    /// Why a target was not gone to.
    pub(super) const fn of_refusal(error: &MotionError) -> Self {
        match error {
            MotionError::SoftLimit { axis, .. } => Self::PathRefused { axis: *axis },
            MotionError::NotPlanned { .. } => Self::NoWay,
        }
    }
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
}

/// One period of the loop, for whoever watches.
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
