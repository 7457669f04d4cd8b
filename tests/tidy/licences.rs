//! Whoever passes this program on may do so: the licence, the source and the requirements of every package.
//!
//! What may be there stands in `deny.toml`, in the form that cargo-deny reads. These tests hold of it what
//! Cargo knows by itself, without the network. Packages for other systems than this one count too.
//! Advisories are not here: they are news, and come from the network.

use std::fs;
use std::process::Command;

use serde_json::{Value, json};
use spdx::{Expression, Licensee, ParseMode};

use crate::root;

/// What `deny.toml` allows.
struct Rules {
    licences: Vec<Licensee>,
    registries: Vec<String>,
}

impl Rules {
    fn read() -> Self {
        let text = fs::read_to_string(root().join("deny.toml")).unwrap();
        let table: toml::Table = text.parse().unwrap();
        for (section, key) in [
            ("bans", "wildcards"),
            ("sources", "unknown-registry"),
            ("sources", "unknown-git"),
        ] {
            let said = table[section][key].as_str();
            assert_eq!(said, Some("deny"), "deny.toml: [{section}] {key}");
        }
        let licences = words(&table["licenses"]["allow"]);
        Self {
            licences: licences.iter().map(|it| licensee(it)).collect(),
            registries: words(&table["sources"]["allow-registry"]),
        }
    }

    /// The same without one licence.
    fn without(&self, licence: &Licensee) -> Self {
        let others = self.licences.iter().filter(|it| *it != licence);
        Self {
            licences: others.cloned().collect(),
            registries: self.registries.clone(),
        }
    }
}

fn words(list: &toml::Value) -> Vec<String> {
    let list = list.as_array().unwrap().iter();
    list.map(|it| it.as_str().unwrap().to_owned()).collect()
}

fn licensee(name: &str) -> Licensee {
    Licensee::parse(name).unwrap_or_else(|error| panic!("deny.toml: {error}"))
}

/// Every package that `Cargo.lock` has, whatever the system it is for, as Cargo tells it.
fn packages() -> Vec<Value> {
    let output = Command::new(env!("CARGO"))
        .args(["metadata", "--format-version=1", "--offline", "--locked"])
        .current_dir(root())
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    let why = "cargo metadata: when packages are missing, `cargo fetch --locked` brings them";
    assert!(output.status.success(), "{why}:\n{said}");
    let mut told: Value = serde_json::from_slice(&output.stdout).unwrap();
    serde_json::from_value(told["packages"].take()).unwrap()
}

fn name_of(package: &Value) -> String {
    let word = |key: &str| package[key].as_str().unwrap_or("?");
    format!("{} {}", word("name"), word("version"))
}

/// Why a package's licence is none that is allowed.
fn licence_offence(rules: &Rules, package: &Value) -> Option<String> {
    let name = name_of(package);
    let Some(said) = package["license"].as_str() else {
        return Some(format!(
            "{name} declares no licence: do without it, or ask its authors"
        ));
    };
    // Old manifests have a stroke where today's say OR.
    let expression = match Expression::parse_mode(said, ParseMode::LAX) {
        Ok(expression) => expression,
        Err(error) => {
            return Some(format!(
                "{name}: `{said}` is no licence expression: {error}"
            ));
        }
    };
    let is_allowed = expression.evaluate(|it| rules.licences.iter().any(|own| own.satisfies(it)));
    (!is_allowed).then(|| {
        format!(
            "{name} is under `{said}`: take another package, or, when what it asks can be met, add \
             the licence to deny.toml and say in docs/dependencies.md what it asks"
        )
    })
}

/// Why a package comes from where none should.
fn source_offence(rules: &Rules, package: &Value) -> Option<String> {
    // What has no source is a folder of this workspace.
    let source = package["source"].as_str()?;
    let registry = source.strip_prefix("registry+");
    let is_known = registry.is_some_and(|it| rules.registries.iter().any(|known| known == it));
    (!is_known).then(|| {
        let name = name_of(package);
        format!("{name} comes from {source}: take a version that crates.io has")
    })
}

