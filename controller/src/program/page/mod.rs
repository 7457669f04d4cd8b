//! Pages for people: self-contained, of facts, tables and pictures. No script, no network.

pub(crate) mod band;
pub(crate) mod chart;
pub(crate) mod svg;

use core::fmt::Write as _;

use machine::records::{IdentityRecord, ReadJournal};

/// By the reader's own scheme on a screen, dark on light on paper. Colours of pictures are named here, too: a
/// picture in the page takes them from it.
pub(crate) const STYLE: &str = "\
:root{color-scheme:light dark;--ink:#1c2430;--paper:#fff;--quiet:#566;--rule:#dde3ea;--grid:#e4e9ef;--zero:#8794a3;\
--limit:#b91c1c;--warning:#b00020;--first:#0b66c3;--second:#c2410c;--third:#4d7c0f;--fourth:#7e22ce;--fifth:#0f766e;\
--sixth:#475569}\
@media screen and (prefers-color-scheme:dark){:root{--ink:#e4e8ee;--paper:#12161c;--quiet:#9aa7b5;--rule:#2c3540;\
--grid:#242c36;--zero:#6b7887;--limit:#f87171;--warning:#ff8a80;--first:#60a5fa;--second:#fb923c;--third:#a3d154;\
--fourth:#c084fc;--fifth:#2dd4bf;--sixth:#a8b3c2}}\
body{font:15px/1.5 system-ui,sans-serif;max-width:62rem;margin:2rem auto;padding:0 1rem;\
color:var(--ink);background:var(--paper)}h1{font-size:1.6rem}h2{font-size:1.15rem;margin-top:2.2rem}\
h3{font-size:1rem}\
table{border-collapse:collapse;margin:.6rem 0}td,th{padding:.2rem .8rem;text-align:right;\
border-bottom:1px solid var(--rule)}th{color:var(--quiet)}td:first-child,th:first-child{text-align:left}\
svg{width:100%;height:auto}figure{margin:0}.note{color:var(--quiet)}\
.warning *{color:var(--warning);font-weight:600}\
@media print{:root{color-scheme:light}body{max-width:none;margin:0;padding:0;font-size:11px}\
figure,svg,tr{break-inside:avoid}h2,h3{break-after:avoid}}";

/// The fact that names the calibration in use.
pub(crate) const IN_USE: &str = "calibration in use";

/// The fact that nobody may overlook: it is red.
const WARNING: &str = "warning";

/// A whole page around `body`; `note` says how to read it.
pub(crate) fn document(title: &str, body: &str, note: &str) -> String {
    let title = escape(title);
    format!(
        "<!doctype html><html lang=\"en\"><head><meta charset=\"utf-8\">\
         <meta name=\"viewport\" content=\"width=device-width\"><title>{title}</title>\
         <style>{STYLE}</style></head><body><h1>{title}</h1>{body}\
         <p class=\"note\">{note} Made by truestage {}; not a certificate.</p></body></html>\n",
        env!("CARGO_PKG_VERSION")
    )
}

/// The head of a page for one run in which so many `points` were measured.
pub(crate) fn facts_of<L>(journal: &ReadJournal<L>, points: usize) -> Vec<(String, String)> {
    let header = &journal.header;
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
        ("configuration".to_owned(), header.config_hash.clone()),
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
        if let Some(warning) = it.warning() {
            facts.push((WARNING.to_owned(), format!("its readings were {warning}")));
        }
    }
    facts
}

pub(crate) fn facts(facts: &[(String, String)]) -> String {
    let rows = facts.iter().fold(String::new(), |mut rows, (name, value)| {
        let (class, value) = (
            if name == WARNING { WARNING } else { "fact" },
            escape(value),
        );
        let _ = write!(
            rows,
            "<tr class=\"{class}\"><th>{}</th><td style=\"text-align:left\">{value}</td></tr>",
            escape(name)
        );
        rows
    });
    format!("<table>{rows}</table>")
}

pub(crate) fn escape(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}
