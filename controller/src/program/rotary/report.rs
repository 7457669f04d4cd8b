//! The page of a rotary table's run: what was read of the plate, what it says of table and plate,
//! and the table as found and as left.

mod bidirectional;
mod harmonics;
mod head;

use core::fmt::Write as _;

use machine::records::{CalibrationRecord, ReadJournal};
use units::Radians;

use crate::program::budget;
use crate::program::page::band::{Sure, band, enlargement, said};
use crate::program::page::chart::{BLUE, Mark, ORANGE, Series, chart};
use crate::program::page::head::facts;
use crate::program::page::polar::polar;
use crate::program::page::{document, escape};
use crate::program::rotary::residuals::residuals_of;
use crate::program::rotary::uncertainty;
use crate::rotary::PlateLog;
use crate::rotary::placed::largest_closure;
use crate::rotary::verify::RotaryFigures;
use crate::rotary::{JudgedEntry, RotaryContent};

pub(crate) use self::head::head;

/// So many readings that were left out are named.
const NAMED: usize = 20;

/// The page of `journal`, with the calibrations that were made from it.
pub(crate) fn render(
    journal: &ReadJournal<PlateLog>,
    calibrations: &[(String, CalibrationRecord<RotaryContent>)],
) -> String {
    render_with(journal, calibrations, &[])
}

/// The same, with verifications that were made later, each under its name.
pub(crate) fn render_with(
    journal: &ReadJournal<PlateLog>,
    calibrations: &[(String, CalibrationRecord<RotaryContent>)],
    later: &[(&str, &ReadJournal<PlateLog>)],
) -> String {
    let header = &journal.header;
    let mut html = facts(&head(journal, calibrations));
    html += &placements(journal);
    for (_, record) in calibrations {
        html += &calibration(&record.content);
    }
    if header.verb == "calibrate" {
        html += &match residuals_of(journal) {
            Some(it) => residuals(&it),
            None => "<p class=\"note\">The placements read so far do not separate the errors of \
                     table and plate.</p>"
                .to_owned(),
        };
    }
    let own = core::iter::once(("", journal));
    for (name, journal) in own.chain(later.iter().copied()) {
        if let Some(judged) = &journal.log.judged {
            html += &verification(name, judged, journal);
        }
    }
    let note = "Angles are those of the table.";
    let title = format!("{} of rotary axis {}", header.verb, header.axis);
    document(&title, &html, note)
}

fn arcsec(radians: f64) -> f64 {
    Radians(radians).arcsec()
}

/// What was read in each placement.
fn placements(journal: &ReadJournal<PlateLog>) -> String {
    let mut html = String::from(
        "<h2>Placements</h2><table><tr><th>offset (lines)</th><th>passes</th><th>readings</th>\
         <th>not read</th><th>moved meanwhile (″)</th></tr>",
    );
    let mut offsets: Vec<f64> = journal.log.sweeps.iter().map(|it| it.offset).collect();
    offsets.dedup();
    for offset in offsets {
        let own = || {
            journal
                .log
                .sweeps
                .iter()
                .filter(move |it| it.offset == offset)
        };
        let all = own().map(|it| it.deviations_rad.len()).sum::<usize>();
        let read = own().map(|it| it.deviations_rad.iter().flatten().count());
        let read: usize = read.sum();
        let closed = journal.log.placements.iter().find(|it| it.offset == offset);
        let moved = closed.map_or("not read to its end".to_owned(), |it| {
            format!("{:+.3}", arcsec(it.closure_rad))
        });
        let _ = write!(
            html,
            "<tr><td>{offset}</td><td>{}</td><td>{read}</td><td>{}</td><td>{moved}</td></tr>",
            own().count(),
            all - read
        );
    }
    html += "</table>";
    let closures = journal.log.placements.iter();
    let moved = largest_closure(closures.map(|it| Radians(it.closure_rad)));
    html + &format!(
        "<p>The plate moved by {:.3} ″ at most while it was read.</p>",
        moved.arcsec()
    )
}