/// What a package asks for in any version whatever.
fn wildcards(package: &Value) -> Vec<String> {
    let asked = package["dependencies"].as_array().unwrap().iter();
    asked
        .filter(|it| it["req"] == "*" && it["path"].is_null())
        .map(|it| {
            let name = name_of(package);
            format!("{name} asks for any {}: name a version", it["name"])
        })
        .collect()
}

fn offences(rules: &Rules, package: &Value) -> Vec<String> {
    let licence = licence_offence(rules, package).into_iter();
    let source = source_offence(rules, package);
    licence.chain(source).chain(wildcards(package)).collect()
}

#[test]
fn every_package_is_under_a_licence_and_from_a_source_that_deny_toml_allows() {
    let rules = Rules::read();
    let packages = packages();
    let offences: Vec<String> = packages
        .iter()
        .flat_map(|it| offences(&rules, it))
        .collect();
    assert!(offences.is_empty(), "{}", offences.join("\n"));
}

#[test]
fn no_licence_is_allowed_that_no_package_needs() {
    let rules = Rules::read();
    let packages = packages();
    for licence in &rules.licences {
        let fewer = rules.without(licence);
        let is_needed = packages
            .iter()
            .any(|it| licence_offence(&fewer, it).is_some());
        assert!(is_needed, "deny.toml: nothing needs {licence} any more");
    }
}

/// A package made for the occasion, in which `key` says `value`.
fn package_with(key: &str, value: Value) -> Value {
    let mut package = json!({
        "name": "borrowed",
        "version": "1.2.3",
        "license": "MIT",
        "source": "registry+https://github.com/rust-lang/crates.io-index",
        "dependencies": [],
    });
    package[key] = value;
    package
}

/// What is said of a package in which `key` says `value`; nothing when it may be there.
#[track_caller]
fn check(key: &str, value: Value, says: Option<&str>) {
    let offences = offences(&Rules::read(), &package_with(key, value.clone()));
    match says {
        None => assert_eq!(offences, [""; 0], "{value}"),
        Some(says) => {
            let told = offences.len() == 1 && offences[0].contains(says);
            assert!(told, "{value}: {offences:?}");
            assert!(offences[0].starts_with("borrowed 1.2.3"), "{offences:?}");
        }
    }
}

#[test]
fn a_licence_is_refused_by_its_name_unless_it_leaves_a_choice() {
    for allowed in [
        "MIT",
        "MIT/Apache-2.0",
        "MIT OR GPL-3.0-only",
        "(MIT OR GPL-3.0-only) AND Unicode-3.0",
        "Apache-2.0 WITH LLVM-exception OR Apache-2.0",
    ] {
        check("license", json!(allowed), None);
    }
    for refused in [
        "GPL-3.0-only",
        "MIT AND GPL-3.0-only",
        "Apache-2.0 WITH LLVM-exception",
        "LicenseRef-Made-Up",
    ] {
        check("license", json!(refused), Some(refused));
    }
    check("license", json!("Made Up"), Some("no licence expression"));
    check("license", Value::Null, Some("declares no licence"));
}

#[test]
fn what_is_not_from_crates_io_is_refused() {
    check("source", Value::Null, None);
    for source in [
        "registry+https://example.org/index",
        "git+https://example.org/borrowed?rev=1#1",
    ] {
        check("source", json!(source), Some(source));
    }
}

#[test]
fn any_version_whatever_is_refused_but_of_a_folder_here() {
    let asks = |req: &str, path: Value| json!([{ "name": "lent", "req": req, "path": path }]);
    check("dependencies", asks("^1.0", Value::Null), None);
    check("dependencies", asks("*", json!("/lent")), None);
    let says = "asks for any \"lent\"";
    check("dependencies", asks("*", Value::Null), Some(says));
}
