//! What becomes of stages that nobody tuned the limits for: `zero` and `calibrate` of the shipped linear
//! stage with other numbers, over a range of seeds.
//!
//! `STAGE="repeatability_nm=300 servo_bandwidth_hz=10" MACHINE="runs=5" SEEDS=1..20 cargo test -p tests
//! --test systems survey -- --ignored --nocapture` prints what each came to, and counts.

use std::collections::BTreeMap;

use tests::{Bench, Edit, seeds};
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

#[test]
#[ignore = "a command: what becomes of the stages of STAGE, MACHINE and SEEDS=FIRST..LAST"]
fn what_becomes_of_stages() {
    let given = |name| std::env::var(name).unwrap_or_default();
    refused(seeds("1..20"), &given("MACHINE"), &given("STAGE"));
}
