//! Charts of several series.

use core::fmt::Write as _;

use super::escape;
use super::svg::{Axes, Frame, grid, opened, padded};

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
    Dashes,
    /// The area that the points go round.
    Band,
    /// From zero to each point.
    Bars,
}

/// A series of points; a line without a name is not in the legend.
#[derive(Clone, Debug)]
pub(crate) struct Series {
    pub(crate) name: &'static str,
    pub(crate) colour: &'static str,
    pub(crate) mark: Mark,
    pub(crate) points: Vec<(f64, f64)>,
}

impl Series {
    pub(crate) const fn new(
        name: &'static str,
        colour: &'static str,
        mark: Mark,
        points: Vec<(f64, f64)>,
    ) -> Self {
        Self {
            name,
            colour,
            mark,
            points,
        }
    }
}

/// A chart of `series` with horizontal lines at `limits`, above and below zero.
pub(crate) fn chart(
    title: &str,
    labels: (&str, &str),
    series: &[Series],
    limit: Option<f64>,
) -> String {
    let limits: Vec<f64> = limit.into_iter().flat_map(|it| [it, -it]).collect();
    let axes = axes_of(series, limits.iter().copied().chain([0.0]));
    drawn(title, labels, series, (&axes, &limits))
}

/// The same of values that lie far from zero, which is not shown.
pub(crate) fn chart_about(title: &str, labels: (&str, &str), series: &[Series]) -> String {
    drawn(
        title,
        labels,
        series,
        (&axes_of(series, core::iter::empty()), &[]),
    )
}

/// Axes that show all points of `series`, and the values `shown`.
pub(crate) fn axes_of(series: &[Series], shown: impl Iterator<Item = f64>) -> Axes {
    let points = || series.iter().flat_map(|it| it.points.iter());
    Axes::new(
        padded(points().map(|it| it.0), 0.02),
        padded(points().map(|it| it.1).chain(shown), 0.06),
    )
}

/// The same on given axes, so that several charts can have one scale.
pub(crate) fn drawn(
    title: &str,
    labels: (&str, &str),
    series: &[Series],
    (axes, limits): (&Axes, &[f64]),
) -> String {
    let frame = axes.frame;
    let mut svg = opened(title, (frame.width, frame.height));
    svg += &grid(axes, labels);
    for limit in limits.iter().copied() {
        let (y, left, right) = (axes.py(limit), frame.left, frame.width - frame.right);
        let _ = write!(
            svg,
            "<line x1=\"{left}\" x2=\"{right}\" y1=\"{y:.1}\" y2=\"{y:.1}\" stroke=\"var(--limit)\" \
             stroke-dasharray=\"6 4\"/>"
        );
    }
    svg += &inked(axes, series);
    svg += &legend(&frame, series);
    svg + "</svg>"
}

/// Each series, one over the other.
pub(crate) fn inked(axes: &Axes, series: &[Series]) -> String {
    let each = series.iter().map(|it| match it.mark {
        Mark::Dots => dots(axes, it),
        Mark::Line => line(axes, it, ""),
        Mark::Dashes => line(axes, it, " stroke-dasharray=\"7 4\""),
        Mark::Band => band(axes, it),
        Mark::Bars => bars(axes, it),
    });
    each.collect()
}

fn dots(axes: &Axes, series: &Series) -> String {
    let colour = series.colour;
    let each = series.points.iter();
    let dots = each.fold(String::new(), |mut svg, (x, y)| {
        let (x, y) = (axes.px(*x), axes.py(*y));
        let _ = write!(svg, "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"2.6\"/>");
        svg
    });
    format!("<g fill=\"{colour}\" opacity=\".6\">{dots}</g>")
}

fn band(axes: &Axes, series: &Series) -> String {
    let (points, colour) = (axes.places(&series.points), series.colour);
    format!("<polygon points=\"{points}\" fill=\"{colour}\" opacity=\".22\"/>")
}

fn line(axes: &Axes, series: &Series, dashes: &str) -> String {
    let points = axes.places(&series.points);
    let colour = series.colour;
    format!(
        "<polyline points=\"{points}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"1.6\"{dashes}/>"
    )
}

/// From zero to each point.
fn bars(axes: &Axes, series: &Series) -> String {
    let each = series.points.iter();
    let path = each.fold(String::new(), |mut path, (x, y)| {
        let _ = write!(
            path,
            "M{:.1},{:.1}V{:.1}",
            axes.px(*x),
            axes.py(0.0),
            axes.py(*y)
        );
        path
    });
    let colour = series.colour;
    format!("<path d=\"{path}\" stroke=\"{colour}\" stroke-width=\"4\"/>")
}

/// What each series that has a name is, above the plot.
pub(crate) fn legend(frame: &Frame, series: &[Series]) -> String {
    let named = series.iter().filter(|it| !it.name.is_empty());
    let entries: Vec<_> = named.map(|it| (it.colour, entry(it))).collect();
    let width = |text: &str| LETTER * text.chars().count() as f64 + APART;
    let all: f64 = entries.iter().map(|(_, text)| width(text)).sum();
    // What the y axis is stands at its left.
    let mut x = frame.width - frame.right - all;
    let mut svg = String::from("<g font-size=\"12\">");
    for (colour, text) in entries {
        let _ = write!(
            svg,
            "<text x=\"{x:.1}\" y=\"14\" fill=\"{colour}\">{}</text>",
            escape(&text)
        );
        x += width(&text);
    }
    svg + "</g>"
}

/// How wide a letter of a legend is, and what is left between two entries.
const LETTER: f64 = 6.8;
const APART: f64 = 16.0;

fn entry(series: &Series) -> String {
    let mark = match series.mark {
        Mark::Dots => '●',
        Mark::Line => '—',
        Mark::Dashes => '┄',
        Mark::Band => '▒',
        Mark::Bars => '▮',
    };
    format!("{mark} {}", series.name)
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
}
