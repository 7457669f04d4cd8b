//! What runs go along: paths and jobs, judged before anything of them goes to the machine's thread. That takes as long as
//! it takes.

use std::sync::{Mutex, PoisonError};

use machine::engine::Join;
use truestage::runs::{AskedJob, Group, JobJudge, PathJudge};
use truestage::{Failure, Machine};

use super::Desk;
use crate::order::Judged;
use crate::problem::{Code, Problem};
use crate::request::{GivenFile, PathRows, RunKind, RunRequest};

/// Who judges paths and jobs.
#[derive(Debug, Default)]
pub(crate) struct Judges {
    /// Of paths, by the group that follows them.
    pub(crate) paths: Vec<(String, Mutex<PathJudge>)>,
    /// Of jobs of any axis.
    pub(crate) jobs: Option<Mutex<JobJudge>>,
}

impl Judges {
    /// Collects those of `machine`.
    pub(crate) fn collect(machine: &mut Machine, groups: &[Group]) -> Result<Self, Failure> {
        let mut judges = Self::default();
        for group in groups {
            if let Some(judge) = group.path_judge(machine)? {
                let judge = Mutex::new(judge);
                judges.paths.push((group.name.clone(), judge));
            }
            // A job says itself which axis does it.
            if judges.jobs.is_none() {
                judges.jobs = group.job_judge(machine).map(Mutex::new);
            }
        }
        Ok(judges)
    }
}

/// So long may a path take, in seconds: its points wait in memory.
const LONGEST_S: f64 = 600.0;
/// What a job is called in what is said of it.
const JOB: &str = "job";

impl Desk {
    /// What `request` goes along, judged; `None` where it is a run of another kind.
    ///
    /// # Errors
    /// When it has none, or one that cannot be followed or done; a row or key is named by its line and column.
    pub(crate) fn judge_run(&self, request: &RunRequest) -> Result<Option<Judged>, Problem> {
        refuse_what_is_of_others(request)?;
        match request.kind {
            RunKind::Path | RunKind::FirstPart => self.judge_path(request).map(Some),
            RunKind::Job => self.judge_job(request).map(Some),
            _ if !request.files.is_empty() => self.judge_files(request).map(Some),
            RunKind::Zero
            | RunKind::Calibrate
            | RunKind::Verify
            | RunKind::Reference
            | RunKind::FirstMemory
            | RunKind::SecondMemory => Ok(None),
        }
    }

    /// What stands in them is judged by whoever takes them.
    fn judge_files(&self, request: &RunRequest) -> Result<Judged, Problem> {
        let files = request.files.iter().map(GivenFile::checked);
        let resume = request.resume.as_deref().map(|it| self.journal_path(it));
        Ok(Judged::Files {
            files: files.collect::<Result<_, _>>()?,
            resume: resume.transpose()?,
        })
    }

    fn judge_path(&self, request: &RunRequest) -> Result<Judged, Problem> {
        let rows = request.path.as_ref().ok_or_else(|| {
            let what = "a run of a path without `path`";
            let help = "give its rows: \"time_s,x_mm,y_mm,z_mm\\n0,10,10,10\\n1,20,10,10\"";
            Problem::new(Code::Refused, what, help)
        })?;
        if request.kind == RunKind::FirstPart && request.uncompensated {
            let what = "a first part records what the correction leaves";
            return Err(Problem::new(
                Code::Refused,
                what,
                "leave `uncompensated` out",
            ));
        }
        let join = join_of(request, rows)?;
        let rows = rows.csv()?;
        require_short(&rows)?;
        let mut judges = self.shared.judges.paths.iter();
        let named = |name: &str| request.axis.as_deref().is_none_or(|it| it == name);
        let (group, judge) = judges.find(|it| named(&it.0)).ok_or_else(|| {
            let what = "nothing of that follows paths";
            Problem::new(Code::NotOffered, what, "three axes of a volume do")
        })?;
        let judge = judge.lock().unwrap_or_else(PoisonError::into_inner);
        let is_corrected = !request.uncompensated;
        let judged = judge.judge(&self.shared.store, (&rows, join), is_corrected);
        Ok(Judged::Path {
            path: judged.map_err(refused)?,
            group: group.clone(),
        })
    }

