//! Pages of an alignment platform: the error of each pose, the deviations of each screw, and where
//! the zero is.

mod head;

use core::fmt::Write as _;

use compensator::platform::Pose;
use compensator::screw::ScrewModel;
use machine::records::ClosureEntry;
use machine::records::{CalibrationRecord, ReadJournal, short};
use units::{Approach, Metres, Radians};

use crate::platform::PlatformLog;
use crate::platform::state::difference;
use crate::platform::verify::{PoseChecked, PoseFigures};
use crate::platform::{ArrangementEntry, PoseEntry, ScrewContent, StrokeEntry};
use crate::program::budget;
use crate::program::page::chart::{BLUE, GREEN, Mark, ORANGE, Series, chart};
use crate::program::page::head::{Fact, facts};
use crate::program::page::map::{Arrow, Map, longest, map};
use crate::program::page::{document, escape};
use crate::program::platform::uncertainty;
use crate::program::text;

pub(crate) use self::head::head;

/// How finely a model's curve is drawn.
const CURVE_POINTS: u32 = 240;

/// A calibration of a screw, under its name.
pub(crate) type Named = (String, CalibrationRecord<ScrewContent>);

/// What a page of a platform shows; what is empty is left out.
#[derive(Clone, Debug, Default)]
pub(crate) struct PlatformPage<'a> {
    /// Heading.
    pub(crate) title: String,
    /// The head of the page.
    pub(crate) facts: Vec<Fact>,
    /// Verifications: a heading (`as found`, `as left` …) and the run.
    pub(crate) visits: Vec<(String, &'a ReadJournal<PlatformLog>)>,
    /// The run that calibrated, with the calibrations made from it by their names.
    pub(crate) calibrated: Option<(&'a ReadJournal<PlatformLog>, Vec<Named>)>,
    /// Runs that found the zero.
    pub(crate) zeros: Vec<&'a ReadJournal<PlatformLog>>,
}

impl<'a> PlatformPage<'a> {
    /// The page of one run; `calibrations` are those made from it.
    pub(crate) fn of(journal: &'a ReadJournal<PlatformLog>, calibrations: Vec<Named>) -> Self {
        let header = &journal.header;
        let mut page = Self {
            title: format!("{} of platform {}", header.verb, header.machine),
            facts: head::head(journal, &calibrations),
            ..Self::default()
        };
        let visited = journal.log.poses.iter().any(|it| it.target.is_some());
        if visited {
            let compensated = header.calibration.is_some();
            let title = if compensated { "as left" } else { "as found" };
            page.visits.push((title.to_owned(), journal));
        } else if !journal.log.poses.is_empty() {
            page.zeros.push(journal);
        }
        if !journal.log.strokes.is_empty() {
            page.calibrated = Some((journal, calibrations));
        }
        page
    }
}

/// The page as HTML.
pub(crate) fn render(page: &PlatformPage<'_>) -> String {
    let mut html = facts(&page.facts);
    let visits: Vec<Visit<'_>> = page.visits.iter().map(Visit::of).collect();
    if !visits.is_empty() {
        html += "<h2>Errors of poses, open loop</h2>";
        html += &visit_figures(&visits);
    }
    if visits.len() > 1 {
        html += &maps_at_one_scale(&visits);
    }
    for visit in &visits {
        html += &visit_section(visit);
    }
    if let Some((journal, calibrations)) = &page.calibrated {
        html += &screws(journal, calibrations);
    }
    if !page.zeros.is_empty() {
        html += "<h2>Zero</h2>";
        html += &zeros(&page.zeros);
    }
    let note = "Poses are counted from where all screws stand at their zero, reached forward.";
    document(&page.title, &html, note)
}

/// A verification, computed.
pub(crate) struct Visit<'a> {
    title: &'a str,
    poses: Vec<PoseChecked>,
    figures: PoseFigures,
    edge: Metres,
    tolerance: Option<Metres>,
}

