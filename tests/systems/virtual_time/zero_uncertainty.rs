//! How often the zero lies within the uncertainty that it states, on emulated stages of all sorts: what they
//! repeat to, how stiff they are, what they lose on a reversal and how noisy their sensors are is drawn.
//!
//! `SEEDS=1..400 cargo test -p tests --test systems coverage_of_zeros -- --ignored --nocapture` counts over a
//! range and prints it; `TELL=1` before it prints each stage.

use mock_bus::plant::DriftLimits;
use tests::{Bench, Coverage, Edit, judged_of_each, random, seeds};
use truestage::Failure;
use truestage::emulated::HallDrift;
use units::{Metres, Volts};

/// Power cycles of each stage, each with sensors that drifted anew.
const CYCLES: u64 = 3;
const DRIFT: DriftLimits = DriftLimits {
    offset: Volts(0.1),
    gain: 0.03,
    gain_per_m: 0.0,
};

/// What is drawn of a stage.
#[derive(Clone, Copy, Debug)]
pub(super) struct Drawn {
    pub(super) repeatability_nm: f64,
    pub(super) bandwidth_hz: f64,
    pub(super) lost_motion_um: f64,
    pub(super) noise_mv: f64,
}

impl Drawn {
    pub(super) fn new(seed: u64) -> Self {
        let mut state = seed ^ 0x2E80_0000;
        let mut over = |low: f64, high: f64| low * (high / low).powf(random(&mut state));
        Self {
            repeatability_nm: over(5.0, 1000.0),
            bandwidth_hz: over(5.0, 200.0),
            noise_mv: over(0.02, 0.5),
            lost_motion_um: 20.0 * random(&mut state),
        }
    }

    fn bench(&self, seed: u64) -> Bench {
        Bench::with(seed, patient, |text| self.emulated(&text))
    }

    /// The description of an emulated machine with what was drawn.
    pub(super) fn emulated(&self, text: &str) -> String {
        let repeats = format!("repeatability_nm = {}", self.repeatability_nm);
        let servo = format!("servo_bandwidth_hz = {}", self.bandwidth_hz);
        let lost = format!("\nlost_motion_um = {}", self.lost_motion_um);
        let noise = format!("noise_mv = {}", self.noise_mv);
        text.edit_first("repeatability_nm = 25.0", &repeats)
            .edit_first("servo_bandwidth_hz = 60.0", &servo)
            .edit_first("\nlost_motion_um = 1.0", &lost)
            .edit_first("noise_mv = 0.2", &noise)
    }
}

/// The configuration of a machine that takes stages which repeat to a micrometre for sound, and does not hurry soft
/// ones.
pub(super) fn patient(text: String) -> String {
    text.edit("uncertainty_limit_um = 0.2", "uncertainty_limit_um = 5.0")
        .edit("speed_mm_per_s = 200.0", "speed_mm_per_s = 50.0")
        .edit(
            "acceleration_mm_per_s2 = 5000.0",
            "acceleration_mm_per_s2 = 500.0",
        )
}

/// Where on the scale the zero has come to lie, less where the undrifted curves have their centre; and the
/// stated uncertainty. A zero is a count: where within that count the stage stands when it is judged is the
/// stop's affair.
fn zeroed(bench: &mut Bench) -> Result<(f64, f64), Failure> {
    let store = bench.store.clone();
    let zeroed = bench.machine.guarded(|machine| {
        machine.start()?;
        machine.linear("x")?.zero(&store)
    })?;
    let reading = bench.machine.reading("x")?.expect("it was read");
    let scale = bench.emulated.simulation().truth().scale_position();
    let count = bench.machine.config().axis["x"].motion.resolution_nm * 1e-9;
    let off = Metres((scale.value() / count).round() * count) - reading.position;
    let u = zeroed.estimate.standard_uncertainty;
    Ok((off.value(), u.value()))
}

/// off/u of each power cycle of a stage.
fn judged(seed: u64, drawn: &Drawn) -> Result<Vec<f64>, Failure> {
    let mut bench = drawn.bench(seed);
    let mut all = Vec::new();
    for number in 0..CYCLES {
        if number > 0 {
            bench.machine.shut_down()?;
            bench.power_cycle(HallDrift::random(seed, number, DRIFT));
            let back = bench.machine.now() + core::time::Duration::from_secs(1);
            bench.machine.run_until(back)?;
        }
        let (off, u) = zeroed(&mut bench)?;
        all.push(off / u);
    }
    if std::env::var("TELL").is_ok() {
        println!("{seed}: {drawn:?}: {all:.2?}");
    }
    Ok(all)
}

/// What is stated of the zeros of so many stages.
fn count(seeds: impl Iterator<Item = u64> + Send, drawn: fn(u64) -> Drawn) -> Coverage {
    let all = judged_of_each(seeds, &|seed| judged(seed, &drawn(seed)));
    let count: Coverage = all.into_iter().flatten().collect();
    println!("zeros {count}");
    count
}

/// A soft servo creeps into its place: what the stage does not repeat shows only in passes that begin when it
/// has. Of 18 zeros with a right 2u more than four lie beyond it once in 700 times (binomial, 0.05 each).
#[test]
fn the_zero_of_a_soft_stage_lies_within_what_it_states() {
    let soft = |seed| Drawn {
        bandwidth_hz: 8.0,
        repeatability_nm: 700.0,
        ..Drawn::new(seed)
    };
    let count = count(6_100..6_106, soft);
    assert_eq!(count.count(), 18);
    assert!(count.within() >= 14, "{count}");
}

/// The mean square of a Student's t with four degrees of freedom has no variance: it is printed, not judged.
#[test]
#[ignore = "many stages: for whoever wants the rates, over SEEDS=FIRST..LAST"]
fn coverage_of_zeros() {
    let count = count(seeds("1..400"), Drawn::new);
    count.judge_share(count.count() as f64);
}
