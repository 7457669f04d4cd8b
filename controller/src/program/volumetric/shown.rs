//! The stored errors of three axes on the screen.

use serde_json::json;

use crate::program::show::{Changes, Show};
use crate::volumetric::{
    BeamReferencesContent, FunctionRecord, GeometryContent, StateMemoryContent,
};

impl Show for GeometryContent {
    fn lines(&self) -> String {
        shown(self)
    }

    fn changes(&self, after: &Self) -> Option<Changes> {
        Some(changes(self, after))
    }
}

impl Show for BeamReferencesContent {
    fn lines(&self) -> String {
        self.summary()
    }

    fn changes(&self, _: &Self) -> Option<Changes> {
        None
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
    let mut text = content.functions.iter().fold(head, |text, it| {
        let unit = unit(it);
        let u = it.standard_uncertainties_si.as_deref().map(largest);
        let u = u.map_or("–".into(), |u| format!("{:.3}", u * unit.1));
        let (count, value) = (it.positions_m.len(), largest(&it.values_si) * unit.1);
        let row = format!(
            "\n  {:<8} {count:>6}   {value:.3} {}   {u}",
            it.name, unit.0
        );
        text + &row
    });
    let names = ["y to x", "z to x", "z to y"];
    let squareness = content.squareness_rad.iter().zip(content.squareness_u_rad);
    for (name, (value, u)) in names.iter().zip(squareness) {
        let (value, u) = (value * ARCSEC, u * ARCSEC);
        text += &format!("\n  {name}: {value:.3} arcsec, u {u:.3} arcsec");
    }
    text
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
        Some('a' | 'b' | 'c') => ("arcsec", ARCSEC),
        _ => ("µm", 1e6),
    }
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |largest, it| largest.max(it.abs()))
}