impl<'a> Visit<'a> {
    fn of((title, journal): &'a (String, &'a ReadJournal<PlatformLog>)) -> Self {
        let arrangement = journal.log.arrangement.as_ref();
        let edge = Metres(arrangement.map_or(0.0, |it| it.edge_m));
        let checked = |it: &PoseEntry| {
            let (target, seen) = (it.target?.into(), it.seen.into());
            Some(PoseChecked::new(target, seen, edge, it.skew_s))
        };
        let poses: Vec<_> = journal.log.poses.iter().filter_map(checked).collect();
        Self {
            title,
            figures: PoseFigures::of(&poses),
            poses,
            edge,
            tolerance: arrangement.and_then(|it| it.tolerance_m).map(Metres),
        }
    }
}

/// A verification under its name.
pub(crate) fn visit<'a>(it: &'a (String, &'a ReadJournal<PlatformLog>)) -> Visit<'a> {
    Visit::of(it)
}

/// A figure of a verification that is compared with that of another.
pub(crate) struct PoseRow {
    pub(crate) name: &'static str,
    pub(crate) unit: &'static str,
    /// `None` where no pose was visited.
    pub(crate) value: fn(&Visit<'_>) -> Option<f64>,
}

pub(crate) const COMPARED: [PoseRow; 3] = [
    PoseRow {
        name: "largest error of a pose",
        unit: "µm",
        value: |it| (!it.poses.is_empty()).then(|| it.figures.largest.um()),
    },
    PoseRow {
        name: "rms error of the poses",
        unit: "µm",
        value: |it| (!it.poses.is_empty()).then(|| it.figures.rms.um()),
    },
    PoseRow {
        name: "largest skew of the starts",
        unit: "ms",
        value: |it| Some(it.figures.skew_max_s? * 1e3),
    },
];

/// The errors in the plane of each verification, all at one scale.
pub(crate) fn maps_at_one_scale(visits: &[Visit<'_>]) -> String {
    let drawn: Vec<_> = visits.iter().map(|it| (it, arrows(it))).collect();
    if drawn.iter().all(|(_, it)| it.is_empty()) {
        return String::new();
    }
    let most = drawn.iter().map(|(_, it)| longest(it)).fold(0.0, f64::max);
    let maps = drawn.iter().map(|(visit, arrows)| {
        let svg = map_of(visit.title, arrows, most);
        let title = escape(visit.title);
        format!("<figure><figcaption>{title}</figcaption>{svg}</figure>")
    });
    let maps: String = maps.collect();
    format!("<h2>Errors over the work range at one scale</h2>{maps}")
}

fn map_of(title: &str, arrows: &[Arrow], longest: f64) -> String {
    map(&Map {
        title: &format!("Errors over the work range {title}"),
        labels: ("x (mm)", "y (mm)"),
        unit: "µm",
        arrows,
        longest,
    })
}

fn error_of(it: &PoseChecked) -> Pose {
    difference(it.seen, it.target)
}

fn at_edge(angle: Radians, edge: Metres) -> Metres {
    Metres(angle.value() * edge.value())
}

/// A row of figures: its name, and its cell for each visit.
type Row = (&'static str, fn(&Visit<'_>) -> String);

const ROWS: [Row; 5] = [
    ("poses", |it| it.poses.len().to_string()),
    ("largest error (µm)", |it| um(it.figures.largest)),
    ("rms error (µm)", |it| um(it.figures.rms)),
    ("tolerance (µm)", |it| or_dash(it.tolerance.map(um))),
    ("largest skew of the starts (ms)", |it| {
        or_dash(it.figures.skew_max_s.map(|it| format!("{:.3}", it * 1e3)))
    }),
];

fn um(length: Metres) -> String {
    format!("{:.3}", length.um())
}

fn or_dash(text: Option<String>) -> String {
    text.unwrap_or("–".to_owned())
}

fn visit_figures(visits: &[Visit<'_>]) -> String {
    let mut html = String::from("<table><tr><th></th>");
    for visit in visits {
        let _ = write!(html, "<th>{}</th>", escape(visit.title));
    }
    html += "</tr>";
    for (name, cell) in ROWS {
        let _ = write!(html, "<tr><td>{name}</td>");
        for visit in visits {
            let _ = write!(html, "<td>{}</td>", cell(visit));
        }
        html += "</tr>";
    }
    html + "</table>"
}

/// The errors in the plane of a verification.
fn arrows(visit: &Visit<'_>) -> Vec<Arrow> {
    let each = visit.poses.iter().map(|it| Arrow {
        at: (it.target.x.mm(), it.target.y.mm()),
        shows: (error_of(it).x.um(), error_of(it).y.um()),
    });
    each.collect()
}

fn visit_section(visit: &Visit<'_>) -> String {
    let title = escape(visit.title);
    let numbered = |of: &dyn Fn(&PoseChecked) -> Metres| {
        let poses = visit.poses.iter().enumerate();
        poses
            .map(|(at, it)| ((at + 1) as f64, of(it).um()))
            .collect()
    };
    let series = |name, colour, points| Series::new(name, colour, Mark::Dots, points);
    let all = [
        series("x", BLUE, numbered(&|it| error_of(it).x)),
        series("y", ORANGE, numbered(&|it| error_of(it).y)),
        series(
            "angle at the edge",
            GREEN,
            numbered(&|it| at_edge(error_of(it).angle, visit.edge)),
        ),
    ];
    let limit = visit.tolerance.map(Metres::um);
    let errors = chart(
        &format!("Error of each pose {}", visit.title),
        ("pose", "error (µm)"),
        &all,
        limit,
    );
    let arrows = arrows(visit);
    let place = map_of(visit.title, &arrows, longest(&arrows));
    format!(
        "<h2>Error of each pose {title}</h2><figure>{errors}</figure>\
         <h2>Errors over the work range {title}</h2><figure>{place}</figure>\
         <details><summary>All poses {title}</summary>{}</details>",
        pose_table(visit)
    )
}

fn pose_table(visit: &Visit<'_>) -> String {
    let mut html = String::from(
        "<table><tr><th>pose</th><th>x (mm)</th><th>y (mm)</th><th>angle (″)</th>\
         <th>error x (µm)</th><th>error y (µm)</th><th>error angle (″)</th><th>largest (µm)</th>\
         <th>skew (ms)</th></tr>",
    );
    for (at, it) in visit.poses.iter().enumerate() {
        let (skew, error) = (it.skew_s, error_of(it));
        let _ = write!(
            html,
            "<tr><td>{}</td><td>{:.4}</td><td>{:.4}</td><td>{:.2}</td><td>{:.3}</td><td>{:.3}</td>\
             <td>{:.3}</td><td>{:.3}</td><td>{}</td></tr>",
            at + 1,
            it.target.x.mm(),
            it.target.y.mm(),
            it.target.angle.arcsec(),
            error.x.um(),
            error.y.um(),
            error.angle.arcsec(),
            it.error.um(),
            or_dash(skew.map(|it| format!("{:.3}", it * 1e3))),
        );
    }
    html + "</table>"
}

/// Every screw of a calibration: its model, its strokes and what the model leaves of them.
fn screws(journal: &ReadJournal<PlatformLog>, calibrations: &[Named]) -> String {
    let mut html = String::from("<h2>Screws</h2>");
    if let Some(ClosureEntry { closure_m, .. }) = journal.log.closures.last() {
        let closure = Metres(*closure_m).um();
        let _ = write!(
            html,
            "<p>At the end the zero was off by {closure:.3} µm (closure).</p>"
        );
    }
    for axis in axes_of(journal) {
        let strokes: Vec<_> = journal
            .log
            .strokes
            .iter()
            .filter(|it| it.axis == axis)
            .collect();
        let record = calibrations.iter().find(|(_, it)| it.head.axis == axis);
        html += &format!("<h2>Screw {}</h2>", escape(axis));
        let content = record.map(|(id, it)| (id, &it.content));
        let model = content.map(|(_, it)| it.model());
        match content {
            Some((id, content)) => {
                let _ = write!(
                    html,
                    "<p>calibration {}, {} strokes, a single stop scatters by {} µm</p>{}{}",
                    short(id),
                    strokes.len(),
                    or_dash(content.scatter_m.map(|it| um(Metres(it)))),
                    screw_table(content),
                    budget::html(uncertainty::worst(content))
                );
            }
            None => html += "<p>No calibration was made from this run.</p>",
        }
        html += &format!(
            "<figure>{}</figure>",
            deviations(axis, &strokes, model.as_ref())
        );
        if let Some(model) = &model {
            html += &format!("<figure>{}</figure>", residuals(axis, &strokes, model));
        }
    }
    html
}

/// The screws in the order of the configuration, or as they appear.
fn axes_of(journal: &ReadJournal<PlatformLog>) -> Vec<&str> {
    let Some(ArrangementEntry { axes, .. }) = &journal.log.arrangement else {
        let mut axes: Vec<&str> = journal
            .log
            .strokes
            .iter()
            .map(|it| it.axis.as_str())
            .collect();
        axes.dedup();
        return axes;
    };
    axes.iter().map(String::as_str).collect()
}

const APPROACHES: [(Approach, &str, &str, &str); 2] = [
    (Approach::Forward, "forward ↑", "model ↑", BLUE),
    (Approach::Reverse, "reverse ↓", "model ↓", ORANGE),
];

fn of_approach<'a>(
    strokes: &'a [&'a StrokeEntry],
    approach: Approach,
) -> impl Iterator<Item = &'a StrokeEntry> {
    let strokes = strokes.iter().copied();
    strokes.filter(move |it| it.approach == approach.symbol())
}