    fn judge_job(&self, request: &RunRequest) -> Result<Judged, Problem> {
        let text = request.job.as_ref().ok_or_else(|| {
            let what = "a run of a job without `job`";
            let help = "give it: what `truestage run` takes from a file";
            Problem::new(Code::Refused, what, help)
        })?;
        let judge = self.shared.judges.jobs.as_ref().ok_or_else(|| {
            let what = "nothing of this machine does jobs";
            Problem::new(
                Code::NotOffered,
                what,
                "axes that are moved by themselves do",
            )
        })?;
        let resume = request.resume.as_deref().map(|it| self.journal_path(it));
        let resume = resume.transpose()?;
        let asked = AskedJob {
            text: (text, JOB),
            beyond: request.beyond,
            resume: resume.as_deref(),
        };
        let judge = judge.lock().unwrap_or_else(PoisonError::into_inner);
        let job = judge.judge(&self.shared.store, asked).map_err(refused)?;
        if request.axis.as_ref().is_some_and(|it| *it != job.axis) {
            let what = format!("the job is one of axis {}", job.axis);
            return Err(Problem::new(Code::Refused, what, "leave `axis` out"));
        }
        Ok(Judged::Job { job, resume })
    }
}

/// What goes along, or says how, and is for other kinds. Other options are refused by whoever has no use for them.
fn refuse_what_is_of_others(request: &RunRequest) -> Result<(), Problem> {
    let is_path = matches!(request.kind, RunKind::Path | RunKind::FirstPart);
    let is_job = request.kind == RunKind::Job;
    let goes_on = is_job || !request.files.is_empty();
    let given = [
        ("path", "path", request.path.is_some() && !is_path),
        ("join", "path", request.join.is_some() && !is_path),
        ("job", "job", request.job.is_some() && !is_job),
        ("beyond", "job", request.beyond && !is_job),
        (
            "files",
            "calibrate",
            !request.files.is_empty() && (is_path || is_job),
        ),
        ("resume", "job", request.resume.is_some() && !goes_on),
    ];
    let Some((option, kind, _)) = given.into_iter().find(|it| it.2) else {
        return Ok(());
    };
    let what = format!("`{option}` is for runs of the kind `{kind}`");
    Err(Problem::new(Code::Refused, what, "leave it out"))
}

/// What joins the rows, where it is said beside them.
fn join_of(request: &RunRequest, rows: &PathRows) -> Result<Option<Join>, Problem> {
    let said = match (request.join.as_deref(), rows.join()) {
        (Some(of_run), Some(of_rows)) if of_run != of_rows => {
            let what = format!("`join` = {of_run:?}, and the rows say {of_rows:?}");
            return Err(Problem::new(Code::Refused, what, "leave one of them out"));
        }
        (of_run, of_rows) => of_run.or(of_rows),
    };
    let join = said.map(|said| {
        Join::of_text(said).ok_or_else(|| {
            let what = format!("`join` = {said:?} joins no rows");
            Problem::new(Code::Refused, what, "write `spline`, or `linear 50um`")
        })
    });
    join.transpose()
}

/// What is wrong with what was sent is not wrong with the configuration.
fn refused(failure: Failure) -> Problem {
    let problem = Problem::from(&failure);
    match failure {
        Failure::Usage { .. } | Failure::Config(_) => {
            Problem::new(Code::Refused, problem.cause, problem.help)
        }
        _ => problem,
    }
}

/// Before a point is made of it for each period.
fn require_short(rows: &str) -> Result<(), Problem> {
    let mut lines = rows.lines().rev().map(str::trim);
    let last = lines.find(|it| !it.is_empty() && !it.starts_with('#'));
    let time = last.and_then(|it| it.split(',').next());
    let takes = time.and_then(|it| it.trim().parse::<f64>().ok());
    match takes {
        Some(takes) if takes > LONGEST_S => {
            let what = format!("`path` takes {takes} s, and at most {LONGEST_S} s are followed");
            Err(Problem::new(Code::Refused, what, "divide it"))
        }
        Some(_) | None => Ok(()),
    }
}
