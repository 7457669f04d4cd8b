//! Paths that documents name are there.

use std::fs;
use std::path::Path;

use crate::root;

/// What tells where things are; decisions tell where they were.
const DOCUMENTS: &[&str] = &[
    "ARCHITECTURE.md",
    "CONTRIBUTING.md",
    "README.md",
    "STYLE.md",
    "configs/README.md",
    "docs/benchmarks.md",
    "docs/dependencies.md",
    "docs/engine.md",
    "docs/glossary.md",
    "docs/json.md",
    "docs/lockstep.md",
    "docs/safety.md",
    "docs/seeds.md",
    "docs/service.md",
    "docs/tutorial.md",
    "tests/README.md",
];

/// Everything in the repository that is source, configuration or text, folders included.
fn everything(folder: &Path, found: &mut Vec<String>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.strip_prefix(root()).unwrap().to_str().unwrap();
        if name.starts_with("target") || name.starts_with(".git/") || name == ".git" {
            continue;
        }
        found.push(format!("/{name}"));
        if path.is_dir() {
            everything(&path, found);
        }
    }
}

/// `a/{b,c}.rs` is two paths.
fn spelled_out(path: &str) -> Vec<String> {
    let Some((before, rest)) = path.split_once('{') else {
        return vec![path.to_owned()];
    };
    let (middle, after) = rest.split_once('}').unwrap_or((rest, ""));
    let each = middle.split(',');
    each.map(|one| format!("{before}{one}{after}")).collect()
}

/// The paths of source files and of folders that stand in `text` as code.
fn named_paths(text: &str) -> Vec<String> {
    let is_of_path = |it: char| it.is_ascii_alphanumeric() || "_-./{},".contains(it);
    let is_path = |code: &&str| {
        let ends = code.ends_with(".rs") || code.ends_with('/');
        ends && code.len() > 1 && !code.starts_with("..") && code.chars().all(is_of_path)
    };
    let code = text.split('`').skip(1).step_by(2);
    code.filter(is_path).flat_map(spelled_out).collect()
}

#[test]
fn every_path_that_a_document_names_is_there() {
    let mut all = Vec::new();
    everything(&root(), &mut all);
    let mut offences = Vec::new();
    for document in DOCUMENTS {
        let text = fs::read_to_string(root().join(document)).unwrap();
        for path in named_paths(&text) {
            // Tables name a file by the end of its path.
            let end = format!("/{}", path.trim_end_matches('/'));
            if !all.iter().any(|it| it.ends_with(&end)) {
                offences.push(format!("{document}: `{path}`"));
            }
        }
    }
    assert!(offences.is_empty(), "{}", offences.join("\n"));
}

/// The tests that stand in `text` as `FILE::TEST`, with the end of the file's path.
fn named_tests(text: &str) -> Vec<(String, String)> {
    let code = text.split('`').skip(1).step_by(2);
    code.filter_map(|code| code.split_once(".rs::"))
        .map(|(file, test)| (format!("/{file}.rs"), format!("fn {test}(")))
        .collect()
}

#[test]
fn every_test_that_a_document_names_is_there() {
    let mut all = Vec::new();
    everything(&root(), &mut all);
    let has = |(file, test): &(String, String)| {
        let mut files = all.iter().filter(|it| it.ends_with(file.as_str()));
        files.any(|it| {
            let text = fs::read_to_string(root().join(&it[1..])).unwrap();
            text.contains(test.as_str())
        })
    };
    let mut named = 0;
    for document in DOCUMENTS {
        let text = fs::read_to_string(root().join(document)).unwrap();
        let tests = named_tests(&text);
        named += tests.len();
        let missing: Vec<_> = tests.into_iter().filter(|it| !has(it)).collect();
        assert_eq!(missing, [], "{document}");
    }
    assert!(named > 40, "{named}: are they still written as FILE::TEST?");
}

#[test]
fn paths_are_found_between_words() {
    let text = "see `a/{b,c}.rs`, `d.rs` and `e/`; not `f()`, `g.toml`, `../h.rs` or i.rs";
    assert_eq!(named_paths(text), ["a/b.rs", "a/c.rs", "d.rs", "e/"]);
}
