//! A curve over a turn as a polar plot: a circle where it is zero, and the curve in or outside of it.

use core::f64::consts::TAU;
use core::fmt::Write as _;

use super::band::Sure;
use super::chart::{BLUE, ORANGE};
use super::escape;
use super::svg::{label, opened, step};

const WIDTH: f64 = 960.0;
const HEIGHT: f64 = 520.0;
const CENTRE: (f64, f64) = (320.0, 260.0);
/// Where zero is, and how far to both sides the curve reaches, in units of the picture.
const ZERO: f64 = 150.0;
const REACH: f64 = 72.0;
/// Where the angles are written.
const RIM: f64 = 240.0;
/// In which direction the circles' values are written, between two rays.
const LABELS: f64 = 75.0;

/// The curve, by degrees, with twice its standard uncertainty times `factor` shaded; its values are in `unit`.
pub(crate) fn polar(title: &str, unit: &str, curve: &[Sure], factor: f64) -> String {
    let most = curve.iter().map(|it| it.1.abs()).fold(1e-9, f64::max);
    let radius = |value: f64| ZERO + (value / most).clamp(-2.0, 2.0) * REACH;
    let at = |degrees: f64, value: f64| place(degrees, radius(value));
    let mut svg = opened(title, (WIDTH, HEIGHT));
    svg += &rays();
    svg += &circles(most, radius);
    let edge = |sign: f64| {
        let of = move |(degrees, value, u): &Sure| at(*degrees, value + sign * 2.0 * factor * u);
        places(curve.iter().map(of))
    };
    if curve.iter().any(|it| it.2 > 0.0) {
        let _ = write!(
            svg,
            "<path d=\"M{}Z M{}Z\" fill-rule=\"evenodd\" fill=\"{ORANGE}\" opacity=\".22\"/>",
            edge(1.0),
            edge(-1.0)
        );
    }
    let line = places(curve.iter().map(|(degrees, value, _)| at(*degrees, *value)));
    let _ = write!(
        svg,
        "<path d=\"M{line}Z\" fill=\"none\" stroke=\"{BLUE}\" stroke-width=\"1.6\"/>"
    );
    svg += &labels(most, radius, unit);
    svg + "</svg>"
}

/// Angles count from the right, against the clock.
fn place(degrees: f64, radius: f64) -> (f64, f64) {
    let (sine, cosine) = (degrees / 360.0 * TAU).sin_cos();
    (CENTRE.0 + radius * cosine, CENTRE.1 - radius * sine)
}

fn places(each: impl Iterator<Item = (f64, f64)>) -> String {
    each.fold(String::new(), |mut text, (x, y)| {
        let _ = write!(text, "{x:.1},{y:.1} ");
        text
    })
}

/// Zero, and round values to both sides of it that `most` reaches; with their step.
fn round_values(most: f64) -> (impl Iterator<Item = f64>, f64) {
    let step = step(most, 2.0);
    let values = [-2.0, -1.0, 0.0, 1.0, 2.0].map(|at| at * step);
    let shown = values.into_iter().filter(move |it| it.abs() <= most * 1.2);
    (shown, step)
}

fn circles(most: f64, radius: impl Fn(f64) -> f64) -> String {
    let (x, y) = CENTRE;
    let (values, _) = round_values(most);
    let circles = values.fold(String::new(), |mut svg, value| {
        let (r, is_zero) = (radius(value), value == 0.0);
        let colour = if is_zero {
            "var(--zero)"
        } else {
            "var(--grid)"
        };
        let _ = write!(
            svg,
            "<circle cx=\"{x}\" cy=\"{y}\" r=\"{r:.1}\" stroke=\"{colour}\"/>"
        );
        svg
    });
    format!("<g fill=\"none\">{circles}</g>")
}

/// What the circles stand for, on a ground of its own: the curve may pass beneath.
fn labels(most: f64, radius: impl Fn(f64) -> f64, unit: &str) -> String {
    let (values, step) = round_values(most);
    let unit = escape(unit);
    let labels = values.fold(String::new(), |mut svg, value| {
        let (text, (x, y)) = (label(value, step), place(LABELS, radius(value)));
        let _ = write!(
            svg,
            "<text x=\"{x:.1}\" y=\"{:.1}\">{text} {unit}</text>",
            y + 4.0
        );
        svg
    });
    format!(
        "<g font-size=\"12\" fill=\"var(--quiet)\" stroke=\"var(--paper)\" stroke-width=\"4\" paint-order=\"stroke\" \
         text-anchor=\"middle\">{labels}</g>"
    )
}

fn rays() -> String {
    let mut svg = String::from("<g font-size=\"12\" fill=\"var(--quiet)\" text-anchor=\"middle\">");
    for thirtieth in 0..12_u8 {
        let degrees = f64::from(thirtieth) * 30.0;
        let ((ax, ay), (bx, by)) = (place(degrees, 40.0), place(degrees, RIM - 14.0));
        let (x, y) = place(degrees, RIM);
        let _ = write!(
            svg,
            "<line x1=\"{ax:.1}\" y1=\"{ay:.1}\" x2=\"{bx:.1}\" y2=\"{by:.1}\" stroke=\"var(--grid)\"/>\
             <text x=\"{x:.1}\" y=\"{:.1}\">{degrees}°</text>",
            y + 4.0
        );
    }
    svg + "</g>"
}
