//! A path on its way to the loop: one set-point for every SYNC period, through a bounded queue.
//!
//! A point is taken only when it can be driven: within the soft limits, with speed, acceleration
//! and jerk (the first, second and third difference over the period) within theirs, and so that
//! from it every axis can still come to rest within the soft limits. So whatever happens to
//! whoever writes, the loop can stop from the last point that it has.
//!
//! A path begins at rest at its first point; the loop goes there first. It ends with
//! [`PathWriter::finish`]; a queue that is empty before that has run dry. The next one begins with
//! [`PathWriter::begin`]: also after a stop, which gives up the path that it interrupts.

use core::time::Duration;

use rtrb::{Producer, PushError as Full};
use units::Metres;

use super::judge::{Judge, PathError};
use super::{AXES_MAX, AxisLimits, PerAxis};

/// What waits in the queue.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Item {
    /// Another path; what was not driven of the one before is not driven any more.
    Begin,
    Point(PerAxis<Metres>),
    End,
}

/// Why a point was not taken.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PushError {
    /// The queue is full: try again when the loop has taken some.
    #[error("the path queue is full; try again a few periods later")]
    Full,
    /// The path is finished already.
    #[error("the path was finished; begin another one")]
    Finished,
    /// It has too few or too many axes.
    #[error("a point of {seen} axes, the engine moves {expected}")]
    WrongAxes {
        /// How many there should be.
        expected: usize,
        /// How many there are.
        seen: usize,
    },
    /// It cannot be driven.
    #[error(transparent)]
    Refused(#[from] PathError),
    /// The loop has ended.
    #[error("the engine has stopped and takes no more points")]
    Stopped,
}

/// Writes a path; lives wherever its points come from, the loop is another thread's.
pub struct PathWriter {
    judge: Judge,
    queue: Producer<Item>,
    finished: bool,
}

impl PathWriter {
    pub(super) fn new(
        names: Vec<String>,
        period: Duration,
        limits: PerAxis<AxisLimits>,
        queue: Producer<Item>,
    ) -> Self {
        Self {
            judge: Judge::new(names, period, limits),
            queue,
            finished: false,
        }
    }

    /// The axes, in the order of a point's positions.
    pub fn axes(&self) -> &[String] {
        self.judge.axes()
    }

    /// From one point to the next.
    pub const fn period(&self) -> Duration {
        self.judge.period()
    }

    /// Whether all `points` could be driven as one path, so that none is begun that cannot be
    /// ended. Writes nothing. It takes some microseconds for each point: time to do it before
    /// drives wait for set-points.
    ///
    /// # Errors
    /// The first point that cannot.
    pub fn check(&self, points: &[Vec<Metres>]) -> Result<(), PushError> {
        let mut judge = self.judge.anew();
        points.iter().try_for_each(|point| {
            let next = judge.judge(&self.of_all_axes(point)?)?;
            judge.accept(next);
            Ok(())
        })
    }

    fn of_all_axes(&self, point: &[Metres]) -> Result<PerAxis<Metres>, PushError> {
        let (expected, seen) = (self.axes().len(), point.len());
        if seen != expected {
            return Err(PushError::WrongAxes { expected, seen });
        }
        let mut all = [Metres::ZERO; AXES_MAX];
        all[..expected].copy_from_slice(point);
        Ok(all)
    }

    /// How many points the queue takes now.
    pub fn room(&self) -> usize {
        self.queue.slots()
    }

    /// Begins another path, from rest at its first point: behind the end of the one before, for
    /// the next [`Machine::follow`](crate::Machine::follow), or after a stop, which has put an end to
    /// the one before.
    ///
    /// # Errors
    /// When there is no room.
    pub fn begin(&mut self) -> Result<(), PushError> {
        if self.judge.has_begun() || self.finished {
            self.enqueue(Item::Begin)?;
        }
        self.judge.begin();
        self.finished = false;
        Ok(())
    }

    /// Appends where the axes shall be one period after the last point.
    ///
    /// # Errors
    /// When there is no room, or the point cannot be driven; the path is as before then.
    pub fn push(&mut self, point: &[Metres]) -> Result<(), PushError> {
        let all = self.of_all_axes(point)?;
        if self.finished {
            return Err(PushError::Finished);
        }
        let next = self.judge.judge(&all)?;
        self.enqueue(Item::Point(all))?;
        self.judge.accept(next);
        Ok(())
    }

    /// Says that nothing follows: the loop comes to rest at (or, from a path that does not slow
    /// down, soon after) the last point.
    ///
    /// # Errors
    /// When there is no room.
    pub fn finish(&mut self) -> Result<(), PushError> {
        if !self.finished {
            self.enqueue(Item::End)?;
            self.finished = true;
        }
        Ok(())
    }

    /// Takes from `points` as many as there is room for, and finishes the path behind the last one;
    /// whether that is done. A program that writes a path while it is driven calls this repeatedly.
    ///
    /// # Errors
    /// As [`PathWriter::push`]; the point that is refused is lost.
    pub fn write(
        &mut self,
        points: &mut impl Iterator<Item = Vec<Metres>>,
    ) -> Result<bool, PushError> {
        while self.room() > 0 && !self.finished {
            match points.next() {
                Some(point) => self.push(&point)?,
                None => self.finish()?,
            }
        }
        Ok(self.finished)
    }

    fn enqueue(&mut self, item: Item) -> Result<(), PushError> {
        if self.queue.is_abandoned() {
            return Err(PushError::Stopped);
        }
        self.queue
            .push(item)
            .map_err(|Full::Full(_)| PushError::Full)
    }
}
