//! Two runs of a platform side by side.

use std::path::Path;

use machine::records::read_journal;

use crate::Failure;
use crate::platform::{PlatformLog, ScrewContent};
use crate::program::made_from::made_from;
use crate::program::page::compare::{Compared, Comparison};
use crate::program::platform::report::{self, Named, PoseRow};
use crate::program::text::screw_terms;

/// The runs whose journals are at `paths`.
pub(crate) fn compared(paths: [&Path; 2]) -> Result<Comparison, Failure> {
    let [first, second] = paths.map(read_journal::<PlatformLog>);
    let [first, second] = [first?, second?];
    let [first_made, second_made] = paths.map(made_from::<ScrewContent>);
    let made = [first_made?, second_made?];
    let named = [
        ("first run".to_owned(), &first),
        ("second run".to_owned(), &second),
    ];
    let visits = named.each_ref().map(report::visit);
    let of_poses = report::COMPARED
        .iter()
        .map(|PoseRow { name, unit, value }| Compared {
            name: (*name).to_owned(),
            unit,
            values: visits.each_ref().map(|it| value(it)),
        });
    let figures = of_poses.chain(of_screws(&made));
    Ok(Comparison {
        title: format!("Two runs of platform {}", second.header.machine),
        figures: figures.filter(|it| it.values != [None, None]).collect(),
        body: report::maps_at_one_scale(&visits),
        heads: [
            report::head(&first, &made[0]),
            report::head(&second, &made[1]),
        ],
    })
}

/// The terms of each screw's model that the second run has.
fn of_screws(made: &[Vec<Named>; 2]) -> Vec<Compared> {
    let mut rows = Vec::new();
    for (_, record) in &made[1] {
        let axis = &record.head.axis;
        let earlier = made[0].iter().find(|(_, it)| it.head.axis == *axis);
        let before = earlier.map_or(Vec::new(), |(_, it)| screw_terms(&it.content.model()));
        for term in screw_terms(&record.content.model()) {
            let old = before.iter().find(|it| it.name == term.name);
            rows.push(Compared {
                name: format!("screw {axis}: {}", term.name),
                unit: term.unit,
                values: [old.map(|it| it.value), Some(term.value)],
            });
        }
    }
    rows
}
