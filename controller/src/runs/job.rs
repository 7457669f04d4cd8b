//! Jobs that one axis does point by point.

use core::any::Any;
use core::fmt;
use std::path::Path;
use std::sync::Arc;

use machine::records::Store;

use super::planned::Planned;
use crate::failure::Failure;

/// A job that was judged, and what it will do.
#[derive(Clone)]
pub struct JudgedJob {
    /// Which axis does it.
    pub axis: String,
    /// What it will do.
    pub planned: Planned,
    /// The calibration that it was judged with.
    pub(crate) calibration: String,
    /// What its kind made of it.
    job: Arc<dyn Any + Send + Sync>,
}

impl JudgedJob {
    pub(crate) fn new(
        axis: &str,
        (planned, calibration): (Planned, String),
        job: impl Any + Send + Sync,
    ) -> Self {
        Self {
            axis: axis.to_owned(),
            planned,
            calibration,
            job: Arc::new(job),
        }
    }

    /// The same as its kind knows it.
    pub(crate) fn of<J: Any>(&self) -> Option<&J> {
        self.job.downcast_ref()
    }
}

/// One that was judged twice is two.
impl PartialEq for JudgedJob {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.job, &other.job)
    }
}

impl fmt::Debug for JudgedJob {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut shown = f.debug_struct("JudgedJob");
        shown.field("axis", &self.axis);
        shown
            .field("planned", &self.planned)
            .finish_non_exhaustive()
    }
}

/// A job as it is asked for.
#[derive(Clone, Copy, Debug)]
pub struct AskedJob<'j> {
    /// Its file, and what that is called in what is said of it.
    pub text: (&'j str, &'j str),
    /// Points beyond the calibrated range are gone to.
    pub beyond: bool,
    /// It goes on with this journal.
    pub resume: Option<&'j Path>,
}

type Judging = dyn Fn(&Store, AskedJob<'_>) -> Result<JudgedJob, Failure> + Send;

/// Judges jobs, on whatever thread that is done.
pub struct JobJudge(Box<Judging>);

impl JobJudge {
    pub(crate) fn new(
        judging: impl Fn(&Store, AskedJob<'_>) -> Result<JudgedJob, Failure> + Send + 'static,
    ) -> Self {
        Self(Box::new(judging))
    }

    /// Judges a job as a whole, with the calibration that `store` says is in use.
    ///
    /// # Errors
    /// What is wrong with its text, by line and column; a place that cannot be gone to; a journal of another job.
    pub fn judge(&self, store: &Store, asked: AskedJob<'_>) -> Result<JudgedJob, Failure> {
        (self.0)(store, asked)
    }
}

impl fmt::Debug for JobJudge {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("JobJudge")
    }
}
