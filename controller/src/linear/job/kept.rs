//! What a journal keeps of a job, and where a job that was interrupted goes on.
//!
//! A point is done when the job went on from it. One that was reached and not left is gone to again: whoever was
//! waited for there has not done it, and the axis, which was zeroed meanwhile, stands elsewhere.

use std::path::Path;

use machine::records::{Store, first_difference, not_resumable};
use units::{Metres, Short};

use crate::failure::Failure;
use crate::linear::job::{GoOn, Job};
use crate::linear::{JobEntry, LinearLog};
use crate::store::StoreError;

/// The first stop that is not done: which repetition and which point of it, both from 1. Beyond the last repetition
/// all of them are done, but for the end.
pub(crate) type Stop = (u32, usize);

/// What `job` is, for the journal.
pub(super) fn entry_of(job: &Job) -> JobEntry {
    JobEntry {
        names: job.points.iter().map(|it| it.name.clone()).collect(),
        repetitions: job.repetitions,
        settle_s: job.settle.as_secs_f64(),
        end_m: job.end.map(Metres::value),
        go_on: job.points.iter().map(|it| it.go_on.text()).collect(),
    }
}

impl GoOn {
    /// `after 0.5 s`, `operator: lay a part`, `input 0 of hall above 2 V within 3 s`.
    fn text(&self) -> String {
        match self {
            Self::After(span) => format!("after {} s", Short(span.as_secs_f64())),
            Self::Operator(text) => format!("operator: {text}"),
            Self::Input(input) => format!(
                "{} within {} s",
                input.with_level(Short(input.level.value())),
                Short(input.within.as_secs_f64())
            ),
        }
    }
}

/// Where `job`, corrected by `calibration`, goes on after what the journal at `path` holds. Nothing is opened for
/// that, so who the drive is is compared when it goes on.
///
/// # Errors
/// When the journal cannot be read, is complete, or is that of another job or calibration: what differs is named.
pub(crate) fn goes_on_at(
    store: &Store,
    path: &Path,
    job: &Job,
    calibration: &str,
) -> Result<Stop, Failure> {
    let read = store.read_journal::<LinearLog>(path)?;
    if read.complete {
        let path = path.to_owned();
        return Err(StoreError::AlreadyComplete { path }.into());
    }
    let now = Some(calibration.to_owned());
    if let Some(it) = first_difference(&read.header.calibration, &now) {
        return Err(not_resumable(path, "calibration", it).into());
    }
    let targets: Vec<f64> = job.points.iter().map(|it| it.target.value()).collect();
    if let Some(it) = first_difference(&read.header.targets_m, &targets) {
        return Err(not_resumable(path, "targets", it).into());
    }
    match first_difference(&read.log.job, &Some(entry_of(job))) {
        Some(it) => Err(not_resumable(path, "job", it).into()),
        None => Ok(first_not_done(&read.log, job.points.len())),
    }
}

fn first_not_done(log: &LinearLog, points: usize) -> Stop {
    match log.went_on.last() {
        None => (1, 1),
        Some(last) if last.number >= points => (last.repetition + 1, 1),
        Some(last) => (last.repetition, last.number + 1),
    }
}

impl Job {
    /// How many stops come before `stop`.
    pub(crate) fn stops_before(&self, (repetition, number): Stop) -> u64 {
        let whole = u64::from(repetition - 1) * self.points.len() as u64;
        whole + number as u64 - 1
    }
}

#[cfg(test)]
mod tests {
    use core::time::Duration;

    use units::Volts;

    use super::*;
    use crate::linear::WentOnEntry;
    use crate::linear::job::JobInput;

    #[test]
    fn the_first_stop_that_is_not_done_follows_the_last_one_that_was_left() {
        let left = |repetition, number| {
            let mut log = LinearLog::default();
            log.went_on.push(WentOnEntry {
                repetition,
                number,
                by: "time".into(),
                waited_s: 0.0,
                seen_v: None,
                at_s: 0.0,
            });
            first_not_done(&log, 3)
        };
        assert_eq!(first_not_done(&LinearLog::default(), 3), (1, 1));
        assert_eq!(left(1, 2), (1, 3));
        assert_eq!(left(1, 3), (2, 1));
        assert_eq!(left(2, 3), (3, 1));
    }

    #[test]
    fn conditions_are_told_to_the_last_digit() {
        let input = JobInput {
            module: "hall".into(),
            channel: 0,
            place: 0,
            level: Volts(2.0001),
            above: true,
            within: Duration::from_secs(3),
        };
        for (go_on, expected) in [
            (GoOn::After(Duration::from_millis(1)), "after 0.001 s"),
            (GoOn::Operator("turn it".into()), "operator: turn it"),
            (
                GoOn::Input(input),
                "input 0 of hall above 2.0001 V within 3 s",
            ),
        ] {
            assert_eq!(go_on.text(), expected);
        }
    }
}
