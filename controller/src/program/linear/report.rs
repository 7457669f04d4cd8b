//! The page of a linear axis: its head, deviations with the figures of ISO 230-2, its table, its zeros, and what
//! drifted.

mod drift;
mod error_table;
mod gantry;
mod hall;
mod head;
mod iso_plot;
mod job;
mod syncs;
mod targets;
mod uncertainty;

use core::fmt::Write as _;

use compensator::iso230::Figures;
use units::Metres;

use crate::linear::{CriterionEntry, LinearContent, LinearLog, PointEntry, RotationEntry};
use crate::program::page::head::{Fact, facts};
use crate::program::page::{document, escape};
use crate::program::text;

pub(crate) use self::head::{CALIBRATE, head};

/// One measured series on the page.
#[derive(Clone, Debug)]
pub(crate) struct Section<'a> {
    /// Its heading: `as found`, `as left` …
    pub(crate) title: String,
    /// Whether a calibration is made from it, which is no test.
    pub(crate) is_calibration: bool,
    /// Its figures.
    pub(crate) figures: &'a Figures,
    /// Its points.
    pub(crate) points: &'a [PointEntry],
    /// By what it is judged.
    pub(crate) criterion: Option<&'a CriterionEntry>,
}

/// What a page shows.
#[derive(Clone, Debug, Default)]
pub(crate) struct Page<'a> {
    /// Heading.
    pub(crate) title: String,
    /// The head of the page.
    pub(crate) facts: Vec<Fact>,
    /// Measured series.
    pub(crate) sections: Vec<Section<'a>>,
    /// The calibration that was made, or is in use.
    pub(crate) calibration: Option<&'a LinearContent>,
    /// The journals whose zeros, drift and punctuality are shown.
    pub(crate) logs: Vec<&'a LinearLog>,
}

/// The page as HTML.
pub(crate) fn render(page: &Page<'_>) -> String {
    let mut html = facts(&page.facts);
    for log in &page.logs {
        if let Some(job) = &log.job {
            html += &job::html(job, log);
        }
    }
    html += &deviations(&page.sections);
    if let Some(calibration) = page.calibration {
        html += "<h2>Calibration</h2>";
        html += &error_table::html(calibration);
        html += "<h3>Uncertainty</h3>";
        html += &uncertainty::html(calibration);
    }
    html += &zeros(&page.logs);
    let rotations = page.logs.iter().flat_map(|it| &it.rotations);
    html += &rotations.map(rotation).collect::<String>();
    for log in &page.logs {
        html += &drift::html(&log.closures, &log.points);
        html += &syncs::html(&log.syncs);
    }
    document(&page.title, &html, "")
}

fn rotation(it: &RotationEntry) -> String {
    format!("<h2>Rotation of the stage</h2>{}", gantry::html(it))
}

/// The figures of all series, all at one scale, then each by itself.
fn deviations(sections: &[Section<'_>]) -> String {
    if sections.is_empty() {
        return String::new();
    }
    let mut html = format!("<h2>ISO 230-2 figures</h2>{}", figures(sections));
    let extents: Vec<_> = sections.iter().map(iso_plot::extent).collect();
    if sections.len() > 1 {
        html += &at_one_scale(sections);
    }
    for (it, extent) in sections.iter().zip(extents) {
        let _ = write!(html, "<h2>Deviation {}</h2>", escape(&it.title));
        html += &plot(it, extent, "");
        html += &targets::html(it);
    }
    html
}

/// The plots of all series, on axes that show each of them.
pub(crate) fn at_one_scale(sections: &[Section<'_>]) -> String {
    let extents = sections.iter().map(iso_plot::extent);
    let all = extents.fold([0.0_f64, 0.0], |[low, high], it| {
        [low.min(it[0]), high.max(it[1])]
    });
    let caption = |it: &Section<'_>| format!("<figcaption>{}</figcaption>", escape(&it.title));
    let plots = sections.iter().map(|it| plot(it, all, &caption(it)));
    format!(
        "<h2>Deviations at one scale</h2>{}",
        plots.collect::<String>()
    )
}

/// Under a heading that says whose it is it needs no `caption`.
fn plot(section: &Section<'_>, extent: [f64; 2], caption: &str) -> String {
    format!(
        "<figure>{caption}{}</figure>",
        iso_plot::iso_plot(section, extent)
    )
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
        let lack = match section.is_calibration {
            true => text::no_test,
            false => text::lack,
        };
        if let Some(lack) = lack(&section.figures.conformity) {
            html += &format!("<p>{}: {}</p>", escape(&section.title), escape(&lack));
        }
    }
    html
}

fn zeros(logs: &[&LinearLog]) -> String {
    if logs.iter().all(|it| it.zeros.is_empty()) {
        return String::new();
    }
    let mut html = String::from(
        "<h2>Zeros</h2><table><tr><th>no.</th><th>origin before (µm)</th><th>u (µm)</th><th>U, k = 2 (µm)</th>\
         <th>peak (V)</th><th>mid voltage (V)</th></tr>",
    );
    for (at, zero) in (1..).zip(logs.iter().flat_map(|it| &it.zeros)) {
        let u = Metres(zero.standard_uncertainty_m).um();
        let _ = write!(
            html,
            "<tr><td>{at}</td><td>{:.3}</td><td>{u:.3}</td><td>{:.3}</td><td>{:.4}</td><td>{:.4}</td></tr>",
            Metres(zero.origin_m).um(),
            2.0 * u,
            zero.peak_max_v,
            zero.mid_v
        );
    }
    html += "</table>";
    for log in logs {
        for sweep in &log.sweeps {
            let zero = sweep.led_to.map(|it| &log.zeros[it]);
            html += &hall::html(&sweep.read, zero);
        }
    }
    html + &uncertainty::of_last(logs.iter().flat_map(|it| &it.zeros))
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

    fn page_of(golden: &str) -> String {
        let golden = format!("{}/golden/{golden}", env!("CARGO_MANIFEST_DIR"));
        crate::program::linear::page::html(golden.as_ref()).unwrap()
    }

    #[test]
    fn a_picture_below_its_own_heading_has_no_caption_that_says_the_same() {
        let html = page_of("linear_calibrate.jsonl");
        assert!(html.contains("<h2>Deviation at the calibrated positions</h2>"));
        assert!(!html.contains("<figcaption>"), "{html}");
    }
}
