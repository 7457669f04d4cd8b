//! Jobs judged for whoever keeps the machine: the same as at the command line, and what they will take.

use core::time::Duration;

use units::{Metres, MetresPerSecond};

use crate::agreed::Agreed;
use crate::config::{ConfigHash, MachineConfig};
use crate::failure::Failure;
use crate::linear::job::kept::goes_on_at;
use crate::linear::job::{GoOn, Job, JobPlan};
use crate::runs::{JobJudge, JudgedJob, Planned, Travel};

/// So many points a job may come to where somebody else waits for what it gives: each is in that.
const STOPS_MAX: u64 = 2000;

/// Who judges jobs on this machine.
pub(crate) fn job_judge(config: MachineConfig, hash: ConfigHash) -> JobJudge {
    JobJudge::new(move |store, asked| {
        let (text, file) = asked.text;
        let job = Job::parse(text, file, &config)?;
        require_short(&job)?;
        let plan = JobPlan::on(&job, (&config, &hash), store)?;
        plan.require(&job.axis, asked.beyond)?;
        if let Some(journal) = asked.resume {
            goes_on_at(store, journal, &job, &plan.calibration)?;
        }
        let speed = config.axis[&job.axis].motion.speed_mm_per_s;
        let planned = planned(&job, &plan, MetresPerSecond(speed * 1e-3));
        let axis = job.axis.clone();
        Ok(JudgedJob::new(&axis, (planned, plan.calibration), job))
    })
}

fn require_short(job: &Job) -> Result<(), Failure> {
    let stops = job.stops();
    if stops <= STOPS_MAX {
        return Ok(());
    }
    Err(Failure::Usage {
        what: format!(
            "the job goes to {stops} points, repetitions counted, and a service does {STOPS_MAX}"
        ),
        help: "divide it, or end the service and use `truestage run`".into(),
    })
}

impl JobPlan {
    /// Refuses points that nothing corrects, unless that is agreed to.
    ///
    /// # Errors
    /// When there is one.
    pub(crate) fn require(&self, axis: &str, beyond: bool) -> Result<(), Failure> {
        let agreed = Agreed {
            uncompensated: false,
            beyond,
        };
        let mut points = self.points.iter();
        points.try_for_each(|it| it.corrected.require(axis, it.target, agreed))
    }
}

/// What `job` will take, from its first point on.
fn planned(job: &Job, plan: &JobPlan, speed: MetresPerSecond) -> Planned {
    let ways = plan.points.windows(2);
    let ways = ways.map(|it| (it[1].set_point - it[0].set_point).abs().value());
    let once: f64 = ways.sum();
    let ends = plan.points.first().zip(plan.points.last());
    let back = ends.map_or(0.0, |(first, last)| {
        (last.set_point - first.set_point).abs().value()
    });
    let times = f64::from(job.repetitions);
    let travel = Metres(once * times + back * (times - 1.0));
    let moves = Duration::try_from_secs_f64(travel.value() / speed.value()).unwrap_or_default();
    let stands: Duration = job
        .points
        .iter()
        .map(|it| job.settle + waits(&it.go_on))
        .sum();
    let mut asks = Vec::new();
    for point in &job.points {
        if let GoOn::Operator(text) = &point.go_on
            && !asks.contains(text)
        {
            asks.push(text.clone());
        }
    }
    Planned {
        points: job.stops(),
        travel: Some(Travel::Length(travel)),
        at_least: moves + stands.saturating_mul(job.repetitions),
        asks,
        ..Planned::default()
    }
}

/// How long a point is stood at, at least.
const fn waits(go_on: &GoOn) -> Duration {
    match go_on {
        GoOn::After(span) => *span,
        GoOn::Operator(_) | GoOn::Input(_) => Duration::ZERO,
    }
}
