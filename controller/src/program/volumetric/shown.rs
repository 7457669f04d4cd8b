//! The stored errors of three axes on the screen.

mod difference;
mod references;

use serde_json::json;

use crate::Failure;
use crate::program::budget;
use crate::program::controls::dcc::Certifiable;
use crate::program::show::{Changes, Show};
use crate::program::volumetric::uncertainty;
use crate::volumetric::{
    BeamReferencesContent, FunctionRecord, GeometryContent, StateMemoryContent,
};
use references::references;

pub(crate) use references::reference_changes;

impl Show for GeometryContent {
    fn certifiable(&self, _axis: &str) -> Result<Certifiable, Failure> {
        Certifiable::volume(self)
    }

    fn lines(&self) -> String {
        shown(self)
    }

    fn changes(&self, after: &Self) -> Option<Changes> {
        Some(changes(self, after))
    }

    fn drawn(&self, after: &Self) -> String {
        difference::drawn(self, after)
    }
}

impl Show for BeamReferencesContent {
    fn lines(&self) -> String {
        references(self)
    }

    fn changes(&self, after: &Self) -> Option<Changes> {
        Some(reference_changes(self, after))
    }
}

impl Show for StateMemoryContent {
    fn lines(&self) -> String {
        self.summary()
    }

    fn changes(&self, _: &Self) -> Option<Changes> {
        None
    }
}

/// How well the readings agree; by name, each function's largest value and uncertainty; the
/// squarenesses.
pub(crate) fn shown(content: &GeometryContent) -> String {
    let agreement = content.agreement.as_ref();
    let agreement = agreement.map(|it| format!("{}\n  {}", it.readings_text(), it.tool_text()));
    let head = agreement.unwrap_or_default() + "\n  error     nodes   largest        u (largest)";
    let mut text = errors(content).fold(head, |text, it| {
        let u = it.u.map_or("–".into(), |u| format!("{u:.3}"));
        let row = format!(
            "\n  {:<8} {:>6}   {:.3} {}   {u}",
            it.name, it.nodes, it.largest, it.unit
        );
        text + &row
    });
    for (name, value, u) in squarenesses(content) {
        text += &format!("\n  {name}: {value:+.3} ″, u {u:.3} ″");
    }
    text + &budget::lines(uncertainty::worst(content.budget.as_ref()))
}

/// What is shown of an error function, in micrometres or arcseconds.
pub(crate) struct ShownError<'a> {
    pub(crate) name: &'a str,
    pub(crate) nodes: usize,
    /// The largest at a node, whatever its sign.
    pub(crate) largest: f64,
    /// The largest standard uncertainty at a node.
    pub(crate) u: Option<f64>,
    pub(crate) unit: &'static str,
}

/// Each error function.
pub(crate) fn errors(content: &GeometryContent) -> impl Iterator<Item = ShownError<'_>> {
    content.functions.iter().map(|it| {
        let (name, per_si) = unit(it);
        let u = it.standard_uncertainties_si.as_deref();
        ShownError {
            name: &it.name,
            nodes: it.positions_m.len(),
            largest: largest(&it.values_si) * per_si,
            u: u.map(|u| largest(u) * per_si),
            unit: name,
        }
    })
}

/// Each squareness and its standard uncertainty, in arcseconds.
pub(crate) fn squarenesses(content: &GeometryContent) -> Vec<(&'static str, f64, f64)> {
    let values = content.squareness_rad.iter().zip(content.squareness_u_rad);
    let names = ["y to x", "z to x", "z to y"].into_iter();
    let each = names.zip(values);
    each.map(|(name, (value, u))| (name, value * ARCSEC, u * ARCSEC))
        .collect()
}

/// Two stored geometries, for `cal diff`: the largest change of each function at its nodes.
fn changes(before: &GeometryContent, after: &GeometryContent) -> Changes {
    let mut lines = vec!["  error      largest Δ".to_owned()];
    let mut values = Vec::new();
    for new in &after.functions {
        let old = before.functions.iter().find(|it| it.name == new.name);
        let Some(old) = old.filter(|it| it.positions_m == new.positions_m) else {
            lines.push(format!("  {:<8} other nodes", new.name));
            values.push(json!({"error": new.name, "change": null}));
            continue;
        };
        let pairs = new.values_si.iter().zip(&old.values_si);
        let differences: Vec<f64> = pairs.map(|(new, old)| new - old).collect();
        let (name, per_si) = unit(new);
        let change = largest(&differences) * per_si;
        lines.push(format!("  {:<8} {change:.3} {name}", new.name));
        values.push(json!({"error": new.name, "unit": name, "change": change}));
    }
    (lines, values)
}

const ARCSEC: f64 = 180.0 * 3600.0 / core::f64::consts::PI;

/// Displacements are called after their direction, tilts after a, b and c.
fn unit(function: &FunctionRecord) -> (&'static str, f64) {
    match function.name.chars().nth(2) {
        Some('a' | 'b' | 'c') => ("″", ARCSEC),
        _ => ("µm", 1e6),
    }
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |largest, it| largest.max(it.abs()))
}
