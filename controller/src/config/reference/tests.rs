use std::fs;
use std::path::PathBuf;

use super::*;

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
    check("README.md", |seen| {
        let (before, rest) = seen.split_once(BEGIN).expect("it begins somewhere");
        let (_, after) = rest.split_once(END).expect("it ends somewhere");
        format!("{before}{BEGIN}\n{}\n{END}{after}", markdown())
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
    let text = markdown();
    for line in text.lines().filter(|it| it.starts_with("| `")) {
        let meaning = line.trim_end_matches(" |").rsplit(" | ").next();
        assert!(meaning.is_some_and(|it| it.len() > 3), "{line}");
    }
}
