//! The stored deviations of a linear axis on the screen.

use serde_json::json;
use units::Metres;

use crate::Failure;
use crate::linear::LinearContent;
use crate::linear::record::NodeRecord;
use crate::program::controls::dcc::Certifiable;
use crate::program::page::chart::{BLUE, ORANGE};
use crate::program::page::compare::{Pair, overlaid};
use crate::program::show::{Changes, Show};
use crate::program::text;

impl Show for LinearContent {
    fn certifiable(&self, axis: &str) -> Result<Certifiable, Failure> {
        Certifiable::linear(axis, self)
    }

    fn lines(&self) -> String {
        let head = format!(
            "{} runs, {}\n  position (mm)   forward (µm)   reverse (µm)        u (µm)",
            self.runs,
            text::closure(self.closure_m.map(Metres)),
        );
        let table = self
            .nodes
            .iter()
            .fold(head, |text, node| text + &node_line(node));
        table + &super::uncertainty::lines(self)
    }

    fn changes(&self, after: &Self) -> Option<Changes> {
        let mut lines = vec!["  position (mm)   Δ forward (µm)   Δ reverse (µm)".to_owned()];
        let mut values = Vec::new();
        for new in &after.nodes {
            let at_it = |old: &&NodeRecord| old.position_m == new.position_m;
            let Some(old) = self.nodes.iter().find(at_it) else {
                continue;
            };
            let change = |new: Option<f64>, old: Option<f64>| Some(new? - old?);
            let (forward, reverse) = (
                change(new.forward_m, old.forward_m),
                change(new.reverse_m, old.reverse_m),
            );
            let position = Metres(new.position_m).mm();
            let (forward_um, reverse_um) = (micrometres(forward), micrometres(reverse));
            lines.push(format!(
                "  {position:>13.3}   {forward_um:>14}   {reverse_um:>14}"
            ));
            values.push(json!({
                "position_mm": position,
                "forward_um": forward.map(|it| Metres(it).um()),
                "reverse_um": reverse.map(|it| Metres(it).um()),
            }));
        }
        if values.is_empty() {
            lines.push("  the two have no position in common".into());
        }
        Some((lines, values))
    }

    fn drawn(&self, after: &Self) -> String {
        let pair = |names, colour, side: fn(&NodeRecord) -> Option<f64>| Pair {
            names,
            colour,
            before: curve(self, side),
            after: curve(after, side),
        };
        let pairs = [
            pair(["before ↑", "after ↑", "↑"], BLUE, |it| it.forward_m),
            pair(["before ↓", "after ↓", "↓"], ORANGE, |it| {
                it.reverse_m
            }),
        ];
        overlaid("Error tables", ("position (mm)", "deviation (µm)"), &pairs)
    }
}

fn curve(content: &LinearContent, side: fn(&NodeRecord) -> Option<f64>) -> Vec<(f64, f64)> {
    let nodes = content.nodes.iter();
    let each = nodes.filter_map(|it| Some((Metres(it.position_m).mm(), Metres(side(it)?).um())));
    each.collect()
}

fn micrometres(metres: Option<f64>) -> String {
    metres.map_or("–".to_owned(), |it| format!("{:.3}", Metres(it).um()))
}

fn node_line(node: &NodeRecord) -> String {
    format!(
        "\n  {:>13.3}   {:>12}   {:>12}   {:>11}",
        Metres(node.position_m).mm(),
        micrometres(node.forward_m),
        micrometres(node.reverse_m),
        micrometres(node.forward_u_m.or(node.reverse_u_m)),
    )
}
