//! A self-contained page of a run: facts, plots, figures. No script, no network.

mod agreement;
mod band;
mod chart;
pub mod platform;
pub mod rotary;
mod svg;
pub mod volumetric;

use core::fmt::Write as _;

use compensator::iso230::Figures;
use units::{Metres, Radians};

use crate::store::{
    CalibrationRecord, Content, IdentityRecord, LinearContent, PointEntry, ReadJournal,
    RotaryContent, ScrewContent, ZeroEntry,
};
use crate::text;

/// One measured series on the page.
#[derive(Clone, Debug)]
pub struct Section<'a> {
    /// Its heading: `as found`, `as left` …
    pub title: String,
    /// Its figures.
    pub figures: &'a Figures,
    /// Its points.
    pub points: &'a [PointEntry],
}

/// What a page shows.
#[derive(Clone, Debug, Default)]
pub struct Page<'a> {
    /// Heading.
    pub title: String,
    /// Name and value, for the head of the page.
    pub facts: Vec<(String, String)>,
    /// Measured series.
    pub sections: Vec<Section<'a>>,
    /// The calibration in use.
    pub calibration: Option<&'a CalibrationRecord>,
    /// Zeros found, in order.
    pub zeros: Vec<ZeroEntry>,
}

const STYLE: &str = "\
body{font:15px/1.5 system-ui,sans-serif;max-width:62rem;margin:2rem auto;padding:0 1rem;\
color:#1c2430;background:#fff}h1{font-size:1.6rem}h2{font-size:1.15rem;margin-top:2.2rem}\
h3{font-size:1rem}\
table{border-collapse:collapse;margin:.6rem 0}td,th{padding:.2rem .8rem;text-align:right;\
border-bottom:1px solid #dde3ea}th{color:#566}td:first-child,th:first-child{text-align:left}\
svg{width:100%;height:auto}.note{color:#566}figure{margin:0}";

/// The fact that names the calibration in use.
const IN_USE: &str = "calibration in use";

/// The page as HTML.
pub fn render(page: &Page<'_>) -> String {
    let mut html = facts(&page.facts);
    if !page.sections.is_empty() {
        html += "<h2>ISO 230-2 figures</h2>";
        html += &figures(&page.sections);
    }
    for section in &page.sections {
        html += &format!("<h2>Deviation {}</h2>", escape(&section.title));
        html += &format!("<figure>{}</figure>", svg::deviations(section));
    }
    if let Some(calibration) = page.calibration {
        html += "<h2>Calibration</h2>";
        html += &match &calibration.content {
            Content::LinearErrorTable(content) => linear_table(content),
            Content::RotaryErrorTable(content) => rotary_table(content),
            Content::ScrewModel(content) => screw_table(content),
            Content::VolumetricGeometry(content) => volumetric::geometry(content),
            Content::BeamReferences(_) | Content::StateMemory(_) => {
                format!("<p>{}</p>", escape(&calibration.content.summary()))
            }
        };
    }
    if !page.zeros.is_empty() {
        html += "<h2>Zeros</h2>";
        html += &zeros(&page.zeros);
    }
    let note = "deviation = actual − target. Bars are mean ± 2 s at each target.";
    document(&page.title, &html, note)
}

/// A whole page around `body`; `note` says how to read it.
fn document(title: &str, body: &str, note: &str) -> String {
    let title = escape(title);
    format!(
        "<!doctype html><html lang=\"en\"><head><meta charset=\"utf-8\">\
         <meta name=\"viewport\" content=\"width=device-width\"><title>{title}</title>\
         <style>{STYLE}</style></head><body><h1>{title}</h1>{body}\
         <p class=\"note\">{note} Made by truestage; not a certificate.</p></body></html>\n"
    )
}

