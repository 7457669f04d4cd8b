//! The page of a run of a linear axis.

use std::path::Path;

use compensator::iso230::{self, Figures};
use machine::records::{ReadJournal, read_journal};

use crate::Failure;
use crate::linear::measure::series_of;
use crate::linear::{LinearContent, LinearLog, PointEntry};
use crate::program::linear::report::{self, CALIBRATE, Page, Section};
use crate::program::made_from::made_from;

/// The page of the journal at `path`.
pub(crate) fn html(path: &Path) -> Result<String, Failure> {
    let journal = read_journal::<LinearLog>(path)?;
    let figures = figures_of(&journal.log.points)?;
    let made = made_from::<LinearContent>(path)?;
    let page = Page {
        title: format!("{} of {}", journal.header.verb, whose(&journal)),
        facts: report::head(&journal, figures.as_ref(), &made),
        sections: figures.iter().map(|it| section(&journal, it)).collect(),
        calibration: made.first().map(|(_, it)| &it.content),
        logs: vec![&journal.log],
    };
    Ok(report::render(&page))
}

/// What was measured in `journal`, under the name of its state.
pub(crate) fn section<'a>(
    journal: &'a ReadJournal<LinearLog>,
    figures: &'a Figures,
) -> Section<'a> {
    let is_corrected = journal.header.calibration.is_some();
    let title = match (journal.header.verb.as_str(), is_corrected) {
        ("verify", true) => "as left",
        ("verify", false) => "as found",
        (CALIBRATE, _) => "at the calibrated positions",
        (other, _) => other,
    };
    Section {
        title: title.to_owned(),
        is_calibration: journal.header.verb == CALIBRATE,
        figures,
        points: &journal.log.points,
        criterion: journal.log.criterion.as_ref(),
    }
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
pub(crate) fn figures_of(points: &[PointEntry]) -> Result<Option<Figures>, Failure> {
    if points.is_empty() {
        return Ok(None);
    }
    Ok(iso230::evaluate(&series_of(points)?).ok())
}
