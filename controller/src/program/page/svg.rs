//! Plots as plain SVG.

use core::fmt::Write as _;

use super::escape;

pub(crate) const WIDTH: f64 = 960.0;
pub(crate) const HEIGHT: f64 = 320.0;
pub(crate) const LEFT: f64 = 64.0;
pub(crate) const RIGHT: f64 = 20.0;
pub(crate) const TOP: f64 = 24.0;
pub(crate) const BOTTOM: f64 = 44.0;

/// A picture's size, and what of it is left around the plot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Frame {
    pub(crate) width: f64,
    pub(crate) height: f64,
    pub(crate) left: f64,
    pub(crate) right: f64,
    pub(crate) top: f64,
    pub(crate) bottom: f64,
}

impl Frame {
    /// That of most plots.
    pub(crate) const USUAL: Self = Self {
        width: WIDTH,
        height: HEIGHT,
        left: LEFT,
        right: RIGHT,
        top: TOP,
        bottom: BOTTOM,
    };
}

/// From data to the page.
pub(crate) struct Axes {
    pub(crate) x: (f64, f64),
    pub(crate) y: (f64, f64),
    pub(crate) frame: Frame,
}

impl Axes {
    pub(crate) const fn new(x: (f64, f64), y: (f64, f64)) -> Self {
        let frame = Frame::USUAL;
        Self { x, y, frame }
    }

    pub(crate) fn px(&self, x: f64) -> f64 {
        let Frame {
            width, left, right, ..
        } = self.frame;
        left + (x - self.x.0) / (self.x.1 - self.x.0) * (width - left - right)
    }

    pub(crate) fn py(&self, y: f64) -> f64 {
        let Frame {
            height,
            top,
            bottom,
            ..
        } = self.frame;
        height - bottom - (y - self.y.0) / (self.y.1 - self.y.0) * (height - top - bottom)
    }

    /// Where the points are on the page, as a list of places.
    pub(crate) fn places(&self, points: &[(f64, f64)]) -> String {
        points.iter().fold(String::new(), |mut text, (x, y)| {
            let _ = write!(text, "{:.1},{:.1} ", self.px(*x), self.py(*y));
            text
        })
    }
}

/// The beginning of a picture that is called `title`.
pub(crate) fn opened(title: &str, (width, height): (f64, f64)) -> String {
    let title = escape(title);
    format!("<svg viewBox=\"0 0 {width} {height}\" role=\"img\"><title>{title}</title>")
}

/// The range of `values`, widened on both sides by `share` of it, and never empty.
pub(crate) fn padded(values: impl Iterator<Item = f64>, share: f64) -> (f64, f64) {
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
        (low.min(value), high.max(value))
    });
    if low > high {
        return (0.0, 1.0);
    }
    // What is the same but for rounding has a range that its places can be told in.
    let rounding = low.abs().max(high.abs()) * 1e-12;
    let margin = ((high - low) * share).max(1e-6).max(rounding);
    (low - margin, high + margin)
}

/// 1, 2 or 5 times a power of ten, giving about `wanted` steps.
pub(crate) fn step(range: f64, wanted: f64) -> f64 {
    let raw = range / wanted;
    let power = 10_f64.powf(raw.log10().floor());
    let factor = [1.0, 2.0, 5.0]
        .into_iter()
        .find(|it| it * power >= raw)
        .unwrap_or(10.0);
    factor * power
}

/// The step of an axis that is called `label`, with its unit in brackets: a turn is parted as a circle is, and what
/// has no unit is counted.
fn step_of(label: &str, range: f64, wanted: f64) -> f64 {
    let step = step(range, wanted);
    if !label.ends_with(')') {
        return step.max(1.0);
    }
    // Below ten degrees they are parted as all other numbers are.
    let parts_of_turn = [15.0, 30.0, 45.0, 90.0, 180.0];
    let of_turn = || parts_of_turn.into_iter().find(|it| it * wanted >= range);
    match of_turn() {
        Some(part) if label.ends_with("(°)") && step >= 10.0 => part,
        _ => step,
    }
}

