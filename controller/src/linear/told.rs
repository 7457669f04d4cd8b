//! What a linear axis gave, in the words of the command line.

use crate::linear::job::JobDone;
use crate::linear::{Calibrated, Job, Moved, Reached, Verified, Zeroed};
use crate::runs::Told;

/// Who says it ([`Teller::of`](crate::runs::Teller::of)).
#[derive(Clone, Copy, Debug)]
pub struct LinearTeller {
    /// A zero that was found.
    pub zeroed: fn(axis: &str, zeroed: &Zeroed) -> Told,
    /// A calibration that was made.
    pub calibrated: fn(calibrated: &Calibrated) -> Told,
    /// A verification, with a calibration or without one.
    pub verified: fn(axis: &str, verified: &Verified, compensated: bool) -> Told,
    /// A move, and the calibration that corrected it.
    pub moved: fn(axis: &str, moved: &Moved, calibration: Option<&str>) -> Told,
    /// A point of a job that was reached, and the calibration that corrected it.
    pub reached: fn(job: &Job, calibration: &str, point: &Reached) -> Told,
    /// A job that was done.
    pub job_done: fn(job: &Job, done: &JobDone) -> Told,
}
