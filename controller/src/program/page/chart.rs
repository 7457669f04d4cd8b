//! Charts of several series, and maps with arrows.

use core::fmt::Write as _;

use super::escape;
use super::svg::{Axes, BOTTOM, HEIGHT, LEFT, RIGHT, TOP, WIDTH, grid, padded};

/// Colours that are told apart also without red and green.
pub(crate) const BLUE: &str = "var(--first)";
pub(crate) const ORANGE: &str = "var(--second)";
pub(crate) const GREEN: &str = "var(--third)";

/// For series that have no colour of their own.
pub(crate) const COLOURS: [&str; 6] = [
    BLUE,
    ORANGE,
    GREEN,
    "var(--fourth)",
    "var(--fifth)",
    "var(--sixth)",
];

/// How a series is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Mark {
    Dots,
    Line,
    /// The area that the points go round.
    Band,
}

/// A series of points; a line without a name is not in the legend.
#[derive(Clone, Debug)]
pub(crate) struct Series {
    pub(crate) name: &'static str,
    pub(crate) colour: &'static str,
    pub(crate) mark: Mark,
    pub(crate) points: Vec<(f64, f64)>,
}

/// A chart of `series` with horizontal lines at `limits`, above and below zero.
pub(crate) fn chart(
    title: &str,
    labels: (&str, &str),
    series: &[Series],
    limit: Option<f64>,
) -> String {
    let limits: Vec<f64> = limit.into_iter().flat_map(|it| [it, -it]).collect();
    let shown = limits.iter().copied().chain([0.0]);
    drawn(title, labels, series, shown, &limits)
}

/// The same of values that lie far from zero, which is not shown.
pub(crate) fn chart_about(title: &str, labels: (&str, &str), series: &[Series]) -> String {
    drawn(title, labels, series, core::iter::empty(), &[])
}

pub(crate) fn drawn(
    title: &str,
    labels: (&str, &str),
    series: &[Series],
    shown: impl Iterator<Item = f64>,
    limits: &[f64],
) -> String {
    let points = || series.iter().flat_map(|it| it.points.iter());
    let axes = Axes {
        x: padded(points().map(|it| it.0), 0.02),
        y: padded(points().map(|it| it.1).chain(shown), 0.06),
    };
    let mut svg = opened(title, HEIGHT);
    svg += &grid(&axes, labels);
    for limit in limits.iter().copied() {
        let (y, right) = (axes.py(limit), WIDTH - RIGHT);
        let _ = write!(
            svg,
            "<line x1=\"{LEFT}\" x2=\"{right}\" y1=\"{y:.1}\" y2=\"{y:.1}\" stroke=\"var(--limit)\" \
             stroke-dasharray=\"6 4\"/>"
        );
    }
    for it in series {
        svg += &match it.mark {
            Mark::Dots => dots(&axes, it),
            Mark::Line => line(&axes, it),
            Mark::Band => band(&axes, it),
        };
    }
    svg += &legend(series);
    svg + "</svg>"
}

pub(crate) fn opened(title: &str, height: f64) -> String {
    let title = escape(title);
    format!("<svg viewBox=\"0 0 {WIDTH} {height}\" role=\"img\"><title>{title}</title>")
}

pub(crate) fn dots(axes: &Axes, series: &Series) -> String {
    series.points.iter().fold(String::new(), |mut svg, (x, y)| {
        let (x, y, colour) = (axes.px(*x), axes.py(*y), series.colour);
        let _ = write!(
            svg,
            "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"2.6\" fill=\"{colour}\" opacity=\".6\"/>"
        );
        svg
    })
}

pub(crate) fn places(axes: &Axes, series: &Series) -> String {
    let points = series.points.iter();
    points.fold(String::new(), |mut text, (x, y)| {
        let _ = write!(text, "{:.1},{:.1} ", axes.px(*x), axes.py(*y));
        text
    })
}

pub(crate) fn band(axes: &Axes, series: &Series) -> String {
    let (points, colour) = (places(axes, series), series.colour);
    format!("<polygon points=\"{points}\" fill=\"{colour}\" opacity=\".22\"/>")
}

pub(crate) fn line(axes: &Axes, series: &Series) -> String {
    let points = places(axes, series);
    let colour = series.colour;
    format!(
        "<polyline points=\"{points}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"1.6\"/>"
    )
}

pub(crate) fn legend(series: &[Series]) -> String {
    let named: Vec<_> = series.iter().filter(|it| !it.name.is_empty()).collect();
    // What the y axis is stands at its left.
    let room = WIDTH - RIGHT - LEFT - 300.0;
    let width = (room / named.len().max(1) as f64).min(150.0);
    let first = WIDTH - RIGHT - width * named.len() as f64;
    let mut svg = String::from("<g font-size=\"12\">");
    for (at, it) in named.iter().enumerate() {
        let mark = match it.mark {
            Mark::Dots => '●',
            Mark::Line => '—',
            Mark::Band => '▒',
        };
        let (x, colour) = (first + width * at as f64, it.colour);
        let name = escape(it.name);
        let _ = write!(
            svg,
            "<text x=\"{x}\" y=\"14\" fill=\"{colour}\">{mark} {name}</text>"
        );
    }
    svg + "</g>"
}

