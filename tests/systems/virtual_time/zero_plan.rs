//! Vc and bands that a sweep proposes, on emulated stages whose magnets are of many sizes: the zero that is found with
//! them, judged by the plant's truth.

use tests::{Bench, Edit, random};
use truestage::Failure;
use units::{Metres, Volts};

/// Magnets and sensors that somebody may build.
fn magnets(seed: u64) -> impl Fn(String) -> String {
    let mut state = seed ^ 0x3A67_0000;
    let mut over = |low: f64, high: f64| low + (high - low) * random(&mut state);
    let (width, spacing, gap) = (over(1.6, 2.4), over(3.6, 4.6), over(1.2, 2.0));
    let noise_mv = 0.02 * (25.0_f64).powf(over(0.0, 1.0));
    move |text| {
        text.edit(
            "magnet_width_mm = 2.0",
            &format!("magnet_width_mm = {width}"),
        )
        .edit(
            "magnet_spacing_mm = 4.0",
            &format!("magnet_spacing_mm = {spacing}"),
        )
        .edit("gap_mm = 1.5", &format!("gap_mm = {gap}"))
        .edit("noise_mv = 0.2", &format!("noise_mv = {noise_mv}"))
    }
}

/// Sweeps and zeros that are far enough for any of these.
fn wide(text: String) -> String {
    text.edit("search_limit_mm = 2.0", "search_limit_mm = 2.9")
        .edit(
            "standard_uncertainty_limit_um = 0.2",
            "standard_uncertainty_limit_um = 1.0",
        )
}

#[test]
fn the_proposed_level_and_bands_find_the_zero_on_stages_with_other_magnets() {
    for seed in 5_501..=5_506 {
        let mut bench = Bench::with(seed, wide, magnets(seed));
        let store = bench.store.clone();
        let planned = bench.machine.guarded(|machine| {
            machine.start()?;
            let planned = machine.linear("x")?.plan_zero(&store)?;
            machine.shut_down()?;
            Ok::<_, Failure>(planned)
        });
        let planned = planned.unwrap_or_else(|failure| panic!("seed {seed}: {failure}"));
        let csv = std::fs::read_to_string(&planned.sweep).expect("the sweep is kept");
        assert!(csv.starts_with("position_um,peak_v,slope_v\n") && csv.lines().count() > 1000);

        let set = planned.plan.settings;
        let mv = |volts: Volts| volts.value() * 1e3;
        let proposed = |text: String| {
            let line = |key: &str, value: f64| format!("\n{key} = {value}\n#");
            wide(text)
                .edit(
                    "\nlevel_below_peak_v",
                    &line("level_below_peak_v", set.vc.value()),
                )
                .edit(
                    "\nturn_below_peak_v",
                    &line("turn_below_peak_v", set.vc0.value()),
                )
                .edit("\ndelta1_mv", &line("delta1_mv", mv(set.delta1)))
                .edit("\ndelta2_mv", &line("delta2_mv", mv(set.delta2)))
                .edit("\ndelta3_mv", &line("delta3_mv", mv(set.delta3)))
                .edit("\ndelta4_mv", &line("delta4_mv", mv(set.delta4)))
                .edit("\nnoise_mv", &line("noise_mv", mv(set.noise)))
        };
        let mut bench = Bench::with(seed, proposed, magnets(seed));
        let store = bench.store.clone();
        let zeroed = bench.machine.guarded(|machine| {
            machine.start()?;
            machine.linear("x")?.zero(&store)
        });
        let zeroed = zeroed.unwrap_or_else(|failure| panic!("seed {seed}: {failure}"));
        assert_eq!(zeroed.flat, None, "seed {seed}: {:?}", planned.plan.chosen);
        let scale = bench.emulated.simulation().truth().scale_position();
        let shown = bench
            .machine
            .reading("x")
            .unwrap()
            .expect("it was read")
            .position;
        let off = scale - shown;
        let u = zeroed.estimate.standard_uncertainty + Metres(10e-9);
        assert!(
            off.abs() < u * 4.0,
            "seed {seed}: {} nm, u {} nm",
            off.nm(),
            u.nm()
        );
    }
}

/// 0.1 V below a peak that is round there.
#[test]
fn a_zero_on_a_flat_part_of_the_curves_says_so() {
    let flat = |text: String| {
        text.edit("level_below_peak_v = 1.0", "level_below_peak_v = 0.1")
            .edit("turn_below_peak_v = 0.3", "turn_below_peak_v = 0.05")
            .edit("delta1_mv = 20.0", "delta1_mv = 5.0")
            .edit(
                "standard_uncertainty_limit_um = 0.2",
                "standard_uncertainty_limit_um = 1.0",
            )
    };
    let zero = |machine: fn(String) -> String| {
        let mut bench = Bench::with(3, machine, |text| text);
        let store = bench.store.clone();
        let zeroed = bench.machine.guarded(|machine| {
            machine.start()?;
            machine.linear("x")?.zero(&store)
        });
        zeroed.unwrap_or_else(|failure| panic!("{failure}")).flat
    };
    assert!(zero(flat).is_some());
    assert_eq!(zero(|text| text), None, "the shipped one is none");
}