/// Degrees on the table, and arcseconds.
fn points<'a>(values: impl Iterator<Item = Option<f64>> + 'a, lines: u32) -> Vec<(f64, f64)> {
    let place = move |at: u32| 360.0 * f64::from(at) / f64::from(lines.max(1));
    (0..)
        .zip(values)
        .filter_map(|(at, value)| Some((place(at), arcsec(value?))))
        .collect()
}

fn calibration(content: &RotaryContent) -> String {
    let lines = content.lines;
    let table = || content.table_error_rad.iter().copied();
    let curve = points(table().map(Some), lines);
    let known = content.standard_uncertainty_rad.as_ref();
    let u_at = |line: usize| known.map_or(0.0, |it| arcsec(it[line]));
    let sure = curve.iter().enumerate();
    let sure = sure.map(|(line, (x, y))| (*x, *y, u_at(line)));
    let sure: Vec<Sure> = sure.collect();
    let factor = enlargement([sure.as_slice()].into_iter());
    let mut table_series = vec![Series::new("table error", BLUE, Mark::Line, curve)];
    let mut shaded = String::new();
    if known.is_some() {
        // Beneath the curve.
        table_series.insert(0, band("2 u", ORANGE, &sure, factor));
        shaded = said(factor);
    }
    let plate = points(content.plate_error_rad.iter().copied(), lines);
    let round = polar("Table error over a turn", "″", &sure, factor);
    let harmonics = harmonics::html(content);
    let plate = [Series::new("plate error", BLUE, Mark::Dots, plate)];
    let u = content.uncertainty_max();
    let u = u.map_or("unknown".to_owned(), |u| {
        format!("{:.4} ″ at most", u.arcsec())
    });
    let mut html = format!(
        "<h2>Table error</h2><p>Up to {:.3} ″ at the lines; standard uncertainty {u}; residuals {:.4} ″ rms with {} \
         degrees of freedom; noise of a reading amplified {:.3} times. The table error {}.</p><figure>{}</figure>{shaded}\
         <figure>{round}</figure>{harmonics}<h2>Plate error</h2><p>Up to {:.3} ″.</p><figure>{}</figure>",
        content.largest_error().arcsec(),
        arcsec(content.residual_rms_rad),
        content.degrees_of_freedom,
        content.noise_amplification,
        content.harmonics_told(),
        chart(
            "Table error and its standard uncertainty",
            ("table angle (°)", "reading − true angle (″)"),
            &table_series,
            None,
        ),
        content.largest_plate_error().arcsec(),
        chart(
            "Plate error",
            (
                "line, as an angle on the plate (°)",
                "error of the line (″)"
            ),
            &plate,
            None,
        ),
    );
    html += &format!(
        "<h3>Uncertainty</h3>{}",
        budget::html(uncertainty::worst(content))
    );
    html += &named(
        "Missing readings",
        &content
            .missing
            .iter()
            .map(|it| (it.line, it.offset))
            .collect::<Vec<_>>(),
    );
    html += &named(
        "Left out as outliers",
        &content
            .outliers
            .iter()
            .map(|it| (it.line, it.offset))
            .collect::<Vec<_>>(),
    );
    html
}

fn named(what: &str, readings: &[(u32, u32)]) -> String {
    if readings.is_empty() {
        return String::new();
    }
    let mut names: Vec<_> = readings
        .iter()
        .take(NAMED)
        .map(|(line, offset)| format!("line {line} at offset {offset}"))
        .collect();
    if readings.len() > NAMED {
        names.push(format!("and {} more", readings.len() - NAMED));
    }
    format!("<p>{}: {}.</p>", escape(what), names.join(", "))
}

fn residuals(each: &[(Radians, Radians)]) -> String {
    let points = each
        .iter()
        .map(|(at, residual)| (at.degrees(), residual.arcsec()));
    let dots = [Series::new(
        "one reading",
        BLUE,
        Mark::Dots,
        points.collect(),
    )];
    format!(
        "<h2>Residuals</h2><p>What the fit leaves of each reading, all placements \
         together.</p><figure>{}</figure>",
        chart(
            "Residuals of all placements",
            ("table angle (°)", "reading − model (″)"),
            &dots,
            None,
        )
    )
}

