//! Paths, judged before anything of them goes to the machine's thread: that takes as long as it takes.

use std::sync::{Mutex, PoisonError};

use truestage::runs::{JudgedPath, PathJudge};

use super::Desk;
use crate::problem::{Code, Problem};
use crate::request::{RunKind, RunRequest};

/// Who judges paths, by the group that follows them.
pub(crate) type PathJudges = Vec<(String, Mutex<PathJudge>)>;

/// So long may a path take, in seconds: its points wait in memory.
const LONGEST_S: f64 = 600.0;

impl Desk {
    /// The path that `request` has, judged; `None` where it is a run of another kind.
    ///
    /// # Errors
    /// When it has none, or one that cannot be followed; a row is named by its line and column.
    pub(crate) fn judge_path(&self, request: &RunRequest) -> Result<Option<JudgedPath>, Problem> {
        let rows = match (request.kind, &request.path) {
            (RunKind::Path, Some(rows)) => rows,
            (RunKind::Path, None) => {
                let what = "a run of a path without `path`";
                let help = "give its rows: \"time_s,x_mm,y_mm,z_mm\\n0,10,10,10\\n1,20,10,10\"";
                return Err(Problem::new(Code::Refused, what, help));
            }
            (_, None) => return Ok(None),
            (_, Some(_)) => {
                let what = "`path` is for runs of the kind `path`";
                return Err(Problem::new(Code::Refused, what, "leave it out"));
            }
        };
        require_short(rows)?;
        let mut judges = self.shared.paths.iter();
        let named = |name: &str| request.axis.as_deref().is_none_or(|it| it == name);
        let (_, judge) = judges.find(|it| named(&it.0)).ok_or_else(|| {
            let what = "nothing of that follows paths";
            Problem::new(Code::NotOffered, what, "three axes of a volume do")
        })?;
        let judge = judge.lock().unwrap_or_else(PoisonError::into_inner);
        let judged = judge.judge(&self.shared.store, rows, !request.uncompensated);
        judged.map(Some).map_err(|failure| {
            let problem = Problem::from(&failure);
            match failure {
                truestage::Failure::Usage { .. } => {
                    Problem::new(Code::Refused, problem.cause, problem.help)
                }
                _ => problem,
            }
        })
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
