use std::fs;
use std::path::PathBuf;

use super::*;
use crate::config::schema;
use crate::linear::JobConfig;
use crate::volumetric::ReferenceFunctionsConfig;

const BEGIN: &str = "<!-- Written from the declarations in controller/src; `WRITE_REFERENCE=1 cargo test -p truestage --lib reference` writes it anew. -->\n";
const END: &str = "<!-- The end of what is written from them. -->\n";

fn configs(name: &str) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../configs");
    folder.join(name)
}

/// The file is `expected`; where it is asked for, it is made so.
#[track_caller]
fn check(name: &str, expected: impl FnOnce(&str) -> String) {
    let path = configs(name);
    let seen = fs::read_to_string(&path).unwrap_or_default();
    let expected = expected(&seen);
    if std::env::var_os("WRITE_REFERENCE").is_some() {
        fs::write(&path, expected).expect("the file can be written");
        return;
    }
    let line = seen.lines().zip(expected.lines()).position(|(a, b)| a != b);
    let how = "WRITE_REFERENCE=1 cargo test -p truestage --lib reference";
    assert!(
        seen == expected,
        "configs/{name}, from line {}: run `{how}`",
        line.unwrap_or_default() + 1
    );
}

#[test]
fn the_reference_of_all_keys_is_what_their_declarations_say() {
    let written = [
        markdown(&schema::schema()),
        markdown(&schema::schema_of::<ReferenceFunctionsConfig>()),
        markdown(&schema::schema_of::<JobConfig>()),
    ];
    check("README.md", |seen| {
        let mut parts = seen.split(BEGIN);
        let before = parts.next().expect("a text has a first part").to_owned();
        let parts: Vec<_> = parts.collect();
        assert_eq!(parts.len(), written.len(), "each begins somewhere");
        let parts = parts.iter().zip(&written);
        parts.fold(before, |text, (part, written)| {
            let (_, after) = part.split_once(END).expect("it ends somewhere");
            format!("{text}{BEGIN}\n{written}\n{END}{after}")
        })
    });
}

#[test]
fn the_schema_for_editors_is_what_the_declarations_say() {
    check("machine.schema.json", |_| {
        let schema = serde_json::to_string_pretty(&schema::schema());
        schema.expect("plain data always serialises") + "\n"
    });
}

#[test]
fn every_key_says_what_it_means() {
    let text = markdown(&schema::schema())
        + &markdown(&schema::schema_of::<JobConfig>())
        + &markdown(&schema::schema_of::<ReferenceFunctionsConfig>());
    for line in text.lines().filter(|it| it.starts_with("| `")) {
        let meaning = line.trim_end_matches(" |").rsplit(" | ").next();
        assert!(meaning.is_some_and(|it| it.len() > 3), "{line}");
    }
}