/// Deviations by line, as degrees of the table and arcseconds.
pub(crate) fn places(journal: &ReadJournal<PlateLog>, values: &[Option<f64>]) -> Vec<(f64, f64)> {
    let offset = offset_of(journal);
    let lines = values.len().max(1) as f64;
    let place = |line: usize| ((line as f64 + offset) % lines) * 360.0 / lines;
    let each = values.iter().enumerate();
    let mut points: Vec<_> = each
        .filter_map(|(line, value)| Some((place(line), arcsec((*value)?))))
        .collect();
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    points
}

/// By how many lines the plate of a verification was turned.
fn offset_of(journal: &ReadJournal<PlateLog>) -> f64 {
    let plan = journal.log.plan.as_ref();
    let offset = plan.and_then(|it| it.offsets.first()).copied();
    offset.unwrap_or(0.0)
}

fn verification(name: &str, judged: &JudgedEntry, journal: &ReadJournal<PlateLog>) -> String {
    let mut html = format!("<h2>As found and as left{}</h2>", escape(name));
    if !judged.plate_known {
        html += "<p>No calibration contains this plate: its errors are part of these \
                 deviations.</p>";
    }
    html += "<table><tr><th></th><th>largest (″)</th><th>rms (″)</th></tr>";
    let left = judged.left_rad.as_ref();
    let both = [("as found", Some(&judged.found_rad)), ("as left", left)];
    for (name, values) in both {
        let Some(values) = values else { continue };
        let RotaryFigures { largest, rms, .. } = RotaryFigures::of_record(values);
        let _ = write!(
            html,
            "<tr><td>{name}</td><td>{:.3}</td><td>{:.3}</td></tr>",
            largest.arcsec(),
            rms.arcsec()
        );
    }
    let _ = write!(
        html,
        "</table><p>tolerance {:.3} ″ as left</p>",
        arcsec(judged.tolerance_rad)
    );
    html += &bidirectional::html(journal, offset_of(journal));
    for (name, values) in both {
        let Some(values) = values else { continue };
        let points = places(journal, values);
        let limit = (name == "as left").then(|| arcsec(judged.tolerance_rad));
        let dots = [Series::new("deviation", BLUE, Mark::Dots, points)];
        let labels = ("table angle (°)", "deviation (″)");
        let _ = write!(
            html,
            "<h3>Deviation {name}</h3><figure>{}</figure>",
            chart(name, labels, &dots, limit)
        );
    }
    html
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 40 lines; the interpolation between them goes beyond the largest of them.
    fn content() -> RotaryContent {
        let error = |line: u32| 5e-5 * (f64::from(line) * 0.7 + 0.3).sin();
        RotaryContent {
            lines: 40,
            offsets: vec![0, 1],
            table_error_rad: (0..40).map(error).collect(),
            standard_uncertainty_rad: Some(vec![5e-8; 40]),
            plate_error_rad: vec![Some(1e-6); 40],
            ..RotaryContent::default()
        }
    }

    #[test]
    fn the_curve_lies_on_its_band_which_is_enlarged_until_it_is_seen() {
        let html = calibration(&content());
        let (band, curve) = (html.find("<polygon"), html.find("<polyline"));
        assert!(band.is_some() && band < curve, "{band:?} {curve:?}");
        assert!(html.contains("enlarged 50 times"), "{html}");
        let unsure = RotaryContent {
            standard_uncertainty_rad: None,
            ..content()
        };
        let html = calibration(&unsure);
        assert!(!html.contains("<polygon") && !html.contains("Shaded"));
    }

    #[test]
    fn the_page_shows_the_largest_error_that_lists_show() {
        let largest = format!("{:.3}", content().largest_error().arcsec());
        let listed = content().summary();
        assert!(
            listed.contains(&format!("up to {largest} arcsec")),
            "{listed}"
        );
        let html = calibration(&content());
        assert!(html.contains(&format!("Up to {largest} ″ at the lines")));
        assert!(html.contains("for harmonics up to 19 of a turn"), "{html}");
    }
}