fn deviations(axis: &str, strokes: &[&StrokeEntry], model: Option<&ScrewModel>) -> String {
    let mut series = Vec::new();
    for (approach, seen, modelled, colour) in APPROACHES {
        let point = |it: &StrokeEntry| {
            let deviation = Metres(it.measured_m - it.stroke_m);
            (Metres(it.stroke_m).mm(), deviation.um())
        };
        series.push(Series {
            name: seen,
            colour,
            mark: Mark::Dots,
            points: of_approach(strokes, approach).map(point).collect(),
        });
        series.extend(model.map(|model| Series {
            name: modelled,
            colour,
            mark: Mark::Line,
            points: curve(model, approach),
        }));
    }
    let title = format!("Deviation of screw {axis}");
    chart(&title, ("stroke (mm)", "deviation (µm)"), &series, None)
}

/// Of each stroke, in millimetres, the deviation that the model says, in micrometres.
pub(crate) fn curve(model: &ScrewModel, approach: Approach) -> Vec<(f64, f64)> {
    let point = |at: u32| {
        let share = f64::from(at) / f64::from(CURVE_POINTS);
        let stroke = model.first + (model.last - model.first) * share;
        (stroke.mm(), model.deviation(stroke, approach).um())
    };
    (0..=CURVE_POINTS).map(point).collect()
}

