//! Two runs of a rotary table side by side.

use std::path::Path;

use machine::records::{ReadJournal, read_journal};
use units::Radians;

use crate::Failure;
use crate::program::made_from::made_from;
use crate::program::page::chart::{BLUE, Mark, Series};
use crate::program::page::compare::{Compared, Comparison, at_one_scale};
use crate::program::rotary::report::{self, places};
use crate::rotary::placed::largest_closure;
use crate::rotary::verify::RotaryFigures;
use crate::rotary::{PlateLog, RotaryContent};

/// A run, and what was made from it.
struct Run {
    journal: ReadJournal<PlateLog>,
    made: Option<RotaryContent>,
}

/// The runs whose journals are at `paths`.
pub(crate) fn compared(paths: [&Path; 2]) -> Result<Comparison, Failure> {
    let read = |path: &Path| -> Result<_, Failure> {
        let journal = read_journal::<PlateLog>(path)?;
        let made = made_from::<RotaryContent>(path)?;
        let head = report::head(&journal, &made);
        let made = made.into_iter().next().map(|(_, it)| it.content);
        Ok((Run { journal, made }, head))
    };
    let [(first, first_head), (second, second_head)] = [read(paths[0])?, read(paths[1])?];
    let both = [&first, &second];
    let figures = ROWS.iter().map(|(name, value)| Compared {
        name: (*name).to_owned(),
        unit: "″",
        values: both.map(|it| Some(value(it)?.arcsec())),
    });
    Ok(Comparison {
        title: format!("Two runs of rotary axis {}", second.journal.header.axis),
        heads: [first_head, second_head],
        figures: figures.filter(|it| it.values != [None, None]).collect(),
        body: plots(both),
    })
}

type Row = (&'static str, fn(&Run) -> Option<Radians>);

const ROWS: [Row; 6] = [
    ("largest deviation as found", |it| Some(found(it)?.largest)),
    ("rms as found", |it| Some(found(it)?.rms)),
    ("largest deviation as left", |it| Some(left(it)?.largest)),
    ("rms as left", |it| Some(left(it)?.rms)),
    ("largest table error", |it| {
        Some(it.made.as_ref()?.largest_error())
    }),
    ("the plate moved by at most", |it| {
        let placements = it.journal.log.placements.iter();
        Some(largest_closure(
            placements.map(|it| Radians(it.closure_rad)),
        ))
    }),
];

fn found(run: &Run) -> Option<RotaryFigures> {
    let judged = run.journal.log.judged.as_ref()?;
    Some(RotaryFigures::of_record(&judged.found_rad))
}

fn left(run: &Run) -> Option<RotaryFigures> {
    let judged = run.journal.log.judged.as_ref()?;
    Some(RotaryFigures::of_record(judged.left_rad.as_ref()?))
}

fn plots(both: [&Run; 2]) -> String {
    let of = |figures: fn(&Run) -> Option<RotaryFigures>| {
        both.map(|it| {
            let deviations = figures(it).map_or(Vec::new(), |it| it.deviations);
            let radians: Vec<_> = deviations.iter().map(|it| it.map(Radians::value)).collect();
            let points = places(&it.journal, &radians);
            vec![Series::new("deviation", BLUE, Mark::Dots, points)]
        })
    };
    let table = both.map(|it| {
        let errors = it.made.as_ref().map_or(&[][..], |it| &it.table_error_rad);
        let lines = errors.len().max(1) as f64;
        let each = errors.iter().enumerate();
        let points = each.map(|(line, it)| (360.0 * line as f64 / lines, Radians(*it).arcsec()));
        vec![Series::new(
            "table error",
            BLUE,
            Mark::Line,
            points.collect(),
        )]
    });
    let labels = ("table angle (°)", "deviation (″)");
    [
        at_one_scale("Deviations as found", labels, of(found)),
        at_one_scale("Deviations as left", labels, of(left)),
        at_one_scale(
            "Table errors",
            ("table angle (°)", "reading − true angle (″)"),
            table,
        ),
    ]
    .concat()
}
