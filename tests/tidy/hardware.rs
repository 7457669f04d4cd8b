//! Each device family stands by itself.

use std::fs;

use crate::imports::Imports;
use crate::root;

/// The family that a module of `hardware` is about, with its section.
fn family(module: &[String]) -> Option<[&str; 2]> {
    match module {
        [hardware, section, family, ..] if hardware == "hardware" => Some([section, family]),
        _ => None,
    }
}

#[test]
fn no_device_family_knows_another_one() {
    let imports = Imports::of(&root().join("controller/src/lib.rs"));
    let between = imports.each().filter(|(from, to)| {
        let (from, to) = (family(from), family(to));
        from.is_some() && to.is_some() && from != to
    });
    let found: Vec<_> = between
        .map(|(from, to)| format!("{} imports {}", from.join("::"), to.join("::")))
        .collect();
    assert!(found.is_empty(), "{found:#?}");
    let seen = imports.each().any(|(from, _)| family(from).is_some());
    assert!(seen, "no family was looked at");
}

/// `Umd2Interferometer` is `umd2_interferometer` in a file.
fn snake_case(variant: &str) -> String {
    let mut word = String::new();
    for letter in variant.chars() {
        if letter.is_ascii_uppercase() && !word.is_empty() {
            word.push('_');
        }
        word.push(letter.to_ascii_lowercase());
    }
    word
}

#[test]
fn each_emulated_device_has_its_description() {
    let source = fs::read_to_string(root().join("mock-bus/src/node/mod.rs")).unwrap();
    let (_, registry) = source.split_once("pub enum DeviceConfig {").unwrap();
    let (registry, _) = registry.split_once("\n}").unwrap();
    let variants = registry
        .lines()
        .filter_map(|line| line.trim().split_once('('));
    let mut wanted: Vec<_> = variants.map(|(name, _)| snake_case(name) + ".md").collect();
    wanted.sort_unstable();
    assert!(wanted.len() > 5, "{wanted:?}");
    let folder = fs::read_dir(root().join("configs/emulated/devices")).unwrap();
    let names = folder.map(|it| it.unwrap().file_name().into_string().unwrap());
    let mut names: Vec<_> = names.collect();
    names.sort_unstable();
    assert_eq!(names, wanted);
}
