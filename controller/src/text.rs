//! What a person reads on a terminal.

use compensator::iso230::{Directional, Figures};
use units::Metres;

/// A row of a table of figures: name, symbol, and the figure of each column.
pub(crate) type Row = (&'static str, &'static str, fn(&Figures) -> Metres);

pub(crate) const ROWS: &[Row] = &[
    ("accuracy, bidirectional", "A", |it| {
        it.accuracy.bidirectional
    }),
    ("accuracy, forward", "A↑", |it| it.accuracy.forward),
    ("accuracy, reverse", "A↓", |it| it.accuracy.reverse),
    ("repeatability, bidirectional", "R", |it| {
        it.repeatability.bidirectional
    }),
    ("repeatability, forward", "R↑", |it| {
        it.repeatability.forward
    }),
    ("repeatability, reverse", "R↓", |it| {
        it.repeatability.reverse
    }),
    ("systematic deviation", "E", |it| {
        it.systematic_deviation.bidirectional
    }),
    ("range of the mean deviation", "M", |it| {
        it.mean_bidirectional_deviation_range
    }),
    ("reversal value", "B", |it| it.reversal_value),
    ("mean reversal value", "B̄", |it| it.mean_reversal_value),
];

/// ISO 230-2 figures side by side, micrometres.
pub fn figures_table(columns: &[(&str, &Figures)]) -> String {
    let mut text = format!("{:<30} {:>3}", "ISO 230-2 (µm)", "");
    for (title, _) in columns {
        text += &format!(" {title:>22}");
    }
    for (name, symbol, figure) in ROWS {
        // A combining mark takes no column of its own.
        let width = if symbol.contains('\u{304}') { 4 } else { 3 };
        text += &format!("\n  {name:<28} {symbol:>width$}");
        for (_, figures) in columns {
            text += &format!(" {:>22.3}", figure(figures).um());
        }
    }
    text
}

/// The largest mean deviation's magnitude: what "as found ±x µm" means.
pub fn largest_deviation(figures: &Figures) -> Metres {
    figures
        .targets
        .iter()
        .flat_map(|target| [target.mean_forward, target.mean_reverse])
        .fold(Metres::ZERO, |largest, deviation| {
            largest.max(deviation.abs())
        })
}

/// One line: `A = 1.234 µm (↑ 1.0, ↓ 1.1)`.
pub fn accuracy_line(accuracy: &Directional) -> String {
    format!(
        "A = {:.3} µm (forward {:.3}, reverse {:.3})",
        accuracy.bidirectional.um(),
        accuracy.forward.um(),
        accuracy.reverse.um()
    )
}