/// An arrow of a map: where it begins, and what it shows there.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Arrow {
    /// In the map's unit.
    pub(crate) at: (f64, f64),
    /// In the arrows' unit.
    pub(crate) shows: (f64, f64),
}

/// How high a map is drawn.
pub(crate) const MAP_HEIGHT: f64 = 560.0;

/// Arrows at their places in the plane, both directions at one scale; the length of the longest
/// stands beside a sample.
pub(crate) fn map(title: &str, unit: &str, arrows_unit: &str, arrows: &[Arrow]) -> String {
    let reach = arrows
        .iter()
        .flat_map(|it| [it.at.0.abs(), it.at.1.abs()])
        .fold(1e-9, f64::max)
        * 1.4;
    let longest = arrows
        .iter()
        .map(|it| it.shows.0.hypot(it.shows.1))
        .fold(1e-9, f64::max);
    let half = (MAP_HEIGHT - TOP - BOTTOM) / 2.0;
    let (middle_x, middle_y) = (WIDTH / 2.0, TOP + half);
    let scale = half / reach;
    // The longest arrow is an eighth of the map.
    let arrow_scale = half / 4.0 / longest;
    let mut svg = opened(title, MAP_HEIGHT);
    svg += &cross((middle_x, middle_y), half, reach, unit);
    for it in arrows {
        let (x, y) = (middle_x + it.at.0 * scale, middle_y - it.at.1 * scale);
        let (dx, dy) = (it.shows.0 * arrow_scale, -it.shows.1 * arrow_scale);
        svg += &arrow((x, y), (dx, dy));
    }
    let sample = round_below(longest);
    let (x, y) = (middle_x + half + 30.0, TOP + 20.0);
    svg += &arrow((x, y), (sample * arrow_scale, 0.0));
    let _ = write!(
        svg,
        "<text x=\"{x:.1}\" y=\"{:.1}\" font-size=\"12\" fill=\"var(--quiet)\">{sample} {}</text></svg>",
        y + 20.0,
        escape(arrows_unit)
    );
    svg
}

pub(crate) fn cross((x, y): (f64, f64), half: f64, reach: f64, unit: &str) -> String {
    let (left, right, top, bottom) = (x - half, x + half, y - half, y + half);
    let unit = escape(unit);
    format!(
        "<g stroke=\"var(--grid)\"><rect x=\"{left:.1}\" y=\"{top:.1}\" width=\"{0:.1}\" \
         height=\"{0:.1}\" fill=\"none\"/><line x1=\"{left:.1}\" x2=\"{right:.1}\" y1=\"{y:.1}\" \
         y2=\"{y:.1}\"/><line x1=\"{x:.1}\" x2=\"{x:.1}\" y1=\"{top:.1}\" \
         y2=\"{bottom:.1}\"/></g><g font-size=\"12\" fill=\"var(--quiet)\"><text x=\"{left:.1}\" \
         y=\"{1:.1}\">x from {2:.2} to {reach:.2} {unit}, the same for y</text></g>",
        2.0 * half,
        bottom + 18.0,
        -reach
    )
}

/// The largest of 1, 2 and 5 times a power of ten that is not above `value`.
pub(crate) fn round_below(value: f64) -> f64 {
    let power = 10_f64.powf(value.log10().floor());
    let factors = [5.0, 2.0];
    let factor = factors.into_iter().find(|it| it * power <= value);
    factor.unwrap_or(1.0) * power
}

/// A line with a dot where it begins.
pub(crate) fn arrow((x, y): (f64, f64), (dx, dy): (f64, f64)) -> String {
    format!(
        "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"2.4\" fill=\"{BLUE}\"/><line x1=\"{x:.1}\" y1=\"{y:.1}\" \
         x2=\"{:.1}\" y2=\"{:.1}\" stroke=\"{ORANGE}\" stroke-width=\"1.6\"/>",
        x + dx,
        y + dy
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_chart_draws_every_point_and_names_every_series_once() {
        let series = |name, mark| Series {
            name,
            colour: BLUE,
            mark,
            points: vec![(0.0, 1.0), (1.0, -1.0), (2.0, 0.5)],
        };
        let all = [series("seen", Mark::Dots), series("model", Mark::Line)];
        let svg = chart("a < b", ("x", "y"), &all, Some(2.0));
        assert_eq!(svg.matches("<circle").count(), 3);
        assert_eq!(svg.matches("<polyline").count(), 1);
        assert_eq!(svg.matches("stroke-dasharray").count(), 2);
        assert!(svg.contains("● seen") && svg.contains("— model") && svg.contains("a &lt; b"));
    }

    #[test]
    fn the_longest_arrow_fits_and_nothing_is_drawn_of_nothing() {
        let it = Arrow {
            at: (1.0, 1.0),
            shows: (0.0, 2.0),
        };
        let svg = map("errors", "mm", "µm", &[it]);
        assert!(svg.contains(">2 µm<"), "{svg}");
        assert!(!map("errors", "mm", "µm", &[]).contains("NaN"));
    }
}
