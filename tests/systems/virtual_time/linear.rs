//! The linear stage: calibrate → zero → compensate → verify.

use compensator::iso230::Figures;
use tests::Bench;
use tests::Edit;
use truestage::CalibrateOptions;
use truestage::Failure;
use truestage::linear::{Corrected, VerifyOptions};
use units::{Metres, Time};

fn options(calibration: Option<String>) -> VerifyOptions {
    VerifyOptions {
        compensated: calibration.is_some(),
        calibration,
        resume: None,
    }
}

/// As found and as left of one emulated stage.
fn cycle(seed: u64) -> (Figures, Figures) {
    let mut bench = Bench::new(seed);
    let store = bench.store.clone();
    let result = bench.machine.guarded(|machine| {
        machine.start()?;
        machine.linear("x")?.zero(&store)?;
        let found = machine.linear("x")?.verify(&store, &options(None))?;
        let calibrated = machine
            .linear("x")?
            .calibrate(&store, &CalibrateOptions::default())?;
        let left = machine
            .linear("x")?
            .verify(&store, &options(Some(calibrated.id)))?;
        machine.shut_down()?;
        Ok((found.figures, left.figures))
    });
    result.unwrap_or_else(|failure: Failure| panic!("seed {seed}: {failure}"))
}

#[test]
fn twenty_stages_are_brought_within_two_micrometres_between_the_calibrated_positions() {
    let mut worst = Metres::ZERO;
    let mut least = Metres(f64::INFINITY);
    for seed in 1..=20 {
        let (found, left) = cycle(seed);
        let largest = found.largest_deviation();
        assert!(
            largest >= Metres::from_um(8.0),
            "seed {seed}: as found {} µm",
            largest.um()
        );
        let accuracy = left.accuracy.bidirectional;
        assert!(
            accuracy <= Metres::from_um(2.0),
            "seed {seed}: as left {} µm",
            accuracy.um()
        );
        worst = worst.max(accuracy);
        least = least.min(largest);
    }
    println!(
        "as found at least ±{:.2} µm; as left A at most {:.3} µm",
        least.um(),
        worst.um()
    );
}

/// Without a calibration, within it, and beyond it where its end is held: each is told, and the place
/// is the encoder's, not the target's.
#[test]
fn a_move_tells_the_encoders_place_and_what_did_not_correct_it() {
    let calibrated_to_30 =
        |text: String| text.edit_first("end_mm = 60.0\nstep_mm", "end_mm = 30.0\nstep_mm");
    let mut bench = Bench::with(3, calibrated_to_30, |text| text);
    let store = bench.store.clone();
    let go = |machine: &mut truestage::Machine, mm: f64| {
        let moved = machine
            .linear("x")
            .unwrap()
            .move_and_read(Metres::from_mm(mm))
            .unwrap();
        let off = moved.encoder - moved.set_point;
        assert!(off.abs() < Metres::from_um(0.1), "{} µm", off.um());
        assert_ne!(moved.encoder, moved.target);
        moved
    };
    bench.machine.start().unwrap();
    bench.machine.linear("x").unwrap().zero(&store).unwrap();
    let moved = go(&mut bench.machine, 12.345_678_9);
    assert_eq!(moved.corrected, Corrected::No);
    assert_eq!(moved.set_point, moved.target);
    assert_eq!((moved.place, moved.uncertainty), (None, None));
    let options = CalibrateOptions::default();
    bench
        .machine
        .linear("x")
        .unwrap()
        .calibrate(&store, &options)
        .unwrap();
    let moved = go(&mut bench.machine, 20.0);
    assert_eq!(moved.corrected, Corrected::Within);
    let off = moved.place.unwrap() - moved.target;
    assert!(off.abs() < Metres::from_um(0.1), "{} µm", off.um());
    // Datum, zero, scatter, instrument and one stop are some 60 nm; a seventh of a micrometre would be
    // more than all of it.
    let u_nm = moved.uncertainty.unwrap().standard_uncertainty.nm();
    assert!((30.0..150.0).contains(&u_nm), "{u_nm}");
    let (first, last) = (Metres::ZERO, Metres::from_mm(30.0));
    let moved = go(&mut bench.machine, 45.0);
    assert_eq!(moved.corrected, Corrected::Held { first, last });
    assert_eq!(moved.uncertainty, None, "nobody measured there");
    assert!(moved.place.is_some());
}

