//! `truestage report`: a page of one run.

use std::path::{Path, PathBuf};

use clap::Args;
use compensator::iso230::{self, Figures};
use serde_json::json;
use truestage::Failure;
use truestage::linear::report::{self, Page, Section};
use truestage::page::facts_of;
use truestage::platform::report::PlatformPage;
use truestage::store::{CalibrationRecord, ReadJournal, Store, read_journal};

use crate::program::output::{Ended, Output};

#[derive(Debug, Args)]
pub(crate) struct ReportArgs {
    /// The run's journal (`machine-data/MACHINE/runs/….jsonl`).
    run: PathBuf,
    /// Where to write the page; beside the journal when not given.
    #[arg(long, short)]
    output: Option<PathBuf>,
}

/// The page of the journal at `run`.
pub(crate) fn html(run: &Path) -> Result<String, Failure> {
    let journal = read_journal(run)?;
    if journal.arrangement.is_some() {
        platform(run, &journal)
    } else if journal.plate_plan.is_some() {
        Ok(truestage::rotary::report::render(
            &journal,
            &made_from(run)?,
        ))
    } else if journal.volume.plan.is_some() || journal.volume.check.is_some() {
        Ok(truestage::volumetric::report::render(
            &journal,
            &made_from(run)?,
        ))
    } else {
        axis(&journal)
    }
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

/// The page of a platform's run, with the calibrations that were made from it.
fn platform(path: &Path, journal: &ReadJournal) -> Result<String, Failure> {
    let page = PlatformPage::of(journal, made_from(path)?);
    Ok(truestage::platform::report::render(&page))
}

/// The calibrations that were made from the journal at `path`.
pub(crate) fn made_from(path: &Path) -> Result<Vec<(String, CalibrationRecord)>, Failure> {
    Ok(match (Store::of_journal(path), path.file_name()) {
        (Some(store), Some(name)) => store.made_from(&name.to_string_lossy())?,
        _ => Vec::new(),
    })
}

/// The page of a run of a single axis.
fn axis(journal: &ReadJournal) -> Result<String, Failure> {
    let figures = figures_of(&journal.points)?;
    let sections = figures
        .iter()
        .map(|figures| Section {
            title: journal.header.verb.clone(),
            figures,
            points: &journal.points,
        })
        .collect();
    let page = Page {
        title: format!("{} of axis {}", journal.header.verb, journal.header.axis),
        facts: facts_of(journal),
        sections,
        calibration: None,
        zeros: journal.zeros.clone(),
    };
    Ok(report::render(&page))
}

/// `None` for a run with too few points for figures (a zero, or one that was interrupted).
fn figures_of(points: &[truestage::linear::PointEntry]) -> Result<Option<Figures>, Failure> {
    if points.is_empty() {
        return Ok(None);
    }
    Ok(iso230::evaluate(&truestage::linear::series_of(points)?).ok())
}
