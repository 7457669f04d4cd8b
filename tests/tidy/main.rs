//! Rules of the layout that the compiler does not know.

mod circles;
mod documents;
mod hardware;
mod imports;
mod kinds;
mod licences;
mod methods;
mod public_names;

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// Which packages each package may import (design: "Imports").
const ALLOWED: &[(&str, &[&str])] = &[
    ("units", &[]),
    ("compensator", &["units"]),
    ("wire", &["units"]),
    ("drivers", &["units", "wire"]),
    ("mock-bus", &["units", "wire"]),
    ("machine", &["units", "wire", "drivers", "compensator"]),
    (
        "truestage",
        &[
            "units",
            "wire",
            "drivers",
            "compensator",
            "machine",
            "mock-bus",
        ],
    ),
    (
        "service",
        &["units", "wire", "drivers", "machine", "truestage"],
    ),
    ("command", &["truestage", "service"]),
    (
        "tests",
        &[
            "units",
            "wire",
            "drivers",
            "compensator",
            "machine",
            "mock-bus",
            "truestage",
            "service",
        ],
    ),
    ("unit-tests", &["units", "wire", "drivers", "compensator"]),
    ("counts", &["units", "wire", "compensator", "tests"]),
];

/// The only files of the controller that may name the emulator.
const EMULATOR_USERS: &[&str] = &[
    "controller/src/emulated.rs",
    "controller/src/emulated/error.rs",
];

/// What may use an emulated machine: who shows it, who tells its failures, and what compares all that is said of it.
const EMULATED_MACHINE_USERS: &[&str] = &[
    "controller/src/emulated.rs",
    "controller/examples/emulated.rs",
    "controller/src/failure.rs",
    "controller/src/program/demo/",
    "controller/src/program/same_figures_tests.rs",
];

/// In the folder of each kind, its demonstration.
fn is_demonstration(name: &str) -> bool {
    let below = name.strip_prefix("controller/src/program/");
    let kind = below.and_then(|it| it.strip_suffix("/demo.rs"));
    kind.is_some_and(|it| !it.contains('/'))
}

/// The folders of the packages that make up the program.
const PACKAGES: &[&str] = &[
    "units",
    "wire",
    "drivers",
    "compensator",
    "mock-bus",
    "machine",
    "controller",
    "service",
    "command",
];

const FILE_LINES_MAX: usize = 500;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .parent()
        .expect("tests/ has a parent")
        .to_owned()
}

/// Every Rust file below `folder` of the repository, by its path from the root.
fn sources(folder: &str) -> BTreeMap<String, String> {
    let mut found = BTreeMap::new();
    let mut folders = vec![root().join(folder)];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|it| it == "rs") {
                let name = path
                    .strip_prefix(root())
                    .unwrap()
                    .to_str()
                    .unwrap()
                    .to_owned();
                found.insert(name, fs::read_to_string(&path).unwrap());
            }
        }
    }
    assert!(
        !found.is_empty(),
        "no sources below {folder}: the rule would hold for nothing"
    );
    found
}

fn code_lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    text.lines()
        .enumerate()
        .map(|(at, line)| (at + 1, line))
        .filter(|(_, line)| !line.trim_start().starts_with("//"))
}

/// The file without its tests: `#[cfg(test)]` ends the code in this project.
fn without_tests(text: &str) -> &str {
    text.split_once("\n#[cfg(test)]\nmod tests {")
        .map_or(text, |(code, _)| code)
}

#[track_caller]
fn nowhere(folder: &str, words: &[&str], why: &str) {
    let mut offences = Vec::new();
    for (name, text) in sources(folder) {
        for (line, code) in code_lines(without_tests(&text)) {
            if let Some(word) = words.iter().find(|word| code.contains(**word)) {
                offences.push(format!("{name}:{line}: `{word}`"));
            }
        }
    }
    assert!(offences.is_empty(), "{why}:\n{}", offences.join("\n"));
}

