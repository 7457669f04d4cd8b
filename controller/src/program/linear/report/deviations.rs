//! The deviations of a linear axis as a picture.

use core::fmt::Write as _;

use units::Metres;

use super::Section;
use crate::program::page::svg::{Axes, FORWARD, HEIGHT, REVERSE, RIGHT, WIDTH, grid, padded};

/// Deviation over position: each point, and mean ± 2 s at each target, both approaches.
pub(super) fn deviations(section: &Section<'_>) -> String {
    let points: Vec<(f64, f64, char)> = section
        .points
        .iter()
        .map(|it| {
            let deviation = Metres(it.measured_m - it.target_m).um();
            (Metres(it.target_m).mm(), deviation, it.approach)
        })
        .collect();
    let axes = Axes {
        x: padded(points.iter().map(|it| it.0), 0.02),
        y: padded(
            points
                .iter()
                .map(|it| it.1)
                .chain(bar_ends(section))
                .chain([0.0]),
            0.06,
        ),
    };
    let mut svg = format!("<svg viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\">");
    svg += &format!("<title>Deviation {}</title>", super::escape(&section.title));
    svg += &grid(&axes, ("target (mm)", "deviation (µm)"));
    svg += &dots(&axes, &points);
    svg += &means(&axes, section);
    svg += &legend();
    svg + "</svg>"
}

/// Where the bars of mean ± 2 s end, micrometres.
fn bar_ends(section: &Section<'_>) -> impl Iterator<Item = f64> {
    section.figures.targets.iter().flat_map(|it| {
        let ends = |mean: Metres, s: Metres| [(mean - s * 2.0).um(), (mean + s * 2.0).um()];
        let [forward, reverse] = [
            ends(it.mean_forward, it.s_forward),
            ends(it.mean_reverse, it.s_reverse),
        ];
        forward.into_iter().chain(reverse)
    })
}

fn dots(axes: &Axes, points: &[(f64, f64, char)]) -> String {
    points.iter().fold(String::new(), |mut svg, (x, y, approach)| {
        let colour = if *approach == '-' { REVERSE } else { FORWARD };
        let (px, py) = (axes.px(*x), axes.py(*y));
        let _ = write!(svg, "<circle cx=\"{px:.1}\" cy=\"{py:.1}\" r=\"2.2\" fill=\"{colour}\" opacity=\".35\"/>");
        svg
    })
}

fn means(axes: &Axes, section: &Section<'_>) -> String {
    let mut svg = String::new();
    for (colour, forward) in [(FORWARD, true), (REVERSE, false)] {
        let mut line = String::new();
        for target in &section.figures.targets {
            let (mean, s) = if forward {
                (target.mean_forward.um(), target.s_forward.um())
            } else {
                (target.mean_reverse.um(), target.s_reverse.um())
            };
            let px = axes.px(target.target.mm());
            let _ = write!(line, "{px:.1},{:.1} ", axes.py(mean));
            let (low, high) = (axes.py(mean - 2.0 * s), axes.py(mean + 2.0 * s));
            let _ = write!(
                svg,
                "<line x1=\"{px:.1}\" x2=\"{px:.1}\" y1=\"{low:.1}\" y2=\"{high:.1}\" stroke=\"{colour}\" stroke-width=\"2\"/>"
            );
        }
        let _ = write!(
            svg,
            "<polyline points=\"{line}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"1.8\"/>"
        );
    }
    svg
}

fn legend() -> String {
    let x = WIDTH - RIGHT - 190.0;
    let y = 14.0;
    format!(
        "<g font-size=\"12\"><text x=\"{x}\" y=\"{y}\" fill=\"{FORWARD}\">● forward ↑</text>\
         <text x=\"{}\" y=\"{y}\" fill=\"{REVERSE}\">● reverse ↓</text></g>",
        x + 100.0
    )
}
