//! Maps of a plane: arrows at their places, both directions at one scale.

use core::fmt::Write as _;

use super::chart::{BLUE, ORANGE};
use super::escape;
use super::svg::{Axes, Frame, grid, opened, step};

/// An arrow of a map: where it begins, and what it shows there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Arrow {
    /// In the map's unit.
    pub(crate) at: (f64, f64),
    /// In the arrows' unit.
    pub(crate) shows: (f64, f64),
}

/// What a map shows.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Map<'a> {
    pub(crate) title: &'a str,
    /// What the directions are, with their unit.
    pub(crate) labels: (&'a str, &'a str),
    /// The unit of what the arrows show.
    pub(crate) unit: &'a str,
    pub(crate) arrows: &'a [Arrow],
    /// The longest arrow of all maps that have one scale; the longest of its own where that is longer.
    pub(crate) longest: f64,
}

/// The longest arrow is this share of the plot's width.
const LONGEST: f64 = 0.12;
/// What is left free around the places, as a share of how far these reach.
const MARGIN: f64 = 0.18;
/// A plot is as wide as it is high.
const SIDE: f64 = 480.0;
const FRAME: Frame = Frame {
    width: 960.0,
    height: 24.0 + SIDE + 44.0,
    left: 64.0,
    right: 960.0 - 64.0 - SIDE,
    top: 24.0,
    bottom: 44.0,
};

/// The length of the longest of `arrows`.
pub(crate) fn longest(arrows: &[Arrow]) -> f64 {
    let lengths = arrows.iter().map(|it| it.shows.0.hypot(it.shows.1));
    lengths.fold(0.0, f64::max)
}

/// The map, with a sample of its arrows beside it.
pub(crate) fn map(map: &Map<'_>) -> String {
    let axes = axes_of(map.arrows);
    let mut svg = opened(map.title, (FRAME.width, FRAME.height));
    svg += &grid(&axes, map.labels);
    svg += &edge();
    let longest = map.longest.max(longest(map.arrows)).max(1e-9);
    let scale = SIDE * LONGEST / longest;
    for it in map.arrows {
        let from = (axes.px(it.at.0), axes.py(it.at.1));
        svg += &arrow(from, (it.shows.0 * scale, -it.shows.1 * scale));
    }
    svg += &sample(longest, scale, map.unit);
    svg + "</svg>"
}

/// A square in which both directions have one scale.
fn axes_of(arrows: &[Arrow]) -> Axes {
    let range = |of: fn(&Arrow) -> f64| {
        let values = arrows.iter().map(of);
        let ends = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), it| {
            (low.min(it), high.max(it))
        });
        if ends.0 > ends.1 { (0.0, 0.0) } else { ends }
    };
    let (x, y) = (range(|it| it.at.0), range(|it| it.at.1));
    let half = ((x.1 - x.0).max(y.1 - y.0) / 2.0).max(1e-9) * (1.0 + 2.0 * MARGIN);
    let about = |it: (f64, f64)| ((it.0 + it.1) / 2.0 - half, (it.0 + it.1) / 2.0 + half);
    Axes {
        x: about(x),
        y: about(y),
        frame: FRAME,
    }
}

fn edge() -> String {
    let (left, top) = (FRAME.left, FRAME.top);
    format!(
        "<rect x=\"{left}\" y=\"{top}\" width=\"{SIDE}\" height=\"{SIDE}\" fill=\"none\" stroke=\"var(--grid)\"/>"
    )
}

/// An arrow of a round length, and what that is.
fn sample(longest: f64, scale: f64, unit: &str) -> String {
    let length = round_below(longest);
    let (x, y) = (FRAME.left + SIDE + 30.0, FRAME.top + 20.0);
    let digits = (-step(length, 1.0).log10().floor()).max(0.0) as usize;
    let mut svg = arrow((x, y), (length * scale, 0.0));
    let _ = write!(
        svg,
        "<text x=\"{x:.1}\" y=\"{:.1}\" font-size=\"12\" fill=\"var(--quiet)\">{length:.digits$} {}</text>",
        y + 20.0,
        escape(unit)
    );
    svg
}

/// The largest of 1, 2 and 5 times a power of ten that is not above `value`.
fn round_below(value: f64) -> f64 {
    let power = 10_f64.powf(value.log10().floor());
    let factors = [5.0, 2.0];
    let factor = factors.into_iter().find(|it| it * power <= value);
    factor.unwrap_or(1.0) * power
}

/// A line with a dot where it begins and a head where it ends.
fn arrow((x, y): (f64, f64), (dx, dy): (f64, f64)) -> String {
    let (end_x, end_y, length) = (x + dx, y + dy, dx.hypot(dy));
    let head = length.min(6.0);
    let (along_x, along_y) = match length > 0.0 {
        true => (dx / length * head, dy / length * head),
        false => (0.0, 0.0),
    };
    let side = |sign: f64| {
        let (across_x, across_y) = (-along_y * 0.4 * sign, along_x * 0.4 * sign);
        (end_x - along_x + across_x, end_y - along_y + across_y)
    };
    let ((ax, ay), (bx, by)) = (side(1.0), side(-1.0));
    format!(
        "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"2.4\" fill=\"{BLUE}\"/><path d=\"M{x:.1},{y:.1}L{end_x:.1},{end_y:.1}\
         M{ax:.1},{ay:.1}L{end_x:.1},{end_y:.1}L{bx:.1},{by:.1}\" fill=\"none\" stroke=\"{ORANGE}\" stroke-width=\"1.6\"/>"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drawn(arrows: &[Arrow]) -> String {
        map(&Map {
            title: "errors",
            labels: ("x (mm)", "y (mm)"),
            unit: "µm",
            arrows,
            longest: 0.0,
        })
    }

    #[test]
    fn the_longest_arrow_fits_and_nothing_is_drawn_of_nothing() {
        let it = Arrow {
            at: (1.0, 1.0),
            shows: (0.0, 2.0),
        };
        let svg = drawn(&[it]);
        assert!(svg.contains(">2 µm<"), "{svg}");
        assert!(!drawn(&[]).contains("NaN"));
    }
}