/// Ticks of an axis at most: rounding makes no more of those that are wanted.
pub(crate) const TICKS_MAX: usize = 100;

pub(crate) fn ticks(range: (f64, f64), wanted: f64) -> Vec<f64> {
    ticks_by(step(range.1 - range.0, wanted), range)
}

fn ticks_by(step: f64, range: (f64, f64)) -> Vec<f64> {
    if !(step > 0.0 && step.is_finite()) {
        return Vec::new();
    }
    let first = (range.0 / step).ceil() as i64;
    let last = (range.1 / step).floor() as i64;
    let each = (first..=last).take(TICKS_MAX);
    each.map(|at| at as f64 * step).collect()
}

/// As few digits as tell the ticks apart.
pub(crate) fn label(value: f64, step: f64) -> String {
    let digits = (-step.log10().floor()).max(0.0) as usize;
    format!("{:.digits$}", value + 0.0)
}

/// Lines, numbers, and what both axes are.
pub(crate) fn grid(axes: &Axes, (x_label, y_label): (&str, &str)) -> String {
    let mut svg = String::from("<g font-size=\"12\" fill=\"var(--quiet)\" stroke-width=\"1\">");
    let Frame {
        width,
        height,
        left,
        ..
    } = axes.frame;
    let (right, bottom) = (width - axes.frame.right, height - axes.frame.bottom);
    let y_step = step(axes.y.1 - axes.y.0, 6.0);
    for y in ticks(axes.y, 6.0) {
        let py = axes.py(y);
        let colour = if y.abs() < y_step * 1e-6 {
            "var(--zero)"
        } else {
            "var(--grid)"
        };
        let _ = write!(
            svg,
            "<line x1=\"{left}\" x2=\"{right}\" y1=\"{py:.1}\" y2=\"{py:.1}\" stroke=\"{colour}\"/>"
        );
        let (x, y_text, text) = (left - 8.0, py + 4.0, label(y, y_step));
        let _ = write!(
            svg,
            "<text x=\"{x}\" y=\"{y_text:.1}\" text-anchor=\"end\">{text}</text>"
        );
    }
    let x_step = step_of(x_label, axes.x.1 - axes.x.0, 10.0);
    for x in ticks_by(x_step, axes.x) {
        let (px, y, text) = (axes.px(x), bottom + 18.0, label(x, x_step));
        let _ = write!(
            svg,
            "<text x=\"{px:.1}\" y=\"{y}\" text-anchor=\"middle\">{text}</text>"
        );
    }
    let (middle, base) = ((left + right) / 2.0, height - 6.0);
    let _ = write!(
        svg,
        "<text x=\"{middle}\" y=\"{base}\" text-anchor=\"middle\">{x_label}</text>"
    );
    let _ = write!(svg, "<text x=\"{left}\" y=\"14\">{y_label}</text></g>");
    svg
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_numbers_inside_the_range() {
        assert_eq!(ticks((-0.3, 10.2), 5.0), [0.0, 5.0, 10.0]);
        assert_eq!(ticks((0.0, 1.0), 5.0).len(), 6);
        assert_eq!(label(0.5, 0.5), "0.5");
        assert_eq!(label(20.0, 10.0), "20");
    }

    #[test]
    fn a_turn_is_parted_as_a_circle_is_and_what_is_counted_is_whole() {
        assert_eq!(step_of("table angle (°)", 359.0, 10.0), 45.0);
        assert_eq!(step_of("table angle (°)", 120.0, 10.0), 15.0);
        assert_eq!(step_of("table angle (°)", 4.0, 10.0), 0.5);
        assert_eq!(step_of("run", 4.2, 10.0), 1.0);
        assert_eq!(step_of("target (mm)", 4.2, 10.0), 0.5);
    }

    #[test]
    fn an_empty_plot_has_a_range() {
        assert_eq!(padded([].into_iter(), 0.1), (0.0, 1.0));
    }
}
