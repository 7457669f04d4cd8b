//! A job of one axis (system S3, steps 4, 5 and 7 of claim 1): its points P1 … PM are gone to one after the other,
//! each corrected by the calibration in use, and at each the axis waits until the next point is wanted.
//!
//! | of the text | here |
//! |---|---|
//! | P1 … PM | [`Job::points`] |
//! | the interval x_n of a point | `interval` of a point of [`JobPlan`] |
//! | is a move wanted? otherwise wait | [`GoOn`] |
//! | end | [`Job::end`] |
//!
//! Absent: points of several axes at once, a speed of its own, and branches.

pub(crate) mod asked;
mod config;
pub(crate) mod judge;
pub(crate) mod kept;
mod load;
mod operator;
pub(crate) mod plan;
mod run;

use core::fmt;
use core::time::Duration;

use units::{Metres, Volts};

use crate::linear::moved::Moved;

#[cfg(test)]
pub(crate) use config::JobConfig;
pub use operator::JobOperator;
pub use plan::JobPlan;
pub use run::JobDone;

/// A job that was judged against its machine.
#[derive(Clone, Debug, PartialEq)]
pub struct Job {
    /// Which axis.
    pub axis: String,
    /// Where to go, in order.
    pub points: Vec<JobPoint>,
    /// How often.
    pub repetitions: u32,
    /// How long the axis stands before its place is read.
    pub settle: Duration,
    /// Where the axis goes at the end; `None`: it stays.
    pub end: Option<Metres>,
}

/// A point of a job.
#[derive(Clone, Debug, PartialEq)]
pub struct JobPoint {
    /// What it is called.
    pub name: String,
    /// Where the point of the axis shall be.
    pub target: Metres,
    /// When to go on from it.
    pub go_on: GoOn,
}

/// When the next point is wanted.
#[derive(Clone, Debug, PartialEq)]
pub enum GoOn {
    /// So long after the place was read.
    After(Duration),
    /// When the operator says that this was done.
    Operator(String),
    /// When an input shows a voltage.
    Input(JobInput),
}

/// An input that is waited for.
#[derive(Clone, Debug, PartialEq)]
pub struct JobInput {
    /// The analog module.
    pub module: String,
    /// The converter's channel, as the configuration calls it.
    pub channel: u8,
    /// Its place among the channels that are read.
    pub place: usize,
    /// The voltage.
    pub level: Volts,
    /// Whether it has to be above the level; below, otherwise.
    pub above: bool,
    /// How long it is waited for.
    pub within: Duration,
}

/// A point that was reached.
#[derive(Clone, Debug, PartialEq)]
pub struct Reached {
    /// Which repetition, from 1.
    pub repetition: u32,
    /// Which point, from 1, of how many.
    pub number: (usize, usize),
    /// What it is called.
    pub name: String,
    /// The calibrated positions before and behind it; `None` beyond the calibrated range.
    pub interval: Option<(Metres, Metres)>,
    /// The move, where it ended, and how uncertain that is.
    pub moved: Moved,
}

impl JobInput {
    /// `input 0 of hall above 2.000 V`.
    pub fn text(&self) -> String {
        self.with_level(format_args!("{:.3}", self.level.value()))
    }

    /// The same, with the level written so.
    fn with_level(&self, level: impl fmt::Display) -> String {
        let side = if self.above { "above" } else { "below" };
        let (channel, module) = (self.channel, &self.module);
        format!("input {channel} of {module} {side} {level} V")
    }

    /// Whether `seen` is what is waited for.
    pub fn is_met(&self, seen: Volts) -> bool {
        match self.above {
            true => seen > self.level,
            false => seen < self.level,
        }
    }
}

impl Job {
    /// How many points are gone to in all.
    pub fn stops(&self) -> u64 {
        self.points.len() as u64 * u64::from(self.repetitions)
    }

    /// Whether a person has to be there.
    pub fn needs_operator(&self) -> bool {
        let mut points = self.points.iter();
        points.any(|it| matches!(it.go_on, GoOn::Operator(_)))
    }
}
