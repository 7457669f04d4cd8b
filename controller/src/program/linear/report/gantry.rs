//! How far the stage of a gantry was turned, on the page.

use core::fmt::Write as _;

use units::Metres;

use crate::linear::RotationEntry;
use crate::program::linear::gantry::compared;
use crate::program::page::escape;

pub(super) fn html(it: &RotationEntry) -> String {
    let mut html = format!(
        "<p>turned by {:+.3} µrad, standard uncertainty {:.3} µrad, where both drives showed the same; positive where \
         {} is ahead. {}</p>",
        it.angle_rad * 1e6,
        it.standard_uncertainty_rad * 1e6,
        escape(&it.ahead_when_positive),
        escape(&compared(it)),
    );
    html += "<table><tr><th>side</th><th>zero point (µm)</th><th>journal</th></tr>";
    for ((axis, origin), journal) in it.axes.iter().zip(it.origins_m).zip(&it.zeros) {
        let _ = write!(
            html,
            "<tr><td>{}</td><td>{:.3}</td><td>{}</td></tr>",
            escape(axis),
            Metres(origin).um(),
            escape(journal)
        );
    }
    html + "</table>"
}
