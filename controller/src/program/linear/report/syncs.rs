//! How punctual the SYNCs were.

use core::fmt::Write as _;

use crate::linear::SyncsEntry;
use crate::program::page::escape;

/// A row for each bus; nothing where no thread sent any.
pub(super) fn html(syncs: &[SyncsEntry]) -> String {
    let Some(first) = syncs.first() else {
        return String::new();
    };
    let mut html =
        String::from("<h2>SYNC lateness</h2><table><tr><th>bus</th><th>sent</th><th>left out</th>");
    for share in &first.shares {
        let _ = write!(html, "<th>{} % (µs)</th>", share * 100.0);
    }
    html += "</tr>";
    for it in syncs {
        let _ = write!(
            html,
            "<tr><td>{}</td><td>{}</td><td>{}</td>",
            escape(&it.bus),
            it.sent,
            it.skipped
        );
        for late_s in &it.late_s {
            let _ = write!(html, "<td>{:.0}</td>", late_s * 1e6);
        }
        html += "</tr>";
    }
    html + "</table><p class=\"note\">How late so many of the SYNCs were at most, in wall time, since the program was \
            connected.</p>"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_latest_sync_of_each_bus_is_told_in_microseconds() {
        let it = SyncsEntry {
            bus: "can0".into(),
            sent: 4000,
            skipped: 2,
            shares: vec![0.5, 1.0],
            late_s: vec![31e-6, 2.5e-3],
        };
        let html = html(&[it]);
        assert!(
            html.contains("<th>50 % (µs)</th><th>100 % (µs)</th>"),
            "{html}"
        );
        assert!(html.contains("<td>can0</td><td>4000</td><td>2</td><td>31</td><td>2500</td>"));
        assert!(super::html(&[]).is_empty());
    }
}
