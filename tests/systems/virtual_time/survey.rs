//! What becomes of stages that nobody tuned the limits for: `zero` and `calibrate` of the shipped linear
//! stage with other numbers, over a range of seeds.
//!
//! `STAGE="repeatability_nm=300 servo_bandwidth_hz=10" MACHINE="runs=5" SEEDS=1..20 cargo test -p tests
//! --test systems survey -- --ignored --nocapture` prints what each came to, and counts.

use std::collections::BTreeMap;

use tests::{Bench, Edit, in_every_run, seeds};
use truestage::CalibrateOptions;
use truestage::Failure;

/// `text` with each `KEY=VALUE` of `changes` written into the one line that sets that key.
fn with(text: String, changes: &str) -> String {
    changes.split_whitespace().fold(text, |text, change| {
        let (key, value) = change.split_once('=').expect("KEY=VALUE");
        let begin = format!("{key} = ");
        let line = text.lines().find(|line| line.starts_with(&begin));
        let line = format!(
            "\n{}\n",
            line.unwrap_or_else(|| panic!("no line sets {key}"))
        );
        text.edit(&line, &format!("\n{key} = {value}\n"))
    })
}

/// The stage of `seed` with those changes, zeroed and calibrated; what was found wrong with it.
fn verdict(seed: u64, machine: &str, stage: &str) -> Result<(), Failure> {
    let mut bench = Bench::with(seed, |text| with(text, machine), |text| with(text, stage));
    let store = bench.store.clone();
    bench.machine.guarded(|machine| {
        machine.start()?;
        machine.linear("x")?.zero(&store)?;
        let options = CalibrateOptions::default();
        machine.linear("x")?.calibrate(&store, &options)?;
        machine.shut_down()
    })
}

/// How many stages of `seeds` were refused.
fn refused(seeds: impl Iterator<Item = u64>, machine: &str, stage: &str) -> usize {
    let mut kinds: BTreeMap<String, u32> = BTreeMap::new();
    let mut refused = 0;
    for seed in seeds {
        let kind = match verdict(seed, machine, stage) {
            Ok(()) => "calibrated".to_owned(),
            Err(failure) => {
                refused += 1;
                println!("seed {seed}: {failure}");
                let told = format!("{failure:?}");
                told.chars().take_while(|it| it.is_alphanumeric()).collect()
            }
        };
        *kinds.entry(kind).or_default() += 1;
    }
    println!("{stage} {machine}: {kinds:?}");
    refused
}

/// For stages that repeat to no better than 300 nm.
const COARSE: &str = "standard_uncertainty_limit_um=1.0 closure_limit_um=4.0";

/// Lost fringes, interference and magnets were what such stages were told to suffer from.
#[test]
fn sound_stages_of_all_sorts_are_not_blamed() {
    for (stage, machine) in [
        ("repeatability_nm=60", ""),
        ("repeatability_nm=100", ""),
        ("repeatability_nm=300", COARSE),
        ("repeatability_nm=1000", COARSE),
        ("servo_bandwidth_hz=10", ""),
        ("servo_bandwidth_hz=20", ""),
        ("servo_bandwidth_hz=200", ""),
        ("lost_motion_um=0", ""),
        ("lost_motion_um=4", ""),
        ("lost_motion_um=20", ""),
        ("lost_motion_take_up_um=1000", ""),
        ("noise_mv=0.02", ""),
    ] {
        assert_eq!(
            refused(88_001..=in_every_run(88_002, 88_004), machine, stage),
            0,
            "{stage}"
        );
    }
}

#[test]
#[ignore = "a command: what becomes of the stages of STAGE, MACHINE and SEEDS=FIRST..LAST"]
fn what_becomes_of_stages() {
    let given = |name| std::env::var(name).unwrap_or_default();
    refused(seeds("1..20"), &given("MACHINE"), &given("STAGE"));
}
