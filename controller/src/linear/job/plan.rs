//! What a job will be, judged before anything moves: the interval of the error table that each point lies in, what
//! it is corrected by, and how uncertain it will be.

use compensator::apply::ApproachTracker;
use compensator::budget::Combined;
use compensator::error_table::{Compensation, ErrorTable};
use units::{Approach, Metres};

use crate::config::{ConfigHash, Loaded, MachineConfig};
use crate::correction::Correction;
use crate::failure::Failure;
use crate::linear::course::{Corrected, Course, set_point_of, started};
use crate::linear::job::Job;
use crate::linear::settings::require_within;
use crate::linear::stored::stored_course;
use crate::store::Store;

/// A job as it will be done.
#[derive(Clone, Debug, PartialEq)]
pub struct JobPlan {
    /// The calibration that corrects it.
    pub calibration: String,
    /// Each point, in order, as it is reached the first time.
    pub points: Vec<PlannedPoint>,
}

/// A point as it will be reached.
#[derive(Clone, Debug, PartialEq)]
pub struct PlannedPoint {
    /// What it is called.
    pub name: String,
    /// Where the point of the axis shall be.
    pub target: Metres,
    /// The calibrated positions before and behind it; `None` beyond the calibrated range.
    pub interval: Option<(Metres, Metres)>,
    /// Where the drive will be sent.
    pub set_point: Metres,
    /// From which side.
    pub approach: Approach,
    /// What corrects it.
    pub corrected: Corrected,
    /// How uncertain the place will be, with the zero that the axis was calibrated with; `None` where the
    /// calibration says nothing of it.
    pub uncertainty: Option<Combined>,
}

impl JobPlan {
    /// Judges `job` on the machine of `loaded` with the calibration that `store` says is in use. Who the drive is
    /// shows only when the machine is connected.
    ///
    /// # Errors
    /// No calibration is in use, or it belongs to another machine or breaks a limit; a target or set-point outside
    /// the soft limits; a target outside the calibrated range where that is refused.
    pub fn of(job: &Job, loaded: &Loaded, store: &Store) -> Result<Self, Failure> {
        Self::on(job, (&loaded.config, &loaded.hash), store)
    }

    /// The same on the machine of this configuration.
    ///
    /// # Errors
    /// As [`Self::of`].
    pub(crate) fn on(
        job: &Job,
        (config, hash): (&MachineConfig, &ConfigHash),
        store: &Store,
    ) -> Result<Self, Failure> {
        let in_use = stored_course((config, hash), &job.axis, store)?;
        let (id, course) = in_use.ok_or_else(|| uncalibrated(&job.axis))?;
        let compensation = course.compensation.as_ref();
        let compensation = compensation.expect("a stored course has what corrects it");
        let planner = Planner {
            job,
            config,
            compensation,
            course: &course,
        };
        let points = planner.plan()?;
        Ok(Self {
            calibration: id,
            points,
        })
    }
}

/// The failure of a job that nothing could correct.
pub(super) fn uncalibrated(axis: &str) -> Failure {
    Failure::Usage {
        what: format!("axis {axis} has no active calibration, and a job is corrected by one"),
        help: "run `truestage calibrate`, or activate a calibration with `truestage cal activate`; nothing was \
               moved"
            .into(),
    }
}

/// What moves are planned with, without a machine.
struct Planner<'a> {
    job: &'a Job,
    config: &'a MachineConfig,
    compensation: &'a Compensation,
    course: &'a Course,
}

impl Planner<'_> {
    /// Each point by the rules of a move; judged twice over, because the first one is reached from the last one, too.
    fn plan(&self) -> Result<Vec<PlannedPoint>, Failure> {
        let mut tracker = ApproachTracker::new();
        let mut planned = Vec::new();
        for _ in 0..self.job.repetitions.min(2) {
            for point in &self.job.points {
                let target = point.target;
                let (set_point, approach) = self.judged(&mut tracker, target)?;
                let length = self.approach_length();
                planned.push(PlannedPoint {
                    name: point.name.clone(),
                    target,
                    interval: interval(self.compensation.table(), target),
                    set_point,
                    approach,
                    corrected: self.course.corrected(target),
                    uncertainty: self.course.uncertainty_after(length, target, approach),
                });
            }
        }
        if let Some(end) = self.job.end {
            self.judged(&mut tracker, end)?;
        }
        planned.truncate(self.job.points.len());
        Ok(planned)
    }

    fn approach_length(&self) -> Option<Metres> {
        let own = self.config.axis[&self.job.axis].compensation.as_ref();
        own.and_then(|it| it.approach_mm).map(Metres::from_mm)
    }

    /// Where the drive is sent for `target`, and from which side that is reached.
    fn judged(
        &self,
        tracker: &mut ApproachTracker,
        target: Metres,
    ) -> Result<(Metres, Approach), Failure> {
        // The zero leaves the axis at its origin.
        let here = Some(Metres::ZERO);
        let is_free = |place| self.within_limits(place);
        let set_point = match self.approach_length() {
            Some(length) => {
                let start = started(tracker, here);
                let (at, to) = ((self.job.axis.as_str(), &start), (target, length));
                let (from, set_point) = self.course.arrival(at, to, Correction::On, &is_free)?;
                tracker.update(from);
                set_point
            }
            None => {
                is_free(target)?;
                let set_point = set_point_of(self.compensation, tracker, here, target);
                let set_point = set_point.map_err(|source| Failure::OutOfCalibration {
                    axis: self.job.axis.clone(),
                    source,
                })?;
                is_free(set_point)?;
                set_point
            }
        };
        tracker.update(set_point);
        Ok((set_point, tracker.approach().unwrap_or(Approach::Forward)))
    }

    fn within_limits(&self, place: Metres) -> Result<(), Failure> {
        require_within(self.config, &self.job.axis, place)
    }
}

/// The positions of `table` before and behind `target`; the last interval has its end.
pub(super) fn interval(table: &ErrorTable, target: Metres) -> Option<(Metres, Metres)> {
    let nodes = table
        .nodes()
        .windows(2)
        .map(|it| (it[0].position, it[1].position));
    let mut within = nodes.filter(|(from, to)| target >= *from && target <= *to);
    // A position itself begins an interval.
    let first = within.next()?;
    Some(within.next().unwrap_or(first))
}

#[cfg(test)]
mod tests {
    use compensator::error_table::Node;

    use super::*;

    #[test]
    fn a_position_of_the_table_begins_an_interval_and_the_last_one_has_its_end() {
        let node = |mm: f64| Node {
            position: Metres::from_mm(mm),
            forward: Some(Metres::ZERO),
            reverse: None,
            u_forward: None,
            u_reverse: None,
        };
        let table = ErrorTable::new(vec![node(0.0), node(3.0), node(5.0)]).unwrap();
        let check = |mm: f64, expected: Option<(f64, f64)>| {
            let seen = interval(&table, Metres::from_mm(mm));
            let expected = expected.map(|(a, b)| (Metres::from_mm(a), Metres::from_mm(b)));
            assert_eq!(seen, expected, "{mm}");
        };
        check(0.0, Some((0.0, 3.0)));
        check(2.9, Some((0.0, 3.0)));
        check(3.0, Some((3.0, 5.0)));
        check(5.0, Some((3.0, 5.0)));
        check(5.1, None);
        check(-0.1, None);
    }
}
