//! `truestage run`: a job of one axis, or a path of three.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use machine::engine::Join;
use units::Metres;
use units::text::length;

use crate::Failure;
use crate::program::linear::job::{self, JobOptions};
use crate::program::output::{Ended, Output};
use crate::program::volumetric::part;
use crate::program::{AgreedArgs, MachineArgs, NEWEST_RUN};

/// A job or a path, and on which machine.
#[derive(Clone, Debug, Args)]
pub(crate) struct RunArgs {
    #[command(flatten)]
    machine: MachineArgs,
    /// The job (`.toml`); or the path: columns time_s and AXIS_mm of each axis, in steps of the SYNC period.
    path: Option<PathBuf>,
    /// Judge the job or the path and say what it would do; no port is opened, nothing moves.
    #[arg(long)]
    dry_run: bool,
    /// Do not wait for the operator of a job.
    #[arg(long)]
    yes: bool,
    /// Go on with the newest interrupted job of its axis, or with the journal given, at the point after the last one
    /// that it went on from.
    #[arg(long, value_name = "JOURNAL", num_args = 0..=1, default_missing_value = NEWEST_RUN)]
    resume: Option<PathBuf>,
    /// The first of several parts: what the detectors see during this part, displacements and rolls, is not corrected
    /// but recorded as the second memory, so that all later parts are made like this one.
    #[arg(long)]
    pub(super) first_part: bool,
    #[command(flatten)]
    joined: JoinArgs,
    #[command(flatten)]
    agreed: AgreedArgs,
}

/// A path or a job that is only judged.
#[derive(Clone, Debug, Args)]
pub(crate) struct PlanArgs {
    #[command(flatten)]
    machine: MachineArgs,
    /// The path, or the job (`.toml`).
    path: Option<PathBuf>,
    #[command(flatten)]
    joined: JoinArgs,
    #[command(flatten)]
    agreed: AgreedArgs,
}

/// As `truestage run --dry-run`.
pub(crate) fn plan(args: PlanArgs, output: Output) -> Ended {
    let args = RunArgs {
        machine: args.machine,
        path: args.path,
        dry_run: true,
        yes: false,
        resume: None,
        first_part: false,
        joined: args.joined,
        agreed: args.agreed,
    };
    run(args, output)
}

/// What joins the rows of a path.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum JoinName {
    /// The cubic spline through all rows; at a corner it swings out.
    Spline,
    /// Straight lines, whose corners are rounded.
    Linear,
}

#[derive(Clone, Copy, Debug, Args)]
struct JoinArgs {
    /// What joins the rows of a path; what its file says (`# join: linear 50um` above its heading) when not given, and
    /// the spline where that says nothing.
    #[arg(long, value_enum)]
    join: Option<JoinName>,
    /// With `--join linear`: how far from a corner the path may pass: `50um`, `0.1mm`.
    #[arg(long, value_name = "LENGTH", value_parser = blend_of)]
    blend: Option<Metres>,
}

fn blend_of(text: &str) -> Result<Metres, String> {
    let positive = length(text).filter(|it| it.value() > 0.0);
    positive.ok_or_else(|| "write a length with its unit, more than 0: 50um, 0.1mm".into())
}

impl JoinArgs {
    const fn is_given(self) -> bool {
        self.join.is_some() || self.blend.is_some()
    }

    /// # Errors
    /// When straight lines are not told how far from a corner, or a spline is.
    fn join(self) -> Result<Option<Join>, Failure> {
        match (self.join, self.blend) {
            (None, None) => Ok(None),
            (Some(JoinName::Spline), None) => Ok(Some(Join::Spline)),
            (Some(JoinName::Linear), Some(blend)) => Ok(Some(Join::Linear { blend })),
            (Some(JoinName::Linear), None) => Err(Failure::Usage {
                what: "--join linear, and nothing says how far from a corner the path may pass"
                    .into(),
                help: "add --blend with a length: --blend 50um".into(),
            }),
            (_, Some(_)) => Err(Failure::Usage {
                what: "--blend is for straight lines".into(),
                help: "add --join linear, or leave it out".into(),
            }),
        }
    }
}

impl RunArgs {
    /// `truestage run path.csv` means `./machine.toml`, as with every verb.
    pub(super) fn settle(mut self) -> (MachineArgs, PathBuf) {
        let path = self
            .path
            .unwrap_or_else(|| core::mem::replace(&mut self.machine.config, "machine.toml".into()));
        (self.machine, path)
    }
}

/// The ending of its name says what is run.
pub(crate) fn run(args: RunArgs, output: Output) -> Ended {
    let (is_first, yes, dry_run) = (args.first_part, args.yes, args.dry_run);
    let AgreedArgs {
        uncompensated,
        beyond,
    } = args.agreed;
    let (resume, joined) = (args.resume.clone(), args.joined);
    let (machine, path) = args.settle();
    let is_job = path
        .extension()
        .is_some_and(|it| it.eq_ignore_ascii_case("toml"));
    let usage = |what: &str| {
        Err(Failure::Usage {
            what: format!("{}: {what}", path.display()),
            help: "a job is a .toml file, a path has columns (.csv); leave the option out".into(),
        })
    };
    let of_paths = is_first || uncompensated || joined.is_given();
    let of_jobs = yes || beyond || resume.is_some();
    match (is_job, of_paths, of_jobs) {
        (true, true, _) => usage(
            "--first-part, --uncompensated, --join and --blend are for paths of three axes, and this is a job",
        ),
        (false, _, true) => usage("--yes, --beyond and --resume are for jobs, and this is a path"),
        (true, false, _) => {
            let options = JobOptions {
                dry_run,
                beyond,
                yes,
                resume,
            };
            job::run(&machine, &path, &options, output)
        }
        (false, _, false) if is_first && uncompensated => {
            usage("--first-part records what the correction leaves: not with --uncompensated")
        }
        (false, _, false) if dry_run => {
            part::only_judged(&machine, &path, joined.join()?, !uncompensated, output)
        }
        (false, _, false) => {
            let (join, how) = (joined.join()?, (is_first, uncompensated));
            part::run(&machine, &path, join, how, output)
        }
    }
}
