//! Pictures of a page that stand by themselves, drawn by a program that nobody here has written.

use std::fs;
use std::path::PathBuf;

use serde_json::json;

use crate::dcc::truestage;
use crate::page::{BROWSER, has_browser};
use crate::peer::Peer;

const RUN: &str = concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/../controller/golden/rotary_verify.jsonl"
);

#[test]
fn a_picture_of_a_page_becomes_a_png_that_is_not_blank_by_the_line_of_the_documents() {
    let what = "pictures of a page by themselves";
    if !has_browser() {
        return tests::not_run(what, "Chromium is not installed: run tests/run");
    }
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let words = ["report", RUN, "--output", "page.html", "--svg", "drawn"];
    let written = truestage(folder.path(), &words);
    let pictures = written["pictures"].as_array().expect("a list");
    let first = pictures.first().and_then(|it| it.as_str()).expect("a path");
    let first = folder.path().join(first);
    // The same with nothing drawn: whoever calls a blank picture drawn is caught.
    let blank = folder.path().join("blank.svg");
    let text = fs::read_to_string(&first).expect("it was written");
    let ground = text.find("/>").expect("its ground") + "/>".len();
    fs::write(&blank, format!("{}</svg>\n", &text[..ground])).expect("there is room");
    let paths: [&PathBuf; 2] = [&first, &blank];
    let mut judge = Peer::start("pictures.py", &[BROWSER]);
    judge.feed(&paths.map(|it| format!("{}\n", it.display())).concat());
    let [drawn, blank] = paths.map(|_| judge.report());
    assert_eq!(drawn["stated"], drawn["drawn"], "{drawn}");
    assert_eq!(drawn["ground"], json!("ffffff"), "{drawn}");
    let number = |key: &str| drawn[key].as_f64().expect("a number");
    assert!(
        number("colours") > 5.0 && number("inked") > 0.005,
        "{drawn}"
    );
    assert_eq!(
        (&blank["colours"], &blank["inked"]),
        (&json!(1), &json!(0.0)),
        "{blank}"
    );
}
