//! No files import one another in a circle.

use std::path::Path;

use crate::imports::Imports;
use crate::root;

/// The roots of all crates of the program.
const CRATES: &[&str] = &[
    "units/src/lib.rs",
    "wire/src/lib.rs",
    "drivers/src/lib.rs",
    "compensator/src/lib.rs",
    "mock-bus/src/lib.rs",
    "mock-bus/src/main.rs",
    "machine/src/lib.rs",
    "controller/src/lib.rs",
    "service/src/lib.rs",
    "command/src/main.rs",
];

#[test]
fn no_files_import_one_another_in_a_circle() {
    let mut offences = Vec::new();
    for crate_root in CRATES {
        for circle in Imports::of(&root().join(crate_root)).circles() {
            offences.push(format!("{crate_root}: {}", circle.join(", ")));
        }
    }
    assert!(offences.is_empty(), "{}", offences.join("\n"));
}

/// Files of a crate made for the occasion; returns its circles.
fn circles_of(files: &[(&str, &str)]) -> Vec<Vec<String>> {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in files {
        let path = folder.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap_or(Path::new(""))).unwrap();
        std::fs::write(path, text).unwrap();
    }
    let mut circles = Imports::of(&folder.path().join("lib.rs")).circles();
    circles.iter_mut().for_each(|it| it.sort());
    circles
}

#[test]
fn a_circle_is_found_however_it_is_written() {
    let found = |a: &str| {
        let b = "pub struct B; fn f() { let _ = crate::a::A; }";
        circles_of(&[("lib.rs", "mod a; mod b;"), ("a.rs", a), ("b.rs", b)]).len()
    };
    assert_eq!(found("pub struct A;"), 0);
    assert_eq!(found("use crate::b::B; pub struct A;"), 1);
    assert_eq!(found("use super::b; pub struct A;"), 1);
    assert_eq!(
        found("pub struct A; fn f() { use crate::{b::{B as C}}; }"),
        1
    );
    assert_eq!(found("pub struct A; fn f(_: &[super::b::B]) {}"), 1);
    assert_eq!(
        found("pub struct A; fn f() { println!(\"{:?}\", crate::b::B); }"),
        1
    );
    assert_eq!(
        found("pub struct A; #[cfg(test)] mod tests { use crate::b::B; }"),
        0
    );
}

#[test]
fn a_name_that_is_passed_on_counts_where_it_is_at_home() {
    let files = [
        ("lib.rs", "mod a; mod b;"),
        (
            "a/mod.rs",
            "mod one; mod two; pub use one::One; pub use two::Two;",
        ),
        ("a/one.rs", "pub struct One;"),
        ("a/two.rs", "pub struct Two; use crate::b::B;"),
        ("b.rs", "pub struct B; use crate::a::One;"),
    ];
    assert_eq!(circles_of(&files), Vec::<Vec<String>>::new());
    let mut files = files;
    files[4].1 = "pub struct B; use crate::a::Two;";
    assert_eq!(circles_of(&files), [["a::two", "b"]]);
}

#[test]
fn a_module_and_those_below_it_may_know_each_other() {
    let files = [
        ("lib.rs", "mod a;"),
        ("a.rs", "mod b; pub struct A; use b::B;"),
        ("a/b.rs", "pub struct B; use super::A;"),
    ];
    assert_eq!(circles_of(&files), Vec::<Vec<String>>::new());
}
