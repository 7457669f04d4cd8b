//! The error table of a linear axis: its curves with their uncertainty, then each position.

use core::fmt::Write as _;

use units::Metres;

use crate::linear::LinearContent;
use crate::linear::record::NodeRecord;
use crate::program::page::band::{Sure, band, enlargement, said};
use crate::program::page::chart::{BLUE, Mark, ORANGE, Series, chart};
use crate::program::text;

/// Both curves, then the table.
pub(super) fn html(content: &LinearContent) -> String {
    let largest = content.table("").ok();
    let largest = largest.map_or("–".into(), |it| format!("{:.3} µm", it.largest().um()));
    format!(
        "<p>{} positions, largest deviation {largest}, {} runs, {}</p>{}{}",
        content.nodes.len(),
        content.runs,
        text::closure(content.closure_m.map(Metres)),
        curves(content),
        table(content)
    )
}

/// A side of a node: the deviation, and its standard uncertainty.
type Side = fn(&NodeRecord) -> Option<(f64, f64)>;

fn curves(content: &LinearContent) -> String {
    let sides: [(&str, &str, Side); 2] = [
        ("forward ↑", BLUE, |it| {
            Some((it.forward_m?, it.forward_u_m.unwrap_or(0.0)))
        }),
        ("reverse ↓", ORANGE, |it| {
            Some((it.reverse_m?, it.reverse_u_m.unwrap_or(0.0)))
        }),
    ];
    let curve = |side: Side| -> Vec<Sure> {
        let nodes = content.nodes.iter();
        let um = |metres: f64| Metres(metres).um();
        nodes
            .filter_map(|it| {
                let (deviation, u) = side(it)?;
                Some((Metres(it.position_m).mm(), um(deviation), um(u)))
            })
            .collect()
    };
    let curves = sides.map(|(name, colour, side)| (name, colour, curve(side)));
    let factor = enlargement(curves.iter().map(|it| it.2.as_slice()));
    let bands = curves
        .iter()
        .map(|(_, colour, it)| band("", colour, it, factor));
    let lines = curves.iter().map(|(name, colour, it)| {
        let points = it.iter().map(|(x, y, _)| (*x, *y)).collect();
        Series::new(name, colour, Mark::Line, points)
    });
    let series: Vec<_> = bands
        .chain(lines)
        .filter(|it| !it.points.is_empty())
        .collect();
    let labels = ("position (mm)", "deviation (µm)");
    let svg = chart("Error table and its uncertainty", labels, &series, None);
    format!("<figure>{svg}</figure>{}", said(factor))
}

fn table(content: &LinearContent) -> String {
    let cell = |value: Option<f64>| {
        value.map_or("–".to_owned(), |metres| {
            format!("{:.3}", Metres(metres).um())
        })
    };
    let mut html = String::from(
        "<table><tr><th>position (mm)</th><th>deviation ↑ (µm)</th><th>deviation ↓ (µm)</th>\
         <th>u ↑ (µm)</th><th>u ↓ (µm)</th></tr>",
    );
    for node in &content.nodes {
        let _ = write!(
            html,
            "<tr><td>{:.3}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>",
            Metres(node.position_m).mm(),
            cell(node.forward_m),
            cell(node.reverse_m),
            cell(node.forward_u_m),
            cell(node.reverse_u_m)
        );
    }
    html + "</table>"
}
