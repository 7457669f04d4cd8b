//! The error functions of two geometries over each other.

use units::Metres;

use super::unit;
use crate::program::page::chart::BLUE;
use crate::program::page::compare::{Pair, overlaid};
use crate::volumetric::{FunctionRecord, GeometryContent};

/// Each function that both have.
pub(super) fn drawn(before: &GeometryContent, after: &GeometryContent) -> String {
    let each = after.functions.iter().filter_map(|new| {
        let old = before.functions.iter().find(|it| it.name == new.name)?;
        let (of, _) = unit(new);
        let axis = new.name.chars().last()?;
        let pair = Pair {
            names: ["before", "after", "change"],
            colour: BLUE,
            before: curve(old),
            after: curve(new),
        };
        let (position, value) = (format!("{axis} (mm)"), format!("{} ({of})", new.name));
        Some(overlaid(&new.name, (&position, &value), &[pair]))
    });
    each.collect()
}

fn curve(function: &FunctionRecord) -> Vec<(f64, f64)> {
    let (_, per_si) = unit(function);
    let nodes = function.positions_m.iter().zip(&function.values_si);
    nodes
        .map(|(at, value)| (Metres(*at).mm(), value * per_si))
        .collect()
}
