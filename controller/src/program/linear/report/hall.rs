//! The Hall sweep of a zero: both sensors' voltages over the way, and the patent's points.

use core::fmt::Write as _;

use units::Metres;

use crate::linear::{HallSweepEntry, ZeroEntry};
use crate::program::page::chart::{BLUE, Mark, ORANGE, Series, axes_of, inked, legend};
use crate::program::page::svg::{Axes, grid, opened};

/// The sweep, and the origin of the zero that it led to.
pub(super) fn html(sweep: &HallSweepEntry, zero: Option<&ZeroEntry>) -> String {
    format!("<figure>{}</figure>{}", plot(sweep, zero), table(sweep))
}

/// A named point: which sensor it lies on, where, and its voltage.
struct Named {
    name: &'static str,
    place_um: f64,
    volts: f64,
    colour: &'static str,
}

/// The points of system S5 in the order of its steps: G on the even curve, P on the odd one.
fn named(sweep: &HallSweepEntry) -> [Named; 7] {
    let of = |name, place_m, volts, colour| Named {
        name,
        place_um: Metres(place_m).um(),
        volts,
        colour,
    };
    let [g1, g2, p0] = [sweep.g1, sweep.g2, sweep.p0];
    [
        of("G7", sweep.peak_m, sweep.peak_max_v, BLUE),
        of("G1", g1.position_m, g1.peak_v, BLUE),
        of("G2", g2.position_m, g2.peak_v, BLUE),
        of("G8", p0.position_m, p0.peak_v, BLUE),
        of("P1", g1.position_m, g1.slope_v, ORANGE),
        of("P2", g2.position_m, g2.slope_v, ORANGE),
        of("P0", p0.position_m, p0.slope_v, ORANGE),
    ]
}

fn plot(sweep: &HallSweepEntry, zero: Option<&ZeroEntry>) -> String {
    let of = |volts: &[f64]| {
        let places = sweep.positions_m.iter().map(|it| Metres(*it).um());
        places.zip(volts.iter().copied()).collect()
    };
    let series = [
        Series::new("sensor 1 (even), V1", BLUE, Mark::Dots, of(&sweep.peak_v)),
        Series::new("sensor 2 (odd), V2", ORANGE, Mark::Dots, of(&sweep.slope_v)),
    ];
    let axes = axes_of(&series, core::iter::empty());
    let title = "Hall voltages of the search";
    let mut svg = opened(title, (axes.frame.width, axes.frame.height));
    svg += &grid(
        &axes,
        ("place in the drive's coordinates (µm)", "voltage (V)"),
    );
    svg += &inked(&axes, &series);
    if let Some(zero) = zero {
        svg += &origin(&axes, Metres(zero.origin_m).um());
    }
    for it in named(sweep) {
        svg += &mark(&axes, &it);
    }
    svg += &legend(&axes.frame, &series);
    svg + "</svg>"
}

/// Where the zero is.
fn origin(axes: &Axes, um: f64) -> String {
    let (x, top) = (axes.px(um), axes.frame.top);
    let bottom = axes.frame.height - axes.frame.bottom;
    format!(
        "<line x1=\"{x:.1}\" x2=\"{x:.1}\" y1=\"{top}\" y2=\"{bottom}\" stroke=\"var(--limit)\" \
         stroke-dasharray=\"6 4\"/><text x=\"{:.1}\" y=\"{:.1}\" font-size=\"12\" \
         fill=\"var(--limit)\">origin</text>",
        x + 5.0,
        bottom - 6.0
    )
}

fn mark(axes: &Axes, it: &Named) -> String {
    let (x, y) = (axes.px(it.place_um), axes.py(it.volts));
    // G8 lies where G7 does.
    let (dx, dy, anchor) = match it.name {
        "G8" => (0.0, 18.0, "middle"),
        "G7" => (-8.0, -6.0, "end"),
        "G1" | "P1" => (-9.0, 4.0, "end"),
        "P0" => (10.0, 18.0, "start"),
        _ => (9.0, 4.0, "start"),
    };
    format!(
        "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"4.5\" fill=\"var(--paper)\" stroke=\"{}\" stroke-width=\"2\"/>\
         <text x=\"{:.1}\" y=\"{:.1}\" font-size=\"12\" font-weight=\"600\" fill=\"{}\" \
         text-anchor=\"{anchor}\">{}</text>",
        it.colour,
        x + dx,
        y + dy,
        it.colour,
        it.name
    )
}

fn table(sweep: &HallSweepEntry) -> String {
    let mut html =
        String::from("<table><tr><th>point</th><th>place (µm)</th><th>voltage (V)</th></tr>");
    for it in named(sweep) {
        let _ = write!(
            html,
            "<tr><td>{}</td><td>{:.3}</td><td>{:.4}</td></tr>",
            it.name, it.place_um, it.volts
        );
    }
    html + "</table>" + POINTS
}

/// As the steps of the search define them.
const POINTS: &str = "<p class=\"note\">G7: the highest voltage of sensor 1, whose curve is even. G1, G2: the places on \
     its two flanks where it has one and the same lower voltage; P1, P2: sensor 2, whose curve is odd, at these places. \
     P0: where sensor 2 has the mean of its voltages at P1 and P2; G8: sensor 1 there, which must be at its highest. The \
     origin is refined from all readings of the search.</p>";
