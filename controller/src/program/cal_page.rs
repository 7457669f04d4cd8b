//! Two calibrations side by side on a page.

use machine::records::Glance;

use crate::program::page::head::{Fact, facts};
use crate::program::page::{document, escape};

/// The page of two calibrations with these names: `lines` are what the screen says of their changes, `drawn` is what
/// both look like.
pub(crate) fn html(both: [(&str, &Glance); 2], lines: &str, drawn: &str) -> String {
    let [before, after] = both.map(|(id, it)| facts(&head(id, it)));
    let body = format!(
        "<h2>Before</h2>{before}<h2>After</h2>{after}{drawn}<h2>Changes</h2><pre>{}</pre>",
        escape(lines)
    );
    let [(_, before), _] = both;
    let title = format!("Two calibrations of {}", before.head.axis);
    document(
        &title,
        &body,
        "A change is after − before; a deviation is actual − target.",
    )
}

fn head(id: &str, it: &Glance) -> Vec<Fact> {
    let head = &it.head;
    let mut facts = vec![
        Fact::new("calibration", id),
        Fact::new(
            "machine",
            format!(
                "{} (stage {}), {}",
                head.machine, head.stage_serial, head.axis
            ),
        ),
        Fact::new("made", format!("{} by {}", head.created, head.program)),
        Fact::new("from", head.source.clone()),
        Fact::new("configuration", head.config_hash.clone()),
        Fact::new("contents", it.summary.clone()),
    ];
    if let Some(warning) = head.instrument.warning() {
        facts.push(Fact::new("corrections off", warning).red_if(true));
    }
    facts
}
