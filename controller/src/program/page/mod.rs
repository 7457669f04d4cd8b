//! Pages for people: self-contained, of facts, tables and pictures. No script, no network.

pub(crate) mod band;
pub(crate) mod chart;
pub(crate) mod compare;
pub(crate) mod dimension;
pub(crate) mod head;
pub(crate) mod map;
pub(crate) mod pictures;
pub(crate) mod polar;
pub(crate) mod svg;

use crate::made_by::made_by;

/// The colours of pages and pictures, dark on light.
macro_rules! colours_light {
    () => {
        "--ink:#1c2430;--paper:#fff;--quiet:#566;--rule:#dde3ea;--grid:#e4e9ef;--zero:#8794a3;--limit:#b91c1c;\
         --warning:#b00020;--first:#0b66c3;--second:#c2410c;--third:#4d7c0f;--fourth:#7e22ce;--fifth:#0f766e;\
         --sixth:#475569"
    };
}

/// For a picture that leaves its page.
const COLOURS_LIGHT: &str = colours_light!();

/// By the reader's own scheme on a screen, dark on light on paper. Colours of pictures are named here, too: a
/// picture in the page takes them from it.
pub(crate) const STYLE: &str = concat!(
    ":root{color-scheme:light dark;",
    colours_light!(),
    "}",
    "\
@media screen and (prefers-color-scheme:dark){:root{--ink:#e4e8ee;--paper:#12161c;--quiet:#9aa7b5;--rule:#2c3540;\
--grid:#242c36;--zero:#6b7887;--limit:#f87171;--warning:#ff8a80;--first:#60a5fa;--second:#fb923c;--third:#a3d154;\
--fourth:#c084fc;--fifth:#2dd4bf;--sixth:#a8b3c2}}\
body{font:15px/1.5 system-ui,sans-serif;max-width:62rem;margin:2rem auto;padding:0 1rem;\
color:var(--ink);background:var(--paper)}h1{font-size:1.6rem}h2{font-size:1.15rem;margin-top:2.2rem}\
h3{font-size:1rem}\
table{border-collapse:collapse;margin:.6rem 0;display:block;overflow-x:auto}td,th{padding:.2rem .8rem;\
text-align:right;border-bottom:1px solid var(--rule)}th{color:var(--quiet)}td:first-child,th:first-child{text-align:left}\
.head td{text-align:left;overflow-wrap:anywhere}.head th{vertical-align:top;padding-left:0;white-space:nowrap}\
figure{margin:0;overflow-x:auto}figcaption{color:var(--quiet)}svg{width:100%;min-width:40rem;height:auto}\
.note{color:var(--quiet)}.warning *{color:var(--warning);font-weight:600}\
@media screen and (max-width:34rem){.head tr,.head th,.head td{display:block;padding:.1rem 0}.head th{border:0}}\
@media print{:root{color-scheme:light}body{max-width:none;margin:0;padding:0;font-size:11px}svg{min-width:0}\
table,figure{overflow:visible}.head th{white-space:normal}figure,svg,tr{break-inside:avoid}h2,h3{break-after:avoid}}"
);

/// A whole page around `body`; `note` says how to read it.
pub(crate) fn document(title: &str, body: &str, note: &str) -> String {
    let title = escape(title);
    format!(
        "<!doctype html><html lang=\"en\"><head><meta charset=\"utf-8\">\
         <meta name=\"viewport\" content=\"width=device-width\"><title>{title}</title>\
         <style>{STYLE}</style></head><body><h1>{title}</h1>{body}\
         <p class=\"note\">{note} This page was made by {}; not a certificate.</p></body></html>\n",
        escape(&made_by())
    )
}

pub(crate) fn escape(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}
