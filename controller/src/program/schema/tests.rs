use std::collections::BTreeSet;
use std::fs;
use std::path::PathBuf;

use clap::CommandFactory as _;

use super::*;
use crate::program::Cli;

/// Verbs that print nothing for programs unless they fail.
const SILENT: [&str; 2] = ["completions", "serve"];

#[test]
fn the_schema_beside_the_documents_is_what_the_verbs_say() {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../docs/output.schema.json");
    let expected = pretty(&document(&Cli::command()));
    if std::env::var_os("WRITE_REFERENCE").is_some() {
        fs::write(&path, expected).expect("the file can be written");
        return;
    }
    let seen = fs::read_to_string(&path).unwrap_or_default();
    let line = seen.lines().zip(expected.lines()).position(|(a, b)| a != b);
    assert!(
        seen == expected,
        "docs/output.schema.json, from line {}: run `WRITE_REFERENCE=1 cargo test -p truestage --lib reference schema`",
        line.unwrap_or_default() + 1
    );
}

#[test]
fn every_form_is_of_a_verb_and_every_verb_has_one() {
    let program = Cli::command();
    let verbs: BTreeSet<String> = verbs(&program).into_iter().map(|it| it.name).collect();
    let described = printed().forms.into_iter().map(|it| it.verb.to_owned());
    let described: BTreeSet<String> = described.chain(SILENT.map(Into::into)).collect();
    assert_eq!(described, verbs);
}

/// Every `$ref` below `schema`.
fn references<'s>(schema: &'s Value, found: &mut Vec<&'s str>) {
    match schema {
        Value::Object(members) => {
            if let Some(Value::String(name)) = members.get("$ref") {
                found.push(name);
            }
            members.values().for_each(|it| references(it, found));
        }
        Value::Array(all) => all.iter().for_each(|it| references(it, found)),
        _ => {}
    }
}

#[test]
fn what_is_described_once_is_used_and_is_there() {
    let document = document(&Cli::command());
    let mut used = Vec::new();
    references(&document, &mut used);
    let used: BTreeSet<String> = used.into_iter().map(Into::into).collect();
    let defined = document["$defs"].as_object().expect("it has some").keys();
    let defined: BTreeSet<String> = defined.map(|it| format!("#/$defs/{it}")).collect();
    assert_eq!(used, defined);
}

/// How often an object below `schema` has a member of this name.
fn count(schema: &Value, name: &str) -> usize {
    match schema {
        Value::Object(members) => {
            let own = usize::from(members.contains_key(name));
            own + members.values().map(|it| count(it, name)).sum::<usize>()
        }
        Value::Array(all) => all.iter().map(|it| count(it, name)).sum(),
        _ => 0,
    }
}

#[test]
fn a_failure_is_described_once_and_each_verb_refers_to_it() {
    let document = document(&Cli::command());
    let defined = document["$defs"].as_object().expect("it has some");
    let verbs = defined.iter().filter(|it| it.0.starts_with("verb"));
    for (name, verb) in verbs {
        let choices = verb["anyOf"].as_array().expect("it has choices");
        assert_eq!(choices.last(), Some(&part("failure").schema()), "{name}");
        assert!(verb["properties"]["verb"]["const"].is_string(), "{name}");
    }
    let failure = &document["$defs"]["failure"]["properties"];
    assert!(failure.get("findings").is_some(), "{failure}");
    assert_eq!(count(&document, "findings"), 1);
}

#[test]
fn no_name_stands_for_two_things() {
    let parts = printed().parts;
    let names: BTreeSet<&str> = parts.iter().map(|it| it.0).collect();
    assert_eq!(names.len(), parts.len());
}

#[test]
fn a_verb_is_called_by_all_of_its_words() {
    let verb = |words: &[&str]| {
        let words = ["truestage"].iter().chain(words);
        let words = Cli::command().try_get_matches_from(words);
        verb_of(&words.unwrap_or_else(|error| panic!("{error}")))
    };
    assert_eq!(verb(&["check", "m.toml"]), "check");
    assert_eq!(verb(&["cal", "list", "m.toml"]), "cal list");
    assert_eq!(verb(&["reference", "m.toml"]), "reference");
    assert_eq!(
        verb(&["reference", "import", "m.toml", "f.csv"]),
        "reference import"
    );
}