/// Closer where the stage is rougher; the run is interrupted after the first of its runs and continued.
#[test]
fn a_stage_is_calibrated_at_unequal_steps_and_such_a_run_is_continued() {
    let listed: Vec<f64> = (0..=30)
        .map(|at| f64::from(at * (at + 30)) / 30.0)
        .collect();
    let unequal = |text: String| {
        let steps = "start_mm = 0.0\nend_mm = 60.0\nstep_mm = 3.0";
        text.edit(steps, &format!("positions_mm = {listed:?}"))
    };
    let mut bench = Bench::with(5, unequal, |text| text);
    let store = bench.store.clone();
    let calibrate = |bench: &mut Bench, resume| {
        let options = CalibrateOptions {
            resume,
            ..CalibrateOptions::default()
        };
        let stage = bench.machine.linear("x");
        stage.unwrap().calibrate(&store, &options)
    };
    bench.machine.start().unwrap();
    bench.machine.linear("x").unwrap().zero(&store).unwrap();
    let whole = calibrate(&mut bench, None).unwrap();
    let lines = std::fs::read_to_string(&whole.journal).unwrap();
    let end = lines.find("\"entry\":\"closed\"").unwrap();
    let end = end + lines[end..].find('\n').unwrap() + 1;
    let interrupted = whole
        .journal
        .with_file_name("20260101T000000Z-calibrate-x-00.jsonl");
    std::fs::write(&interrupted, &lines[..end]).unwrap();
    let continued = calibrate(&mut bench, Some(interrupted)).unwrap();
    for calibrated in [whole, continued] {
        let nodes = &calibrated.record.content.nodes;
        let positions = nodes.iter().map(|it| it.position_m * 1e3);
        assert_eq!(nodes.len(), listed.len());
        assert!(
            positions
                .zip(&listed)
                .all(|(seen, it)| (seen - it).abs() < 1e-9)
        );
        assert_eq!(calibrated.measured.points.len(), 3 * 2 * listed.len());
    }
    let id = store.active("x").unwrap().current;
    let left = bench.machine.linear("x").unwrap();
    let left = { left }.verify(&store, &options(id)).unwrap();
    let accuracy = left.figures.accuracy.bidirectional;
    assert!(accuracy <= Metres::from_um(2.0), "A = {} µm", accuracy.um());
}

#[test]
fn a_compensated_move_brings_the_point_itself_to_its_target() {
    let mut bench = Bench::new(3);
    let store = bench.store.clone();
    bench
        .machine
        .guarded(|machine| {
            machine.start()?;
            machine.linear("x")?.zero(&store)?;
            machine
                .linear("x")?
                .calibrate(&store, &CalibrateOptions::default())?;
            machine.linear("x")?.move_to(Metres::from_mm(50.0))
        })
        .unwrap_or_else(|failure| panic!("{failure}"));
    for (mm, seed) in [
        (12.5, "forward"),
        (44.4, "forward"),
        (31.0, "reverse"),
        (3.3, "reverse"),
    ] {
        let target = Metres::from_mm(mm);
        bench.machine.linear("x").unwrap().move_to(target).unwrap();
        let now: Time = bench.machine.now();
        bench
            .machine
            .run_until(now + core::time::Duration::from_millis(50))
            .unwrap();
        let off = bench.true_position() - target;
        assert!(
            off.abs() <= Metres::from_um(1.0),
            "{mm} mm ({seed}): {} µm off",
            off.um()
        );
    }
}

#[test]
fn the_pinned_log_of_a_linear_stage_is_that_of_every_computer() {
    super::pinned::check("linear");
}

/// The library is as strict as the verbs: no program of anybody's moves by an example's limits.
#[test]
fn a_machine_whose_file_has_marks_does_not_start_and_nothing_is_sent() {
    let marked = |text: String| text.edit("soft_min_mm = -3.0", "soft_min_mm = -3.0 # fill in");
    let mut bench = Bench::with(7, marked, |text| text);
    let begun = bench.machine.now();
    let refused = bench.machine.start();
    let Err(failure @ Failure::Config(_)) = refused else {
        panic!("{refused:?}")
    };
    assert_eq!(failure.exit_code(), 2);
    let said = failure.to_string();
    assert!(said.contains("axis.x.soft_min_mm: -3.0 is an"), "{said}");
    assert_eq!(bench.machine.power_state("x").expect("it is there"), None);
    assert_eq!(bench.machine.now(), begun);
}
