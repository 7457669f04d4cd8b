//! The page of a linear axis: facts, deviations, figures of ISO 230-2, its table and its zeros.

mod deviations;
mod gantry;
mod job;
mod uncertainty;

use core::fmt::Write as _;

use compensator::iso230::Figures;
use units::Metres;

use crate::linear::{LinearContent, LinearLog, PointEntry, RotationEntry, ZeroEntry};
use crate::program::page::{document, escape, facts};
use crate::program::text;

/// One measured series on the page.
#[derive(Clone, Debug)]
pub(crate) struct Section<'a> {
    /// Its heading: `as found`, `as left` …
    pub(crate) title: String,
    /// Its figures.
    pub(crate) figures: &'a Figures,
    /// Its points.
    pub(crate) points: &'a [PointEntry],
}

/// What a page shows.
#[derive(Clone, Debug, Default)]
pub(crate) struct Page<'a> {
    /// Heading.
    pub(crate) title: String,
    /// Name and value, for the head of the page.
    pub(crate) facts: Vec<(String, String)>,
    /// Measured series.
    pub(crate) sections: Vec<Section<'a>>,
    /// The calibration in use.
    pub(crate) calibration: Option<&'a LinearContent>,
    /// Zeros found, in order.
    pub(crate) zeros: Vec<ZeroEntry>,
    /// How far a gantry's stage was turned, each time.
    pub(crate) rotations: Vec<RotationEntry>,
    /// The journal of a job.
    pub(crate) job: Option<&'a LinearLog>,
}

/// The page as HTML.
pub(crate) fn render(page: &Page<'_>) -> String {
    let mut html = facts(&page.facts);
    if let Some((job, log)) = page.job.and_then(|it| Some((it.job.as_ref()?, it))) {
        html += &job::html(job, log);
    }
    if !page.sections.is_empty() {
        html += "<h2>ISO 230-2 figures</h2>";
        html += &figures(&page.sections);
    }
    for section in &page.sections {
        html += &format!("<h2>Deviation {}</h2>", escape(&section.title));
        html += &format!("<figure>{}</figure>", deviations::deviations(section));
    }
    if let Some(calibration) = page.calibration {
        html += "<h2>Calibration</h2>";
        html += &table(calibration);
        html += "<h3>Uncertainty</h3>";
        html += &uncertainty::html(calibration);
    }
    if !page.zeros.is_empty() {
        html += "<h2>Zeros</h2>";
        html += &zeros(&page.zeros);
    }
    for rotation in &page.rotations {
        html += "<h2>Rotation of the stage</h2>";
        html += &gantry::html(rotation);
    }
    let note = "deviation = actual − target. Bars are mean ± 2 s at each target.";
    document(&page.title, &html, note)
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
    html += "</table>";
    for section in sections {
        if let Some(lack) = text::lack(&section.figures.conformity) {
            html += &format!("<p>{}: {}</p>", escape(&section.title), escape(&lack));
        }
    }
    html
}

fn table(content: &LinearContent) -> String {
    let cell = |value: Option<f64>| {
        value.map_or("–".to_owned(), |metres| {
            format!("{:.3}", Metres(metres).um())
        })
    };
    let mut html = format!(
        "<p>{} positions, largest deviation {}, {} runs, {}</p><table><tr><th>position (mm)</th><th>deviation ↑ (µm)</th><th>deviation ↓ (µm)</th>\
         <th>u ↑ (µm)</th><th>u ↓ (µm)</th></tr>",
        content.nodes.len(),
        content
            .table("")
            .map_or("–".into(), |it| format!("{:.3} µm", it.largest().um())),
        content.runs,
        text::closure(content.closure_m.map(Metres))
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
    html + "</table>" + &uncertainty::of_last(zeros)
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
