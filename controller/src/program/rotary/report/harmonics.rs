//! The harmonics of a table error on its page.

use core::fmt::Write as _;

use compensator::rotary::{TABLES_PER_FALSE_HARMONIC, TableHarmonic};

use crate::program::page::chart::{BLUE, Mark, ORANGE, Series, chart};
use crate::rotary::RotaryContent;

/// So many of those that are more than noise are in the table: the largest.
const LISTED: usize = 12;

/// All as a picture, the largest with their uncertainty; up to where they hold is said above.
pub(super) fn html(content: &RotaryContent) -> String {
    let all = content.harmonics();
    let significant = all.iter().filter(|it| it.is_significant).count();
    format!(
        "<h3>Harmonics</h3><p>{significant} of {} are larger than noise makes any of them in one of {TABLES_PER_FALSE_HARMONIC:.0} tables.</p>\
         <figure>{}</figure>{}",
        all.len(),
        picture(&all),
        table(all)
    )
}

fn picture(all: &[TableHarmonic]) -> String {
    let number = |it: &TableHarmonic| it.number as f64;
    let amplitudes = all.iter().map(|it| (number(it), it.amplitude.arcsec()));
    let limits = all.iter().filter_map(|it| {
        let u = it.standard_uncertainty?;
        Some((number(it), (u * 2.0).arcsec()))
    });
    let series = [
        Series::new("amplitude", BLUE, Mark::Bars, amplitudes.collect()),
        Series::new("U, k = 2", ORANGE, Mark::Line, limits.collect()),
    ];
    let labels = ("periods in a turn", "amplitude (″)");
    chart("Harmonics of the table error", labels, &series, None)
}

fn table(mut all: Vec<TableHarmonic>) -> String {
    all.retain(|it| it.is_significant);
    if all.is_empty() {
        return String::new();
    }
    all.sort_by(|a, b| b.amplitude.value().total_cmp(&a.amplitude.value()));
    let mut html = String::from(
        "<table><tr><th>periods in a turn</th><th>amplitude (″)</th><th>U, k = 2 (″)</th><th>phase (°)</th></tr>",
    );
    for it in all.iter().take(LISTED) {
        let u = it
            .standard_uncertainty
            .map(|it| format!("{:.4}", (it * 2.0).arcsec()));
        let _ = write!(
            html,
            "<tr><td>{}</td><td>{:.4}</td><td>{}</td><td>{:.2}</td></tr>",
            it.number,
            it.amplitude.arcsec(),
            u.unwrap_or("–".into()),
            it.phase.degrees()
        );
    }
    html + "</table><p class=\"note\">reading − true angle = amplitude · cos(periods · angle − phase).</p>"
}
