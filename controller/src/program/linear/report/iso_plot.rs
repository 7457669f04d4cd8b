//! The plot of ISO 230-2 as metrologists know it: each deviation, the means of both approaches with bands of ± 2 s,
//! the mean of both, and beside it where A, E, M, R and B come from.

use compensator::iso230::{Figures, TargetFigures};
use units::Metres;

use super::Section;
use crate::program::page::chart::{BLUE, GREEN, Mark, ORANGE, Series, inked, legend};
use crate::program::page::dimension::{COLUMN, Dimension, dimensions};
use crate::program::page::svg::{Axes, Frame, grid, opened, padded};

const LABELS: (&str, &str) = ("target (mm)", "deviation (µm)");
/// Figures beside the plot.
const BESIDE: f64 = 5.0;
const FRAME: Frame = Frame {
    height: 380.0,
    right: COLUMN * BESIDE + 20.0,
    ..Frame::USUAL
};

/// What a section's deviations and bands lie between, micrometres.
pub(super) fn extent(section: &Section<'_>) -> [f64; 2] {
    let bands = section.figures.targets.iter().flat_map(|it| {
        let (up, down) = (band_of(it, Side::Up), band_of(it, Side::Down));
        [up.0, up.1, down.0, down.1]
    });
    let seen = section
        .points
        .iter()
        .map(|it| um(it.measured_m - it.target_m));
    let all = bands.chain(seen).chain([0.0]);
    all.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], it| {
        [low.min(it), high.max(it)]
    })
}

/// The plot of `section`; what it lies between with others at one scale is `extent`.
pub(super) fn iso_plot(section: &Section<'_>, extent: [f64; 2]) -> String {
    let figures = section.figures;
    let axes = Axes {
        x: padded(figures.targets.iter().map(|it| it.target.mm()), 0.03),
        y: padded(extent.into_iter(), 0.06),
        frame: FRAME,
    };
    let series = series(section);
    let title = format!("Deviation {}", section.title);
    let mut svg = opened(&title, (FRAME.width, FRAME.height));
    svg += &grid(&axes, LABELS);
    svg += &dimensions(&axes, &of_figures(figures));
    svg += &inked(&axes, &series);
    svg += &legend(&FRAME, &series);
    svg + "</svg>"
}

fn um(metres: f64) -> f64 {
    Metres(metres).um()
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Side {
    Up,
    Down,
}

fn mean_of(it: &TargetFigures, side: Side) -> f64 {
    match side {
        Side::Up => it.mean_forward.um(),
        Side::Down => it.mean_reverse.um(),
    }
}

/// From mean − 2 s to mean + 2 s.
fn band_of(it: &TargetFigures, side: Side) -> (f64, f64) {
    let s = match side {
        Side::Up => it.s_forward.um(),
        Side::Down => it.s_reverse.um(),
    };
    let mean = mean_of(it, side);
    (mean - 2.0 * s, mean + 2.0 * s)
}

fn series(section: &Section<'_>) -> Vec<Series> {
    let mut series = Vec::new();
    let targets = &section.figures.targets;
    let sides = [
        (Side::Up, '+', "mean ↑", BLUE),
        (Side::Down, '-', "mean ↓", ORANGE),
    ];
    for (side, _, _, colour) in sides {
        let edge = |end: fn((f64, f64)) -> f64| {
            let at = move |it: &TargetFigures| (it.target.mm(), end(band_of(it, side)));
            targets.iter().map(at)
        };
        let around = edge(|it| it.1).chain(edge(|it| it.0).rev());
        series.push(Series::new("± 2 s", colour, Mark::Band, around.collect()));
    }
    for (side, approach, name, colour) in sides {
        let own = section.points.iter().filter(|it| it.approach == approach);
        let seen = own.map(|it| (Metres(it.target_m).mm(), um(it.measured_m - it.target_m)));
        series.push(Series::new("", colour, Mark::Dots, seen.collect()));
        let means = targets.iter().map(|it| (it.target.mm(), mean_of(it, side)));
        series.push(Series::new(name, colour, Mark::Line, means.collect()));
    }
    let both = targets.iter();
    let both = both.map(|it| (it.target.mm(), it.mean_bidirectional().um()));
    series.push(Series::new(
        "mean of both",
        GREEN,
        Mark::Dashes,
        both.collect(),
    ));
    series
}

/// A place of the plot: where, and what the deviation is there.
type Place = (f64, f64);

/// The lowest and the highest of some places.
fn ends(places: impl Iterator<Item = Place> + Clone) -> [Place; 2] {
    let by_value = |a: &Place, b: &Place| a.1.total_cmp(&b.1);
    let low = places.clone().min_by(by_value).unwrap_or_default();
    [low, places.max_by(by_value).unwrap_or_default()]
}

/// Where the figures come from: the values are those of the figures, the ends only where they are drawn.
fn of_figures(figures: &Figures) -> Vec<Dimension<'static>> {
    let each = || {
        let targets = figures.targets.iter();
        targets.flat_map(|it| [Side::Up, Side::Down].map(|side| (it, side)))
    };
    let bands = each().flat_map(|(it, side)| {
        let (low, high) = band_of(it, side);
        [low, high].map(|um| (it.target.mm(), um))
    });
    let means = each().map(|(it, side)| (it.target.mm(), mean_of(it, side)));
    let both = figures.targets.iter();
    let both = both.map(|it| (it.target.mm(), it.mean_bidirectional().um()));
    let dimension = |symbol, value: Metres, ends| Dimension {
        symbol,
        value: value.um(),
        ends,
    };
    let mut all = vec![
        dimension("A", figures.accuracy.bidirectional, ends(bands)),
        dimension("E", figures.systematic_deviation.bidirectional, ends(means)),
        dimension("M", figures.mean_bidirectional_deviation_range, ends(both)),
    ];
    let largest = |of: fn(&TargetFigures) -> Metres| {
        let targets = figures.targets.iter();
        targets.max_by(|a, b| of(a).abs().value().total_cmp(&of(b).abs().value()))
    };
    if let Some(it) = largest(|it| it.repeatability) {
        let value = figures.repeatability.bidirectional;
        all.push(dimension("R", value, repeatability_of(it)));
    }
    if let Some(it) = largest(|it| it.reversal_value) {
        let places = [Side::Up, Side::Down].map(|side| (it.target.mm(), mean_of(it, side)));
        all.push(dimension("B", figures.reversal_value, places));
    }
    all
}

/// What the bidirectional repeatability spans at a target: one band, or both.
fn repeatability_of(it: &TargetFigures) -> [Place; 2] {
    let sides = [
        (it.repeatability_forward, Side::Up),
        (it.repeatability_reverse, Side::Down),
    ];
    let (up, down) = (band_of(it, Side::Up), band_of(it, Side::Down));
    let alone = sides.into_iter().find(|(own, _)| *own >= it.repeatability);
    let (low, high) = match alone {
        Some((_, side)) => band_of(it, side),
        None => (up.0.min(down.0), up.1.max(down.1)),
    };
    [low, high].map(|um| (it.target.mm(), um))
}
