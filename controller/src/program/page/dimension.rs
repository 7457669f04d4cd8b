//! A figure drawn as a draughtsman does: a line from one value to the other beside the plot, thin lines that lead to
//! where the values are, and the figure's letter and number under it.

use core::fmt::Write as _;

use super::svg::Axes;

/// Room for one figure beside a plot.
pub(crate) const COLUMN: f64 = 56.0;
const CAP: f64 = 5.0;

/// A figure that is a distance on the y axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Dimension<'a> {
    /// Its letter.
    pub(crate) symbol: &'a str,
    /// What it comes to, in the unit of the axis.
    pub(crate) value: f64,
    /// Where its ends are: x and y of the data.
    pub(crate) ends: [(f64, f64); 2],
}

/// The figures side by side in the right margin of a plot.
pub(crate) fn dimensions(axes: &Axes, all: &[Dimension<'_>]) -> String {
    let right = axes.frame.width - axes.frame.right;
    let mut svg = String::from("<g font-size=\"12\" text-anchor=\"middle\">");
    for (at, it) in (0_u8..).zip(all) {
        let x = right + COLUMN * (f64::from(at) + 0.6);
        svg += &one(axes, x, it);
    }
    svg + "</g>"
}

fn one(axes: &Axes, x: f64, it: &Dimension<'_>) -> String {
    let mut svg = String::new();
    for (from_x, y) in it.ends {
        let (from, py, end) = (axes.px(from_x), axes.py(y), x + CAP);
        let _ = write!(
            svg,
            "<line x1=\"{from:.1}\" x2=\"{end:.1}\" y1=\"{py:.1}\" y2=\"{py:.1}\" stroke=\"var(--zero)\" \
             stroke-dasharray=\"1 4\"/><line x1=\"{:.1}\" x2=\"{end:.1}\" y1=\"{py:.1}\" y2=\"{py:.1}\" \
             stroke=\"var(--ink)\"/>",
            x - CAP
        );
    }
    let [first, second] = it.ends.map(|(_, y)| axes.py(y));
    let base = axes.frame.height - axes.frame.bottom;
    let _ = write!(
        svg,
        "<line x1=\"{x:.1}\" x2=\"{x:.1}\" y1=\"{first:.1}\" y2=\"{second:.1}\" stroke=\"var(--ink)\" \
         stroke-width=\"1.6\"/><text x=\"{x:.1}\" y=\"{:.1}\" fill=\"var(--ink)\" font-weight=\"600\">{}</text>\
         <text x=\"{x:.1}\" y=\"{:.1}\" fill=\"var(--ink)\" data-figure=\"{}\">{:.3}</text>",
        base + 18.0,
        it.symbol,
        base + 34.0,
        it.symbol,
        it.value
    );
    svg
}
