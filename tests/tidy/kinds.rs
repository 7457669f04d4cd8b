//! Each kind of machine has a folder of its own, and knows of no other kind.

use std::sync::LazyLock;

use crate::imports::Imports;
use crate::{code_lines, root, sources, without_tests};

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
    "check",
    "config",
    "dependence",
    "entries",
    "log",
    "record",
    "settings",
    "sound",
];

/// What these may import of their own kind: each other, what follows from a configuration
/// alone, and why it is refused.
const OF_DATA: &[&str] = &[
    "check",
    "config",
    "entries",
    "failure",
    "line_speed",
    "log",
    "positions",
    "record",
    "settings",
    "sound",
    "state",
];

/// The only files that name every kind, each of them by its modules or types: what a further kind adds lines
/// to, and what names all that there were once or what only some have. It only gets shorter.
const LISTS: &[&str] = &[
    // A further kind is added here.
    "controller/src/config/model.rs",
    "controller/src/groups.rs",
    "controller/src/kinds/mod.rs",
    "controller/src/lib.rs",
    "controller/src/program/kind.rs",
    "controller/src/program/mod.rs",
    "mock-bus/src/plant/config.rs",
    "mock-bus/src/plant/mod.rs",
    // When it has data that are evaluated alone, or a person turns or sets up something.
    "controller/src/program/data.rs",
    "mock-bus/src/runner/hand.rs",
    // Never: what calibrations of the first programs depend on.
    "controller/src/config/dependence/version_1.rs",
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

/// A procedure of a kind belongs to that kind's handle; the machine only gives that handle, in the
/// file where it stands. How many methods that makes is held by `the_machine_gets_no_more_methods`.
#[test]
fn a_kind_adds_nothing_to_the_machine_but_the_way_to_its_handle() {
    let mut found = Vec::new();
    let mut ways = 0;
    for kind in KINDS.iter() {
        for (name, text) in sources(&format!("controller/src/{kind}")) {
            let lines: Vec<_> = code_lines(&text)
                .filter(|(_, code)| is_impl_of_machine(code))
                .collect();
            if is_file_of_a_handle(&text) {
                ways += lines.len();
            } else {
                found.extend(
                    lines
                        .iter()
                        .map(|(line, it)| format!("{name}:{line}: `{it}`")),
                );
            }
        }
    }
    assert!(found.is_empty(), "{found:#?}");
    assert_eq!(ways, KINDS.len(), "one `impl Machine` for each kind");
    assert!(is_impl_of_machine("impl Machine {"));
    assert!(is_impl_of_machine("impl crate::connected::Machine {"));
    assert!(!is_impl_of_machine("impl RotaryTable<'_> {"));
}

fn is_file_of_a_handle(text: &str) -> bool {
    text.contains("pub(crate) core: Core<'m>,")
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

/// The words for each kind but the linear axis, which every other one consists of.
const WORDS: &[&[&str]] = &[&["rotary", "table"], &["platform"], &["volumetric"]];

/// Whether code names every kind.
fn names_every_kind(text: &str) -> bool {
    let code = code_lines(without_tests(text)).map(|(_, line)| line.to_lowercase());
    let code: String = code.collect();
    let is_named = |words: &&[&str]| words.iter().any(|it| code.contains(it));
    WORDS.iter().all(is_named)
}

fn is_of_a_kind_or_a_test(name: &str) -> bool {
    let mut parts = name.split(['/', '.']);
    parts.any(|part| {
        let own = KINDS.iter().any(|kind| kind == part);
        own || part == "table" || part.ends_with("tests")
    })
}

#[test]
fn only_the_lists_name_every_kind() {
    let packages = [
        "controller/src",
        "machine/src",
        "mock-bus/src",
        "service/src",
    ];
    let files = packages.into_iter().flat_map(|it| sources(it).into_iter());
    let own = files.filter(|(name, _)| !is_of_a_kind_or_a_test(name));
    let found: Vec<_> = own.filter(|(_, text)| names_every_kind(text)).collect();
    let mut found: Vec<&str> = found.iter().map(|(name, _)| name.as_str()).collect();
    let mut expected = LISTS.to_vec();
    found.sort_unstable();
    expected.sort_unstable();
    assert_eq!(
        found, expected,
        "more: let `Kind` or `Verbs` say it; fewer: shorten the list in this test"
    );
}

#[test]
fn whoever_names_every_kind_is_seen() {
    assert!(names_every_kind(
        "match it {\n Rotary(_) => 1,\n Platform(_) => 2,\n Volumetric(_) => 3 }"
    ));
    assert!(!names_every_kind("use crate::{platform, volumetric};"));
    assert!(!names_every_kind("// rotary, platform, volumetric"));
    assert!(is_of_a_kind_or_a_test("controller/src/rotary/turn.rs"));
    assert!(!is_of_a_kind_or_a_test("controller/src/failure.rs"));
}
