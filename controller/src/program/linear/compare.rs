//! Two runs of linear axes side by side.

use std::path::Path;

use compensator::iso230::Figures;
use machine::records::{ReadJournal, read_journal};
use units::Metres;

use crate::Failure;
use crate::linear::measure::largest_closure;
use crate::linear::{LinearLog, ZeroEntry};
use crate::program::linear::page::{figures_of, section};
use crate::program::linear::report::{self, Section};
use crate::program::page::chart::{BLUE, Mark, ORANGE, Series, chart};
use crate::program::page::compare::{Compared, Comparison, differences};
use crate::program::text;

/// The runs whose journals are at `paths`.
pub(crate) fn compared(paths: [&Path; 2]) -> Result<Comparison, Failure> {
    let [first, second] = paths.map(read_journal::<LinearLog>);
    let journals = [first?, second?];
    let [first, second] = [&journals[0], &journals[1]].map(|it| figures_of(&it.log.points));
    let figures = [first?, second?];
    let rows = of_figures(figures.each_ref().map(Option::as_ref))
        .into_iter()
        .chain(of_zeros(&journals))
        .chain([closures(&journals)]);
    let [first, second] = [0, 1].map(|at| report::head(&journals[at], figures[at].as_ref(), &[]));
    Ok(Comparison {
        title: format!("Two runs of axis {}", journals[1].header.axis),
        heads: [first, second],
        figures: rows.filter(|it| it.values != [None, None]).collect(),
        body: deviations(&journals, &figures),
    })
}

/// Those of ISO 230-2, as everywhere.
fn of_figures(both: [Option<&Figures>; 2]) -> Vec<Compared> {
    let each = text::ROWS.iter().map(|(name, symbol, figure)| Compared {
        name: format!("{symbol}, {name}"),
        unit: "µm",
        values: both.map(|it| it.map(|it| figure(it).um())),
    });
    each.collect()
}

fn of_zeros(journals: &[ReadJournal<LinearLog>; 2]) -> Vec<Compared> {
    type Row = (&'static str, &'static str, fn(&ZeroEntry) -> f64);
    const ROWS: [Row; 3] = [
        ("origin before the zero", "µm", |it| {
            Metres(it.origin_m).um()
        }),
        ("highest voltage of the even sensor", "mV", |it| {
            it.peak_max_v * 1e3
        }),
        ("voltage of the odd sensor at the origin", "mV", |it| {
            it.mid_v * 1e3
        }),
    ];
    let each = ROWS.iter().map(|(name, unit, value)| Compared {
        name: (*name).to_owned(),
        unit,
        values: journals.each_ref().map(|it| it.log.zeros.last().map(value)),
    });
    each.collect()
}

fn closures(journals: &[ReadJournal<LinearLog>; 2]) -> Compared {
    Compared {
        name: "closure of the datum".into(),
        unit: "µm",
        values: journals
            .each_ref()
            .map(|it| Some(largest_closure(&it.log.closures)?.um())),
    }
}

/// Both at one scale, and what changed of the means at targets that both have.
fn deviations(journals: &[ReadJournal<LinearLog>; 2], figures: &[Option<Figures>; 2]) -> String {
    let [Some(first), Some(second)] = figures else {
        return String::new();
    };
    let sections: Vec<_> = [("first run", 0, first), ("second run", 1, second)]
        .into_iter()
        .map(|(title, at, figures)| {
            let own = section(&journals[at], figures);
            let title = format!("{title}: {}", own.title);
            Section { title, ..own }
        })
        .collect();
    report::at_one_scale(&sections) + &change([first, second])
}

fn change(both: [&Figures; 2]) -> String {
    type Side = fn(&compensator::iso230::TargetFigures) -> Metres;
    let sides: [(&str, &str, Side); 2] = [
        ("mean ↑", BLUE, |it| it.mean_forward),
        ("mean ↓", ORANGE, |it| it.mean_reverse),
    ];
    let series = sides.map(|(name, colour, side)| {
        let [first, second] = both.map(|it| -> Vec<_> {
            let targets = it.targets.iter();
            targets.map(|it| (it.target.mm(), side(it).um())).collect()
        });
        Series::new(name, colour, Mark::Line, differences(&first, &second))
    });
    if series.iter().all(|it| it.points.is_empty()) {
        return "<p class=\"note\">The runs have no target in common.</p>".into();
    }
    let labels = ("target (mm)", "second − first (µm)");
    let svg = chart("Change of the means", labels, &series, None);
    format!("<h2>Change of the means</h2><figure>{svg}</figure>")
}