#[test]
fn packages_depend_only_on_those_below_them() {
    let members: BTreeMap<_, _> = ALLOWED.iter().copied().collect();
    for folder in PACKAGES.iter().chain(&["tests", "tests/unit"]) {
        let text = fs::read_to_string(root().join(folder).join("Cargo.toml")).unwrap();
        let manifest: toml::Table = text.parse().unwrap();
        let package = manifest["package"]["name"].as_str().unwrap();
        let allowed = members[package];
        for section in ["dependencies", "dev-dependencies", "build-dependencies"] {
            let Some(dependencies) = manifest.get(section).and_then(toml::Value::as_table) else {
                continue;
            };
            for name in dependencies
                .keys()
                .filter(|name| members.contains_key(name.as_str()))
            {
                assert!(
                    allowed.contains(&name.as_str()),
                    "{package} must not depend on {name}"
                );
            }
        }
    }
}

/// Whoever drives a stage from a program of his own asks for neither.
#[test]
fn the_library_alone_links_no_command_line_and_no_emulator() {
    let tree = std::process::Command::new(env!("CARGO"))
        .args(["tree", "--offline", "--edges", "normal", "--prefix", "none"])
        .args(["--package", "truestage", "--no-default-features"])
        .current_dir(root())
        .output()
        .expect("cargo runs");
    let tree = String::from_utf8(tree.stdout).expect("names are text");
    assert!(tree.contains("machine v"), "no tree: {tree}");
    let absent = [
        "clap v",
        "signal-hook v",
        "mock-bus v",
        "axum v",
        "utoipa v",
    ];
    for absent in absent {
        assert!(!tree.contains(absent), "{absent}:\n{tree}");
    }
}

/// A write to a terminal that is held waits for hours: no thread that owns a machine or answers a client may make one.
#[test]
fn standard_streams_have_one_writer() {
    const WRITES: &[&str] = &[
        "print!(",
        "println!(",
        "eprint!(",
        "eprintln!(",
        " stdout()",
        " stderr()",
        "(stdout()",
        "(stderr()",
        "::stdout()",
        "::stderr()",
    ];
    for folder in [
        "drivers/src",
        "machine/src",
        "controller/src",
        "service/src",
        "command/src",
    ] {
        let mut files = sources(folder);
        files.remove("controller/src/program/streams.rs");
        for (name, text) in files {
            if is_test_file(&name) {
                continue;
            }
            for (line, code) in code_lines(without_tests(&text)) {
                let found = WRITES.iter().find(|word| code.contains(**word));
                assert_eq!(found, None, "{name}:{line}: use `streams`");
            }
        }
    }
}

/// A module of tests in a file of its own.
fn is_test_file(name: &str) -> bool {
    let is_test = |part: &str| {
        part == "tests.rs"
            || part.ends_with("_tests.rs")
            || part.ends_with("_tests")
            || part == "rates.rs"
    };
    name.split('/').any(is_test)
}

#[test]
fn only_the_demonstration_knows_the_emulator() {
    let offences: Vec<String> = sources("controller")
        .iter()
        .flat_map(|(name, text)| emulator_offences(name, text))
        .collect();
    assert!(offences.is_empty(), "{}", offences.join("\n"));
}

/// Where a file of the controller reaches further into the emulator than it may. What no file
/// may read is the truth: an estimate that looked at it would prove nothing.
fn emulator_offences(name: &str, text: &str) -> Vec<String> {
    let mut forbidden = vec![".truth(", "Truth"];
    if !EMULATOR_USERS.contains(&name) {
        forbidden.extend(["mock_bus", "simulation(", "simulation_mut(", ".running("]);
    }
    let is_user = EMULATED_MACHINE_USERS.iter().any(|it| name.starts_with(it));
    if !is_user && !is_demonstration(name) {
        forbidden.push("emulated::");
    }
    let lines = code_lines(text).filter(|(_, code)| forbidden.iter().any(|it| code.contains(it)));
    lines
        .map(|(line, code)| format!("{name}:{line}: {}", code.trim()))
        .collect()
}

#[test]
fn whoever_reads_the_truth_is_caught_whatever_the_way_to_it() {
    let verify = "controller/src/platform/verify.rs";
    for code in [
        "use mock_bus::simulation::Simulation;",
        "    let seen = mock_bus::plant::Pose::default();",
        "use crate::emulated::Emulated;",
        "    let seen = self.emulated.simulation().truth().platform();",
        "fn judge(truth: &PlatformTruth<'_>) {}",
    ] {
        assert_eq!(emulator_offences(verify, code).len(), 1, "{code}");
    }
    let demo = "controller/src/program/platform/demo.rs";
    let allowed = "use crate::emulated::HallDrift;";
    assert_eq!(emulator_offences(demo, allowed), [""; 0]);
    let peeks = "    let truly = emulated.simulation().truth().position();";
    assert_eq!(emulator_offences(demo, peeks).len(), 1);
    let emulated = EMULATOR_USERS[0];
    assert_eq!(
        emulator_offences(emulated, "self.simulation.borrow().truth()").len(),
        1
    );
}

