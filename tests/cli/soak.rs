//! The demonstrations of many seeds: whatever stage a seed draws, it must end well.
//!
//! Each seed is another stage: errors, noise, places of the limit switches and of the zero, drift. They are shown
//! without terminals, which changes neither frames nor figures
//! (`demo::check`), so that a thousand of them take an hour and not a day.
//!
//! `SEEDS=1..1000 MACHINE=rotary cargo test -p tests --test cli soak -- --ignored --nocapture` shows any range of
//! one machine (of all, without `MACHINE`), says which seeds ended badly and why, and counts.

use std::fmt::Write as _;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use tests::seeds;

use crate::programs::truestage;

const MACHINES: [&str; 5] = ["linear", "uvw", "uvw-copley", "rotary", "volumetric"];

/// How many seeds of `machine` are shown in every run: fifty in all. Three axes take twenty times as long as any other.
fn how_many(machine: &str) -> u64 {
    match machine {
        "volumetric" => 1,
        "linear" => 13,
        _ => 12,
    }
}

/// Below it lie the seeds that are drawn; easy to type again.
const SEED_MAX: u64 = 1_000_000;

/// Numbers that nobody could tune anything to: any change of any source draws others.
fn drawn(machine: &str) -> Vec<u64> {
    let mut hasher = DefaultHasher::new();
    machine.hash(&mut hasher);
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    for package in [
        "compensator",
        "configs",
        "controller",
        "drivers",
        "machine",
        "mock-bus",
        "units",
        "wire",
    ] {
        hash_sources(&root.join(package), &mut hasher);
    }
    let seed = |number: u64| {
        let mut hasher = hasher.clone();
        number.hash(&mut hasher);
        hasher.finish() % SEED_MAX
    };
    (0..how_many(machine)).map(seed).collect()
}

/// Every source and configuration below `folder`, in the order of their names.
fn hash_sources(folder: &Path, hasher: &mut DefaultHasher) {
    let entries = std::fs::read_dir(folder).expect("a folder of this workspace can be read");
    let mut paths: Vec<_> = entries
        .map(|entry| entry.expect("it can be read").path())
        .collect();
    paths.sort();
    for path in paths {
        let is_source = path
            .extension()
            .is_some_and(|it| it == "rs" || it == "toml");
        if path.is_dir() {
            hash_sources(&path, hasher);
        } else if is_source {
            std::fs::read(&path).expect("it can be read").hash(hasher);
        }
    }
}

/// What is wrong with how the demonstration of `machine` with `seed` ended, if anything is.
fn complaint(machine: &str, seed: u64) -> Option<String> {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let seed = seed.to_string();
    let words = [
        "demo",
        "--machine",
        machine,
        "--seed",
        &seed,
        "--in-process",
    ];
    let words = words
        .into_iter()
        .chain(["--data-dir", "."])
        .collect::<Vec<_>>();
    let ended = truestage(folder.path(), &words);
    (ended.code != Some(0)).then(|| format!("{:?}: {}", ended.code, ended.said.trim_end()))
}

/// Shows `machine` with each of `seeds`, on as many processors as there are; what ended badly.
fn shown(machine: &str, seeds: &[u64]) -> Vec<String> {
    let (next, bad) = (AtomicUsize::new(0), Mutex::new(Vec::new()));
    let workers = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| {
        for _ in 0..workers {
            scope.spawn(|| {
                while let Some(seed) = seeds.get(next.fetch_add(1, Ordering::Relaxed)) {
                    if let Some(complaint) = complaint(machine, *seed) {
                        let mut bad = bad.lock().expect("nobody panics with it");
                        bad.push(format!("{machine}, seed {seed}: {complaint}"));
                    }
                }
            });
        }
    });
    bad.into_inner().expect("nobody panics with it")
}

#[track_caller]
fn check_drawn(machine: &str) {
    let seeds = drawn(machine);
    let bad = shown(machine, &seeds);
    assert!(
        bad.is_empty(),
        "of the seeds {seeds:?} ended badly:\n{}",
        bad.join("\n")
    );
}

#[test]
fn seeds_drawn_from_the_sources_end_well_linear() {
    check_drawn("linear");
}

#[test]
fn seeds_drawn_from_the_sources_end_well_platform() {
    check_drawn("uvw");
}

#[test]
fn seeds_drawn_from_the_sources_end_well_platform_on_a_serial_line() {
    check_drawn("uvw-copley");
}

#[test]
fn seeds_drawn_from_the_sources_end_well_rotary() {
    check_drawn("rotary");
}

#[test]
fn seeds_drawn_from_the_sources_end_well_three_axes() {
    check_drawn("volumetric");
}

#[test]
#[ignore = "takes an hour: SEEDS=FIRST..LAST of MACHINE, or of all"]
fn a_thousand_seeds_of_every_machine_end_well() {
    let only = std::env::var("MACHINE").ok();
    let machines = MACHINES
        .into_iter()
        .filter(|it| only.as_deref().is_none_or(|only| only == *it));
    let seeds: Vec<u64> = seeds("1..1000").collect();
    let (mut told, mut all_well) = (String::new(), true);
    for machine in machines {
        let bad = shown(machine, &seeds);
        all_well &= bad.is_empty();
        bad.iter().for_each(|it| println!("{it}"));
        let _ = writeln!(
            told,
            "{machine}: {} of {} seeds ended badly",
            bad.len(),
            seeds.len()
        );
    }
    println!("{told}");
    assert!(all_well, "{told}");
}
