//! Pages of three axes: the lines that were read, the errors they tell with their uncertainties, how
//! warm the machine was, and what verifications showed over the hours.

mod agreement;
mod head;
mod volume;

use core::fmt::Write as _;

use compensator::volumetric::Axis;
use machine::records::{ReadJournal, Store, StoreError};
use units::{Metres, Radians};

use crate::program::budget;
use crate::program::page::band::{Sure, band, enlargement, said};
use crate::program::page::chart::{BLUE, COLOURS, GREEN, Mark, ORANGE, Series, chart};
use crate::program::page::head::facts;
use crate::program::page::{document, escape};
use crate::program::text::verdict;
use crate::program::volumetric::{shown, uncertainty};
use crate::volumetric::verify::from_the_first;
use crate::volumetric::{
    FunctionRecord, GeometryContent, LineEntry, LineReadingEntry, OpticsName, VolumeLog,
};

pub(crate) use self::head::head;

/// Parts between two nodes in which a curve is drawn.
const PARTS: usize = 8;
/// The error functions of each axis: displacements, then tilts.
const NAMES: [[[&str; 3]; 2]; 3] = [
    [["e_xx", "e_yx", "e_zx"], ["e_ax", "e_bx", "e_cx"]],
    [["e_xy", "e_yy", "e_zy"], ["e_ay", "e_by", "e_cy"]],
    [["e_xz", "e_yz", "e_zz"], ["e_az", "e_bz", "e_cz"]],
];
/// Thermometers in the order of the configuration, as charts call them.
const THERMOMETERS: [&str; 8] = ["1", "2", "3", "4", "5", "6", "7", "8"];

/// What a line showed at one hour of a day, in each state.
#[derive(Clone, Debug)]
pub(crate) struct HourOfDay<'a> {
    /// Which hour.
    pub(crate) hour: f64,
    /// As found, by tables alone, corrected by what the machine sees.
    pub(crate) runs: [&'a ReadJournal<VolumeLog>; 3],
}