#[test]
fn protocols_and_mathematics_know_no_clock_socket_thread_or_chance() {
    let words = [
        "std::thread",
        "std::net",
        "std::fs",
        "Instant::now",
        "SystemTime",
        "sleep(",
        "tokio",
        "socketcan::",
        "rand::",
        "rand_",
    ];
    for folder in [
        "compensator/src",
        "wire/src",
        "drivers/src/protocol",
        "drivers/src/device",
    ] {
        nowhere(folder, &words, "sans-io code reaches outside");
    }
    nowhere(
        "mock-bus/src/plant",
        &words[..6],
        "the plant lives in virtual time",
    );
    nowhere(
        "mock-bus/src/node",
        &words[..6],
        "nodes live in virtual time",
    );
}

#[test]
fn fused_multiply_add_is_never_used() {
    for folder in PACKAGES {
        let why = "without the fma target feature it calls libm, and results differ by machine";
        nowhere(folder, &[".mul_add("], why);
    }
}

/// Functions of the operating system, whose last bits differ between processors and versions.
const SYSTEMS_MATHEMATICS: &[&str] = &[
    "sin", "cos", "tan", "sin_cos", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh", "exp",
    "exp2", "exp_m1", "ln", "ln_1p", "log", "log2", "log10", "powf", "powi", "hypot", "cbrt",
];

/// What is only looked at: it reaches no set-point, no record and no log.
const PICTURES: &[&str] = &["controller/src/program/page/", "/report.rs", "/report/"];

#[test]
fn a_seed_is_the_same_log_whatever_the_processor_calls_a_sine() {
    let is_test = |name: &str| {
        ["test", "rig.rs", "fake"]
            .iter()
            .any(|it| name.contains(it))
    };
    let mut offences = Vec::new();
    for folder in PACKAGES {
        for (name, text) in sources(&format!("{folder}/src")) {
            if is_test(&name) || PICTURES.iter().any(|it| name.contains(it)) {
                continue;
            }
            for (line, code) in code_lines(without_tests(&text)) {
                if let Some(function) = systems_function(code) {
                    offences.push(format!("{name}:{line}: `{function}`"));
                }
            }
        }
    }
    let why = "take it from `units::portable`";
    assert!(offences.is_empty(), "{why}:\n{}", offences.join("\n"));
}

/// The first of the system's functions that a line of code calls or names.
fn systems_function(code: &str) -> Option<&'static str> {
    let named = |function: &&&str| {
        let called = |with: &str| {
            let argument = code.split(&format!(".{function}(")).nth(1);
            argument.is_some_and(|it| with.is_empty() || it.starts_with(with))
        };
        let of_one = !["atan2", "log", "powf", "powi", "hypot"].contains(*function);
        called(if of_one { ")" } else { "" }) || code.contains(&format!("f64::{function}"))
    };
    SYSTEMS_MATHEMATICS.iter().find(named).copied()
}

#[test]
fn the_systems_functions_are_known_by_their_calls() {
    for code in [
        "let height = angle.sin();",
        "let (sin, cos) = self.angle.value().sin_cos();",
        "    .atan2(cosine)",
        "values.map(f64::exp)",
        "10.0_f64.powi(digits)",
    ] {
        assert!(systems_function(code).is_some(), "{code}");
    }
    for code in [
        "let height = sin(angle);",
        "self.log.delivery(&delivery);",
        "let name = it.cos(4);",
        "variance.sqrt().abs().floor()",
    ] {
        assert_eq!(systems_function(code), None, "{code}");
    }
}

#[test]
fn no_test_waits_for_the_clock_on_the_wall() {
    for (name, text) in sources("tests") {
        if name == "tests/tidy/main.rs" {
            continue;
        }
        for (line, code) in code_lines(&text) {
            assert!(
                !code.contains("thread::sleep"),
                "{name}:{line}: {}",
                code.trim()
            );
        }
    }
}