/// The head of a page for one run.
pub fn facts_of(journal: &ReadJournal) -> Vec<(String, String)> {
    let header = &journal.header;
    let points = journal.points.len() + journal.strokes.len() + journal.poses.len();
    let mut facts = vec![
        (
            "machine".to_owned(),
            format!("{} (stage {})", header.machine, header.stage_serial),
        ),
        ("axis".to_owned(), header.axis.clone()),
        (
            "run".to_owned(),
            format!("{}, started {}", header.verb, header.started),
        ),
        (
            IN_USE.to_owned(),
            header.calibration.clone().unwrap_or("none".into()),
        ),
        ("points".to_owned(), points.to_string()),
        (
            "complete".to_owned(),
            if journal.complete { "yes" } else { "no" }.to_owned(),
        ),
    ];
    if let Some(cause) = &journal.failure {
        facts.push(("ended because".to_owned(), cause.clone()));
    }
    // What several drives move together names none of them.
    let drive = &header.drive;
    if *drive != IdentityRecord::default() {
        let value = format!(
            "{} {:#X}:{:#X}, serial {}",
            drive.name, drive.vendor, drive.product, drive.serial
        );
        facts.push(("drive".to_owned(), value));
    }
    if !header.instrument.name.is_empty() {
        let it = &header.instrument;
        let on = [
            ("air", it.air_corrected),
            ("material", it.material_corrected),
            ("dead path", it.dead_path_corrected),
            ("cosine", it.cosine_corrected),
        ];
        let on: Vec<_> = on
            .iter()
            .filter(|(_, on)| *on)
            .map(|(name, _)| *name)
            .collect();
        let corrected = if on.is_empty() {
            "nothing".to_owned()
        } else {
            on.join(", ")
        };
        let value = format!("{} ({}), corrected for {corrected}", it.name, it.identity);
        facts.push(("instrument".to_owned(), value));
    }
    facts
}

fn facts(facts: &[(String, String)]) -> String {
    let rows = facts.iter().fold(String::new(), |mut rows, (name, value)| {
        let value = escape(value);
        let _ = write!(
            rows,
            "<tr><th>{}</th><td style=\"text-align:left\">{value}</td></tr>",
            escape(name)
        );
        rows
    });
    format!("<table>{rows}</table>")
}

fn figures(sections: &[Section<'_>]) -> String {
    let mut html = String::from("<table><tr><th>µm</th><th></th>");
    for section in sections {
        let _ = write!(html, "<th>{}</th>", escape(&section.title));
    }
    html += "</tr>";
    for (name, symbol, figure) in text::ROWS {
        let _ = write!(html, "<tr><td>{name}</td><td>{symbol}</td>");
        for section in sections {
            let _ = write!(html, "<td>{:.3}</td>", figure(section.figures).um());
        }
        html += "</tr>";
    }
    html + "</table>"
}

fn linear_table(content: &LinearContent) -> String {
    let cell = |value: Option<f64>| {
        value.map_or("–".to_owned(), |metres| {
            format!("{:.3}", Metres(metres).um())
        })
    };
    let mut html = String::from(
        "<table><tr><th>position (mm)</th><th>deviation ↑ (µm)</th><th>deviation ↓ (µm)</th>\
         <th>u ↑ (µm)</th><th>u ↓ (µm)</th></tr>",
    );
    for node in &content.nodes {
        let _ = write!(
            html,
            "<tr><td>{:.3}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>",
            Metres(node.position_m).mm(),
            cell(node.forward_m),
            cell(node.reverse_m),
            cell(node.forward_u_m),
            cell(node.reverse_u_m)
        );
    }
    html + "</table>"
}

fn rotary_table(content: &RotaryContent) -> String {
    let cell = |value: Option<f64>| {
        value.map_or("–".to_owned(), |radians| {
            format!("{:.4}", Radians(radians).arcsec())
        })
    };
    let mut html = String::from(
        "<table><tr><th>line</th><th>table error (″)</th><th>u (″)</th><th>plate (″)</th></tr>",
    );
    let u = content.standard_uncertainty_rad.as_ref();
    for (line, error) in content.table_error_rad.iter().enumerate() {
        let _ = write!(
            html,
            "<tr><td>{line}</td><td>{}</td><td>{}</td><td>{}</td></tr>",
            cell(Some(*error)),
            cell(u.and_then(|it| it.get(line).copied())),
            cell(content.plate_error_rad.get(line).copied().flatten()),
        );
    }
    html + "</table>"
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

fn zeros(zeros: &[ZeroEntry]) -> String {
    let mut html = String::from(
        "<table><tr><th>no.</th><th>origin before (µm)</th><th>u (µm)</th><th>peak (V)</th>\
         <th>mid voltage (V)</th></tr>",
    );
    for (at, zero) in zeros.iter().enumerate() {
        let _ = write!(
            html,
            "<tr><td>{}</td><td>{:.3}</td><td>{:.3}</td><td>{:.4}</td><td>{:.4}</td></tr>",
            at + 1,
            Metres(zero.origin_m).um(),
            Metres(zero.standard_uncertainty_m).um(),
            zero.peak_max_v,
            zero.mid_v
        );
    }
    html + "</table>"
}

pub(crate) fn escape(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_person_typed_cannot_become_markup() {
        let page = Page {
            title: "<script>\"x\"&".into(),
            ..Page::default()
        };
        let html = render(&page);
        assert!(!html.contains("<script>"));
        assert!(html.contains("&lt;script&gt;&quot;x&quot;&amp;"));
    }
}