fn residuals(axis: &str, strokes: &[&StrokeEntry], model: &ScrewModel) -> String {
    let series = APPROACHES.map(|(approach, seen, _, colour)| {
        let point = |it: &StrokeEntry| {
            let stroke = Metres(it.stroke_m);
            let left = Metres(it.measured_m - it.stroke_m) - model.deviation(stroke, approach);
            (stroke.mm(), left.um())
        };
        Series {
            name: seen,
            colour,
            mark: Mark::Dots,
            points: of_approach(strokes, approach).map(point).collect(),
        }
    });
    let title = format!("What the model of screw {axis} leaves");
    chart(&title, ("stroke (mm)", "seen − model (µm)"), &series, None)
}

fn zeros(journals: &[&ReadJournal<PlatformLog>]) -> String {
    let mut html = String::from(
        "<table><tr><th>found</th><th>seen at x (µm)</th><th>y (µm)</th><th>angle (″)</th></tr>",
    );
    for journal in journals {
        for it in &journal.log.poses {
            let seen = Pose::from(it.seen);
            let _ = write!(
                html,
                "<tr><td>{}</td><td>{:.3}</td><td>{:.3}</td><td>{:.3}</td></tr>",
                escape(&journal.header.started),
                seen.x.um(),
                seen.y.um(),
                seen.angle.arcsec()
            );
        }
    }
    html + "</table><p class=\"note\">Where the camera sees the platform with all screws at their \
            zero, in the machine's frame.</p>"
}

fn screw_table(content: &ScrewContent) -> String {
    let mut html = String::from("<table><tr><th>term</th><th>value</th><th>u</th></tr>");
    for term in text::screw_terms(&content.model()) {
        let u = term.standard_uncertainty;
        let _ = write!(
            html,
            "<tr><td>{} ({})</td><td>{:.4}</td><td>{}</td></tr>",
            term.name,
            term.unit,
            term.value,
            u.map_or("–".to_owned(), |u| format!("{u:.4}")),
        );
    }
    html + "</table>"
}
