//! The page of a run of a linear axis.

use std::path::Path;

use compensator::iso230::{self, Figures};
use machine::records::read_journal;

use crate::Failure;
use crate::linear::measure::series_of;
use crate::linear::{LinearLog, PointEntry};
use crate::program::linear::report::{self, Page, Section};
use crate::program::page::facts_of;

/// The page of the journal at `path`.
pub(crate) fn html(path: &Path) -> Result<String, Failure> {
    let journal = read_journal::<LinearLog>(path)?;
    let points = &journal.log.points;
    let figures = figures_of(points)?;
    let sections = figures
        .iter()
        .map(|figures| Section {
            title: journal.header.verb.clone(),
            figures,
            points,
        })
        .collect();
    let page = Page {
        title: format!("{} of axis {}", journal.header.verb, journal.header.axis),
        facts: facts_of(&journal, points.len()),
        sections,
        calibration: None,
        zeros: journal.log.zeros.clone(),
    };
    Ok(report::render(&page))
}

/// `None` for a run with too few points for figures (a zero, or one that was interrupted).
fn figures_of(points: &[PointEntry]) -> Result<Option<Figures>, Failure> {
    if points.is_empty() {
        return Ok(None);
    }
    Ok(iso230::evaluate(&series_of(points)?).ok())
}
