//! What forward and reverse passes differ by, on the page of a verification.

use machine::records::ReadJournal;
use units::Radians;

use crate::program::page::chart::{BLUE, Mark, Series, chart};
use crate::rotary::PlateLog;
use crate::rotary::bidirectional::Bidirectional;

/// The figures, and the reversal value over the turn.
pub(super) fn html(journal: &ReadJournal<PlateLog>, offset: f64) -> String {
    let log = &journal.log;
    let passes = log.plan.as_ref().map_or(1, |it| it.passes);
    let Some(it) = Bidirectional::of(&log.sweeps, offset, passes) else {
        return "<p>No line was read in both directions: figures of both (B, B̄) are not stated.</p>".into();
    };
    let of = |it: Option<Radians>| {
        it.map_or("– (one pass)".to_owned(), |it| {
            format!("{:.3}", it.arcsec())
        })
    };
    let [up, down] = it.repeatability.map(of);
    format!(
        "<h3>Bidirectional</h3><table><tr><th>″</th><th></th><th></th></tr>\
         <tr><td>mean reversal value, what the detector is late by included</td><td>B̄</td><td>{:.3}</td></tr>\
         <tr><td>largest difference from it</td><td></td><td>{:.3}</td></tr>\
         <tr><td>repeatability, forward</td><td>R↑</td><td>{up}</td></tr>\
         <tr><td>repeatability, reverse</td><td>R↓</td><td>{down}</td></tr></table><figure>{}</figure>",
        it.mean_reversal.arcsec(),
        it.reversal_variation.arcsec(),
        picture(&it)
    )
}

/// Less its mean, which is what the detector is late by for the most part.
fn picture(it: &Bidirectional) -> String {
    let lines = it.reversal.len().max(1) as f64;
    let each = it.reversal.iter().enumerate();
    let points = each.filter_map(|(position, value)| {
        let degrees = 360.0 * position as f64 / lines;
        Some((degrees, ((*value)? - it.mean_reversal).arcsec()))
    });
    let series = [Series::new("B − B̄", BLUE, Mark::Dots, points.collect())];
    let labels = ("table angle (°)", "forward − reverse, less its mean (″)");
    chart("Reversal value over the turn", labels, &series, None)
}
