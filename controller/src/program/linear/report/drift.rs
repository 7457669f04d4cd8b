//! What drifted while an axis was measured: the place of the datum after each run, and the temperatures.

use machine::records::ClosureEntry;
use units::Metres;

use crate::linear::PointEntry;
use crate::program::page::chart::{BLUE, Mark, ORANGE, Series, chart, chart_about};

/// The plots of `closures` and `points`; nothing where neither was written down.
pub(super) fn html(closures: &[ClosureEntry], points: &[PointEntry]) -> String {
    let drawn = [datum(closures), temperatures(points)].concat();
    match drawn.is_empty() {
        true => drawn,
        false => format!("<h2>Drift</h2>{drawn}"),
    }
}

fn datum(closures: &[ClosureEntry]) -> String {
    if closures.is_empty() {
        return String::new();
    }
    let of = |place: fn(&ClosureEntry) -> f64| {
        let each = closures.iter();
        each.map(|it| (f64::from(it.run), Metres(place(it)).um()))
            .collect()
    };
    let series = [
        Series::new("before the run", ORANGE, Mark::Dots, of(|it| it.start_m)),
        Series::new("after it", BLUE, Mark::Line, of(|it| it.closure_m)),
        Series::new("", BLUE, Mark::Dots, of(|it| it.closure_m)),
    ];
    let labels = ("run", "datum read at (µm)");
    let svg = chart("The datum before and after each run", labels, &series, None);
    format!("<figure>{svg}</figure>")
}

fn temperatures(points: &[PointEntry]) -> String {
    let of = |what: fn(&PointEntry) -> Option<f64>| {
        let each = points.iter();
        each.filter_map(|it| Some((it.at_s / 60.0, what(it)?)))
            .collect()
    };
    let series = [
        Series::new(
            "air",
            BLUE,
            Mark::Line,
            of(|it| it.environment.air_temperature_c),
        ),
        Series::new(
            "material",
            ORANGE,
            Mark::Line,
            of(|it| it.environment.material_temperature_c),
        ),
    ];
    let series: Vec<_> = series
        .into_iter()
        .filter(|it| !it.points.is_empty())
        .collect();
    if series.is_empty() {
        return String::new();
    }
    let labels = ("time of the machine (min)", "temperature (°C)");
    let svg = chart_about("Temperatures while it was measured", labels, &series);
    format!("<figure>{svg}</figure>")
}