#[test]
fn no_test_edits_a_text_without_noticing_that_nothing_matched() {
    for (name, text) in sources("tests") {
        if name == "tests/tidy/main.rs" {
            continue;
        }
        for (line, code) in code_lines(&text) {
            assert!(
                !code.contains(".replace(") && !code.contains(".replacen("),
                "{name}:{line}: use `tests::Edit`: {}",
                code.trim()
            );
        }
    }
}

#[test]
fn every_name_in_the_rules_for_running_tests_is_one_of_tests() {
    const SYNTAX: &[&str] = &["package", "binary", "test", "not", "mock", "bus", "unit"];
    let text = fs::read_to_string(root().join(".config/nextest.toml")).unwrap();
    let config: toml::Table = text.parse().unwrap();
    let overrides = config["profile"]["default"]["overrides"]
        .as_array()
        .unwrap();
    let mut files = sources("tests");
    files.extend(sources("drivers"));
    files.extend(sources("mock-bus"));
    for filter in overrides.iter().map(|it| it["filter"].as_str().unwrap()) {
        let words = filter.split(|it: char| !it.is_ascii_lowercase() && it != '_');
        for word in words.filter(|it| it.len() > 2 && !SYNTAX.contains(it)) {
            let there = files
                .keys()
                .any(|name| name.split(['/', '.']).any(|part| part.starts_with(word)));
            assert!(there, "nothing is called `{word}` any more");
        }
    }
}

#[test]
fn files_stay_within_a_screenful_of_ideas() {
    for folder in PACKAGES {
        for (name, text) in sources(folder) {
            let lines = without_tests(&text).lines().count();
            let is_test = name.contains("test") || name.contains("rig");
            assert!(
                is_test || lines <= FILE_LINES_MAX,
                "{name} has {lines} lines: split it"
            );
        }
    }
}

#[test]
fn code_has_no_loose_ends() {
    for folder in PACKAGES {
        nowhere(
            folder,
            &["todo!(", "unimplemented!(", "dbg!(", "#[allow("],
            "loose end",
        );
    }
}

/// `tests/run` checks these for two systems, which stand for all others as long as this holds; what needs Linux is a
/// feature.
#[test]
fn what_is_for_every_system_does_not_ask_which_one_it_is() {
    const ASKS: &[&str] = &[
        "unix",
        "windows",
        "target_arch",
        "target_endian",
        "target_family",
        "target_os",
        "target_pointer_width",
    ];
    for folder in ["units", "wire", "drivers", "compensator", "mock-bus"] {
        for (name, text) in sources(folder) {
            for (line, code) in code_lines(&text).filter(|it| it.1.contains("cfg")) {
                let asked = ASKS.iter().find(|asked| code.contains(**asked));
                assert_eq!(asked, None, "{name}:{line}");
            }
        }
        let manifest = fs::read_to_string(root().join(folder).join("Cargo.toml")).unwrap();
        assert!(!manifest.contains("[target."), "{folder}");
    }
}

#[test]
fn every_package_is_in_the_workspace() {
    let text = fs::read_to_string(root().join("Cargo.toml")).unwrap();
    let manifest: toml::Table = text.parse().unwrap();
    let members = manifest["workspace"]["members"].as_array().unwrap();
    assert_eq!(
        members.len(),
        ALLOWED.len(),
        "tell this test what the new package may import"
    );
}

/// Machines of one name share a folder, and what one of them activates the other refuses.
#[test]
fn machines_that_ship_share_no_name_no_serial_number_and_no_folder() {
    let folder = root().join("configs/machines");
    let mut owners = BTreeMap::new();
    let mut machines = 0;
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let loaded = truestage::config::load(&path).unwrap_or_else(|error| panic!("{error}"));
        let machine = &loaded.config.machine;
        let store = machine.store();
        machines += 1;
        for what in [
            format!("name {}", machine.name),
            format!("serial number {}", machine.stage_serial),
            format!("folder {}", store.root().display()),
        ] {
            let before = owners.insert(what.clone(), path.clone());
            assert_eq!(before, None, "{what} is that of {}, too", path.display());
        }
    }
    assert!(machines >= 5, "{machines} machines ship");
}
