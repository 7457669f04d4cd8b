//! Each kind of machine has a folder of its own, and knows of no other kind.

use std::sync::LazyLock;

use crate::imports::Imports;
use crate::{code_lines, root, sources};

/// The folders of the kinds, in the library and below `program/`: those that have verbs.
static KINDS: LazyLock<Vec<String>> = LazyLock::new(|| {
    let files = sources("controller/src/program");
    let below = files
        .keys()
        .map(|it| &it["controller/src/program/".len()..]);
    let folders = below.filter_map(|it| it.strip_suffix("/verbs.rs"));
    let kinds: Vec<_> = folders.map(str::to_owned).collect();
    assert!(
        kinds.len() >= 4,
        "{kinds:?}: the rules would hold for nothing"
    );
    kinds
});

/// Files that say what can be configured, stored and shown: whoever only reads a file of a kind need
/// not move a machine of that kind.
const DATA: &[&str] = &[
    "check", "config", "entries", "log", "record", "settings", "sound",
];

/// What these may import of their own kind: each other, and what follows from a configuration alone.
const OF_DATA: &[&str] = &[
    "check",
    "config",
    "entries",
    "line_speed",
    "log",
    "positions",
    "record",
    "settings",
    "sound",
    "state",
];

/// The kind that a module belongs to.
fn kind_of(module: &[String]) -> Option<&str> {
    let module = match module.first().map(String::as_str) {
        Some("program") => &module[1..],
        _ => module,
    };
    let first = module.first()?.as_str();
    KINDS.iter().any(|it| it == first).then_some(first)
}

fn offences(imports: &Imports, is_one: impl Fn(&[String], &[String]) -> bool) -> Vec<String> {
    let each = imports.each().filter(|(from, to)| is_one(from, to));
    each.map(|(from, to)| format!("{} imports {}", from.join("::"), to.join("::")))
        .collect()
}

fn imports_another_kind(from: &[String], to: &[String]) -> bool {
    match (kind_of(from), kind_of(to)) {
        (Some(own), Some(other)) => own != other,
        _ => false,
    }
}

fn is_data_that_imports_a_procedure(from: &[String], to: &[String]) -> bool {
    let second = |module: &[String]| module.get(1).cloned().unwrap_or_default();
    let is_data = kind_of(from).is_some() && DATA.contains(&second(from).as_str());
    is_data && kind_of(to).is_some() && !OF_DATA.contains(&second(to).as_str())
}

#[test]
fn no_kind_imports_a_kind() {
    let imports = Imports::of(&root().join("controller/src/lib.rs"));
    let found = offences(&imports, imports_another_kind);
    assert!(found.is_empty(), "{found:#?}");
}

/// A procedure of a kind belongs to that kind's handle.
#[test]
fn no_kind_adds_methods_to_the_machine() {
    let mut found = Vec::new();
    for kind in KINDS.iter() {
        for (name, text) in sources(&format!("controller/src/{kind}")) {
            let lines = code_lines(&text).filter(|(_, code)| is_impl_of_machine(code));
            found.extend(lines.map(|(line, code)| format!("{name}:{line}: `{code}`")));
        }
    }
    assert!(found.is_empty(), "{found:#?}");
    assert!(is_impl_of_machine("impl Machine {"));
    assert!(is_impl_of_machine("impl crate::connected::Machine {"));
    assert!(!is_impl_of_machine("impl RotaryTable<'_> {"));
}

fn is_impl_of_machine(code: &str) -> bool {
    let words: Vec<_> = code.split_whitespace().collect();
    let of = |word: &&str| *word == "Machine" || word.ends_with("::Machine");
    words.first() == Some(&"impl") && words.iter().any(of)
}

#[test]
fn what_can_be_configured_and_stored_needs_no_procedure() {
    let imports = Imports::of(&root().join("controller/src/lib.rs"));
    let found = offences(&imports, is_data_that_imports_a_procedure);
    assert!(found.is_empty(), "{found:#?}");
}

#[test]
fn a_kind_that_imports_another_one_is_seen() {
    let module = |text: &str| text.split("::").map(str::to_owned).collect::<Vec<_>>();
    let (rotary, linear) = (module("rotary::moves"), module("linear::travel"));
    assert!(imports_another_kind(&rotary, &linear));
    assert!(imports_another_kind(
        &module("program::rotary::fit"),
        &module("program::linear")
    ));
    assert!(imports_another_kind(&module("program::rotary"), &linear));
    assert!(!imports_another_kind(&rotary, &module("rotary::turn")));
    assert!(!imports_another_kind(&module("store::journal"), &linear));
    assert!(is_data_that_imports_a_procedure(
        &module("rotary::config"),
        &module("rotary::turn")
    ));
    assert!(!is_data_that_imports_a_procedure(
        &module("rotary::record"),
        &module("rotary::entries")
    ));
}
