//! The page of a run of a linear axis.

use std::path::Path;

use compensator::iso230::{self, Figures};
use machine::records::{ReadJournal, read_journal};

use crate::Failure;
use crate::linear::measure::{largest_closure, series_of};
use crate::linear::{LinearContent, LinearLog, PointEntry};
use crate::program::linear::report::{self, Page, Section};
use crate::program::made_from::made_from;
use crate::program::page::facts_of;
use crate::program::text;

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
    let made = made_from::<LinearContent>(path)?;
    let mut facts = facts_of(&journal, points.len());
    if !points.is_empty() {
        let closure = largest_closure(&journal.log.closures);
        facts.push(("datum after the runs".into(), text::closure(closure)));
    }
    facts.extend(
        made.iter()
            .map(|(id, _)| ("calibration made".into(), id.clone())),
    );
    let page = Page {
        title: format!("{} of {}", journal.header.verb, whose(&journal)),
        facts,
        sections,
        calibration: made.first().map(|(_, it)| &it.content),
        zeros: journal.log.zeros.clone(),
        rotations: journal.log.rotations.clone(),
        job: Some(&journal.log),
    };
    Ok(report::render(&page))
}

/// Whose journal it is: a gantry's tells of both its sides.
fn whose(journal: &ReadJournal<LinearLog>) -> String {
    let name = &journal.header.axis;
    match journal.log.rotations.is_empty() {
        true => format!("axis {name}"),
        false => format!("gantry {name}"),
    }
}

/// `None` for a run with too few points for figures (a zero, or one that was interrupted).
fn figures_of(points: &[PointEntry]) -> Result<Option<Figures>, Failure> {
    if points.is_empty() {
        return Ok(None);
    }
    Ok(iso230::evaluate(&series_of(points)?).ok())
}
