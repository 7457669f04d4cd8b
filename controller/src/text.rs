//! What a person reads on a terminal.

use compensator::iso230::{Directional, Figures};
use compensator::screw::ScrewModel;
use drivers::transport::LinkState;
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

/// One term of a screw's model.
#[derive(Clone, Debug, PartialEq)]
pub struct ScrewTerm {
    /// What it is.
    pub name: String,
    /// How large, in its unit.
    pub value: f64,
    /// Its standard uncertainty, where anything was repeated.
    pub standard_uncertainty: Option<f64>,
    /// The unit of both.
    pub unit: &'static str,
}

/// The terms of a screw's model, in the units people read.
pub fn screw_terms(model: &ScrewModel) -> Vec<ScrewTerm> {
    let term = |name: &str, value, standard_uncertainty, unit| ScrewTerm {
        name: name.to_owned(),
        value,
        standard_uncertainty,
        unit,
    };
    let um = |length: Option<Metres>| length.map(Metres::um);
    let (offset, lost_motion) = (model.offset.um(), model.lost_motion.um());
    let u_slope = model.u_slope().map(|u| u * 1e3);
    let mut terms = vec![
        term("slope", model.slope * 1e3, u_slope, "µm/mm"),
        term("lost motion", lost_motion, um(model.u_lost_motion()), "µm"),
        term("offset", offset, um(model.u_offset()), "µm"),
    ];
    for (index, harmonic) in model.harmonics.iter().enumerate() {
        let name = format!("amplitude, {} per turn", harmonic.number);
        let u = model.u_harmonic(index).map(|[.., u]| u);
        terms.push(term(&name, harmonic.amplitude().um(), um(u), "µm"));
    }
    terms
}

/// What became of a bus or line.
pub(crate) fn link_text(state: LinkState) -> &'static str {
    match state {
        LinkState::Up => "came back; the machine must be started anew",
        LinkState::Down => {
            "down: the interface was set down (ENETDOWN), or the adapter does not answer any more; \
             set it up and start again"
        }
        LinkState::Gone => "the interface or adapter vanished (ENODEV); plug it in and start again",
    }
}