/// What was made from a run.
#[derive(Clone, Debug, Default)]
pub(crate) struct Made {
    /// The name and the kind of each record.
    pub(crate) named: Vec<(String, &'static str)>,
    /// The errors among them.
    pub(crate) geometries: Vec<GeometryContent>,
}

impl Made {
    /// What `store` has from the journal called `source`.
    ///
    /// # Errors
    /// When the folder cannot be read.
    pub(crate) fn of(store: &Store, source: &str) -> Result<Self, StoreError> {
        let geometries = store.made_from::<GeometryContent>(source)?;
        let named = store.glances_from(source)?;
        Ok(Self {
            named: named.into_iter().map(|(id, it)| (id, it.kind)).collect(),
            geometries: geometries.into_iter().map(|(_, it)| it.content).collect(),
        })
    }
}

/// The page of `journal`, with the calibrations that were made from it.
pub(crate) fn render(journal: &ReadJournal<VolumeLog>, made: &Made) -> String {
    let header = &journal.header;
    let title = format!("{} of three axes, {}", header.verb, header.machine);
    let mut html = facts(&head(journal, made));
    if journal.log.check.is_some() {
        html += &verification(journal);
        html += &temperatures(&journal.log.readings);
    } else {
        html += &calibration(journal, made);
    }
    document(&title, &html, NOTE)
}

/// The page of a demonstration: a day, and the calibration that it began with.
pub(crate) fn render_day(
    day: &[HourOfDay<'_>],
    calibrated: &ReadJournal<VolumeLog>,
    made: &Made,
) -> String {
    let title = format!("A day of three axes, {}", calibrated.header.machine);
    let mut html = facts(&head(calibrated, made));
    html += &curves(day);
    html += &calibration(calibrated, made);
    document(&title, &html, NOTE)
}

const NOTE: &str =
    "E of an axis and a direction: e_yx is the displacement of x along y, e_ax its tilt about x.";

fn um(metres: f64) -> f64 {
    Metres(metres).um()
}

fn mm(metres: f64) -> f64 {
    Metres(metres).mm()
}

fn arcsec(radians: f64) -> f64 {
    Radians(radians).arcsec()
}

fn section(title: &str, labels: (&str, &str), series: &[Series]) -> String {
    let chart = chart(title, labels, series, None);
    format!("<h3>{}</h3><figure>{chart}</figure>", escape(title))
}

/// Ranges over the hours, what the line showed at the end of the day, and how warm it was.
fn curves(day: &[HourOfDay<'_>]) -> String {
    const STATES: [(&str, &str); 3] = [
        ("as found", ORANGE),
        ("tables alone", GREEN),
        ("corrected live", BLUE),
    ];
    let ranges = STATES.iter().enumerate().map(|(state, (name, colour))| {
        let range = |it: &HourOfDay<'_>| (it.hour, range_of(it.runs[state]));
        line(name, colour, day.iter().map(range).collect())
    });
    let ranges: Vec<_> = ranges.collect();
    let mut html = String::from(
        "<h2>Over the hours</h2><p>A line that no calibration uses, read by interferometer: as \
         found, corrected by the tables of the morning alone, and corrected by what detectors and \
         thermometers see.</p>",
    );
    let labels = ("hour (h)", "range of the deviation along the line (µm)");
    html += &section("Range of the deviation over the hours", labels, &ranges);
    if let Some(last) = day.last() {
        let each = STATES.iter().zip(last.runs);
        let series: Vec<_> = each
            .map(|((name, colour), run)| line(name, colour, deviations(run)))
            .collect();
        let title = format!("Deviation along the line after {} h", last.hour);
        html += &section(&title, ALONG, &series);
    }
    let readings: Vec<_> = day
        .iter()
        .flat_map(|it| it.runs[2].log.readings.iter().cloned())
        .collect();
    html + &temperatures(&readings)
}

pub(crate) const ALONG: (&str, &str) = ("distance along the line (mm)", "deviation (µm)");

const fn line(name: &'static str, colour: &'static str, points: Vec<(f64, f64)>) -> Series {
    Series::new(name, colour, Mark::Line, points)
}

fn way(reading: &LineReadingEntry, from: [f64; 3]) -> f64 {
    let square = |k: usize| (reading.at_m[k] - from[k]).powi(2);
    mm((0..3).map(square).sum::<f64>().sqrt())
}

/// Of each reading its way in millimetres and its deviation in micrometres, from what these were at the beginning.
pub(crate) fn deviations(journal: &ReadJournal<VolumeLog>) -> Vec<(f64, f64)> {
    let readings = &journal.log.readings;
    let from = readings.first().map_or([0.0; 3], |it| it.at_m);
    let (deviations, _) = read_along(journal);
    let each = readings.iter().zip(deviations);
    each.map(|(it, deviation)| (way(it, from), deviation.um()))
        .collect()
}

pub(crate) fn read_along(journal: &ReadJournal<VolumeLog>) -> (Vec<Metres>, Metres) {
    let readings = journal.log.readings.iter();
    let read: Vec<Metres> = readings.map(|it| Metres(it.deviation_si)).collect();
    from_the_first(&read)
}

fn range_of(journal: &ReadJournal<VolumeLog>) -> f64 {
    read_along(journal).1.um()
}

fn verification(journal: &ReadJournal<VolumeLog>) -> String {
    let Some(check) = &journal.log.check else {
        return String::new();
    };
    let range = range_of(journal);
    let points = deviations(journal);
    let readings = &journal.log.readings;
    let sure = points.iter().zip(readings);
    let sure = sure.map(|((x, y), it)| (*x, *y, um(it.u_si)));
    let sure: Vec<Sure> = sure.collect();
    let factor = enlargement([sure.as_slice()].into_iter());
    let series = [
        band("", BLUE, &sure, factor),
        line("deviation", BLUE, points),
    ];
    let verdict = verdict(
        &format!("range {range:.3} µm"),
        &format!("{:.3} µm", um(check.limit_m)),
        range <= um(check.limit_m),
    );
    let mut html = format!(
        "<h2>Line {}</h2><p>From {} to {} mm: {verdict}.</p>",
        escape(&check.state),
        place(check.from_m),
        place(check.to_m),
    );
    html += &section("Deviation along the line", ALONG, &series);
    html += &said(factor);
    html += "<table><tr><th>place (mm)</th><th>deviation (µm)</th><th>u (µm)</th>\
             <th>correction x, y, z (µm)</th></tr>";
    for (it, (_, deviation)) in readings.iter().zip(deviations(journal)) {
        let correction = it.correction_m.map_or("–".to_owned(), |it| {
            let [x, y, z] = it.map(um);
            format!("{x:+.3}, {y:+.3}, {z:+.3}")
        });
        let _ = write!(
            html,
            "<tr><td>{}</td><td>{deviation:.3}</td><td>{:.3}</td><td>{correction}</td></tr>",
            place(it.at_m),
            um(it.u_si)
        );
    }
    html + "</table>"
}

fn place(metres: [f64; 3]) -> String {
    let [x, y, z] = metres.map(mm);
    format!("({x:.1}, {y:.1}, {z:.1})")
}

/// What the thermometers showed, over the time of the machine.
fn temperatures(readings: &[LineReadingEntry]) -> String {
    let count = readings.iter().map(|it| it.temperatures_c.len()).max();
    let span_s = match readings {
        [first, .., last] => last.at_s - first.at_s,
        _ => 0.0,
    };
    let (seconds, label) = match span_s < 3600.0 {
        true => (60.0, "time of the machine (min)"),
        false => (3600.0, "time of the machine (h)"),
    };
    let each = (0..count.unwrap_or(0).min(THERMOMETERS.len())).map(|at| {
        let shown = readings.iter().filter_map(|it| {
            let celsius = it.temperatures_c.get(at).copied().flatten()?;
            Some((it.at_s / seconds, celsius))
        });
        let colour = COLOURS[at % COLOURS.len()];
        line(THERMOMETERS[at], colour, shown.collect())
    });
    let series: Vec<_> = each.filter(|it| !it.points.is_empty()).collect();
    if series.is_empty() {
        return String::new();
    }
    let chart = crate::program::page::chart::chart_about(
        "Temperatures",
        (label, "thermometer (°C)"),
        &series,
    );
    format!("<h2>Temperatures</h2><figure>{chart}</figure>")
}

fn calibration(journal: &ReadJournal<VolumeLog>, made: &Made) -> String {
    let mut html: String = made.geometries.iter().map(geometry).collect();
    let read = &journal.log;
    if let (Some(content), Some(plan)) = (made.geometries.first(), &read.plan) {
        html += &volume::html(content, plan);
    }
    html += &agreement::residuals(read, made.geometries.first());
    html += &temperatures(&read.readings);
    html + &lines(read)
}

/// The error functions with their uncertainties, squarenesses, and what warmth does.
pub(crate) fn geometry(content: &GeometryContent) -> String {
    let mut html = String::from("<h2>Errors</h2>");
    html += &content
        .agreement
        .as_ref()
        .map_or_else(String::new, agreement::figures);
    html += &budget::html(uncertainty::worst(content.budget.as_ref()));
    for (axis, names) in Axis::ALL.into_iter().zip(NAMES) {
        let [along, about] = names;
        let title = format!("Displacements of {axis}");
        let position = format!("{axis} (mm)");
        let label = "displacement (µm)";
        html += &functions(content, &title, (&position, label), along, um);
        let title = format!("Tilts of {axis}");
        html += &functions(content, &title, (&position, "tilt (″)"), about, arcsec);
    }
    html += &largest(content);
    html += "<h2>Squareness</h2><table><tr><th></th><th>″</th><th>u (″)</th></tr>";
    for (name, value, u) in shown::squarenesses(content) {
        let _ = write!(
            html,
            "<tr><td>{name}</td><td>{value:+.3}</td><td>{u:.3}</td></tr>"
        );
    }
    html += "</table>";
    if content.bends.is_empty() && content.expansions.is_empty() {
        return html;
    }
    html += "<h2>Thermal effects</h2><table><tr><th></th><th></th><th>u</th></tr>";
    for it in &content.expansions {
        let _ = write!(
            html,
            "<tr><td>scale of {} (ppm/K)</td><td>{:.3}</td><td>{:.3}</td></tr>",
            it.axis,
            it.per_k * 1e6,
            it.standard_uncertainty_per_k * 1e6
        );
    }
    for it in &content.bends {
        let _ = write!(
            html,
            "<tr><td>guide of {} towards {} (µm/K)</td><td>{:.3}</td><td>{:.3}</td></tr>",
            it.axis,
            it.towards,
            um(it.bow_m_per_k),
            um(it.standard_uncertainty_m_per_k)
        );
    }
    html + "</table>"
}

fn record<'a>(content: &'a GeometryContent, name: &str) -> Option<&'a FunctionRecord> {
    content.functions.iter().find(|it| it.name == name)
}

fn functions(
    content: &GeometryContent,
    title: &str,
    labels: (&str, &str),
    names: [&'static str; 3],
    unit: fn(f64) -> f64,
) -> String {
    let drawn: Vec<Drawn> = names
        .into_iter()
        .zip(COLOURS)
        .filter_map(|(name, colour)| drawn(record(content, name)?, (name, colour), unit))
        .collect();
    if drawn.is_empty() {
        return String::new();
    }
    let known = drawn.iter().filter(|it| it.is_sure);
    let factor = enlargement(known.clone().map(|it| it.curve.as_slice()));
    let bands = known.map(|it| band("", it.colour, &it.curve, factor));
    let curves = drawn.iter().map(|it| {
        let points = it.curve.iter().map(|(x, y, _)| (*x, *y));
        line(it.name, it.colour, points.collect())
    });
    let series: Vec<Series> = bands.chain(curves).collect();
    section(title, labels, &series) + &said(factor)
}

/// An error function as it is drawn.
struct Drawn {
    name: &'static str,
    colour: &'static str,
    curve: Vec<Sure>,
    /// Whether its uncertainty is known.
    is_sure: bool,
}

fn drawn(
    record: &FunctionRecord,
    (name, colour): (&'static str, &'static str),
    unit: fn(f64) -> f64,
) -> Option<Drawn> {
    let function = record.function::<Metres>("the page").ok()?;
    let at = |position: Metres| {
        let u = function.standard_uncertainty(position);
        let u = u.map_or(0.0, |it| unit(it.value()));
        (position.mm(), unit(function.at(position).value()), u)
    };
    let nodes: Vec<Metres> = function.nodes().collect();
    let between = nodes.windows(2).flat_map(|pair| {
        let step = (pair[1] - pair[0]) / PARTS as f64;
        (0..PARTS).map(move |part| pair[0] + step * part as f64)
    });
    Some(Drawn {
        name,
        colour,
        curve: between.chain(nodes.last().copied()).map(at).collect(),
        is_sure: record.standard_uncertainties_si.is_some(),
    })
}

fn largest(content: &GeometryContent) -> String {
    let mut html = String::from(
        "<table><tr><th>error</th><th>nodes</th><th>largest</th><th>u (largest)</th><th></th></tr>",
    );
    for it in shown::errors(content) {
        let u = it.u.map_or("–".to_owned(), |u| format!("{u:.3}"));
        let _ = write!(
            html,
            "<tr><td>{}</td><td>{}</td><td>{:.3}</td><td>{u}</td><td>{}</td></tr>",
            escape(it.name),
            it.nodes,
            it.largest,
            it.unit
        );
    }
    html + "</table>"
}

fn lines(read: &VolumeLog) -> String {
    let Some(plan) = &read.plan else {
        return String::new();
    };
    let mut html = String::from(
        "<h2>Lines</h2><table><tr><th>line</th><th>read by</th><th>from (mm)</th><th>to (mm)</th>\
         <th>readings</th><th>largest deviation</th><th>what for</th></tr>",
    );
    for (at, line) in plan.lines.iter().enumerate() {
        let own = || read.readings.iter().filter(move |it| it.line == at);
        let most = own().map(|it| it.deviation_si.abs()).fold(0.0, f64::max);
        let most = match line.optics {
            OpticsName::Angular => format!("{:.2} ″", arcsec(most)),
            OpticsName::Linear | OpticsName::Straightness => format!("{:.2} µm", um(most)),
        };
        let whole = if read.is_whole(at) {
            ""
        } else {
            " (not whole)"
        };
        let _ = write!(
            html,
            "<tr><td>{}{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}{whole}</td><td>{most}</td>\
             <td style=\"text-align:left\">{}</td></tr>",
            at + 1,
            if line.warm { ", warm" } else { "" },
            reader(line),
            place(line.from_m),
            place(line.to_m),
            own().count(),
            escape(&line.purpose)
        );
    }
    html + "</table>"
}

fn reader(line: &LineEntry) -> String {
    let optics = match line.optics {
        OpticsName::Linear => "linear",
        OpticsName::Straightness => "straightness",
        OpticsName::Angular => "angular",
    };
    let sees = line.sees.map_or(String::new(), |it| format!(" {it}"));
    match line.by_detectors {
        true => format!("detectors, {optics}{sees}"),
        false => format!("{optics}{sees}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volumetric::error_name;

    #[test]
    fn every_error_function_has_its_place_on_the_page() {
        let mut names: Vec<&str> = NAMES.into_iter().flatten().flatten().collect();
        assert!(names.iter().all(|it| error_name(it).is_some()), "{names:?}");
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), 18);
    }
}
