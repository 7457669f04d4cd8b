//! Two runs of three axes side by side.

use std::path::Path;

use machine::records::{ReadJournal, read_journal};
use units::Metres;

use crate::Failure;
use crate::program::page::chart::{BLUE, Mark, Series};
use crate::program::page::compare::{Compared, Comparison, at_one_scale};
use crate::program::volumetric::report::{self, ALONG, Made, deviations, read_along};
use crate::program::volumetric::{made_from, shown};
use crate::volumetric::VolumeLog;

/// The runs whose journals are at `paths`.
pub(crate) fn compared(paths: [&Path; 2]) -> Result<Comparison, Failure> {
    let [first, second] = paths.map(read_journal::<VolumeLog>);
    let journals = [first?, second?];
    let [first, second] = paths.map(made_from);
    let made = [first?, second?];
    let figures = [range(&journals), tool(&made)]
        .into_iter()
        .chain(errors(&made));
    let series = journals.each_ref().map(|it| {
        let points = it.log.check.as_ref().map_or(Vec::new(), |_| deviations(it));
        vec![Series::new("deviation", BLUE, Mark::Line, points)]
    });
    Ok(Comparison {
        title: format!("Two runs of three axes, {}", journals[1].header.machine),
        figures: figures.filter(|it| it.values != [None, None]).collect(),
        body: at_one_scale("Deviation along the line", ALONG, series),
        heads: [
            report::head(&journals[0], &made[0]),
            report::head(&journals[1], &made[1]),
        ],
    })
}

fn range(journals: &[ReadJournal<VolumeLog>; 2]) -> Compared {
    Compared {
        name: "range of the deviation along the line".into(),
        unit: "µm",
        values: journals.each_ref().map(|it| {
            it.log.check.as_ref()?;
            Some(read_along(it).1.um())
        }),
    }
}

fn tool(made: &[Made; 2]) -> Compared {
    Compared {
        name: "standard uncertainty of the tool, at most".into(),
        unit: "µm",
        values: made.each_ref().map(|it| {
            let agreement = it.geometries.first()?.agreement.as_ref()?;
            Some(Metres(agreement.tool_u_max_m).um())
        }),
    }
}

/// The largest of each error function, and the squarenesses.
fn errors(made: &[Made; 2]) -> Vec<Compared> {
    let of = |at: usize| made[at].geometries.first();
    let Some(second) = of(1) else {
        return Vec::new();
    };
    let functions = shown::errors(second).map(|it| {
        let mut before = of(0).into_iter().flat_map(shown::errors);
        let before = before.find(|old| old.name == it.name);
        Compared {
            name: format!("{}, largest", it.name),
            unit: it.unit,
            values: [before.map(|it| it.largest), Some(it.largest)],
        }
    });
    let squarenesses = shown::squarenesses(second).into_iter();
    let squarenesses = squarenesses.map(|(name, value, _)| {
        let mut before = of(0).into_iter().flat_map(shown::squarenesses);
        let before = before.find(|old| old.0 == name);
        Compared {
            name: format!("squareness of {name}"),
            unit: "″",
            values: [before.map(|it| it.1), Some(value)],
        }
    });
    functions.chain(squarenesses).collect()
}
