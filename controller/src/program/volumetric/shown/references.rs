//! Stored references of detectors on the screen.

use compensator::volumetric::function::Function;
use compensator::volumetric::{Axis, ReferenceOf};
use serde_json::json;
use units::{Metres, Short};

use crate::program::show::Changes;
use crate::program::volumetric::shown::{ARCSEC, largest};
use crate::volumetric::{BeamReferencesContent, FunctionRecord};

/// What a reading is expected to be.
enum Expected<'a> {
    /// It changes along the travel.
    Along(&'a FunctionRecord),
    /// The detector stands still.
    Still(f64),
}

/// The reference of one reading.
struct Reference<'a> {
    name: String,
    expected: Expected<'a>,
    /// Micrometres, or arcseconds, and how many of them the SI unit has.
    unit: (&'static str, f64),
}

/// Each reading that has a reference.
fn each(content: &BeamReferencesContent) -> Vec<Reference<'_>> {
    let mut each = Vec::new();
    for beam in &content.beams {
        let Some(axis) = Axis::of_letter(beam.axis) else {
            continue;
        };
        let mut add = |of: ReferenceOf, expected| {
            each.push(Reference {
                name: format!("{axis}, {of}"),
                expected,
                unit: ("µm", 1e6),
            });
        };
        for (along, function) in axis.others().into_iter().zip(&beam.slider) {
            add(ReferenceOf::Slide(along), Expected::Along(function));
        }
        for (along, place) in axis
            .others()
            .into_iter()
            .zip(beam.end_m.into_iter().flatten())
        {
            add(ReferenceOf::End(along), Expected::Still(place));
        }
    }
    each.extend(content.roll.iter().map(|function| Reference {
        name: ReferenceOf::Roll.to_string(),
        expected: Expected::Along(function),
        unit: ("″", ARCSEC),
    }));
    each.extend(content.rolls.iter().map(|it| Reference {
        name: format!("{}, {}", it.axis, ReferenceOf::Roll),
        expected: Expected::Along(&it.roll),
        unit: ("″", ARCSEC),
    }));
    each
}

/// What it is of; by reading, the positions it has values at, and the smallest and largest of these.
pub(super) fn references(content: &BeamReferencesContent) -> String {
    let head =
        content.summary() + "\n  reading              from (mm)   to (mm)    smallest     largest";
    each(content).iter().fold(head, |text, it| {
        let (unit, per_si) = it.unit;
        let row = match &it.expected {
            Expected::Still(value) => {
                let value = value * per_si;
                format!("{:>9} {:>9} {value:>11.3} {value:>11.3}", "–", "–")
            }
            Expected::Along(function) => {
                let (from, to) = ends(&function.positions_m);
                let values = function.values_si.iter().map(|it| it * per_si);
                let low = values.clone().fold(f64::INFINITY, f64::min);
                let high = values.fold(f64::NEG_INFINITY, f64::max);
                let (from, to) = (Short(from * 1e3).to_string(), Short(to * 1e3).to_string());
                format!("{from:>9} {to:>9} {low:>11.3} {high:>11.3}")
            }
        };
        text + &format!("\n  {:<20} {row} {unit}", it.name)
    })
}

fn ends(positions: &[f64]) -> (f64, f64) {
    let first = positions.first().copied().unwrap_or_default();
    (first, positions.last().copied().unwrap_or(first))
}

/// By reading, the largest difference at any position that either has a value at.
pub(crate) fn reference_changes(
    before: &BeamReferencesContent,
    after: &BeamReferencesContent,
) -> Changes {
    let old = each(before);
    let (mut lines, mut values) = (Vec::new(), Vec::new());
    for new in each(after) {
        let old = old.iter().find(|it| it.name == new.name);
        let (unit, per_si) = new.unit;
        let change = old.and_then(|old| difference(&old.expected, &new.expected));
        let change = change.map(|it| it * per_si);
        lines.push(match change {
            Some(change) => format!("  {:<20} {change:.3} {unit}", new.name),
            None => format!("  {:<20} not in both", new.name),
        });
        values.push(json!({"reading": new.name, "unit": unit, "change": change}));
    }
    (lines, values)
}

fn difference(before: &Expected<'_>, after: &Expected<'_>) -> Option<f64> {
    match (before, after) {
        (Expected::Still(before), Expected::Still(after)) => Some((after - before).abs()),
        (Expected::Along(before), Expected::Along(after)) => {
            let function = |it: &FunctionRecord| -> Option<Function<Metres>> {
                it.function("what is compared").ok()
            };
            let (old, new) = (function(before)?, function(after)?);
            let positions = before.positions_m.iter().chain(&after.positions_m);
            let changes = positions.map(|it| {
                let at = Metres(*it);
                (new.at(at) - old.at(at)).value()
            });
            Some(largest(&changes.collect::<Vec<_>>()))
        }
        _ => None,
    }
}
