//! A placement that was read elsewhere, from a file.

use compensator::rotary::SightedReading;

use super::dialog::judged;
use crate::failure::Failure;
use crate::rotary::placed::Placed;
use crate::rotary::plate_journal::PlateJournal;
use crate::rotary::plate_run::PlateRun;
use crate::rotary::sighting::Sighting;
use crate::rotary::{PlateEntry, SightedEntry};
use crate::run::utc_now;
use crate::runs::DataFile;
use crate::store::Log;

/// The readings of the placement at `offset` in `file`.
///
/// # Errors
/// The first thing that is not as it should be, with file, line and column.
pub(super) fn readings(
    file: &DataFile,
    (run, sighting): (&PlateRun, Sighting),
    offset: f64,
) -> Result<Vec<SightedReading>, Failure> {
    let plan = sighting.plan(offset, run.lines, run.passes);
    Ok(plan.from_csv(&file.text, &file.name, sighting.value)?)
}

/// Writes the placement at `offset` into the journal, once all of it was judged.
pub(super) fn import(
    axis: &str,
    (run, sighting): (&PlateRun, Sighting),
    offset: f64,
    file: &DataFile,
    journal: &mut PlateJournal,
) -> Result<Placed, Failure> {
    let readings = readings(file, (run, sighting), offset)?;
    let plan = sighting.plan(offset, run.lines, run.passes);
    let beside = offset.fract() * plan.spacing().value();
    let at = utc_now();
    let mut entries = Vec::new();
    for (pass, approach) in plan.passes() {
        let own = readings
            .iter()
            .filter(|it| (it.pass, it.approach) == (pass, approach));
        let mut values = vec![None; plan.lines];
        own.for_each(|it| values[it.line] = Some(it.deviation.value() + beside));
        // Lines that are not in the file were not read, whatever was typed of them before.
        entries.extend((0..).zip(values).map(|(line, deviation_rad)| {
            PlateEntry::Sighted(SightedEntry {
                offset,
                pass,
                approach: approach.symbol(),
                line,
                deviation_rad,
                at: at.clone(),
            })
        }));
    }
    let mut imagined = journal.so_far().clone();
    entries.iter().for_each(|it| imagined.take(it.clone()));
    let (placement, _) = judged(axis, (run, &plan), &imagined, 0.0)?;
    for entry in entries {
        journal.write(entry)?;
    }
    journal.close(placement)
}
