//! `truestage report`: a page of one run.

use std::path::{Path, PathBuf};

use clap::Args;
use machine::records::{AnyLog, read_journal};
use serde_json::json;

use crate::Failure;
use crate::program::kind::KINDS;
use crate::program::linear;
use crate::program::output::{Ended, Output};

#[derive(Debug, Args)]
pub(crate) struct ReportArgs {
    /// The run's journal (`machine-data/MACHINE/runs/….jsonl`).
    run: PathBuf,
    /// Where to write the page; beside the journal when not given.
    #[arg(long, short)]
    output: Option<PathBuf>,
}

/// The page of the journal at `run`, of the kind that its first line tells.
pub(crate) fn html(run: &Path) -> Result<String, Failure> {
    let opened_by = read_journal::<AnyLog>(run)?.log.opened_by;
    let own = opened_by.and_then(|name| {
        let mut kinds = KINDS.iter().copied();
        kinds.find(|it| it.opened_by.contains(&&*name))
    });
    // A run of which only the header was written shows that.
    (own.unwrap_or(&linear::VERBS).page)(run)
}

pub(crate) fn run(args: &ReportArgs, output: Output) -> Ended {
    let html = html(&args.run)?;
    let path = args
        .output
        .clone()
        .unwrap_or_else(|| args.run.with_extension("html"));
    std::fs::write(&path, html).map_err(|source| Failure::File {
        path: path.clone(),
        source,
    })?;
    output.result(
        &format!("report in {}", path.display()),
        &json!({"report": path}),
    )
}
